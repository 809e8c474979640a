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


NAN = float("nan")


@pytest.mark.parametrize(
    "action, says",
    [
        (np.array([0.0, NAN]), r"action must have shape \(1,\), as .*; an array of shape \(2,\) was given"),
        (np.zeros((1, 1)), r"action must have shape \(1,\), .* shape \(1, 1\) was given"),
        (0.1, r"action must have shape \(1,\), .*; 0.1, a single number, was given"),
        ([NAN], r"action\[0\] = nan must be finite: a share of the command limit, -1 to 1"),
        ([np.inf], r"action\[0\] = inf must be finite"),
        ("up", r"action must be numbers of shape \(1,\); a str was given"),
    ],
)
def test_an_action_of_another_shape_is_refused(action, says):
    env = furuta.gym.RotaryPendulum(RIG)
    env.reset(seed=1)
    before = env.plant.x
    with pytest.raises(ValueError, match=says):
        env.step(action)
    assert np.array_equal(env.plant.x, before) and env.samples == 0
    env.step([0.5])


@pytest.mark.parametrize(
    "actions, says",
    [
        (np.zeros((1, 3)), r"actions must have shape \(3, 1\), as .*; an array of shape \(1, 3\) was given"),
        (np.zeros(3), r"actions must have shape \(3, 1\), .* shape \(3,\) was given"),
        (np.zeros((2, 1)), r"actions must have shape \(3, 1\), .* shape \(2, 1\) was given"),
        (0.1, r"actions must have shape \(3, 1\), .* a single number, was given"),
        ([[0], [NAN], [0]], r"actions\[1, 0\] = nan must be finite"),
        ([[0], [0, 1], [0]], r"actions must be numbers of shape \(3, 1\); a list was given"),
    ],
)
def test_actions_of_another_shape_are_refused(actions, says):
    many = furuta.gym.RotaryPendulumVector(3, RIG)
    many.reset(seed=1)
    before = many.plants.x
    with pytest.raises(ValueError, match=says):
        many.step(actions)
    assert np.array_equal(many.plants.x, before) and not many.samples.any()


def test_an_action_beyond_the_limits_is_the_limit():
    ends = []
    for action in (1.0, 7.0):
        one, many = furuta.gym.RotaryPendulum(RIG), furuta.gym.RotaryPendulumVector(2, RIG)
        one.reset(seed=1), many.reset(seed=1)
        ends.append((one.step([action])[0], many.step([[action], [-action]])[0]))
    assert all(np.array_equal(a, b) for a, b in zip(*ends))


@pytest.mark.parametrize("observe", ["state", "encoders"])
def test_a_mask_resets_some_rigs(observe):
    many = gymnasium.make_vec(ID, num_envs=4, rig=RIG, randomize={"pendulum.mass": 0.1}, observe=observe, seconds=0.1)
    base, mask = many.unwrapped, np.array([True, False, True, False])
    many.reset(seed=1)
    for _ in range(10):  # to the end of every episode
        seen = many.step(np.full((4, 1), 0.3))[0]
    rigs, x = base.plants.rigs, base.plants.x
    options = {"reset_mask": mask}
    after, _ = many.reset(options=options)
    assert np.array_equal(after[~mask], seen[~mask]) and (after[mask] != seen[mask]).any(axis=1).all()
    assert np.array_equal(base.plants.x[~mask], x[~mask]) and not base.plants.x[mask, 2:].any()
    assert [a == b for a, b in zip(base.plants.rigs, rigs)] == [not anew for anew in mask]
    assert base.samples.tolist() == [0, 10, 0, 10] and options == {"reset_mask": mask}
    if observe == "encoders":
        assert not after[mask, 3:5].any()  # no speed before the first step
    # The others ended, and begin anew by themselves.
    _, rewards, failed, truncated, _ = many.step(np.zeros((4, 1)))
    assert base.samples.tolist() == [1, 0, 1, 0] and np.array_equal(rewards != 0, mask)
    assert not failed.any() and not truncated.any()


def test_a_seed_repeats_the_reset_of_a_mask():
    many = furuta.gym.RotaryPendulumVector(3, RIG)
    many.reset(seed=1)
    mask = np.array([False, True, False])
    first, again, other = (many.reset(seed=seed, options={"reset_mask": mask})[0] for seed in (5, 5, 6))
    assert np.array_equal(first, again) and not np.array_equal(first, other)


@pytest.mark.parametrize(
    "mask, error, says",
    [
        (np.array([True, False]), ValueError, r"has shape \(2,\); it must be \(3,\), one boolean for each rig"),
        (np.ones((3, 1), dtype=bool), ValueError, r"has shape \(3, 1\)"),
        (np.array([1, 0, 1]), TypeError, "must be an array of 3 booleans; one of int64 was given"),
        ([True, False, True], TypeError, "must be a NumPy array of 3 booleans; a list was given"),
        (None, TypeError, "a NoneType was given"),
        (np.zeros(3, dtype=bool), ValueError, "chooses no rig: at least one entry must be True"),
    ],
)
def test_what_is_no_mask(mask, error, says):
    many = furuta.gym.RotaryPendulumVector(3, RIG)
    many.reset(seed=1)
    x = many.plants.x
    with pytest.raises(error, match=r'^options\["reset_mask"\].* ' + says):
        many.reset(seed=2, options={"reset_mask": mask})
    assert np.array_equal(many.plants.x, x)


def test_no_mask_before_a_reset_of_all():
    with pytest.raises(gymnasium.error.ResetNeeded, match=r"comes after a reset\(\) of all rigs"):
        furuta.gym.RotaryPendulumVector(2).reset(options={"reset_mask": np.array([True, False])})


@pytest.mark.parametrize("share", [-1, NAN, np.inf, (0.1, 0.2), [0.1, [0.2]], "0.1", True, 1j, 10**400])
def test_what_is_no_share_is_refused_when_the_environment_is_made(share):
    for make in (furuta.gym.RotaryPendulum, lambda **options: furuta.gym.RotaryPendulumVector(2, **options)):
        with pytest.raises(ValueError, match=r"randomize: arm\.inertia = .* must be a finite number, at least 0"):
            make(randomize={"pendulum.mass": 0.1, "arm.inertia": share})


def test_a_share_that_leaves_what_a_rig_can_be_is_refused():
    for name, share in (("arm.inertia", 1e3), ("environment.gravity", 1)):
        says = rf"randomize: {name} = {share:g} is too large a share: .*{name} = .* range"
        with pytest.raises(ValueError, match=says):
            furuta.gym.RotaryPendulum(randomize={name: share})
    with pytest.raises(ValueError, match="randomize: 3, arm.inertial: no parameters"):
        furuta.gym.RotaryPendulum(randomize={"arm.inertial": 0.1, 3: 0.1})


def test_shares_that_vary_nothing_and_those_of_a_file():
    rng = np.random.default_rng(1)
    still = furuta.gym.draws_of({"arm.inertia": 0, "arm.viscous": None, "pendulum.mass": np.float32(0)}, RIG)
    assert still(rng) == RIG
    own, named = (furuta.gym.draws_of(given, RIG)(np.random.default_rng(2)) for given in (RIG.tolerance, "tolerance"))
    assert own == named != RIG
    furuta.gym.draws_of({"motor.efficiency": 1.0, "arm.inertia": np.array(2.0)}, RIG)(rng)
