"""Many short recordings: a student who repeats an experiment has a dozen files, or one with as many gaps."""

from __future__ import annotations

import furuta
import numpy as np
import pytest

DT = 0.002
RIG = furuta.Rig("qube-servo-2")


def recordings(count, seconds=2.0):
    """What the encoders see of a rig in which no catalogue's effect is: its alpha depends on theta."""
    found = []
    for i in range(count):
        rng = np.random.default_rng(i)
        t = np.arange(0, seconds, DT)
        u = 2.0 * np.sin(2 * np.pi * (0.5 + 2 * t) * t + rng.uniform(0, 6))
        _, y = furuta.simulate(RIG, [0, np.pi, 0, 0], u[:-1], DT, encoders=True)
        theta, alpha = y.T
        found.append({"t": t, "u": u, "theta": theta, "alpha": alpha + 0.05 * np.sin(3 * theta)})
    return found


@pytest.mark.parametrize("count", [7, 8, 12])
def test_a_dozen_recordings_that_nothing_explains(count):
    found = furuta.diagnose(recordings(count), RIG, time_limit=10)
    assert found.verdict in ("unexplained", "missing_effects")
    fitted = furuta.calibrate(recordings(count), RIG, free=["pendulum.inertia", "pendulum.viscous"])
    assert fitted.to_dict()


def test_one_recording_with_a_dozen_gaps():
    parts = recordings(12)
    whole = {name: np.concatenate([part[name] for part in parts]) for name in ("u", "theta", "alpha")}
    whole["t"] = np.concatenate([part["t"] + 5.0 * i for i, part in enumerate(parts)])
    found = furuta.diagnose(whole, RIG, time_limit=10)
    assert found.verdict in ("unexplained", "missing_effects")
