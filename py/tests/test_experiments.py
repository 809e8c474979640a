"""The steady motion and the papers' experiments from Python, against SciPy."""

import numpy as np
import pytest
from numpy.polynomial.polynomial import polyval2d
from scipy.integrate import solve_ivp

import furuta


@pytest.mark.parametrize("spring", [0.0, 0.02])
def test_the_series_is_the_motion_that_the_zero_dynamics_integrate_to(spring):
    """QUBE: the arm's motion integrated by DOP853 from the series' start stays on the series for a turn.

    A spring on the arm changes the command alone, and the simulation with the spring stays on the same motion.
    """
    rig = furuta.Rig.load("qube-servo-2").with_effect("arm.spring", stiffness=spring, rest=0.0)
    p = rig.parameters
    lam, amplitude = 3.0, 0.02
    theta, theta_dot, u = furuta.steady_motion(rig, lam, order=7)
    coupling = p["pendulum.mass"] * p["arm.length"] * p["pendulum.com"]
    m22 = p["pendulum.inertia"] + p["pendulum.mass"] * p["pendulum.com"] ** 2
    k = p["pendulum.mass"] * p["pendulum.com"] ** 2 + p["pendulum.inertia_transverse"] - p["pendulum.inertia_axial"]
    weight = p["pendulum.mass"] * p["environment.gravity"] * p["pendulum.com"]

    def w(t):
        return amplitude * np.cos(lam * t), amplitude * np.sin(lam * t)

    def rate(t, y):
        w1, w2 = w(t)
        # alpha = w2 with w1' = lam w2 would run the other way round: w2 = amplitude sin(-lam t).
        alpha, alpha_dot, alpha_ddot = -w2, -lam * w1, lam**2 * w2
        s, c = np.sin(alpha), np.cos(alpha)
        moment = m22 * alpha_ddot + p["pendulum.viscous"] * alpha_dot - weight * s - k * s * c * y[1] ** 2
        return y[1], moment / (coupling * c)

    start = polyval2d(amplitude, 0.0, theta), polyval2d(amplitude, 0.0, theta_dot)
    t = np.linspace(0, 2 * np.pi / lam, 50)
    exact = solve_ivp(rate, (0, t[-1]), start, method="DOP853", rtol=1e-11, atol=1e-12, t_eval=t).y
    w1, w2 = w(t)
    # What the series leaves out is of ninth order: 1e-6 of the motion at this amplitude.
    assert np.abs(polyval2d(w1, -w2, theta) - exact[0]).max() < 1e-5 * np.abs(exact[0]).max()
    assert np.abs(polyval2d(w1, -w2, theta_dot) - exact[1]).max() < 1e-5 * np.abs(exact[1]).max()
    # The command turns the arm so: simulated, one period brings the state back where it was.
    steps = 4000
    dt = 2 * np.pi / lam / steps
    middle = w((np.arange(steps) + 0.5) * dt)
    commands = polyval2d(middle[0], -middle[1], u)
    x0 = [start[0], 0.0, start[1], -lam * amplitude]
    x = furuta.simulate(rig, x0, commands, dt)
    # Upright is unstable: what is wrong by 1e-6 grows by exp(8 * 2) in two seconds; a fifth of a turn shows it without.
    fifth = steps // 5
    at = w(fifth * dt)
    expected = [polyval2d(at[0], -at[1], theta), -at[1]]
    assert np.abs(x[fifth, :2] - expected).max() < 1e-4


def test_the_steady_motion_says_which_effects_it_cannot_hold():
    rig = furuta.Rig.load("qube-servo-2")
    lag = rig.with_effect("motor.lag", time_constant=0.01)
    with pytest.warns(UserWarning, match="motor.lag: left out, it is none of the four states"):
        furuta.steady_motion(lag, 3.0)
    tilted = rig.with_effect("arm.tilt", angle=0.05, direction=0.3)
    with pytest.raises(furuta.DesignError, match="torque on the pendulum changes by .* per rad of the arm's angle"):
        furuta.steady_motion(tilted, 3.0)


