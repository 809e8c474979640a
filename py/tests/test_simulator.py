"""A rig that is stepped, and the control system that is: against whole runs."""

from __future__ import annotations

import copy
import pickle

import furuta
import numpy as np
import pytest

DT = 0.002
RIG = furuta.Rig.load("qube-servo-2")
HANGING = [0.0, np.pi, 0.0, 0.0]


@pytest.mark.parametrize(
    "effect", ["motor.lag", "motor.delay", "drive.backlash", "arm.presliding", "sensor.delay", "motor.drift"]
)
@pytest.mark.parametrize("substeps", [1, 3])
def test_steps_are_a_run(effect, substeps):
    rig = RIG.with_effect(effect)
    u = furuta.signal("noise", 1.0, DT, amplitude=2, band=(0, 20), seed=3)
    x, y = furuta.simulate(rig, HANGING, u, DT, substeps=substeps, encoders=True)
    simulator = furuta.Simulator(rig, HANGING, DT, substeps=substeps)
    seen, read = [simulator.x], [simulator.reading]
    for volts in u:
        seen.append(simulator.step(volts))
        read.append(simulator.reading)
    assert np.array_equal(seen, x) and np.array_equal(read, y)
    assert simulator.t == pytest.approx(1.0)


def test_one_sample_calls_forget_and_the_simulator_does_not():
    """What the newcomer met: the arm under a lag, 0.0145 rad for 0.2645."""
    rig = RIG.with_effect("motor.lag", time_constant=0.05)
    whole = furuta.simulate(rig, HANGING, np.full(500, 1.0), DT)[-1]
    x = HANGING
    for _ in range(500):
        x = furuta.simulate(rig, x, [1.0], DT)[-1]
    assert x[0] < 0.2 * whole[0]
    assert "furuta.Simulator" in furuta.simulate.__doc__
    simulator = furuta.Simulator(rig, HANGING, DT)
    assert np.array_equal(simulator.steps(np.full(500, 1.0))[-1], whole)


def test_copies_go_their_own_way():
    simulator = furuta.Simulator(RIG.with_effect("motor.lag"), HANGING, DT)
    simulator.steps(np.ones(50))
    twins = [copy.copy(simulator), copy.deepcopy(simulator), simulator.copy()]
    expected = simulator.step(0.3)
    for twin in twins:
        assert np.array_equal(twin.step(0.3), expected)
    simulator.reset(HANGING)
    assert simulator.t == 0.0 and np.array_equal(simulator.x, HANGING)


def test_what_a_simulator_refuses():
    simulator = furuta.Simulator(RIG, HANGING, DT)
    with pytest.raises(furuta.SimulationError, match=r"u\[0\] = NaN is not a finite number"):
        simulator.step(float("nan"))
    assert simulator.t == 0.0
    for wrong in ({"dt": 0.0}, {"dt": 2.0}, {"dt": DT, "substeps": 0}):
        with pytest.raises(furuta.SimulationError):
            furuta.Simulator(RIG, HANGING, **wrong)


def test_the_supervisor_stepped_is_the_one_that_simulate_runs():
    rig = furuta.Rig.load("shahzad2022-srv02")
    standard = furuta.Controller.from_toml("", rig, DT)
    n = 2500
    x, u, modes = furuta.simulate(rig, HANGING, np.zeros(n), DT, substeps=2, controller=standard, reference=0.2)
    supervisor = furuta.Supervisor(rig, standard)
    plant = furuta.Simulator(rig, HANGING, DT, substeps=2)
    command, held, seen, states = 0.0, [], [], [plant.x]
    for _ in range(n):
        now = command
        command, mode = supervisor.step(plant.t, *plant.reading, target=0.2)
        held.append(now)
        seen.append(mode)
        states.append(plant.step(now))
    assert seen == modes and modes[-1] == "balance"
    assert np.array_equal(held, u) and np.array_equal(states, x)
    assert supervisor.mode == "balance" and supervisor.fault is None
    assert supervisor.reference == pytest.approx(0.2)
    assert np.abs(supervisor.estimate - states[-1]).max() < 0.2


def test_requests_faults_and_time():
    supervisor = furuta.Supervisor("qube-servo-2", start=False)
    assert supervisor.step(0.0, 0.0, np.pi) == (0.0, "idle")
    assert supervisor.request("start") and supervisor.step(DT, 0.0, np.pi)[1] == "swing-up"
    assert supervisor.step(2 * DT, float("nan"), np.pi)[1] == "fault"
    assert supervisor.fault and not supervisor.request("start")
    with pytest.raises(furuta.ControllerError, match="is not after the sample before"):
        supervisor.step(2 * DT, 0.0, np.pi)
    with pytest.raises(furuta.ControllerError, match='"go" is none of'):
        supervisor.request("go")
    supervisor.reset()
    assert supervisor.mode == "idle" and supervisor.estimate is None
    twin = copy.deepcopy(supervisor)
    supervisor.request("start")
    assert (supervisor.mode, twin.mode) == ("swing-up", "idle")


