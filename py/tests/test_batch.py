"""Many rollouts at once against one at a time."""

from __future__ import annotations

import _thread
import threading
import time

import furuta
import numpy as np
import pytest

SRV02 = furuta.Rig.load("shahzad2022-srv02")
N, DT = 400, 2e-3
U = 3.0 * np.sin(0.03 * np.arange(N))
M = 21  # not a whole number of lanes


def starts(count: int = M) -> np.ndarray:
    return np.random.default_rng(5).normal([0, np.pi, 0, 0], [0.5, 1.0, 2.0, 3.0], (count, 4))


def test_parameters_that_differ():
    x0, masses = starts(), np.linspace(0.1, 0.2, M)
    x = furuta.simulate_batch(SRV02, x0, U, DT, parameters={"pendulum.mass": masses, "arm.viscous": 2e-3})
    for i in range(M):
        rig = SRV02.with_parameters({"pendulum.mass": masses[i], "arm.viscous": 2e-3})
        np.testing.assert_array_equal(x[i], furuta.simulate(rig, x0[i], U, DT)[-1])


@pytest.mark.parametrize("effect", [id for id, of in furuta.catalogue().items() if "voltage" in of["kinds"]])
def test_effects_that_differ(effect):
    """To the bit what `simulate` gives, for effects that run in lanes and for those that cut the step."""
    values = {
        "run": 0.0, "time": 0.1, "duration": 0.05, "order": 2.0, "motor_share": 0.4, "damping": 1e-3, "stiffness": 0.3,
        "velocity": 0.5, "seed": 1.0,
        "negative_gain": 0.8, "scale": 1.02, "frequency": 7.0, "delay": 0.0031, "gap": 0.05, "width": 0.3, "limit": 2.0,
    }  # fmt: skip
    details = furuta.catalogue()[effect]["details"]
    given = {p: d["default"] if d["kind"] == "choice" else values.get(p, 0.02) for p, d in details.items()}
    first = next(iter(details))
    strengths = given[first] * np.linspace(0.5, 1.5, M)
    x0 = starts()
    x = furuta.simulate_batch(SRV02, x0, U, DT, effects={effect: given | {first: strengths}}, every=100)
    assert x.shape == (M, 5, 4)
    for i in range(M):
        rig = SRV02.with_effect(effect, **(given | {first: strengths[i]}))
        np.testing.assert_array_equal(x[i], furuta.simulate(rig, x0[i], U, DT)[::100])


def test_effects_of_the_rig_stay():
    rig = SRV02.with_effect("arm.spring", stiffness=0.05, rest=0.3).with_effect(
        "drive.backlash", gap=0.02, motor_share=0.3, encoder="motor"
    )
    x0, stiffness = starts(), np.linspace(0.0, 0.1, M)
    x = furuta.simulate_batch(
        rig, x0, U, DT, effects={"arm.spring": {"stiffness": stiffness}, "drive.backlash": {"encoder": "arm"}}
    )
    for i in range(M):
        alone = rig.with_effect("arm.spring", stiffness=stiffness[i], rest=0.3)
        np.testing.assert_array_equal(x[i], furuta.simulate(alone, x0[i], U, DT)[-1])


def test_feedback():
    a, b = furuta.linearize(SRV02)
    gain, _, _ = furuta.lqr(a, b, np.diag([5, 1, 0.1, 0.1]), [[1.0]])
    goal = [0.3, 0, 0, 0]
    x0 = np.random.default_rng(1).normal(0, [0.3, 0.05, 0.1, 0.1], (100, 4))
    x = furuta.simulate_batch(SRV02, x0, None, DT, feedback=(gain[0], goal, 10.0), samples=3000, every=1)
    assert x.shape == (100, 3001, 4)
    np.testing.assert_allclose(x[:, -1], np.tile(goal, (100, 1)), atol=1e-3)
    u = np.clip(-(x[7, :-1] - goal) @ gain[0], -10, 10)
    # the same commands, summed in another order: the closed loop is stable, the open loop is not, so for half a second
    # only
    np.testing.assert_allclose(furuta.simulate(SRV02, x0[7], u[:250], DT), x[7, :251], atol=1e-9)


def test_shapes():
    x0 = starts(3)
    assert furuta.simulate_batch(SRV02, x0, [], DT).tolist() == x0.tolist()
    assert furuta.simulate_batch(SRV02, x0, U, DT, every=N + 1).tolist() == x0[:, None].tolist()
    assert furuta.simulate_batch(SRV02, np.empty((0, 4)), U, DT).shape == (0, 4)
    wild = furuta.simulate_batch(SRV02, [[0, 1, 0, 1e9], [0, 1, 0, 0]], np.ones(1000), 0.05)
    assert not np.isfinite(wild[0]).all() and np.isfinite(wild[1]).all()


def test_progress():
    seen = []
    furuta.simulate_batch(
        SRV02, starts(200), U, DT, progress=lambda done, count: seen.append((done, count, threading.get_ident()))
    )
    done = [s[0] for s in seen]
    assert done == sorted(done) and done[-1] == 200
    assert {s[1:] for s in seen} == {(200, threading.get_ident())}