def test_largest_sine_is_the_closed_form_for_small_angles():
    rig = furuta.Rig.load("ramos-velasco")
    p = rig.parameters
    # (g + l2 lam^2) / l1 and l2 / l1 of a point mass.
    for lam in (0.5, 1.0, 4.0):
        a = (9.81 + p["pendulum.com"] * lam**2) / p["arm.length"]
        b = p["pendulum.com"] / p["arm.length"]
        found = furuta.largest_sine(rig, lam)
        assert found == pytest.approx(np.pi * lam / 2 / np.sqrt(a * b), rel=0.05)
        assert furuta.largest_sine(rig, lam, planar=True) is None


def test_experiments():
    run = furuta.papers.shahzad2022("step", "linear")
    assert run["x"].shape == run["reference"].shape == (10001, 4)
    assert run["u"][999] == 0 and run["reference"][1001, 0] == 0.1
    nominal, off = (furuta.papers.ramos_velasco("regulator", factors=f) for f in [(1, 1, 1), (0.8, 0.8, 0.8)])
    error = [np.abs(r["x"][4000:10000, 1] - r["reference"][4000:10000, 1]).max() for r in (nominal, off)]
    assert error[0] < 0.012 < 0.02 < error[1]
    np.testing.assert_array_equal(nominal["x"][:2000], off["x"][:2000])
    fallen = furuta.papers.ramos_velasco("layer", "full", amplitude=0.1)
    assert len(fallen["t"]) < 15001 and abs(fallen["x"][-1, 1]) > np.pi / 2


def test_draws():
    drawn = furuta.papers.ramos_velasco_draws("twisting", draws=16, seed=3)
    again = furuta.papers.ramos_velasco_draws("layer", draws=16, seed=3)
    np.testing.assert_array_equal(drawn["factors"], again["factors"])
    assert (np.abs(drawn["factors"] - 1) <= 0.2).all()
    assert (drawn["bound"] >= drawn["rms"]).all()
    assert drawn["chatter"].min() > again["chatter"].max()


@pytest.mark.parametrize(
    "call",
    [
        lambda: furuta.steady_motion(furuta.Rig.load("qube-servo-2"), 1.0, order=32),
        lambda: furuta.steady_motion(furuta.Rig.load("qube-servo-2"), -1.0),
        lambda: furuta.largest_sine(furuta.Rig.load("qube-servo-2"), float("nan")),
        lambda: furuta.papers.ramos_velasco("pid"),
        lambda: furuta.papers.ramos_velasco("layer", factors=(0, 1, 1)),
        lambda: furuta.papers.ramos_velasco_draws("layer", spread=2),
        lambda: furuta.papers.shahzad2022("jump"),
    ],
)
def test_mistakes_are_named(call):
    with pytest.raises(furuta.FurutaError, match="is none of|possible|must be"):
        call()


def test_predictive_control_keeps_the_pendulum_within_its_limit():
    """The arm's step under LQR and MPC; what is reported follows from the runs."""
    study = furuta.arm_step(furuta.Rig.load("qube-servo-2"), 0.5, pendulum_angle=0.1, duration=3.0)
    assert study["pendulum_limit"] == 0.1 and study["command_limit"] == 10.0
    for name in ("lqr", "sliding", "mpc_clarabel", "mpc_active_set"):
        run = study[name]
        assert (
            run["up"]
            and run["alpha_max"] == np.abs(run["x"][:, 1]).max()
            and run["u_max"] == np.abs(run["u"]).max() <= 10.0
        )
        assert run["effort"] == pytest.approx((run["u"][:-1] ** 2).sum() * 0.002, rel=1e-9)
        assert np.abs(run["x"][run["t"] > run["settle"], 0] - 0.5).max() <= 0.01
        assert run["violations"] == (np.abs(run["x"][:, 1]) > 0.101).sum()
    assert study["lqr"]["alpha_max"] > 0.2 and study["mpc_active_set"]["alpha_max"] < 0.102
    # Two solvers of one problem; the interior-point method stops at a finite precision.
    assert np.abs(study["mpc_active_set"]["x"] - study["mpc_clarabel"]["x"]).max() < 1e-4


def test_a_study_that_is_not_possible_says_why():
    rig = furuta.Rig.load("qube-servo-2")
    with pytest.raises(furuta.SimulationError, match="step = 0"):
        furuta.arm_step(rig, 0.0)
    with pytest.raises(furuta.SimulationError, match="both q and r"):
        furuta.arm_step(rig, q=[1, 1, 1, 1])
    with pytest.raises(furuta.SimulationError, match="iterations = 0"):
        furuta.arm_step(rig, iterations=0)
