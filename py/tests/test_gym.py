"""The Gymnasium environment: its interface, what it simulates, what varies, and many rigs at once."""

from __future__ import annotations

import warnings

import furuta
import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium")

import furuta.gym  # noqa: E402
from gymnasium.utils.env_checker import check_env  # noqa: E402

ID = "furuta/RotaryPendulum-v0"
RIG = furuta.Rig.load("qube-servo-2")


@pytest.mark.parametrize("task", ["swing-up", "balance"])
@pytest.mark.parametrize("options", [{}, {"observe": "encoders", "references": (-0.5, 0.5), "randomize": "tolerance"}])
def test_gymnasiums_own_check_has_nothing_to_say(task, options):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gymnasium.make(ID, task=task, **options).unwrapped)


def test_it_is_the_simulator():
    env = furuta.gym.RotaryPendulum(RIG.with_effect("motor.delay", delay=0.006), "swing-up", arm_angle=100)
    env.reset(seed=3)
    plant = furuta.Simulator(env.rig, env.plant.x, 0.002)
    for action in np.random.default_rng(1).uniform(-1, 1, 200):
        seen = env.step(np.array([action], dtype=np.float32))[0]
        x = plant.steps(np.full(5, float(np.float32(action)) * 10))[-1]
    assert np.array_equal(env.plant.x, x)
    assert np.allclose(seen[:3], [x[0], np.sin(x[1]), np.cos(x[1])], atol=1e-6)


def test_a_gain_balances_and_doing_nothing_falls():
    env = gymnasium.make(ID, task="balance", rig="shahzad2022-srv02", references=(-0.2, 0.2), hold=1, seconds=5)
    K = furuta.lqr("shahzad2022-srv02", np.diag([10, 1, 1, 1]), 1)[0][0]
    for acts, whole in ((True, True), (False, False)):
        seen, _ = env.reset(seed=1)
        rewards, ended, truncated, references = [], False, False, set()
        while not (ended or truncated):
            theta, sin, cos, theta_dot, alpha_dot, reference = map(float, seen)
            references.add(round(reference, 3))
            u = -K @ [theta - reference, np.arctan2(sin, cos), theta_dot, alpha_dot]
            seen, reward, ended, truncated, _ = env.step(np.array([acts * np.clip(u / 10, -1, 1)], dtype=np.float32))
            rewards.append(reward)
        assert truncated is whole and (len(rewards) == 500) is whole
        if whole:
            assert references == {-0.2, 0.2} and np.mean(rewards) > 0.9
        else:
            assert rewards[-1] == -10


def test_what_varies():
    rng = np.random.default_rng(2)
    draw = furuta.gym.draws_of({"pendulum.mass": 0.05}, RIG)
    masses = np.array([draw(rng)["pendulum.mass"] for _ in range(400)])
    assert np.std(np.log(masses)) == pytest.approx(0.05, rel=0.15)
    varied = furuta.gym.draws_of("tolerance", RIG)(rng)
    assert varied["arm.length"] != RIG["arm.length"] and varied["arm.length"] == pytest.approx(
        RIG["arm.length"], rel=0.07
    )


def recording(rig, volts=1.2):
    u = furuta.signal("multisine", 4, 0.002, amplitude=volts)
    _, y = furuta.simulate(rig, [0, np.pi, 0, 0], u[:-1], 0.002, encoders=True)
    return {"t": 0.002 * np.arange(len(u)), "u": u, "theta": y[:, 0], "alpha": y[:, 1]}


def test_what_a_calibration_leaves_open_varies_as_it_says():
    found = furuta.calibrate(recording(RIG), RIG, free=["arm.inertia", "arm.viscous", "pendulum.viscous"])
    rng, draw = np.random.default_rng(4), furuta.gym.draws_of(found, RIG)
    rigs = [draw(rng) for _ in range(2000)]
    drawn = np.array([[rig[name] for name in found.fitted] for rig in rigs])
    std = [found.parameters[name]["std"] for name in found.fitted]
    assert np.allclose(drawn.std(axis=0), std, rtol=0.1)
    assert np.allclose(np.corrcoef(drawn.T), np.array(found.correlation, dtype=float), atol=0.08)


def test_what_a_diagnosis_cannot_exclude_varies_up_to_its_limits():
    found = furuta.diagnose(recording(RIG.with_effect("arm.spring", stiffness=2e-3, rest=0.2)), RIG, time_limit=None)
    limits = {limit["id"]: limit for limit in found.limits}
    rng, draw = np.random.default_rng(5), furuta.gym.draws_of(found, RIG)
    seen = set()
    for _ in range(100):
        effects = draw(rng).effects
        assert effects.pop("arm.spring")
        ((id, values),) = effects.items()
        off = furuta.catalogue()[id]["details"][limits[id]["parameter"]]["off"]
        assert abs(values[limits[id]["parameter"]] - off) <= limits[id]["at_most"] * (1 + 1e-9)
        seen.add(id)
    assert len(seen) > 3


