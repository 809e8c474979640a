"""Controller files from Python: read, refused, alone, and at work on a simulated rig."""

from __future__ import annotations

import pickle

import furuta
import numpy as np
import pytest

DT = 0.002
HANGING = [0, np.pi, 0, 0]


@pytest.fixture
def rig():
    return furuta.Rig.load("shahzad2022-srv02")


def wrapped(angle):
    return (angle + np.pi) % (2 * np.pi) - np.pi


def test_the_standard_gain_is_the_designs(rig):
    """Python's dlqr with Bryson's weights gives what an empty file does."""
    controller = furuta.Controller.from_toml("", rig, DT)
    a, b = furuta.linearize(rig)
    a, b = furuta.zero_order_hold(a, b, DT)
    weights = furuta.Controller.from_toml("[controller]\nq = [0.0625, 4, 0, 0]\nr = 0.01\n", rig, DT)
    k, _, _ = furuta.dlqr(a, b, np.diag([0.0625, 4, 0, 0]), [[0.01]])
    for i, x in enumerate(1e-3 * np.eye(4)):
        assert controller.update(x) == pytest.approx(-1e-3 * k[0, i], rel=1e-9)
        assert weights.update(x) == pytest.approx(-1e-3 * k[0, i], rel=1e-9)
    assert controller.command_limit == 10 and controller.dt == DT


def test_a_file_is_read_written_and_pickled(rig, tmp_path):
    path = tmp_path / "lqr.toml"
    path.write_text('[controller]\nkind = "lqr"\ngain = [-1, 27.7, -2, 3.6]\n[limits]\ncommand = 4\n')
    controller = furuta.Controller.from_file(path, rig, DT)
    assert controller.kind == "lqr" and controller.command_limit == 4
    assert controller.update([0, 0.1, 0, 0]) == pytest.approx(-2.77)
    assert controller.update([0, 1, 0, 0]) == -4
    assert controller.update([0.1, 0.1, 0, 0], [0.1, 0.1, 0, 0]) == 0
    again = pickle.loads(pickle.dumps(controller))
    assert again.to_toml() == controller.to_toml()
    assert repr(again) == '<furuta.Controller "lqr" for "shahzad2022-srv02" at 0.002 s>'


@pytest.mark.parametrize("kind", furuta.Controller.KINDS)
def test_every_kind_starts_anew(rig, kind):
    controller = furuta.Controller.from_toml(f'[controller]\nkind = "{kind}"\n', rig, DT)
    states = np.random.default_rng(1).normal(0, 0.05, (50, 4))
    first = [controller.update(x) for x in states]
    controller.start()
    assert [controller.update(x) for x in states] == first
    assert np.isfinite(first).all() and np.abs(first).max() <= controller.command_limit


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[controller]\ngian = 1\n", "line 2: .controller. has no key `gian`"),
        ('[controller]\nkind = "bang_bang"\n', "it has lqr"),
        ("[limits]\ncommand = -1\n", "outside the allowed range"),
        ("[controller]\nr = 1\n", "give both q and r"),
    ],
)
def test_mistakes_are_named(rig, text, message):
    with pytest.raises(furuta.ControllerError, match=message):
        furuta.Controller.from_toml(text, rig, DT)


def test_bad_arguments_are_named(rig, tmp_path):
    controller = furuta.Controller.from_toml("", rig, DT)
    with pytest.raises(furuta.ControllerError, match="absent.toml"):
        furuta.Controller.from_file(tmp_path / "absent.toml", rig, DT)
    with pytest.raises(furuta.ControllerError, match="sample period"):
        furuta.Controller.from_toml("", rig, 0)
    with pytest.raises(furuta.ControllerError, match="0.002 s, not for 0.001 s"):
        furuta.simulate(rig, HANGING, np.zeros(9), 0.001, controller=controller)
    with pytest.raises(furuta.SimulationError, match="1, or 9 as u has"):
        furuta.simulate(rig, HANGING, np.zeros(9), DT, controller=controller, reference=[1, 2])
    with pytest.raises(furuta.SimulationError, match="give controller"):
        furuta.simulate(rig, HANGING, np.zeros(9), DT, reference=0.1)
    with pytest.raises(furuta.SimulationError, match=r"x has shape \(3,\)"):
        controller.update([0, 0, 0])


