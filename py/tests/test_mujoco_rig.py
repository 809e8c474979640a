"""The MuJoCo rig against equations derived from the energies: before it may judge furuta, it is judged itself."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
from scipy.linalg import expm

pytest.importorskip("mujoco")

from lagrange_effects import Motion  # noqa: E402
from mujoco_case import multisine, write_case  # noqa: E402
from mujoco_effects import EFFECTS, FOREIGN, RARE, draw_effect, hide  # noqa: E402
from mujoco_plant import Plant, untimely  # noqa: E402
from mujoco_rig import FAMILIES, data_sheet, rig_toml  # noqa: E402

RIG = FAMILIES["bench-made"]


def commands(samples, seed=3, scale=0.4):
    return RIG.vmax * scale * np.repeat(np.random.default_rng(seed).uniform(-1, 1, samples // 40), 40)


def mujoco_states(rig, effects, u, x0):
    plant = Plant(rig, effects, alpha=x0[1], theta=x0[0])
    plant.data.qvel[:2] = x0[2:]
    if plant.drive:
        plant.data.qvel[2] = x0[2]
    states = [plant.state]
    for volts in u:
        plant.advance(volts)
        states.append(plant.state)
    return np.array(states), plant


def hidden(*ids, seed=5):
    """The rig with these effects, moved into the one second that is looked at."""
    rig, effects = hide(RIG, [id for id in ids if id != "nothing"], np.random.default_rng(seed))
    for id in effects:
        if id.endswith(("kick", "lost_counts")):
            effects[id] |= {"run": 0.0, "time": 0.31234}
    return rig, effects


# Largest difference of angles over one second, rad, where it is not 1e-6; an encoder count is 1.5e-3. Torques and
# lagged voltages are held for a step of 1e-4 s at a time; the edge of a delayed command is averaged over one; so is the
# edge of a kick; friction is a constraint of 0.1 ms there and a smoothed sign here; the ends of the play yield to a
# load here, where MuJoCo's do not. Falling from upright multiplies every difference, hence the factor below.
DIFFERENCES = {
    "motor.delay": 1e-5,
    "motor.lag": 1e-5,
    "arm.presliding": 1e-5,
    "arm.lugre": 1e-5,
    "arm.coulomb": 5e-4,
    "arm.stribeck": 1.5e-3,  # twice the friction at the stop, and less of it the faster the arm
    "pendulum.coulomb": 5e-4,
    "arm.load_friction": 1e-3,
    "arm.angle_friction": 1e-3,
    "arm.fading_friction": 1e-3,
    "arm.stop": 5e-4,  # its damper acts from the step after the contact on
    "drive.backlash": 1e-3,
    "disturbance.arm_kick": 1e-5,
}


@pytest.mark.parametrize("effect", ["nothing", *(id for id in EFFECTS + RARE if not id.startswith("sensor"))])
@pytest.mark.parametrize("start", ([0.1, np.pi - 0.4, 1.0, -2.0], [0.0, 0.05, 0.0, 0.0]), ids=("hanging", "falling"))
def test_motion_follows_the_energies(effect, start):
    rig, effects = hidden(effect)
    u = commands(400)
    expected = Motion(rig, effects, u).at(np.arange(401) / rig.rate, start)
    got, _ = mujoco_states(rig, effects, u, np.array(start))
    difference = np.abs(got - expected[:, :4])[:, :2].max()
    print(effect, difference)
    assert difference < DIFFERENCES.get(effect, 1e-6) * (4 if start[1] < 1 else 1)


TOGETHER = (
    ("motor.deadzone", "motor.bias", "motor.saturation"),
    ("motor.asymmetry", "motor.drift", "motor.lag"),
    ("arm.cable", "arm.cogging", "disturbance.vibration"),
    ("pendulum.inertia_transverse", "pendulum.spring", "arm.quadratic"),
    ("drive.compliance", "arm.tilt", "arm.spring"),
    ("drive.compliance", "arm.presliding", "motor.delay"),
    ("drive.compliance", "arm.coulomb", "arm.cogging"),
    ("arm.stribeck", "pendulum.coulomb", "pendulum.bias"),
    ("motor.inductance", "disturbance.arm_kick", "motor.drift"),  # a push on the arm is no torque of the motor
    ("motor.ripple", "disturbance.arm_kick", "arm.load_friction"),
)


@pytest.mark.long
@pytest.mark.parametrize("ids", TOGETHER, ids=lambda ids: "+".join(ids))
def test_effects_together(ids):
    """Three at once: each acts on what the others leave, in the order and on the side that is written down."""
    rig, effects = hidden(*ids, seed=6)
    u, start = commands(400), [0.1, np.pi - 0.4, 1.0, -2.0]
    expected = Motion(rig, effects, u).at(np.arange(401) / rig.rate, start)
    got, _ = mujoco_states(rig, effects, u, np.array(start))
    difference = np.abs(got - expected[:, :4])[:, :2].max()
    print(ids, difference)
    assert difference < sum(DIFFERENCES.get(effect, 1e-6) for effect in ids)


def test_what_cannot_be_hidden_is_named():
    for ids, message in (
        (("drive.backlash", "drive.compliance"), "room for one"),
        (("arm.magic",), "no effect called 'arm.magic'"),
    ):
        with pytest.raises(ValueError, match=message):
            hide(RIG, ids, np.random.default_rng(0))
    with pytest.raises(ValueError, match="has no arm.magic"):
        Plant(RIG, {"arm.magic": {}}, alpha=0.0)


@pytest.mark.parametrize("effect", [id for id in EFFECTS + RARE if id.startswith("sensor")])
def test_what_the_encoders_read(effect):
    rig, effects = hidden(effect)
    u, start = commands(200), [0.1, np.pi - 0.4, 0.0, 0.0]
    plant, shown = Plant(rig, effects, alpha=start[1], theta=start[0]), []
    for volts in u:
        shown.append(plant.measure())
        plant.advance(volts)
    p = effects[effect]
    states = Motion(rig, {}, u).at(np.arange(200) / rig.rate - p.get("delay", 0.0), start)
    angles = states[:, :2]
    if effect == "sensor.delay":
        assert p["delay"] * rig.rate % 1 > 0.1  # between samples
    elif "eccentricity" in effect:
        axis = ["sensor.theta.eccentricity", "sensor.alpha.eccentricity"].index(effect)
        angles[:, axis] += p["amplitude"] * np.sin(angles[:, axis] + p["phase"])
    elif effect == "sensor.jitter":
        late = np.array([untimely(p, 0, k / rig.rate) for k in range(200)])
        assert 0.8 * p["spread"] < late.std() < 1.2 * p["spread"]
        angles = angles + late[:, None] * states[:, 2:4]
    elif "lost_counts" in effect:
        axis = ["sensor.theta.lost_counts", "sensor.alpha.lost_counts"].index(effect)
        angles[np.arange(200) / rig.rate >= p["time"], axis] += p["size"]
    elif effect == "sensor.theta.scale":
        angles[:, 0] *= p["scale"]
    else:
        angles[:, 1] = p.get("scale", 1.0) * angles[:, 1] + p.get("angle", 0.0)
    assert np.abs(shown - angles).max() < 0.5 * 2 * np.pi / rig.pend_counts + 1e-6


@pytest.mark.parametrize("effect", ("drive.backlash", "drive.compliance"))
def test_the_encoder_sits_on_either_side(effect):
    rig, effects = hidden(effect)
    u, count = commands(200), 2 * np.pi / RIG.arm_counts
    for side in ("arm", "motor"):
        effects[effect]["encoder"] = side
        states, plant = mujoco_states(rig, effects, u, np.array([0.0, np.pi, 0.0, 0.0]))
        theta, _ = plant.measure()
        assert theta == pytest.approx(plant.rotor[0] if side == "motor" else states[-1, 0], abs=0.51 * count)
    assert abs(plant.rotor[0] - states[-1, 0]) > 2 * count


@pytest.mark.long
def test_points_and_planar_bodies():
    """Inertias that no body has but rig files do: the same motion from a body that exists."""
    start, u = [0.1, np.pi - 0.4, 1.0, -2.0], commands(400)
    for hinge, transverse, axial in ((0.0, 0.0, 0.0), (1.4e-4, 0.0, 0.0), (1.4e-4, 2e-5, 3e-6), (1.4e-4, 1.5e-4, 2e-5)):
        rig = dataclasses.replace(RIG, pend_inertia=hinge, pend_transverse=transverse, pend_axial=axial)
        expected = Motion(rig, {}, u).at(np.arange(401) / rig.rate, start)
        got, _ = mujoco_states(rig, {}, u, np.array(start))
        assert np.abs(got - expected)[:, :2].max() < 1e-6
    with pytest.raises(ValueError, match="no body"):
        Plant(dataclasses.replace(RIG, pend_transverse=2 * RIG.pend_inertia), {}, alpha=0.0)


def test_lag_and_offset():
    """A held command through a lag: the arm alone (no gravity on it) obeys a linear equation with a closed-form
    answer."""
    rig = dataclasses.replace(RIG, pend_mass=1e-8, pend_inertia=1e-11, pend_viscous=0.0)
    lag, volts, seconds = 0.02, 3.0, 0.5
    plant = Plant(rig, {"motor.lag": {"time_constant": lag}, "sensor.alpha.offset": {"angle": 0.04}}, alpha=np.pi)
    for _ in range(round(seconds * rig.rate)):
        plant.advance(volts)
    rate, final = rig.arm_damping / rig.arm_inertia, rig.torque_per_volt * volts / rig.arm_damping
    fast = 1 / lag
    speed = final * (1 - (fast * np.exp(-rate * seconds) - rate * np.exp(-fast * seconds)) / (fast - rate))
    assert plant.state[2] == pytest.approx(speed, rel=1e-6)
    assert plant.measure()[1] - plant.state[1] == pytest.approx(0.04, abs=np.pi / rig.pend_counts)


def test_friction_stops_and_holds():
    """Coulomb friction alone: speed falls on a straight line, ends at zero, and less torque than it holds moves
    nothing."""
    rig = dataclasses.replace(RIG, pend_mass=1e-8, pend_inertia=1e-11, pend_viscous=0.0, arm_viscous=0.0, kb=0.0)
    friction, speed = 0.01, 2.0
    plant = Plant(rig, {"arm.coulomb": {"torque": friction}}, alpha=np.pi)
    plant.data.qvel[0] = speed
    stop = speed * rig.arm_inertia / friction
    for _ in range(round(2 * stop * rig.rate)):
        plant.advance(0.0)
    assert plant.state[0] == pytest.approx(0.5 * speed * stop, rel=2e-3)
    before = plant.state[0]
    for _ in range(200):
        plant.advance(0.9 * friction / rig.torque_per_volt)
    assert abs(plant.state[0] - before) < 2e-4


def test_case_folder(tmp_path):
    write_case(tmp_path, RIG, {"motor.bias": {"voltage": 0.8}}, seed=2, spread=0.03, seconds=2.0)
    truth = json.loads((tmp_path / "truth.json").read_text())
    assert truth["effects"] == {"motor.bias": {"voltage": 0.8}}
    for run, (complete, rows) in truth["runs"].items():
        (file,) = tmp_path.glob(f"run-*-{run}.csv")
        data = np.genfromtxt(file, delimiter=",", names=True)
        assert complete and len(data) == rows == 800
        assert data.dtype.names == ("t", "u", "theta", "alpha")
        counts = data["alpha"] * RIG.pend_counts / (2 * np.pi)
        assert np.abs(counts - np.round(counts)).max() < 1e-3
        assert np.abs(data["u"]).max() <= RIG.vmax
    assert (tmp_path / "rig.toml").read_text() != rig_toml(RIG)  # the sheet is wrong, as sheets are


def recorded(folder):
    return [np.genfromtxt(file, delimiter=",", names=True) for file in sorted(folder.glob("run-*.csv"))]


def test_every_recording_has_its_own_zero(tmp_path):
    """The same seed without zeros shows the same recordings in the true frame: whole counts between them, the commands
    untouched."""
    options = {"seed": 4, "spread": 0.05, "noise": 0.3, "seconds": 1.5, "runs": ["multisine", "decay", "balance"]}
    write_case(tmp_path / "own", RIG, {}, **options)
    write_case(tmp_path / "same", RIG, {}, **options, own_zeros=False, length_error=0.0)
    truth = json.loads((tmp_path / "own/truth.json").read_text())
    for own, same, zero in zip(recorded(tmp_path / "own"), recorded(tmp_path / "same"), truth["zeros"], strict=True):
        assert (own["u"] == same["u"]).all()
        for axis, per_rev in (("theta", RIG.arm_counts), ("alpha", RIG.pend_counts)):
            assert own[axis] - same[axis] == pytest.approx(zero[axis], abs=2e-7)
            assert zero[axis] * per_rev / (2 * np.pi) == pytest.approx(
                round(zero[axis] * per_rev / (2 * np.pi)), abs=1e-9
            )
    arm = [zero["theta"] for zero in truth["zeros"]]
    assert len(set(arm)) == 3 and max(map(abs, arm)) <= 1.5 + np.pi / RIG.arm_counts
    assert all(abs(zero["alpha"]) < 8 * 2 * np.pi / RIG.pend_counts for zero in truth["zeros"])
    lengths = truth["arm_length"]
    assert lengths["true"] == truth["true_rig"]["arm_length"] == RIG.arm_length
    assert 0 < abs(lengths["data_sheet"] / lengths["true"] - 1) < 0.03
    exact = json.loads((tmp_path / "same/truth.json").read_text())
    assert exact["arm_length"]["data_sheet"] == RIG.arm_length
    assert all(zero["theta"] == zero["alpha"] == 0.0 for zero in exact["zeros"])


def test_the_ruler_has_a_stream_of_its_own():
    """An exact length changes nothing else on the sheet."""
    ruled, exact = (data_sheet(RIG, np.random.default_rng(3), 0.1, error) for error in (0.03, 0.0))
    assert ruled.arm_length != exact.arm_length == RIG.arm_length
    assert dataclasses.replace(ruled, arm_length=exact.arm_length) == exact
    drawn = [data_sheet(RIG, np.random.default_rng(seed), 0.1).arm_length / RIG.arm_length - 1 for seed in range(300)]
    assert -0.03 <= min(drawn) < -0.028 and 0.028 < max(drawn) <= 0.03


def test_a_pendulum_that_is_let_go(tmp_path):
    write_case(tmp_path, RIG, {}, seed=5, spread=0.05, seconds=6.0, runs=["decay"], own_zeros=False)
    (rows,) = recorded(tmp_path)
    swing = np.abs(rows["alpha"] - np.pi)
    assert len(rows) == 6 * RIG.rate and (rows["u"] == 0.0).all()
    assert 1.0 <= swing[0] <= 2.0 and swing.max() == pytest.approx(swing[0], abs=0.01)
    assert swing[-round(RIG.rate) :].max() < 0.8 * swing[0]


@pytest.mark.long
@pytest.mark.parametrize("effect", FOREIGN)
def test_foreign_effects_are_seen(effect):
    """Half a second from the same true state, with the effect and without: most readings differ by several times an
    encoder's noise."""
    geared = effect in ("x.inductance", "x.current_limit")  # the rig in which the benchmark hides them
    rig = FAMILIES["srv02-like" if geared else sorted(FAMILIES)[FOREIGN.index(effect) % len(FAMILIES)]]
    _, effects = hide(rig, (effect,), np.random.default_rng(1))
    if effect == "x.lost_counts":
        effects[effect]["time"] = 0.7
    u = multisine(rig, np.arange(round(3 * rig.rate)) / rig.rate, np.random.default_rng(2))
    plant, readings, states = Plant(rig, effects, alpha=np.pi), [], []
    for volts in u:
        states.append(plant.state)
        readings.append(plant.measure())
        plant.advance(volts)
    piece, apart = round(0.5 * rig.rate), []
    for begin in range(piece, len(u) - piece + 1, piece):
        plain, expected = Plant(rig, {}, alpha=states[begin][1], theta=states[begin][0]), []
        plain.data.qvel[:2] = states[begin][2:]
        for volts in u[begin : begin + piece]:
            expected.append(plain.measure())
            plain.advance(volts)
        counts = (
            (np.array(readings[begin : begin + piece]) - expected) * [rig.arm_counts, rig.pend_counts] / (2 * np.pi)
        )
        apart.append(np.sqrt(np.mean(counts**2, axis=0)).max())
    print(effect, rig.name, np.round(apart, 1))
    assert np.median(apart) > 3.0