def test_lost_samples_are_told_by_the_time():
    def sees(lost):
        supervisor = furuta.Supervisor("qube-servo-2", start=False)
        plant = furuta.Simulator("qube-servo-2", [0.0, np.pi - 0.8, 0.0, 0.0], DT)
        for k in range(200):
            if k not in lost:
                supervisor.step(plant.t, *plant.reading)
            x = plant.step(0.0)
        return supervisor.estimate, x

    (estimate, x), (with_loss, _) = sees(()), sees(range(180, 190))
    assert abs(with_loss[3] - estimate[3]) < 0.1 * abs(x[3]) + 0.3


def test_swing_up_pumps_and_says_what_is_missing():
    rig = furuta.Rig.load("shahzad2022-srv02")
    p = rig.parameters
    swing_up = furuta.SwingUp(rig, DT)
    weight = 2 * p["pendulum.mass"] * 9.81 * p["pendulum.com"]
    assert swing_up.missing_energy(HANGING) == pytest.approx(weight, rel=0.2)
    u = swing_up.update([0, np.pi - 0.2, 0, 0.5])
    assert abs(u) <= p["motor.command_limit"]
    with pytest.raises(furuta.ControllerError, match="swing_up has no parameter `nonsense`; it has arm_range"):
        furuta.SwingUp(rig, DT, nonsense=1)


# ----------------------------------------------------------------------- callables


def test_a_callable_is_a_controller_on_the_true_state():
    """Ideal: near upright it is the sampled linear closed loop."""
    rig = furuta.Rig.load("shahzad2022-srv02")
    K, _, _ = furuta.lqr(rig, np.eye(4), 1)
    x0 = np.array([0, 1e-3, 0, 0])
    x, u, modes = furuta.simulate(rig, x0, np.zeros(300), 1e-3, controller=lambda t, x: -K @ x, ideal=True)
    a, b = furuta.linearize(rig)
    ad, bd = furuta.zero_order_hold(a, b, 1e-3)
    expected = np.array([np.linalg.matrix_power(ad - bd @ K, k) @ x0 for k in (100, 200, 300)])
    assert np.abs(x[[100, 200, 300]] - expected).max() < 1e-6
    assert modes == ["callable"] * 300 and np.allclose(u, (-x[:-1] @ K.T)[:, 0], rtol=1e-9, atol=1e-12)


def test_a_callable_sees_encoders_and_acts_a_sample_late():
    seen = []

    def controller(t, x):
        seen.append((t, np.array(x)))
        return 1.0

    x, u, _, y = furuta.simulate(
        RIG, HANGING, np.zeros(5), DT, controller=controller, estimator=lambda t, a, b, u: [a, b, u, 0], encoders=True
    )
    assert u.tolist() == [0.0, 1.0, 1.0, 1.0, 1.0]
    assert [t for t, _ in seen] == pytest.approx(DT * np.arange(5))
    assert np.array_equal([s[:2] for _, s in seen], y[:-1])
    assert [s[2] for _, s in seen] == u.tolist()


def test_estimators_of_ours_with_controllers_of_theirs():
    rig = furuta.Rig.load("shahzad2022-srv02")
    K, _, _ = furuta.lqr(rig, np.eye(4), 1)
    for estimator in (None, "kalman", furuta.Estimator("kalman", rig, DT)):
        x, _, _ = furuta.simulate(
            rig, [0, 0.1, 0, 0], np.zeros(1500), DT, controller=lambda t, x: -K @ x, estimator=estimator
        )
        assert np.abs(x[-1, :2]).max() < 0.05
    x, u, modes = furuta.simulate(
        rig,
        [0, 0.1, 0, 0],
        np.zeros(4000),
        DT,
        controller=furuta.Controller.lqr(K, rig, DT),
        estimator="kalman",
        reference=0.3,
    )
    assert abs(x[-1, 0] - 0.3) < 0.05 and set(modes) == {"balance"} and np.abs(u).max() <= rig["motor.command_limit"]


def test_a_callable_may_overwrite_what_it_is_shown():
    def overwriting(t, x):
        x[:] = 9.0
        return 0.0

    kept = np.array([0.0, 0.1, 0.0, 0.0])
    x, _, _ = furuta.simulate(RIG, kept, np.zeros(5), DT, controller=overwriting, ideal=True)
    assert np.array_equal(x, furuta.simulate(RIG, kept, np.zeros(5), DT))
    furuta.simulate(RIG, kept, np.zeros(5), DT, controller=overwriting, estimator=lambda *seen: kept)
    assert kept.tolist() == [0.0, 0.1, 0.0, 0.0]


