//! The page of a calibration: the parameters with their intervals, what the recordings can tell, measured against
//! model.

use core::fmt::Write as _;

use super::{escape, page};
use crate::calibrate::{Calibration, Curve, Outcome};
use crate::diagnose::result::{Channel, significant};

const WIDTH: f64 = 960.0;
/// Points of a line: more than a screen has columns for.
const POINTS: usize = 1200;

/// The page of a calibration, one self-contained HTML file: what the recordings can tell, the parameters, measured
/// against model.
#[must_use]
pub fn calibration(outcome: &Outcome) -> String {
    let c = &outcome.calibration;
    let title = format!("Calibration of {}", escape(&c.rig));
    let mut body = format!("<h1>{title}</h1>\n");
    let _ = write!(
        body,
        "<p>{} parameters fitted; the model is off by {} times the encoders' noise.</p>\n<section><h2>Parameters and \
         their 95 % intervals</h2>{}</section>\n",
        c.fitted.len(),
        significant(c.chi, 3),
        intervals(c)
    );
    let _ = writeln!(
        body,
        "<section><h2>In numbers</h2><pre>{}</pre></section>",
        escape(&c.summary())
    );
    for profile in &c.profiles {
        let _ = writeln!(
            body,
            "<section><h2>Profile of {}</h2>{}</section>",
            escape(&profile.key),
            super::charts::profile(profile)
        );
    }
    body += "<section><h2>Measured and predicted</h2>";
    body += "<p class=\"legend\"><span class=\"key\"><i class=\"measured\"></i>measured</span><span class=\"key\"><i \
             class=\"nominal\"></i>rig file</span><span class=\"key\"><i class=\"after\"></i>calibrated</span></p>";
    for curve in &outcome.curves {
        let _ = write!(body, "<h3>{}</h3>", escape(&curve.run));
        for (c, channel) in Channel::ALL.into_iter().enumerate() {
            body += &lines(curve, c, channel);
        }
    }
    body += "</section>\n";
    page(&title, LINES, &body, "")
}

/// How lines over time look on this page, which has no script to draw them.
const LINES: &str = "pre { overflow-x: auto; font-size: .82rem; line-height: 1.35; }\n\
    svg polyline[class] { fill: none; stroke-width: 1.3; } svg polyline.measured { stroke: var(--measured); } \
    svg polyline.nominal { stroke: var(--nominal); stroke-dasharray: 4 3; } svg polyline.after \
    { stroke: var(--after); }\n";

/// A calibration at a glance, a fragment of HTML for notebooks: the fitted parameters with their intervals, and how
/// well the model follows.
#[must_use]
pub fn calibration_card(c: &Calibration) -> String {
    let mut rows = String::new();
    for key in &c.fitted {
        let Some(p) = c.parameters.get(key) else {
            continue;
        };
        let interval = p.interval.map_or_else(
            || "at its bound".to_owned(),
            |[low, high]| format!("{} to {}", significant(low, 4), significant(high, 4)),
        );
        let _ = write!(
            rows,
            "<tr><td><code>{}</code></td><td>{}</td><td>{}</td><td>{interval}</td><td>{}</td></tr>",
            escape(key),
            significant(p.nominal, 4),
            significant(p.fitted, 4),
            escape(&p.unit)
        );
    }
    let fits: Vec<String> = c
        .fit
        .iter()
        .map(|f| format!("{} {}: {:.1} %", escape(&f.run), f.channel, f.fit_percent))
        .collect();
    format!(
        "<div><b>Calibration of {}</b><table><tr><th>parameter</th><th>rig file</th><th>calibrated</th><th>95 \
         %</th><th>unit</th></tr>{rows}</table><div>fit: {}</div></div>",
        escape(&c.rig),
        fits.join(", ")
    )
}

