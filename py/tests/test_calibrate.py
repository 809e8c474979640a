"""Calibration, validation and the planning of experiments, against plants and optimisers that share nothing with
furuta."""

from __future__ import annotations

import dataclasses

import furuta
import numpy as np
import pytest
import scipy.optimize
import scipy.stats

RIG = furuta.Rig.load("qube-servo-2")


def recorded(rig, u, h, rng, noise=1e-3):
    x = furuta.simulate(rig, [0, np.pi, 0, 0], u[:-1], h)
    angles = furuta.measure(rig, x) + noise * rng.standard_normal((len(u), 2))
    return {"t": h * np.arange(len(u)), "u": u, "theta": angles[:, 0], "alpha": angles[:, 1]}


def sweep(seconds, h, amplitude=3.0):
    t = h * np.arange(round(seconds / h))
    return amplitude * np.sin(2 * t * (1 + t))


def fine():
    """The rig with encoders so fine that rounding is nothing beside the noise, and every sample counts alike."""
    return furuta.Rig.from_toml(RIG.to_toml().replace("2048", "100000000"))


@pytest.mark.parametrize("same_zero", [False, True])
def test_same_minimum_as_scipy(same_zero):
    """One window over the whole run: the cost's minimum over initial state, two parameters and, where it is not said to
    be the rig's, the zero of alpha's encoder, which is known to 5 mrad beforehand; found by SciPy with differences."""
    h, rng = 0.005, np.random.default_rng(1)
    rig, keys = fine(), ("arm.inertia", "motor.torque_constant")
    data = recorded(rig, sweep(3.0, h), h, rng)
    found = furuta.calibrate(data, rig, free=list(keys), horizon=60.0, same_zero=same_zero)
    noise = np.array(found.to_dict()["noise"])
    assert noise == pytest.approx(1e-3, rel=0.1)
    n = len(data["t"])
    y = np.column_stack([data["theta"], data["alpha"]])

    def residual(p):
        changed = rig.with_parameters({key: factor * rig.parameters[key] for key, factor in zip(keys, p[4:6])})
        x = furuta.simulate(changed, p[:4], data["u"][:-1], h)
        if same_zero:
            return ((x[1:, :2] - y[1:]) / noise).ravel()
        return np.append(((x[1:, :2] - [0.0, p[6]] - y[1:]) / noise).ravel(), p[6] / 5e-3)

    x = furuta.simulate(rig, [0, np.pi, 0, 0], data["u"][:-1], h)[0]
    start, scale = [*x, 1.0, 1.0, 0.0], [0.1, 0.1, 1, 1, 0.1, 0.1, 5e-3]
    count = 6 if same_zero else 7
    answer = scipy.optimize.least_squares(
        residual, start[:count], x_scale=scale[:count], xtol=1e-14, ftol=1e-14, gtol=1e-14
    )
    cost = found.chi**2 * (2 * (n - 1) - 4)
    # SciPy's slopes are differences; the minimum is flat, so the cost agrees to the square of their error.
    assert cost == pytest.approx(2 * answer.cost, rel=1e-5)
    for key, factor in zip(keys, answer.x[4:6]):
        p = found.parameters[key]
        assert abs(p["fitted"] - factor * p["nominal"]) < 0.05 * p["std"], key


def test_whiteness_is_that_of_the_textbook():
    rng = np.random.default_rng(2)
    for residual in (rng.standard_normal(500), np.convolve(rng.standard_normal(520), np.ones(3), "valid")[:500]):
        test = furuta.whiteness(residual, lags=20)
        e = residual - residual.mean()
        r = np.array([e[k:] @ e[: len(e) - k] for k in range(1, 21)]) / (e @ e)
        n = len(e)
        q = n * (n + 2) * np.sum(r**2 / (n - np.arange(1, 21)))
        assert test["values"] == pytest.approx(r, abs=1e-12)
        assert test["ljung_box"] == pytest.approx(q, rel=1e-12)
        assert test["p_value"] == pytest.approx(scipy.stats.chi2.sf(q, 20), rel=1e-9, abs=1e-300)
        assert test["bound"] == pytest.approx(scipy.stats.norm.ppf(0.995) / np.sqrt(n), rel=1e-6)