@pytest.mark.parametrize(
    "keywords, what",
    [
        ({"controller": lambda t, x: 0, "estimator": furuta.Estimator("kalman", RIG, 0.01)}, "estimator"),
        ({"controller": furuta.Controller.from_toml("", RIG, 0.01), "estimator": "kalman"}, "controller"),
        ({"controller": furuta.Controller.from_toml("", RIG, 0.01)}, "controller"),
    ],
)
def test_what_is_made_for_another_period(keywords, what):
    with pytest.raises(furuta.ControllerError, match=f"the {what} is made for dt = 0.01 s, not for 0.002 s"):
        furuta.simulate(RIG, HANGING, np.zeros(3), DT, **keywords)


@pytest.mark.parametrize(
    "u, says",
    [
        (np.ma.array([0.0, 1.0], mask=[False, True]), "u is an array with masked entries"),
        (np.array([1j, 2]), "u holds complex numbers"),
        (np.array([1, 2], dtype="timedelta64[s]"), "u holds times"),
    ],
)
def test_arrays_whose_numbers_mean_something_else(u, says):
    with pytest.raises(furuta.SimulationError, match=says):
        furuta.simulate(RIG, HANGING, u, DT)
    unmasked = np.ma.array([0.0, 1.0], mask=False)
    assert np.array_equal(
        furuta.simulate(RIG, HANGING, unmasked, DT), furuta.simulate(RIG, HANGING, unmasked.data, DT)
    )


def test_states_to_measure_are_finite():
    with pytest.raises(furuta.SimulationError, match=r"x\[1\] = .* not finite"):
        furuta.measure(RIG, [[0, 0, 0, 0], [0, np.nan, 0, 0]])


@pytest.mark.parametrize(
    "keywords, error, says",
    [
        ({"controller": lambda t, x: [1, 2]}, furuta.SimulationError, r"the controller gave shape \(2,\) at t = 0 s"),
        ({"controller": lambda t, x: np.nan}, furuta.SimulationError, "the controller gave nan V at t = 0 s"),
        ({"controller": 3}, TypeError, "controller must be a furuta.Controller or a callable"),
        ({"controller": lambda t, x: 0, "estimator": 3}, TypeError, "estimator must be a furuta.Estimator"),
        (
            {"controller": lambda t, x: 0, "estimator": lambda *a: [0]},
            furuta.SimulationError,
            r"the estimator gave shape \(1,\)",
        ),
        (
            {"controller": lambda t, x: 0, "estimator": lambda *a: [0, np.nan, 0, 0]},
            furuta.SimulationError,
            r"the estimator gave \[0.0, nan, 0.0, 0.0\] at t = 0 s: a state has finite numbers",
        ),
        ({"estimator": "kalman"}, furuta.SimulationError, "estimator belongs to a controller"),
        ({"controller": lambda t, x: 0, "reference": 1.0}, furuta.SimulationError, "a callable knows its own"),
        ({"controller": lambda t, x: 1 / 0}, ZeroDivisionError, "division"),
    ],
)
def test_what_a_callable_may_not(keywords, error, says):
    with pytest.raises(error, match=says):
        furuta.simulate(RIG, HANGING, np.zeros(3), DT, **keywords)


# ------------------------------------------------------------- copies, equality, pickles


def test_copies_and_pickles():
    sprung = RIG.with_effect("arm.spring", stiffness=1e-3, rest=0.1)
    for again in (copy.copy(sprung), copy.deepcopy(sprung), pickle.loads(pickle.dumps(sprung))):
        assert again == sprung and hash(again) == hash(sprung) and again != RIG
    balance = furuta.Controller.from_toml("", RIG, DT)
    for again in (copy.copy(balance), copy.deepcopy(balance), pickle.loads(pickle.dumps(balance))):
        assert again == balance
    assert balance != furuta.Controller.from_toml("", RIG, 2 * DT) and balance != furuta.Controller.from_toml(
        "", sprung, DT
    )
    kalman = furuta.Estimator("kalman", RIG, DT)
    kalman.update(0.1, 3.0, 1.0)
    again = pickle.loads(pickle.dumps(kalman))
    assert again == kalman and kalman != furuta.Estimator("kalman", RIG, 2 * DT)
    twin = copy.copy(kalman)
    assert np.array_equal(twin.update(0.1, 3.0, 1.0)[0], kalman.update(0.1, 3.0, 1.0)[0])  # it remembers
