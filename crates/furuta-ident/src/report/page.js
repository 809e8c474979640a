"use strict";
// Draws the recordings on canvas. Series come as base64: times as 32-bit floats, the others as 16-bit integers over [lo, hi] with one value
// kept for "not there". Models come as residuals (measured - model), so that a residual of a milliradian keeps its own resolution.
(() => {
  const GONE = -32768, PAD = { left: 58, right: 10, top: 20, gap: 34, bottom: 26 };
  const MODELS = [["nominal", "rig file as given"], ["recalibrated", "refitted"], ["augmented", "repaired"]];
  const COLOURS = { measured: "--measured", nominal: "--nominal", recalibrated: "--before", augmented: "--after" };
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
  const series = (s) => {
    if (!s) return null;
    const raw = new Int16Array(bytes(s.data)), out = new Float64Array(raw.length), step = (s.hi - s.lo) / 65534;
    for (let i = 0; i < raw.length; i++) out[i] = raw[i] === GONE ? NaN : s.lo + (raw[i] + 32767) * step;
    return out;
  };
  const minus = (a, b) => (a && b ? a.map((x, i) => x - b[i]) : null);

  function decode(run) {
    if (run.ready) return run;
    run.time = Float64Array.from(new Float32Array(bytes(run.t)));
    run.command = series(run.u);
    run.angle = run.measured.map(series);
    run.left = {}; run.model = {};
    for (const [key] of MODELS) {
      run.left[key] = run.residual[key].map(series);
      run.model[key] = run.left[key].map((left, c) => minus(run.angle[c], left));
    }
    // Lines end where the prediction starts anew, and everything ends at a gap.
    run.anew = new Set(run.restarts);
    const steps = run.time.slice(1).map((t, i) => t - run.time[i]), usual = Float64Array.from(steps).sort()[Math.floor(0.95 * steps.length)] || 1; // of clocks that jitter the long ones
    run.holes = new Set(); steps.forEach((s, i) => { if (s > 1.6 * usual) run.holes.add(i + 1); });
    run.ready = true;
    return run;
  }

  const nice = (low, high, count) => {
    const raw = (high - low) / Math.max(count, 1), unit = 10 ** Math.floor(Math.log10(raw)), step = [1, 2, 2.5, 5, 10].find((m) => m * unit >= raw * 0.999) * unit;
    const ticks = [];
    for (let v = Math.ceil(low / step) * step; v <= high + 1e-9 * step; v += step) ticks.push(Math.abs(v) < 1e-9 * step ? 0 : v);
    return [ticks, Math.max(0, -Math.floor(Math.log10(step) + 1e-9) + (step / 10 ** Math.floor(Math.log10(step)) === 2.5 ? 1 : 0))];
  };
  const text = (v) => (Number.isFinite(v) ? (Math.abs(v) >= 100 ? v.toFixed(1) : v.toFixed(4)) : "–");

  function plot(root, runs) {
    const canvas = root.querySelector("canvas"), readout = root.querySelector(".readout"), ctx = canvas.getContext("2d");
    const shown = { nominal: false, recalibrated: true, augmented: true };
    let run = decode(runs[0]), view = null, hover = null, drag = null, height = 0;
    const span = () => view || [run.time[0], run.time[run.time.length - 1]];
    const at = (t) => { let a = 0, b = run.time.length; while (a < b) { const m = (a + b) >> 1; if (run.time[m] < t) a = m + 1; else b = m; } return a; };

    function panels() {
      const angle = (c, name) => ({ title: name + ": measured and predicted", unit: "rad", size: 165, lines: [["measured", run.angle[c]], ...MODELS.map(([k]) => [k, run.model[k][c]])], frame: ["measured", "augmented"] });
      const left = (c, name) => ({ title: name + ": measured minus predicted", unit: "rad", size: 105, lines: MODELS.map(([k]) => [k, run.left[k][c]]), frame: ["recalibrated", "augmented"], zero: true });
      return [angle(0, "Arm θ"), left(0, "Arm θ"), angle(1, "Pendulum α"), left(1, "Pendulum α"),
        { title: "Motor command u", unit: run.unit, size: 75, lines: [["measured", run.command]], frame: ["measured"], held: true }]
        .map((p) => ({ ...p, lines: p.lines.filter(([k, d]) => d && (k === "measured" || shown[k])) }))
        .filter((p) => p.lines.length);
    }

    function range(panel, from, to) {
      let low = Infinity, high = -Infinity;
      const framing = panel.lines.filter(([k]) => panel.frame.includes(k));
      for (const [, data] of framing.length ? framing : panel.lines)
        for (let i = from; i < to; i++) { const v = data[i]; if (v < low) low = v; if (v > high) high = v; }
      if (panel.zero) { low = Math.min(low, 0); high = Math.max(high, 0); }
      if (!(low < high)) { const mid = Number.isFinite(low) ? low : 0; low = mid - 0.01; high = mid + 0.01; }
      const room = 0.08 * (high - low);
      return [low - room, high + room];
    }

    function line(data, key, held, from, to, x, y) {
      const breaks = key === "measured" ? run.holes : run.anew;
      ctx.beginPath();
      let pen = false, column = NaN, low = 0, high = 0, last = 0;
      const dense = to - from > 2.5 * canvas.clientWidth;
      const flush = () => { if (pen && dense && !Number.isNaN(column)) { ctx.lineTo(column, low); ctx.lineTo(column, high); ctx.lineTo(column, last); } };
      for (let i = from; i < to; i++) {
        const v = data[i];
        if (!Number.isFinite(v) || breaks.has(i) || run.holes.has(i)) { flush(); pen = false; column = NaN; if (!Number.isFinite(v)) continue; }
        const px = x(run.time[i]), py = y(v);
        if (!pen) { ctx.moveTo(px, py); pen = true; column = Math.round(px); low = high = last = py; continue; }
        if (dense) {
          const c = Math.round(px);
          if (c !== column) { flush(); column = c; low = high = py; ctx.lineTo(c, py); }
          low = Math.min(low, py); high = Math.max(high, py); last = py;
        } else { if (held) ctx.lineTo(px, y(data[i - 1])); ctx.lineTo(px, py); }
      }
      flush();
      ctx.stroke();
    }

    function draw() {
      const style = getComputedStyle(document.documentElement), colour = (name) => style.getPropertyValue(name).trim();
      const list = panels(), width = canvas.clientWidth, ratio = window.devicePixelRatio || 1;
      height = PAD.top + list.reduce((sum, p) => sum + p.size + PAD.gap, 0) - PAD.gap + PAD.bottom + 8;
      canvas.style.height = height + "px";
      canvas.width = width * ratio; canvas.height = height * ratio;
      ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
      ctx.font = "12px system-ui, sans-serif";
      const [t0, t1] = span(), inner = width - PAD.left - PAD.right, x = (t) => PAD.left + ((t - t0) / (t1 - t0)) * inner;
      const from = Math.max(0, at(t0) - 1), to = Math.min(run.time.length, at(t1) + 2);
      const [times, digits] = nice(t0, t1, Math.max(3, Math.floor(inner / 110)));
      let top = PAD.top;
      list.forEach((panel, n) => {
        const [low, high] = range(panel, from, to), bottom = top + panel.size, y = (v) => bottom - ((v - low) / (high - low)) * panel.size;
        const [values, places] = nice(low, high, Math.max(3, panel.size / 36));
        ctx.lineWidth = 1; ctx.strokeStyle = colour("--grid"); ctx.fillStyle = colour("--faint"); ctx.textBaseline = "middle"; ctx.textAlign = "right";
        for (const v of values) { const py = Math.round(y(v)) + 0.5; ctx.beginPath(); ctx.moveTo(PAD.left, py); ctx.lineTo(PAD.left + inner, py); ctx.stroke(); ctx.fillText(v.toFixed(places), PAD.left - 8, py); }
        for (const t of times) { const px = Math.round(x(t)) + 0.5; ctx.beginPath(); ctx.moveTo(px, top); ctx.lineTo(px, bottom); ctx.stroke(); }
        ctx.textAlign = "left"; ctx.textBaseline = "alphabetic"; ctx.fillStyle = colour("--soft"); ctx.fillText(panel.title + " [" + panel.unit + "]", PAD.left, top - 7);
        ctx.save(); ctx.beginPath(); ctx.rect(PAD.left, top, inner, panel.size); ctx.clip(); ctx.lineJoin = "round";
        for (const [key, data] of panel.lines) {
          ctx.strokeStyle = colour(COLOURS[key]); ctx.lineWidth = key === "measured" ? (panel.held ? 1.2 : 2.4) : 1.5; ctx.globalAlpha = key === "measured" && !panel.held ? 0.55 : 1;
          line(data, key, panel.held, from, to, x, y);
        }
        ctx.globalAlpha = 1; ctx.restore();
        if (n === list.length - 1) {
          ctx.fillStyle = colour("--faint"); ctx.textAlign = "center"; ctx.textBaseline = "top";
          for (const t of times) ctx.fillText(t.toFixed(digits) + (t === times[times.length - 1] ? " s" : ""), Math.min(x(t), width - 22), bottom + 8);
        }
        top = bottom + PAD.gap;
      });
      if (drag && Math.abs(drag[1] - drag[0]) > 3) {
        ctx.fillStyle = colour("--after"); ctx.globalAlpha = 0.14; ctx.fillRect(Math.min(...drag), PAD.top, Math.abs(drag[1] - drag[0]), height - PAD.top - PAD.bottom); ctx.globalAlpha = 1;
      }
      if (hover !== null) {
        const i = Math.min(Math.max(at(hover), 0), run.time.length - 1), px = x(run.time[i]);
        ctx.strokeStyle = colour("--faint"); ctx.setLineDash([3, 3]); ctx.beginPath(); ctx.moveTo(px, PAD.top); ctx.lineTo(px, height - PAD.bottom); ctx.stroke(); ctx.setLineDash([]);
        const parts = ["t = " + run.time[i].toFixed(3) + " s", "u = " + text(run.command ? run.command[i] : NaN) + " " + run.unit];
        ["θ", "α"].forEach((name, c) => {
          const models = MODELS.filter(([k]) => shown[k] && run.model[k][c]).map(([k, word]) => word + " " + text(run.model[k][c][i]));
          parts.push(name + ": measured " + text(run.angle[c][i]) + (models.length ? ", " + models.join(", ") : "") + " rad");
        });
        readout.textContent = parts.join("    ");
      } else readout.textContent = "Drag to zoom in, double-click for the whole run. Keys: + and - zoom, arrows move.";
    }

    const place = (event) => event.clientX - canvas.getBoundingClientRect().left;
    const time = (px) => { const [t0, t1] = span(); return t0 + (Math.min(Math.max((px - PAD.left) / (canvas.clientWidth - PAD.left - PAD.right), 0), 1)) * (t1 - t0); };
    const look = (a, b) => {
      const first = run.time[0], last = run.time[run.time.length - 1], least = 8 * (last - first) / run.time.length;
      a = Math.max(first, a); b = Math.min(last, b);
      if (b - a >= least) view = b - a > 0.999 * (last - first) ? null : [a, b];
      draw();
    };
    canvas.addEventListener("pointermove", (e) => { hover = time(place(e)); if (drag) drag[1] = place(e); draw(); });
    canvas.addEventListener("pointerleave", () => { hover = null; draw(); });
    canvas.addEventListener("pointerdown", (e) => { if (e.pointerType !== "touch") { canvas.setPointerCapture(e.pointerId); drag = [place(e), place(e)]; } });
    canvas.addEventListener("pointerup", () => { if (!drag) return; const [a, b] = drag.map(time).sort((p, q) => p - q), far = Math.abs(drag[1] - drag[0]) > 5; drag = null; if (far) look(a, b); else draw(); });
    canvas.addEventListener("dblclick", () => { view = null; draw(); });
    canvas.addEventListener("keydown", (e) => {
      const [a, b] = span(), mid = (a + b) / 2, half = (b - a) / 2;
      if (e.key === "+" || e.key === "=") look(mid - half / 1.6, mid + half / 1.6);
      else if (e.key === "-") look(mid - half * 1.6, mid + half * 1.6);
      else if (e.key === "ArrowLeft") { const s = Math.min(half / 2, a - run.time[0]); look(a - s, b - s); }
      else if (e.key === "ArrowRight") { const s = Math.min(half / 2, run.time[run.time.length - 1] - b); look(a + s, b + s); }
      else return;
      e.preventDefault();
    });
    const select = root.querySelector("select");
    if (select) select.addEventListener("change", () => { run = decode(runs[select.selectedIndex]); view = null; draw(); });
    root.querySelectorAll("button[data-model]").forEach((button) => {
      const key = button.dataset.model;
      button.setAttribute("aria-pressed", shown[key]);
      button.addEventListener("click", () => { shown[key] = !shown[key]; button.setAttribute("aria-pressed", shown[key]); draw(); });
    });
    root.querySelector("button[data-whole]").addEventListener("click", () => { view = null; draw(); });
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
    new ResizeObserver(draw).observe(canvas.parentElement);
    draw();
  }

  for (const root of document.querySelectorAll(".plot")) {
    const runs = JSON.parse(document.getElementById(root.dataset.source).textContent);
    if (runs.length) plot(root, runs);
  }
  for (const button of document.querySelectorAll("button[data-copy]")) {
    button.addEventListener("click", async () => {
      try { await navigator.clipboard.writeText(button.parentElement.querySelector("pre").textContent); button.textContent = "copied"; } catch { button.textContent = "select and copy"; }
      setTimeout(() => { button.textContent = "copy"; }, 1600);
    });
  }
})();
