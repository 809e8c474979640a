"""Cards: how a notebook shows rigs, recordings and results. HTML without script, light or dark."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from typing import Any

import numpy as np

BLUE, GREEN, ORANGE = "#1f6fd6", "#2f9e6e", "#d9730d"


def card(
    title: str, rows: Iterable[tuple[str, Any]] = (), *, text: str = "", notes: Iterable[str] = (), colour: str = BLUE
) -> str:
    """A title, a table of names and values, text as it stands, notes."""
    cell = "padding:.1em .8em .1em 0;text-align:left;border:none;background:none"
    table = "".join(
        f'<tr style="background:none"><td style="{cell};opacity:.75">{escape(name)}</td>'
        f'<td style="{cell}">{escape(_shown(value))}</td></tr>'
        for name, value in rows
    )
    lines = "".join(f'<div style="opacity:.75;font-size:.9em">{escape(note)}</div>' for note in notes)
    frame = (
        f"max-width:46em;border:1px solid #8886;border-left:5px solid {colour};border-radius:8px;"
        "padding:.7em 1em;line-height:1.45"
    )
    return (
        f'<div style="{frame}"><div><b style="color:{colour}">{escape(title)}</b></div>'
        + (f'<table style="border-collapse:collapse;margin:.3em 0">{table}</table>' if table else "")
        + (f'<pre style="white-space:pre-wrap;margin:.4em 0 0">{escape(text)}</pre>' if text else "")
        + f"{lines}</div>"
    )


def _shown(value: Any) -> str:
    if isinstance(value, (float, np.floating)):
        return f"{value:.6g}"
    if isinstance(value, np.ndarray):
        return "[" + ", ".join(f"{v:.5g}" for v in value.ravel()) + "]"
    return str(value)


def _assignments(values: dict[str, Any]) -> str:
    return ", ".join(f"{name} = {_shown(value)}" for name, value in values.items())


def rig(rig: Any) -> str:
    rows: list[tuple[str, Any]] = [("motor.kind", f"{rig.motor_kind}, in {rig.command_unit}")]
    rows += rig.parameters.items()
    rows += [(f"sensors.{name}", value) for name, value in rig.sensors.items()]
    rows += [(f"limits.{name}", value) for name, value in rig.limits.items() if value is not None]
    rows += [(f"effect {id}", _assignments(values)) for id, values in rig.effects.items()]
    return card(f"rig {rig.name}", rows, notes=[rig.source] if rig.source else [])


def controller(controller: Any) -> str:
    rows: list[tuple[str, Any]] = [
        ("rig", controller.rig.name),
        ("dt [s]", controller.dt),
        (f"command limit [{controller.rig.command_unit}]", controller.command_limit),
    ]
    if controller.gain is not None:
        rows.append(("gain K", controller.gain))
    return card(f"controller {controller.kind}", rows, text=controller.to_toml().strip())


def estimator(estimator: Any) -> str:
    return card(f"estimator {estimator.kind}", [("dt [s]", estimator.dt)])


def simulator(simulator: Any) -> str:
    names = ["theta [rad]", "alpha [rad]", "theta_dot [rad/s]", "alpha_dot [rad/s]"]
    return card("simulator", [("t [s]", simulator.t), *zip(names, simulator.x)])


def recording(recording: Any) -> str:
    rows: list[tuple[str, Any]] = [
        ("samples", recording.samples),
        ("duration [s]", recording.duration),
        ("rate [Hz]", 1 / recording.dt),
        ("columns", ", ".join(recording)),
    ]
    for name, unit in [("u", "V"), ("theta", "rad"), ("alpha", "rad")]:
        rows.append((f"{name} [{unit}]", f"{np.min(recording[name]):.4g} to {np.max(recording[name]):.4g}"))
    return card(f"recording {recording.name}", rows, notes=recording.notices)


def trajectory(run: Any) -> str:
    rows: list[tuple[str, Any]] = [("samples", len(run.t)), ("duration [s]", run.t[-1])]
    for name, unit in [("u", run.command_unit), ("theta", "rad"), ("alpha", "rad")]:
        rows.append(
            (f"{name} [{unit}]", f"{np.min(run[name]):.4g} to {np.max(run[name]):.4g}, at the end {run[name][-1]:.4g}")
        )
    if run.modes:
        changes = [run.modes[0], *(b for a, b in zip(run.modes, run.modes[1:]) if a != b)]
        rows.append(("modes", ", ".join(changes)))
    return card(f"simulation of {run.name}", rows)


def validation(validation: Any) -> str:
    rows = [
        (f"{c['run']} {c['channel']}", f"fit {c['fit_percent']:.1f} %, RMS error {c['rms']:.4g} rad")
        for c in validation.channels
    ]
    return card("validation", rows, notes=validation.notices, colour=GREEN)


def plan(plan: Any) -> str:
    return card("plan of experiments", text=plan.summary())


def frf(frf: Any) -> str:
    rows: list[tuple[str, Any]] = [
        ("lines", len(frf.frequency)),
        ("band [Hz]", f"{frf.frequency[0]:.4g} to {frf.frequency[-1]:.4g}"),
        ("method", frf.method),
        ("averages", frf.averages),
    ]
    return card("frequency response", rows, notes=frf.notices)


def transfer_fit(fit: Any) -> str:
    return card("transfer function", text=fit.summary(), notes=fit.notices, colour=GREEN if fit.stable else ORANGE)


def comparison(comparison: Any) -> str:
    return card("comparison with a rig file", text=comparison.summary())


def replay(replay: Any) -> str:
    rows = [("pilot", replay.pilot), ("samples", replay.samples), ("equal", replay.equal)]
    notes = [replay.notice] if replay.notice else []
    return card("replay", rows, text=replay.summary(), notes=notes, colour=GREEN if replay.identical else ORANGE)