/// Each fitted parameter as a share of the rig file's value: a bar from end to end of its interval.
fn intervals(c: &Calibration) -> String {
    let rows: Vec<(&str, f64, [f64; 2])> = c
        .fitted
        .iter()
        .filter_map(|key| {
            let p = c.parameters.get(key)?;
            let unit = if p.nominal == 0.0 {
                p.fitted
            } else {
                p.nominal
            };
            let [low, high] = p.interval?;
            Some((key.as_str(), p.fitted / unit, [low / unit, high / unit]))
        })
        .collect();
    let (low, high) = rows.iter().fold((0.9, 1.1), |(a, b): (f64, f64), r| {
        (a.min(r.2[0]), b.max(r.2[1]))
    });
    if !(high - low).is_finite() || rows.is_empty() {
        return String::new();
    }
    let (from, to) = (230.0, WIDTH - 20.0);
    let at = |x: f64| from + (x - low) / (high - low) * (to - from);
    let bottom = 12.0 + 28.0 * rows.len() as f64;
    let mut svg = String::new();
    for tick in [low, 1.0, high] {
        let x = at(tick);
        let _ = write!(
            svg,
            "<line class=\"{}\" x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"4\" y2=\"{bottom}\"/><text class=\"soft small\" \
             x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{:.0} %</text>",
            if tick == 1.0 { "axis" } else { "grid" },
            bottom + 16.0,
            100.0 * tick
        );
    }
    for (i, (key, value, [a, b])) in rows.iter().enumerate() {
        let y = 20.0 + 28.0 * i as f64;
        let _ = write!(
            svg,
            "<text class=\"mono\" x=\"0\" y=\"{:.1}\">{}</text><rect class=\"after\" x=\"{:.1}\" y=\"{:.1}\" \
             width=\"{:.1}\" height=\"6\" rx=\"3\"/><circle class=\"after\" cx=\"{:.1}\" cy=\"{y:.1}\" r=\"4.5\"/>",
            y + 4.0,
            escape(key),
            at(*a),
            y - 3.0,
            (at(*b) - at(*a)).max(1.0),
            at(*value)
        );
    }
    format!(
        "<svg viewBox=\"0 0 {WIDTH:.0} {:.0}\" role=\"img\" aria-label=\"fitted parameters as a share of the rig \
         file's, with 95 % intervals\">{svg}</svg><p class=\"soft\">as a share of the rig file's value</p>",
        bottom + 24.0
    )
}

/// One angle over time: measured, rig file, calibrated.
fn lines(curve: &Curve, c: usize, channel: Channel) -> String {
    let (top, bottom, from, to) = (10.0, 190.0, 60.0, WIDTH - 10.0);
    let finite = |values: &[f64]| {
        values
            .iter()
            .copied()
            .filter(|v| v.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| {
                (a.min(v), b.max(v))
            })
    };
    let (low, high) = finite(&curve.measured[c]);
    let (Some(&first), Some(&last)) = (curve.t.first(), curve.t.last()) else {
        return String::new();
    };
    let margin = (0.05 * (high - low)).max(1e-6);
    let (low, high) = (low - margin, high + margin);
    let x = |t: f64| from + (t - first) / (last - first).max(1e-9) * (to - from);
    let y = |v: f64| bottom - ((v - low) / (high - low)).clamp(-0.1, 1.1) * (bottom - top);
    let stride = curve.t.len().div_ceil(POINTS).max(1);
    let mut svg = String::new();
    for (v, words) in [(low + margin, "min"), (high - margin, "max")] {
        let _ = write!(
            svg,
            "<line class=\"grid\" x1=\"{from}\" x2=\"{to}\" y1=\"{0:.1}\" y2=\"{0:.1}\"/><text class=\"soft small\" \
             x=\"{1:.1}\" y=\"{2:.1}\" text-anchor=\"end\">{3}<title>{words}</title></text>",
            y(v),
            from - 6.0,
            y(v) + 4.0,
            significant(v, 3)
        );
    }
    let _ = write!(
        svg,
        "<text class=\"strong\" x=\"0\" y=\"{:.1}\">{channel}</text><text class=\"soft small\" x=\"{from}\" \
         y=\"{:.1}\">{} s</text><text class=\"soft small\" x=\"{to}\" y=\"{:.1}\" text-anchor=\"end\">{} s</text>",
        0.5 * (top + bottom),
        bottom + 16.0,
        significant(first, 3),
        bottom + 16.0,
        significant(last, 3)
    );
    for (class, values) in [
        ("measured", &curve.measured[c]),
        ("nominal", &curve.nominal[c]),
        ("after", &curve.calibrated[c]),
    ] {
        // A line is broken where nothing was predicted.
        let mut points = String::new();
        let mut draw = |points: &mut String| {
            if !points.is_empty() {
                let _ = write!(svg, r#"<polyline class="{class}" points="{points}"/>"#);
                points.clear();
            }
        };
        for (t, v) in curve.t.iter().zip(values).step_by(stride) {
            if v.is_finite() {
                let _ = write!(points, "{:.1},{:.1} ", x(*t), y(*v));
            } else {
                draw(&mut points);
            }
        }
        draw(&mut points);
    }
    format!(
        r#"<svg viewBox="0 0 {WIDTH:.0} {:.0}" role="img" aria-label="{channel} measured and predicted">{svg}</svg>"#,
        bottom + 22.0
    )
}
