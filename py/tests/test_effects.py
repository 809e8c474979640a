"""Every effect of the model against the same effect made by MuJoCo's means."""

from __future__ import annotations

import furuta
import numpy as np
import pytest

pytest.importorskip("mujoco")

from mujoco_rig import EFFECTS, FAMILIES, Plant, draw_effect, rig_toml  # noqa: E402

# Largest difference of the angles over one second from the same state, rad. An encoder count is 1.5e-3 to 3e-3 rad. Without dry friction
# two good integrators agree far better; with it, the model's friction acts within a sample of the stop (one Runge-Kutta step per sample).
TOLERANCE = {effect: 2e-2 if effect.endswith("coulomb") else 2e-5 for effect in EFFECTS}


@pytest.mark.parametrize("family", sorted(FAMILIES))
@pytest.mark.parametrize("effect", ["nothing", *EFFECTS])
def test_against_mujoco(effect, family):
    true = FAMILIES[family]
    effects = {} if effect == "nothing" else {effect: draw_effect(effect, true, np.random.default_rng(8))}
    rig = furuta.Rig.from_toml(rig_toml(true))
    for id, values in effects.items():
        rig = rig.with_effect(id, **values)
    u = true.vmax * 0.5 * np.repeat(np.random.default_rng(3).uniform(-1, 1, 10), round(true.rate / 10))
    plant = Plant(true, effects, alpha=np.pi - 0.5, theta=0.1)
    states, shown = [plant.state], [plant.measure()]
    for volts in u:
        plant.advance(volts)
        states.append(plant.state)
        shown.append(plant.measure())
    x = furuta.simulate(rig, states[0], u, 1 / true.rate)
    worst = np.abs(x - states)[:, :2].max()
    print(f"{family} {effect} {worst:.2e} rad")
    assert worst < TOLERANCE.get(effect, 2e-5)
    count = 2 * np.pi / min(true.arm_counts, true.pend_counts)
    assert np.abs(furuta.measure(rig, x) - shown).max() < 1.01 * count + worst