def test_a_stiff_rod_is_a_rod():
    """The two parts of the rod that bends weigh what the whole one weighs, about the same middle: with a stiff joint
    they move alike."""
    start, u = np.array([0.1, np.pi - 0.4, 1.0, -2.0]), commands(400)
    rod = {"share": 0.3, "frequency": 150.0, "damping_ratio": 0.5}
    difference = {}
    for frequency in (150.0, 3.5):
        bending, _ = mujoco_states(RIG, {"x.flexible_rod": rod | {"frequency": frequency}}, u, start)
        difference[frequency] = np.abs(bending - mujoco_states(RIG, {}, u, start)[0])[:, :2].max()
    assert difference[150.0] < 2e-3 < 0.02 < difference[3.5]


def test_a_winding_and_a_limit_of_its_current():
    """The arm alone: a linear equation of second order for the winding, a constant torque at the limit."""
    rig = dataclasses.replace(FAMILIES["srv02-like"], pend_mass=1e-8, pend_inertia=1e-11, pend_viscous=0.0)
    tau, volts, seconds, emf = 0.05, 3.0, 0.3, rig.back_emf_damping
    plant = Plant(rig, {"x.inductance": {"time_constant": tau}}, alpha=np.pi)
    limit = 0.2 * rig.torque_per_volt * volts
    limited = Plant(rig, {"x.current_limit": {"torque": limit}}, alpha=np.pi)
    for _ in range(round(seconds * rig.rate)):
        plant.advance(volts)
    for _ in range(10):
        limited.advance(volts)
    # [speed, torque]
    matrix = np.array([[-rig.arm_viscous / rig.arm_inertia, 1 / rig.arm_inertia], [-emf / tau, -1 / tau]])
    final = np.linalg.solve(-matrix, [0.0, rig.torque_per_volt * volts / tau])
    speed = final[0] - (expm(matrix * seconds) @ final)[0]
    assert plant.state[2] == pytest.approx(speed, rel=1e-4)
    assert limited.state[2] == pytest.approx(limit / rig.arm_inertia * 10 / rig.rate, rel=0.02)


