"""The catalogue of effects: a page for each part of the rig, for each effect a picture of what it does."""

from __future__ import annotations

import io
from typing import NamedTuple

import furuta
import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

RIG = furuta.Rig.load("qube-servo-2")
# For what acts on arms alone that follow a commanded acceleration.
STEPPER = furuta.Rig.load("stepper-kit")
PARTS = {
    "arm": "The arm",
    "motor": "The motor",
    "drive": "The drive",
    "pendulum": "The pendulum",
    "sensor": "The sensors",
    "disturbance": "Disturbances",
}


class Experiment(NamedTuple):
    """What is simulated with and without an effect."""

    says: str
    u: object = lambda t: 0 * t
    seconds: float = 4.0
    alpha: float = np.pi
    alpha_dot: float = 0.0
    dt: float = 0.002


def sine(amplitude: float, frequency: float, seconds: float = 4.0) -> Experiment:
    says = f"The command is a sine of {amplitude:g} V at {frequency:g} Hz, the pendulum hanging."
    return Experiment(says, lambda t: amplitude * np.sin(2 * np.pi * frequency * t), seconds)


STEPS = Experiment(
    "The command is 1 V, -1 V and 0 V for 1.5 s each, the pendulum hanging.",
    lambda t: np.select([t < 1.5, t < 3], [1.0, -1.0], 0.0),
    6.0,
)
EDGE = Experiment("The command steps from 0 to 3 V after 10 ms.", lambda t: 3.0 * (t >= 0.01), 0.08, dt=0.001)
REST = Experiment("No command, the rig begins at rest.")
DECAY = Experiment("The pendulum is let go 1.5 rad from hanging, without a command.", seconds=5.0, alpha=np.pi - 1.5)
TURNS = Experiment("The pendulum hangs and is thrown at 30 rad/s, without a command.", seconds=2.5, alpha_dot=30.0)
SLOW, LARGE = sine(2, 0.5), sine(6, 1)
PUSHES = Experiment(
    "The command is 100 rad/s², then -100 rad/s², for 0.3 s each, the pendulum hanging.",
    lambda t: np.select([t < 0.3, t < 0.6], [100.0, -100.0], 0.0),
    2.0,
)
TAP = Experiment(
    "The command is 100 rad/s², then -100 rad/s², for 20 ms each, the pendulum hanging.",
    lambda t: np.select([t < 0.02, t < 0.04], [100.0, -100.0], 0.0),
    0.6,
)
SHOWN = {
    "arm.spring": STEPS,
    "arm.relaxation": STEPS,
    "arm.stop": STEPS,
    "motor.inductance": EDGE,
    "motor.current_limit": LARGE,
    "sensor.theta.eccentricity": SLOW,
    "arm.cable": STEPS,
    "arm.quadratic": LARGE,
    "arm.tilt": REST,
    "motor.bias": REST,
    "motor.saturation": LARGE,
    "motor.lag": EDGE,
    "motor.delay": EDGE,
    "motor.asymmetry": sine(2, 0.5, 6),
    "motor.drift": sine(2, 0.5, 20),
    "motor.speed_limit": PUSHES,
    "motor.resonance": TAP,
    "motor.lost_steps": REST,
    "drive.backlash": sine(1, 2, 2),
    "drive.compliance": Experiment("The command is 6 V for 20 ms.", lambda t: 6.0 * (t < 0.02), 0.3, dt=0.001),
    "pendulum.inertia_transverse": TURNS,
    "pendulum.bias": REST,
    "sensor.alpha.scale": TURNS,
    "sensor.theta.scale": SLOW,
    "sensor.delay": EDGE,
    "sensor.theta.lost_counts": SLOW,
    "sensor.jitter": TURNS,
    "disturbance.vibration": REST,
    "disturbance.kick": REST,
    "disturbance.arm_kick": REST,
}
# Where the typical size would not be seen: what is shown in its place.
LARGER = {
    "drive.compliance": {"stiffness": 0.05, "motor_share": 0.5},
    "motor.resonance": {"period": 0.1, "damping": 0.1},
}
BY_PART = {"pendulum": DECAY, "sensor": DECAY}