def test_ljung_box_of_statsmodels():
    diagnostic = pytest.importorskip("statsmodels.stats.diagnostic")
    residual = np.random.default_rng(3).standard_normal(400)
    answer = diagnostic.acorr_ljungbox(residual, lags=[15])
    test = furuta.whiteness(residual, lags=15)
    assert test["ljung_box"] == pytest.approx(answer["lb_stat"].iloc[0], rel=1e-10)
    assert test["p_value"] == pytest.approx(answer["lb_pvalue"].iloc[0], rel=1e-9)


def test_the_objects():
    h, rng = 0.004, np.random.default_rng(4)
    data = recorded(RIG, sweep(6.0, h), h, rng)
    found = furuta.calibrate(data, RIG, hold=["arm.length"], profile=["arm.inertia"])
    assert "arm.length" not in found.fitted and "arm.inertia" in found.fitted
    assert found.rig.parameters["arm.inertia"] == found.parameters["arm.inertia"]["fitted"]
    assert found.to_dict()["fitted"] == found.fitted
    assert found.chi == pytest.approx(1.0, abs=0.1)
    assert len(found.profiles) == 1 and min(found.profiles[0]["rise"]) > -0.1
    assert "arm.inertia" in found._repr_html_() and "95 %" in found._repr_html_()
    assert str(found) == found.summary()
    pytest.importorskip("matplotlib")
    assert len(found.plot().axes) == 4

    judged = furuta.validate(data, found.rig)
    assert all(c["simulated"] and c["fit_percent"] > 95 for c in judged.channels)
    # The fit in per cent, from its definition on the same residuals.
    assert len(judged.plot().axes) == 6
    assert judged.to_dict()["channels"] == judged.channels


def test_the_report(tmp_path):
    h, rng = 0.004, np.random.default_rng(5)
    found = furuta.calibrate(recorded(RIG, sweep(4.0, h), h, rng), RIG)
    found.report(tmp_path / "calibration.html")
    page = (tmp_path / "calibration.html").read_text()
    assert page.startswith("<!doctype html>") and "polyline" in page and "http" not in page


def test_what_is_refused():
    with pytest.raises(furuta.CalibrateError, match="nothing moves"):
        n = 1000
        furuta.calibrate(
            {"t": 0.01 * np.arange(n), "u": np.zeros(n), "theta": np.zeros(n), "alpha": np.full(n, np.pi)}, RIG
        )
    data = recorded(RIG, sweep(4.0, 0.004), 0.004, np.random.default_rng(6))
    with pytest.raises(furuta.CalibrateError, match="`arm.mass` cannot be calibrated"):
        furuta.calibrate(data, RIG, free=["arm.mass"])
    with pytest.raises(furuta.CalibrateError, match="rate = 1 is outside"):
        furuta.plan_experiment(RIG, rate=1.0)


def test_a_plan():
    plan = furuta.plan_experiment(RIG, rate=200.0, experiments=3)
    assert len(plan.sequence) == 3 and len(plan.after[0]) == len(plan.parameters)
    assert all(np.diff([e["log_det"] for e in plan.experiments]) <= 0)
    assert "furuta simulate --rig my.toml" in plan.summary("my.toml")


