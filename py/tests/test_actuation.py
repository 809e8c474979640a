"""Commands that are no voltage, against SciPy, MuJoCo and python-control."""

from __future__ import annotations

import control
import furuta
import mujoco
import numpy as np
import pytest
from scipy.integrate import solve_ivp

STEPPER = furuta.Rig.load("stepper-kit")
CURRENT = furuta.Rig.load("qube-servo-3")


def pendulum(rig):
    p = rig.parameters
    m, c, length = p["pendulum.mass"], p["pendulum.com"], p["arm.length"]
    swing = m * c**2 + p["pendulum.inertia_transverse"] - p["pendulum.inertia_axial"]
    hinge = p["pendulum.inertia"] + m * c**2
    return swing, hinge, m * length * c, m * p["environment.gravity"] * c, p["pendulum.viscous"]


def test_a_stepper_moves_its_pendulum_as_scipy_says():
    swing, hinge, coupling, weight, damping = pendulum(STEPPER)
    u = 120 * np.sin(np.arange(150) * 0.31)

    def rate(t, x):
        theta_dot, alpha, alpha_dot = x[1:]
        a = u[min(int(t / 0.01 + 1e-9), len(u) - 1)]
        sin, cos = np.sin(alpha), np.cos(alpha)
        moment = coupling * cos * a + swing * sin * cos * theta_dot**2 + weight * sin - damping * alpha_dot
        return [theta_dot, a, alpha_dot, moment / hinge]

    truth = [np.array([0.1, 0.5, 2.5, -1.0])]
    for k in range(len(u)):
        span = (0.01 * k, 0.01 * (k + 1))
        one = solve_ivp(lambda t, x, k=k: rate(0.01 * k + 1e-6, x), span, truth[-1], rtol=1e-11, atol=1e-12)
        truth.append(one.y[:, -1])
    theta, theta_dot, alpha, alpha_dot = np.array(truth).T
    x = furuta.simulate(STEPPER, [0.1, 2.5, 0.5, -1.0], u, dt=0.01, substeps=20)
    assert np.abs(x - np.column_stack([theta, alpha, theta_dot, alpha_dot])).max() < 1e-6


def test_a_current_is_mujocos_motor():
    model = mujoco.MjModel.from_xml_string(CURRENT.to_mjcf(timestep=2e-4))
    data = mujoco.MjData(model)
    data.qpos[:] = [0.1, 2.0]
    mujoco.mj_forward(model, data)
    u = 0.4 * np.sin(np.arange(200) * 0.2)
    seen = [np.r_[data.qpos, data.qvel]]
    for command in u:
        data.ctrl[0] = command
        mujoco.mj_step(model, data, nstep=10)
        seen.append(np.r_[data.qpos, data.qvel])
    x = furuta.simulate(CURRENT, [0.1, 2.0, 0, 0], u, dt=0.002, substeps=10)
    assert np.abs(x - np.array(seen))[:, :2].max() < 1e-6


@pytest.mark.parametrize("rig", [STEPPER, CURRENT], ids=lambda r: r.name)
def test_gains_are_python_controls(rig):
    a, b = furuta.linearize(rig)
    q, r = np.diag([1.0, 5.0, 0.0, 0.0]), np.array([[0.01]])
    gain, _, poles = control.lqr(a, b, q, r)
    ours = furuta.lqr(a, b, q, r)
    ours = np.asarray(ours[0] if isinstance(ours, tuple) else ours)
    assert np.allclose(ours.reshape(-1), np.asarray(gain).reshape(-1), rtol=1e-7)
    assert np.all(np.real(poles) < 0)


def test_the_stepper_is_swung_up_and_balanced():
    controller = furuta.Controller.from_toml('[controller]\nkind = "lqr"', STEPPER, 0.005)
    run = furuta.Trajectory.simulate(STEPPER, [0, np.pi, 0, 0], np.zeros(2000), 0.005, controller=controller)
    assert run.command_unit == "rad/s2" and run.modes[-1] == "balance"
    # It may have come up once around.
    assert np.abs(np.sin(run.alpha[-200:] / 2)).max() < 0.025 and np.abs(run.u).max() <= 150


def test_what_a_kind_does_not_have():
    assert (STEPPER.motor_kind, STEPPER.command_unit) == ("acceleration", "rad/s2")
    assert (CURRENT.motor_kind, CURRENT.command_unit) == ("torque", "A")
    assert "arm.inertia" not in STEPPER.parameters and "motor.resistance" not in CURRENT.parameters
    with pytest.raises(furuta.FurutaError, match="motor.resistance does not enter"):
        CURRENT.with_parameters({"motor.resistance": 2.0})
    with pytest.raises(furuta.FurutaError, match="arm.coulomb cannot act"):
        furuta.simulate(STEPPER.with_effect("arm.coulomb", torque=0.1), [0, 3, 0, 0], np.zeros(3), dt=0.01)
    with pytest.raises(furuta.FurutaError, match="motor.speed_limit cannot act"):
        furuta.simulate(CURRENT.with_effect("motor.speed_limit", speed=3.0), [0, 3, 0, 0], np.zeros(3), dt=0.01)
    assert set(furuta.Rig.VOLTAGE) == set(furuta.Rig.BUILTIN) - {"qube-servo-3", "stepper-kit"}
    assert STEPPER.to_dict()["motor"] == {"kind": "acceleration", "unit": "rad/s2"}


def test_what_a_stepper_does_is_listed_and_looked_for_on_request():
    kinds = {id: of["kinds"] for id, of in furuta.catalogue().items()}
    assert [id for id, of in kinds.items() if of == ["acceleration"]] == [
        "motor.speed_limit", "motor.resonance", "motor.lost_steps"
    ]  # fmt: skip
    assert kinds["arm.coulomb"] == ["voltage", "torque"] and kinds["motor.inductance"] == ["voltage"]
    assert kinds["pendulum.coulomb"] == ["voltage", "torque", "acceleration"]
    dt = 0.005
    u = furuta.signal("multisine", 5, dt, amplitude=20, band=(0.5, 20))
    rig = furuta.Rig.from_toml(STEPPER.to_toml().replace("= 1600", "= 16000"))
    x = furuta.simulate(
        rig.with_effect("motor.resonance", period=0.08, damping=0.1), [0, np.pi, 0, 0], u[:-1], dt, encoders=True
    )
    theta, alpha = x[1][:, 0], x[1][:, 1]
    run = {"t": dt * np.arange(len(u)), "u": u, "theta": theta, "alpha": alpha}
    found = furuta.diagnose(run, rig, candidates=["motor.resonance"], time_limit=None)
    assert [effect["id"] for effect in found.effects] == ["motor.resonance"]
    with pytest.raises(furuta.RigError, match="motor.lost_steps$"):
        furuta.diagnose(run, rig, candidates=["motor.resonanse"])


def test_plots_and_cards_say_the_unit():
    run = furuta.Trajectory.simulate(STEPPER, [0, 3, 0, 0], np.zeros(10), 0.01)
    assert run.plot().axes[2].get_ylabel() == "command, u [rad/s2]"
    assert "rad/s2" in STEPPER._repr_html_() and "u [rad/s2]" in run._repr_html_()