def rig(id: str) -> furuta.Rig:
    """A rig that can have the effect."""
    return RIG if "voltage" in furuta.catalogue()[id]["kinds"] else STEPPER


def experiment(id: str) -> Experiment:
    return SHOWN.get(id) or BY_PART.get(id.split(".")[0], SLOW)


def runs(id: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times, and what the encoders read without and with an effect of typical size."""
    how = experiment(id)
    t = how.dt * np.arange(round(how.seconds / how.dt) + 1)
    x0 = [0.0, how.alpha, 0.0, how.alpha_dot]
    without, having = (
        furuta.simulate(it, x0, how.u(t[:-1]), how.dt, substeps=4, encoders=True)[1]
        for it in (rig(id), rig(id).with_effect(id, **LARGER.get(id, {})))
    )
    return t, without, having


def picture(id: str) -> bytes:
    t, without, having = runs(id)
    with rc_context({"svg.hashsalt": id, "svg.fonttype": "path", "font.size": 9}):
        figure = Figure(figsize=(8, 2.5), layout="constrained")
        for axis, column, name in zip(figure.subplots(1, 2), (0, 1), ("arm, theta [rad]", "pendulum, alpha [rad]")):
            axis.plot(t, without[:, column], color="0.6", label="without")
            axis.plot(t, having[:, column], color="C3", linewidth=1.2, label=f"with {id}")
            axis.set(title=name, xlabel="t [s]")
            axis.ticklabel_format(useOffset=False)
            axis.grid(alpha=0.3)
        figure.axes[0].legend(fontsize=8)
        file = io.BytesIO()
        figure.savefig(file, format="svg", metadata={"Date": None})
    return file.getvalue()


def number(value: float | str | None) -> str:
    return "must be given" if value is None else f"`{value}`" if isinstance(value, str) else f"{value:.4g}"


def size(id: str) -> str:
    shown = LARGER.get(id)
    return "of `" + ", ".join(f"{name}={value}" for name, value in shown.items()) + "`" if shown else "of typical size"


def asked_for(id: str, entry: dict) -> str:
    """How to have it looked for, where it is not always."""
    if entry["offered"] == "always":
        return ""
    if entry["offered"] == "never":
        return " No diagnosis looks for it: no fit can follow it."
    return f" A diagnosis looks for it on request: `furuta diagnose --candidate {id}`."


def section(id: str, entry: dict) -> str:
    """One effect as Markdown."""
    shown = rig(id)
    typical = shown.with_effect(id).effects[id]
    rows = [
        f"| `{name}` | {of['unit']} | {number(typical[name])} | {number(of['off'])} | {number(of['default'])} |"
        for name, of in entry["details"].items()
    ]
    alike = ", ".join(f"[`{other}`]({other.split('.')[0]}.md#{other})" for other in entry["look_alikes"])
    return f"""## {entry["name"]} {{ #{id} }}

`{id}`: {entry["sentence"]}{asked_for(id, entry)}

```text
{entry["law"]}
```

| Parameter | Unit | Typical, on {shown.name} | Does nothing at | Default |
|---|---|---|---|---|
{chr(10).join(rows)}

**What it does to data.** {entry["shows"]}

![Both angles over time without and with {id}]({id}.svg)

{experiment(id).says} Grey: the rig as its manual has it; red: with the effect {size(id)}.

**Looks like** {alike or "no other entry"}. **What tells them apart:** {entry["experiment"]}.
"""


def pages() -> dict[str, str]:
    """Markdown by page."""
    catalogue = furuta.catalogue()
    parts = {part: [id for id in catalogue if id.split(".")[0] == part] for part in PARTS}
    assert sum(map(len, parts.values())) == len(catalogue)
    return {
        f"effects/{part}.md": f"# {PARTS[part]}\n\n" + "\n".join(section(id, catalogue[id]) for id in ids)
        for part, ids in parts.items()
    }


def pictures() -> dict[str, bytes]:
    """SVG by file."""
    return {f"effects/{id}.svg": picture(id) for id in furuta.catalogue()}