def test_a_plant_of_mujoco():
    """A sheet that is off by 20 % in what cannot be measured directly: the intervals hold the truth of a plant that is
    MuJoCo's."""
    pytest.importorskip("mujoco")
    from mujoco_plant import Plant
    from mujoco_rig import FAMILIES, rig_toml

    true = FAMILIES["bench-made"]
    sheet = dataclasses.replace(
        true,
        arm_inertia=1.2 * true.arm_inertia,
        arm_viscous=0.8 * true.arm_viscous,
        pend_inertia=0.8 * true.pend_inertia,
        pend_viscous=1.2 * true.pend_viscous,
        kt=0.8 * true.kt,
    )
    h = 1 / true.rate
    recordings = []
    for phase in (0.0, 2.0):
        plant, rows = Plant(true, {}, alpha=np.pi), []
        t = h * np.arange(round(8.0 * true.rate))
        u = 0.25 * true.vmax * np.sin(2 * t * (1 + t) + phase)
        for volts in u:
            rows.append(plant.measure())
            plant.advance(volts)
        theta, alpha = np.array(rows).T
        recordings.append({"t": t, "u": u, "theta": theta, "alpha": alpha})
    found = furuta.calibrate(recordings, furuta.Rig.from_toml(rig_toml(sheet)))
    truth = {
        "arm.inertia": true.arm_inertia,
        "pendulum.inertia": true.pend_inertia,
        "pendulum.viscous": true.pend_viscous,
        "motor.torque_constant": true.kt,
        "arm.length": true.arm_length,
    }
    for key, value in truth.items():
        p = found.parameters[key]
        # Five intervals are looked at, and MuJoCo's integrator has errors of its own: three standard deviations, and a
        # twentieth of a per cent.
        assert abs(p["fitted"] - value) < 3 * p["std"] + 5e-4 * value, (key, p, value)
        assert p["std"] < 0.01 * value
    damping = next(c for c in found.combinations if c["name"] == "arm damping")
    assert (
        abs(damping["fitted"] - true.arm_damping / true.gravity_torque) < 3 * damping["std"] + 5e-4 * damping["fitted"]
    )
    assert found.chi < 1.1


def test_a_part_of_a_recording_is_used():
    rig = furuta.Rig.load("qube-servo-2")
    t = 0.002 * np.arange(3001)
    u = 1.5 * np.sin(3 * t * (1 + t))
    theta, alpha = furuta.measure(rig, furuta.simulate(rig, [0, np.pi, 0, 0], u[:-1], 0.002)).T
    data = {"t": t, "u": u, "theta": theta, "alpha": alpha}
    assert furuta.validate(data, rig, every=2, span=(1.0, 5.0)) is not None
    with pytest.raises(furuta.RecordingError, match=r"the recording lasts 6 s"):
        furuta.validate(data, rig, span=(50.0, 60.0))
    with pytest.raises(furuta.RecordingError, match="every 0th sample"):
        furuta.calibrate(data, rig, every=0)
    with pytest.raises(furuta.RecordingError, match="leaves no 20"):
        furuta.diagnose(data, rig, every=1000)


def test_what_is_no_recording_is_named(tmp_path):
    rig = furuta.Rig.load("qube-servo-2")
    with pytest.raises(furuta.RecordingError, match="is a directory, not a recording"):
        furuta.validate(str(tmp_path), rig)
    bad = tmp_path / "run.csv"
    bad.write_text("t,u,theta,alpha\n0,0,0,\x1b[31mred\n")
    with pytest.raises(furuta.RecordingError) as caught:
        furuta.validate(str(bad), rig)
    assert "\x1b" not in str(caught.value) and "\\u{1b}[31mred" in str(caught.value)
    with pytest.raises(furuta.RigError, match="is a directory, not a rig file"):
        furuta.Rig.load(str(tmp_path))


def arm_alone(rig, seconds=8.0, h=0.002):
    """A recording of the arm with the pendulum off: `J theta'' = gain u - damping theta'`, solved exactly from sample
    to sample."""
    gain = rig["motor.torque_constant"] / rig["motor.resistance"]
    rate = (rig["arm.viscous"] + gain * rig["motor.back_emf_constant"]) / rig["arm.inertia"]
    t = h * np.arange(round(seconds / h))
    u = 2.0 * np.sin(2 * np.pi * t * (0.3 + 0.35 * t))
    theta, speed, angles, decay = 0.3, 0.0, [], np.exp(-rate * h)
    for volts in u:
        angles.append(theta)
        end = gain * volts / rig["arm.inertia"] / rate
        theta, speed = theta + end * h + (speed - end) * (1 - decay) / rate, end + (speed - end) * decay
    count = 2 * np.pi / 2048
    return {"t": t, "u": u, "theta": count * np.round(np.array(angles) / count), "alpha": np.zeros_like(t)}


