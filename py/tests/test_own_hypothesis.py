"""A law of one's own from Python: compiled, carried, simulated against SciPy, found in data that SciPy made."""

from __future__ import annotations

import copy
import pickle

import furuta
import numpy as np
import pytest

solve_ivp = pytest.importorskip("scipy.integrate").solve_ivp

BRAKE = {
    "arm": "-k*theta_dot/(1 + (theta_dot/v)^2)",
    "parameters": {
        "k": {"unit": "N m s/rad", "min": 0, "max": 0.1, "typical": 1e-3, "strength": True},
        "v": {"unit": "rad/s", "min": 0.3, "max": 100, "typical": 3},
    },
}
# A cable that relaxes and stiffens.
CABLE = {
    "arm": "-k*(z + c*z^3)",
    "state": {"name": "z", "unit": "rad", "rate": "theta_dot - z/tau"},
    "parameters": {
        "k": {"unit": "N m/rad", "min": 0, "max": 1, "typical": 3e-3, "strength": True},
        "tau": {"unit": "s", "min": 0.01, "max": 100, "typical": 0.5},
    },
    "constants": {"c": {"value": 0.5, "unit": "1/rad2"}},
}


@pytest.fixture
def brake():
    return furuta.Hypothesis("user.brake", name="Eddy-current brake", **BRAKE)


@pytest.fixture
def cable():
    return furuta.Hypothesis("user.cable", **CABLE)


def scipy_run(rig, hidden, u, dt, x0):
    """States under held commands, by SciPy, of equations written here. `hidden(theta, theta_dot, z)` is a torque on the
    arm and the rate of z."""
    p = rig.parameters
    m, com, length = p["pendulum.mass"], p["pendulum.com"], p["arm.length"]
    arm = p["arm.inertia"] + m * length**2 + p["pendulum.inertia_axial"]
    pendulum = p["pendulum.inertia"] + m * com**2
    swing = p["pendulum.inertia_transverse"] + m * com**2 - p["pendulum.inertia_axial"]
    coupling, weight = m * length * com, m * p["environment.gravity"] * com
    gear = p["motor.gear_ratio"]
    gain = p["motor.torque_constant"] * gear * p["motor.efficiency"] / p["motor.resistance"]

    def rate(_, y, volts):
        theta, alpha, w, v, z = y
        torque, z_rate = hidden(theta, w, z)
        s, c = np.sin(alpha), np.cos(alpha)
        on_arm = (
            gain * (p["motor.amplifier_gain"] * volts - p["motor.back_emf_constant"] * gear * w)
            - p["arm.viscous"] * w
            + torque
            - 2 * swing * s * c * w * v
            - coupling * s * v**2
        )
        on_pendulum = weight * s - p["pendulum.viscous"] * v + swing * s * c * w**2
        mass = np.array([[arm + swing * s**2, -coupling * c], [-coupling * c, pendulum]])
        return [w, v, *np.linalg.solve(mass, [on_arm, on_pendulum]), z_rate]

    y = np.array([*x0, 0.0])
    states = [y]
    for volts in u:
        y = solve_ivp(rate, (0, dt), y, args=(volts,), rtol=1e-8, atol=1e-11).y[:, -1]
        states.append(y)
    return np.array(states)[:, :4]


def sweep(n, dt, a):
    t = dt * np.arange(n)
    return 3 * np.sin(a * t * (1 + 0.8 * t)) + 1.5 * np.sin(0.9 * a * t)


def test_it_is_a_value(brake, tmp_path):
    assert brake.id == "user.brake" and brake.name == "Eddy-current brake"
    assert brake.law == "arm: -k*theta_dot/(1 + (theta_dot/v)^2)"
    assert brake.parameters["k"] == {
        "unit": "N m s/rad",
        "min": 0.0,
        "max": 0.1,
        "typical": 1e-3,
        "off": 0.0,
        "strength": True,
    }
    again = furuta.Hypothesis.from_toml(brake.to_toml())
    assert again == brake and hash(again) == hash(brake)
    assert pickle.loads(pickle.dumps(brake)) == brake == copy.deepcopy(brake)
    assert furuta.Hypothesis("user.brake", parameters=brake.parameters, arm="-2*k*theta_dot/v*v") != brake
    path = tmp_path / "brake.toml"
    brake.save(path)
    assert furuta.Hypothesis.load(path) == brake
    with pytest.raises(FileExistsError):
        brake.save(path)
    rig = furuta.Rig.load("qube-servo-2").with_effect(brake, k=2e-3, v=2)
    assert rig.effects == {"user.brake": {"k": 2e-3, "v": 2.0}}
    assert furuta.Rig.from_toml(rig.to_toml()) == rig == pickle.loads(pickle.dumps(rig))
    assert rig.with_effect(brake).effects == {"user.brake": {"k": 1e-3, "v": 3.0}}  # typical