def test_a_progress_that_raises_ends_it():
    def refuse(done, count):
        raise LookupError(f"{done} of {count}")

    with pytest.raises(LookupError, match="of 20000"):
        furuta.simulate_batch(SRV02, starts(20_000), np.zeros(10_000), 1e-3, progress=refuse)


def test_ctrl_c_ends_it(interruptible):
    threading.Timer(0.2, _thread.interrupt_main).start()
    with pytest.raises(KeyboardInterrupt):
        furuta.simulate_batch(SRV02, starts(20_000), np.zeros(10_000), 1e-3)


def test_ctrl_c_ends_a_single_run(interruptible):
    threading.Timer(0.2, _thread.interrupt_main).start()
    with pytest.raises(KeyboardInterrupt):
        furuta.simulate(SRV02, [0, 3, 0, 0], np.zeros(1_000_000), 1e-3, substeps=1000)


def test_other_threads_run_meanwhile():
    counted, stop = [0], threading.Event()

    def count():
        while not stop.is_set():
            counted[0] += 1
            time.sleep(0)

    thread = threading.Thread(target=count)
    thread.start()
    before = counted[0]
    furuta.simulate_batch(SRV02, starts(2000), np.zeros(2000), 1e-3)
    during = counted[0] - before
    stop.set()
    thread.join()
    assert during > 100


def batch(**given):
    given = {"x0": starts(3), "u": U, "dt": DT} | given
    return furuta.simulate_batch(SRV02, **given)


@pytest.mark.parametrize(
    ("error", "call", "message"),
    [
        (furuta.SimulationError, lambda: batch(x0=[[0, 0]]), r"x0 has shape \(1, 2\)"),
        (furuta.SimulationError, lambda: batch(x0=[[0, 0, 0, 0], [0, np.nan, 0, 0]]), r"x0\[1\] = .* not finite"),
        (furuta.SimulationError, lambda: batch(u=[0, np.inf]), r"u\[1\] = inf is not a finite number"),
        (furuta.SimulationError, lambda: batch(dt=-1.0), r"sample period of -1 s is outside"),
        (furuta.SimulationError, lambda: batch(dt=1e9), r"\(0, 1\] s"),
        (furuta.SimulationError, lambda: batch(every=0), "every 0th sample"),
        (furuta.SimulationError, lambda: batch(parameters={"pendulum.mass": [0.1, -0.1, 0.1]}),
         r"rollout 1: pendulum.mass = -0.1 .* \(0, 100\] kg"),
        (furuta.SimulationError, lambda: batch(parameters={"pendulum.mass": [0.1, 0.1, np.nan]}),
         "rollout 2: pendulum.mass = NaN"),
        (furuta.SimulationError, lambda: batch(parameters={"pendulum.mass": [0.1, 0.1]}),
         "pendulum.mass has 2 values for 3 rollouts"),
        (furuta.RigError, lambda: batch(parameters={"pendulum.weight": 0.1}), "no parameter `pendulum.weight`"),
        (furuta.RigError, lambda: batch(parameters={"pendulum.mass": "much"}),
         'pendulum.mass = "much" must be a number'),
        (furuta.RigError, lambda: batch(effects={"arm.sprong": {}}), "`arm.sprong` is not in the catalogue"),
        (furuta.RigError, lambda: batch(effects={"arm.spring": {"stifness": 1.0}}), "has no parameter `stifness`"),
        (furuta.RigError,
         lambda: batch(effects={"drive.backlash": {"gap": 0.1, "motor_share": 0.5, "encoder": "gear"}}),
         'encoder = "gear" must be "arm" or "motor"'),
        (furuta.SimulationError, lambda: batch(effects={"arm.coulomb": {"torque": [0.0, 0.0, -1.0]}}),
         "rollout 2: arm.coulomb: torque = -1 is outside"),
        (furuta.SimulationError, lambda: batch(effects={"arm.cogging": {"amplitude": 0.1, "order": [1, 2, 2.5]}}),
         "rollout 2: .* order = 2.5 must be a whole"),
        (furuta.SimulationError, lambda: batch(effects={"motor.delay": {"delay": 0.5}}),
         "rollout 0: a delay of 0.5 s is longer"),
        (furuta.SimulationError, lambda: batch(u=None), "no commands"),
        (furuta.SimulationError, lambda: batch(samples=5), "samples belongs to feedback"),
        (furuta.SimulationError, lambda: batch(feedback=([0] * 4, [0] * 4, 1.0), samples=5), "exclude each other"),
        (furuta.SimulationError, lambda: batch(u=None, feedback=([0] * 4, [0] * 4, 1.0)), "give samples=N"),
        (furuta.SimulationError, lambda: batch(u=None, feedback=([0] * 3, [0] * 4, 1.0), samples=5),
         r"gain has shape \(3,\)"),
        (furuta.SimulationError, lambda: batch(u=None, feedback=([0] * 4, [0] * 4, np.nan), samples=5),
         "limit = NaN V"),
        (MemoryError, lambda: batch(u=None, feedback=([0] * 4, [0] * 4, 1.0), samples=2**62, every=1), "keep fewer"),
    ],
)  # fmt: skip
def test_what_cannot_be_run_is_named(error, call, message):
    with pytest.raises(error, match=message):
        call()