DRAG = RIG.with_effect("arm.quadratic", coefficient=1e-4)
SMOOTH = DRAG.with_effect("motor.ripple", amplitude=0.2, order=3, phase=0.4)
EVENTS = SMOOTH.with_effect("arm.coulomb", torque=5e-4).with_effect("motor.delay", delay=0.007)
REMEMBERS = SMOOTH.with_effect("motor.lag", time_constant=0.03)


@pytest.mark.parametrize("rig", [SMOOTH, EVENTS, REMEMBERS], ids=["smooth", "events", "remembers"])
@pytest.mark.parametrize("observe", ["state", "encoders"])
def test_many_rigs_at_once_are_the_single_rig(rig, observe):
    many = gymnasium.make_vec(
        ID,
        num_envs=11,
        rig=rig,
        randomize={"pendulum.mass": 0.1},
        references=(-0.3, 0.3),
        arm_angle=1.5,
        observe=observe,
        seconds=0.4,
    )
    many.reset(seed=1)
    base, game = many.unwrapped, many.unwrapped.game

    def single(k):
        return furuta.Simulator(base.plants.rigs[k], base.plants.x[k], 0.002)

    singles = [single(k) for k in range(11)]
    readings = np.array([plant.reading for plant in singles])
    rng, begun = np.random.default_rng(1), 0
    for _ in range(100):
        actions = rng.uniform(-0.05, 0.05, (11, 1)).astype(np.float32)
        actions[2] = 1  # its arm leaves the limits; the time of the others runs out
        shares, reference, anew = actions[:, 0].astype(float), base.reference.copy(), base.ended.copy()
        seen, reward, failed, truncated, _ = many.step(actions)
        x = np.array([plant.steps(np.full(5, 10 * share))[-1] for plant, share in zip(singles, shares)])
        gain, out = game.judge(x, shares, reference)
        for k in np.flatnonzero(anew):
            singles[k], gain[k], out[k] = single(k), 0, False
            x[k], readings[k], begun = singles[k].x, singles[k].reading, begun + 1
        assert np.array_equal(base.plants.x, x) and np.array_equal(reward, gain) and np.array_equal(failed, out)
        now = np.array([plant.reading for plant in singles])
        visible = x if observe == "state" else np.concatenate([now, (now - readings) / 0.01], axis=1)
        assert np.array_equal(seen, game.observe(visible, base.reference)) and many.observation_space.contains(seen)
        assert (base.samples[truncated] == 40).all()
        readings = now
    assert begun > 20 and failed.sum() + truncated.sum() < 11
    assert len({float(mass) for mass in (rig["pendulum.mass"] for rig in base.plants.rigs)}) == 11


def test_what_cannot_be_is_refused():
    with pytest.raises(ValueError, match="none of"):
        furuta.gym.RotaryPendulum(task="juggle")
    with pytest.raises(ValueError, match="beyond arm_angle"):
        furuta.gym.RotaryPendulum(references=(3.0,))
    with pytest.raises(ValueError, match="rate = 0 must be above 0"):
        furuta.gym.RotaryPendulum(rate=0)
    with pytest.raises(ValueError, match="references is empty"):
        furuta.gym.RotaryPendulum(references=())
    with pytest.raises(ValueError, match="observe = 'counts' is none of"):
        furuta.gym.RotaryPendulum(observe="counts")
    with pytest.raises(ValueError, match="observe = 'counts' is none of"):
        furuta.gym.RotaryPendulumVector(observe="counts")
    with pytest.raises(ValueError, match="pendulum.weight: no parameters of a rig"):
        furuta.gym.RotaryPendulum(randomize={"pendulum.weight": 0.1})
    with pytest.raises(ValueError, match="num_envs = 0"):
        furuta.gym.RotaryPendulumVector(0)


def test_no_step_before_a_reset():
    one, many = furuta.gym.RotaryPendulum(render_mode="rgb_array"), furuta.gym.RotaryPendulumVector(2)
    for call in (lambda: one.step(np.zeros(1)), one.render, lambda: many.step(np.zeros((2, 1)))):
        with pytest.raises(gymnasium.error.ResetNeeded, match="call reset"):
            call()
    with pytest.raises(ValueError, match=r"references\[1\] = nan rad"):
        furuta.gym.RotaryPendulum(references=(0.0, float("nan")))