def test_a_part_of_the_rig_alone_and_beside_the_whole():
    real = RIG.with_parameters({"motor.torque_constant": 0.046, "arm.inertia": 8e-5, "pendulum.com": 0.06})
    arm, h = arm_alone(real), 0.004
    found = furuta.calibrate(arm, RIG, pendulum="removed", fix=["motor.torque_constant"])
    # To data in proportion to the inertia, one number too small by a factor is another one too large by it.
    ratio = found.parameters["arm.inertia"]["fitted"] / RIG["motor.torque_constant"]
    assert ratio == pytest.approx(8e-5 / 0.046, rel=5e-3)
    judged = furuta.validate(arm, found.rig, pendulum="removed")
    assert [c["channel"] for c in judged.channels] == ["theta"] and judged.channels[0]["fit_percent"] > 99
    whole = recorded(real, sweep(6.0, h), h, np.random.default_rng(2))
    keys = ["motor.torque_constant", "arm.inertia", "arm.viscous", "pendulum.inertia", "pendulum.viscous", "pendulum.com"]
    alone, both = (furuta.calibrate(whole, RIG, free=keys, removed=removed) for removed in (None, [arm]))
    assert not alone.parameters["pendulum.com"]["identifiable"]
    com = both.parameters["pendulum.com"]
    assert com["identifiable"] and abs(com["fitted"] - 0.06) < 4 * com["std"] < 0.003
    with pytest.raises(ValueError, match="swings, removed, locked, alone or driven, not off"):
        furuta.calibrate(whole, RIG, pendulum="off")
    # A command of another rig says nothing where the arm moves as measured.
    wrong = whole | {"u": -5 * np.asarray(whole["u"])[::-1]}
    sheet = RIG.with_parameters({"pendulum.com": 0.06})
    driven = furuta.calibrate(wrong, sheet, free=["pendulum.inertia", "pendulum.viscous"], pendulum="driven")
    inertia = driven.parameters["pendulum.inertia"]
    assert abs(inertia["fitted"] - real["pendulum.inertia"]) < 4 * inertia["std"]
    beside = furuta.calibrate(whole, sheet, free=keys[:-1], driven=[wrong]).parameters
    for key in ("pendulum.inertia", "arm.inertia"):
        assert abs(beside[key]["fitted"] - real[key]) < 4 * beside[key]["std"]


@pytest.mark.parametrize(
    "residual, lags, says",
    [
        ([0.0, np.nan, 1.0], 1, r"residual\[1\] = NaN"),
        ([0.0, 1.0, np.inf], 1, r"residual\[2\] = inf"),
        ([], 1, "residual of 0 samples"),
        (np.arange(5.0), 5, "lags = 5 for a residual of 5 samples"),
        (np.arange(5.0), 0, "lags must be at least 1"),
        (np.zeros((5, 2)), 2, r"residual has shape \(5, 2\)"),
    ],
)
def test_what_has_no_whiteness(residual, lags, says):
    with pytest.raises(furuta.CalibrateError, match=says):
        furuta.whiteness(residual, lags=lags)
    assert len(furuta.whiteness(np.arange(6.0)[:, None], lags=5)["values"]) == 5


def test_what_is_asked_twice_or_not_at_all():
    rig, qube = furuta.Rig.load("qube-servo-2"), furuta.example("qube-servo-2")
    run = qube.runs["chirp-plus-1"]
    for call in (furuta.calibrate, furuta.diagnose):
        with pytest.raises(furuta.RecordingError, match="holds the same samples as"):
            call([run, run], rig)
    with pytest.raises(furuta.CalibrateError, match=r"`arm\.inertia` is both to be fitted and to be held"):
        furuta.calibrate(run, rig, free="arm.inertia", fix="arm.inertia")
    with pytest.raises(furuta.CalibrateError, match="experiments = 0"):
        furuta.plan_experiment(rig, experiments=0)
    # Recordings by name are a sequence of recordings with these names.
    runs = {name: qube.runs[name] for name in ("chirp-plus-1", "chirp-minus-1")}
    judged = furuta.validate(runs, qube.rig)
    assert {channel["run"].split(" ")[0] for channel in judged.channels} <= set(runs)