def test_swings_up_and_follows(rig):
    n = 5000
    reference = np.where(np.arange(n) < 3500, 0.0, 0.3)
    controller = furuta.Controller.from_toml("", rig, DT)
    x, u, modes, y = furuta.simulate(
        rig, HANGING, np.zeros(n), DT, controller=controller, reference=reference, encoders=True
    )
    assert x.shape == (n + 1, 4) and u.shape == (n,) and y.shape == (n + 1, 2) and len(modes) == n
    assert set(modes) == {"swing-up", "balance"} and modes[-1] == "balance"
    assert abs(wrapped(x[-1, 1])) < 0.02 and x[-1, 0] == pytest.approx(0.3, abs=0.05)
    assert np.abs(u).max() <= 10 and u[0] == 0
    # The plant is the one of open-loop simulation: its own commands give the same course.
    again = furuta.simulate(rig, HANGING, u[:200], DT, substeps=2)
    np.testing.assert_array_equal(again, x[:201])
    # A controller keeps nothing between runs.
    repeated = furuta.simulate(rig, HANGING, np.zeros(n), DT, controller=controller, reference=reference)
    np.testing.assert_array_equal(repeated[0], x)


def test_a_controller_of_one_rig_on_another(rig):
    heavier = rig.with_parameters({"pendulum.mass": 0.13}).with_effect("arm.coulomb", torque=0.01)
    controller = furuta.Controller.from_toml("", rig, DT)
    x, _, modes = furuta.simulate(heavier, HANGING, np.zeros(5000), DT, controller=controller)
    assert modes[-1] == "balance" and abs(wrapped(x[-1, 1])) < 0.1


def test_ideal_is_the_controller_on_true_states(rig):
    controller = furuta.Controller.from_toml("", rig, DT)
    x, u, modes = furuta.simulate(rig, [0, 0.1, 0, 0], np.zeros(2000), DT, controller=controller, ideal=True)
    assert set(modes) == {"balance"}
    np.testing.assert_allclose(u, [controller.update(row) for row in x[:-1]], rtol=1e-12)
    assert np.abs(x[-1]).max() < 0.01


def test_a_fault_switches_the_motor_off(rig):
    controller = furuta.Controller.from_toml("[limits]\narm_speed = 1.0\n", rig, DT)
    _, u, modes = furuta.simulate(rig, HANGING, np.zeros(1000), DT, controller=controller)
    first = modes.index("fault")
    assert set(modes[first:]) == {"fault"} and not u[first + 1 :].any()


def test_the_list_of_what_a_file_may_say():
    listed = furuta.controllers()
    assert list(listed["controller"]) == furuta.Controller.KINDS
    assert listed["estimator"]["observer"]["parameters"]["bandwidth"]["default"] == 120


def test_the_region_of_attraction_is_what_simulate_says(rig):
    controller = furuta.Controller.from_toml("", rig, DT)
    alpha, alpha_dot, inside = furuta.region_of_attraction(rig, controller, points=7)
    assert alpha.shape == alpha_dot.shape == (7,) and inside.shape == (7, 7)
    assert 0.2 < inside.mean() < 0.9
    frequency = alpha_dot[-1] / 2
    samples = int(round(40 / frequency / DT))
    for j, i in np.ndindex(7, 7):
        start = [0, alpha[i], 0, alpha_dot[j]]
        x, _, _ = furuta.simulate(rig, start, np.zeros(samples), DT, controller=controller, ideal=True)
        up = abs(x[:, 1]).max() <= np.pi / 2 and abs(x[:, 0]).max() <= 2 * np.pi
        settled = up and abs(x[-samples // 10 :, 1]).max() <= 0.05
        assert settled == inside[j, i], start


def test_a_region_of_nothing_is_refused(rig):
    controller = furuta.Controller.from_toml("", rig, DT)
    for wrong in [{"alpha": -1}, {"speed": np.nan}, {"points": 1}]:
        with pytest.raises(furuta.SimulationError, match=next(iter(wrong))):
            furuta.region_of_attraction(rig, controller, **wrong)