def test_a_clock_that_is_late_and_early():
    rig = dataclasses.replace(RIG, rate=250.0)
    spread = 0.006
    taken = []
    for run in (0, 0, 1):
        plant = Plant(
            rig, {"x.clock_jitter": {"spread": spread, "correlation": 0.1, "seed": 5.0}}, alpha=np.pi, run=run
        )
        times = []
        for _ in range(1000):
            times.append(plant.time)
            plant.advance(0.0)
        taken.append(np.array(times))
    assert (taken[0] == taken[1]).all() and (taken[0] != taken[2]).any()
    assert (np.diff(taken[0]) > 0).all()
    late = taken[0] - np.arange(1000) / rig.rate
    assert 0.6 * spread < late.std() < 1.5 * spread


def test_an_encoder_that_slips_once():
    plant, shown = Plant(RIG, {"x.lost_counts": {"angle": 0.2, "time": 0.1}}, alpha=np.pi), []
    for _ in range(80):
        shown.append(plant.measure()[0])
        plant.advance(0.0)
    count = 2 * np.pi / RIG.arm_counts
    assert shown[:40] == [0.0] * 40
    assert shown[40:] == pytest.approx([0.2] * 40, abs=0.51 * count)


def test_every_effect_has_a_size():
    for rig in FAMILIES.values():
        for effect in EFFECTS + RARE + FOREIGN:
            values = [v for name, v in draw_effect(effect, rig, np.random.default_rng(0)).items() if name != "encoder"]
            assert values and np.isfinite(values).all()