def test_mistakes_are_shown(brake):
    def said(**change):
        with pytest.raises(furuta.RigError) as error:
            furuta.Hypothesis("user.wrong", **{**BRAKE, **change})
        return str(error.value)

    assert said(arm="-k*thetta_dot").splitlines()[1:] == ["  -k*thetta_dot", "     ^^^^^^^^^^"]
    assert "character 1: the law is in" in said(arm="-k*theta")
    assert "parameter k has no key `maxi`" in said(parameters={"k": {**BRAKE["parameters"]["k"], "maxi": 1}})
    assert "parameter k lacks `min`" in said(parameters={"k": {"unit": "-"}})
    assert "state.rate, character 1" in said(arm="-k*z", state={"name": "z", "unit": "rad/s", "rate": "theta"})
    assert "the state lacks `rate`" in said(state={"name": "z", "unit": "rad/s"})
    assert "only a law for `arm`" in said(arm=None, pendulum="-k*alpha_dot", side="motor")
    with pytest.raises(furuta.RigError, match="it has user.a, user.b"):
        text = brake.to_toml()
        furuta.Hypothesis.from_toml(text.replace("user.brake", "user.a") + text.replace("user.brake", "user.b"))
    with pytest.raises(ValueError, match="side"):
        furuta.Hypothesis("user.wrong", side="left", **BRAKE)
    with pytest.raises(furuta.RigError, match="has no parameter `q`"):
        furuta.Rig.load("qube-servo-2").with_effect(brake, q=1)
    with pytest.raises(TypeError, match="candidates"):
        furuta.diagnose({"t": [0]}, "qube-servo-2", candidates=[3])
    with pytest.raises(TypeError, match="candidates"):
        furuta.diagnose({"t": [0]}, "qube-servo-2", candidates=3)
    # One alone, without a list around it: the id is looked up, the recording is what is refused.
    with pytest.raises(furuta.RigError, match="arm.lugr` is not in the catalogue"):
        furuta.diagnose({"t": [0]}, "qube-servo-2", candidates="arm.lugr")
    for alone in ("arm.lugre", brake):
        with pytest.raises(furuta.RecordingError):
            furuta.diagnose({"t": [0]}, "qube-servo-2", candidates=alone)
    other = furuta.Hypothesis("user.brake", parameters=BRAKE["parameters"], arm="-2*k*theta_dot/v*v")
    with pytest.raises(furuta.RigError, match="two different laws are called user.brake"):
        furuta.diagnose({"t": [0]}, "qube-servo-2", candidates=[brake, other])


@pytest.mark.parametrize("law", ["brake", "cable"])
def test_simulate_agrees_with_scipy(law, request):
    k, other = (2e-3, 2.0) if law == "brake" else (6e-3, 0.3)

    def hidden(_, w, z):
        if law == "brake":
            return -k * w / (1 + (w / other) ** 2), 0.0
        return -k * (z + 0.5 * z**3), w - z / other

    name = {"brake": "v", "cable": "tau"}[law]
    hypothesis = request.getfixturevalue(law)
    rig = furuta.Rig.load("qube-servo-2")
    u, dt, x0 = sweep(300, 0.002, 3.0), 0.002, [0.3, 3.0, 0.0, 0.0]
    expected = scipy_run(rig, hidden, u, dt, x0)
    with_law = rig.with_effect(hypothesis, **{"k": k, name: other})
    found = furuta.simulate(with_law, x0, u, dt, substeps=4)
    # RK4 at 0.5 ms against 1e-8 a step
    assert np.abs(found - expected).max() < 1e-5
    assert np.abs(furuta.simulate(rig, x0, u, dt) - expected).max() > 0.05


@pytest.mark.parametrize("given", ["object", "path"])
def test_it_is_found_beside_a_catalogue_effect_on_a_sheet_that_is_off(given, brake, tmp_path):
    rig = furuta.Rig.load("qube-servo-2")
    p = rig.parameters
    sheet = rig.with_parameters(
        {
            "arm.inertia": 1.04 * p["arm.inertia"],
            "pendulum.inertia": 0.96 * p["pendulum.inertia"],
            # A slender rod's: what a fit refits of one it refits of the other.
            "pendulum.inertia_transverse": 0.96 * p["pendulum.inertia_transverse"],
            "motor.torque_constant": 0.97 * p["motor.torque_constant"],
        }
    )

    def hidden(theta, w, _):
        return -2e-3 * w / (1 + (w / 2) ** 2) - 3e-3 * (theta - 0.4), 0.0

    dt, n, count = 0.002, 2500, 2 * np.pi / 2048
    recordings = []
    for a in (3.0, 4.1):
        u = sweep(n, dt, a)
        x = scipy_run(rig, hidden, u, dt, [0, np.pi, 0, 0])[:-1]
        theta, alpha = (np.round(x[:, :2] / count) * count).T
        recordings.append({"t": dt * np.arange(n), "u": u, "theta": theta, "alpha": alpha})
    path = tmp_path / "brake.toml"
    brake.save(path)
    found = furuta.diagnose(recordings, sheet, candidates=[brake if given == "object" else path], time_limit=None)
    assert sorted(e["id"] for e in found.effects) == ["arm.spring", "user.brake"]
    fitted = found.repaired_rig.effects["user.brake"]
    assert fitted["k"] == pytest.approx(2e-3, rel=0.1) and fitted["v"] == pytest.approx(2.0, rel=0.15)
    calibrated = furuta.calibrate(recordings, found.repaired_rig, free=["user.brake.k"])
    assert "user.brake.k" in str(calibrated.to_dict())
