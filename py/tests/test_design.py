"""Regulators, estimators and pole placement against SciPy, and the gain a paper published."""

from __future__ import annotations

import furuta
import numpy as np
import pytest
from scipy.linalg import solve_continuous_are, solve_discrete_are
from scipy.signal import place_poles

SIZES = [(n, m) for n in range(1, 9) for m in (1, 2, 3)]


def problem(n, m, seed):
    rng = np.random.default_rng(seed)
    a, b = rng.standard_normal((n, n)), rng.standard_normal((n, m))
    q, r = rng.standard_normal((n, n)), rng.standard_normal((m, m))
    return a, b, q @ q.T + 0.1 * np.eye(n), r @ r.T + 0.1 * np.eye(m)


# Random problems of size 8 have condition numbers to 1e6: 1e-8 is what two good solvers then agree to.
@pytest.mark.parametrize(("n", "m"), SIZES)
def test_continuous(n, m):
    for seed in range(5):
        a, b, q, r = problem(n, m, seed)
        k, s, poles = furuta.lqr(a, b, q, r)
        expected = solve_continuous_are(a, b, q, r)
        np.testing.assert_allclose(s, expected, rtol=1e-8, atol=1e-8 * np.abs(expected).max())
        np.testing.assert_allclose(k, np.linalg.solve(r, b.T @ expected), rtol=1e-7, atol=1e-8 * np.abs(k).max())
        np.testing.assert_allclose(
            np.sort_complex(poles), np.sort_complex(np.linalg.eigvals(a - b @ k)), rtol=1e-6, atol=1e-8
        )
        assert k.shape == (m, n) and (poles.real < 0).all()


@pytest.mark.parametrize(("n", "m"), SIZES)
def test_discrete(n, m):
    for seed in range(5):
        a, b, q, r = problem(n, m, 100 + seed)
        k, s, poles = furuta.dlqr(a, b, q, r)
        expected = solve_discrete_are(a, b, q, r)
        np.testing.assert_allclose(s, expected, rtol=1e-8, atol=1e-8 * np.abs(expected).max())
        np.testing.assert_allclose(
            k, np.linalg.solve(r + b.T @ expected @ b, b.T @ expected @ a), rtol=1e-7, atol=1e-8 * np.abs(k).max()
        )
        assert k.shape == (m, n) and (np.abs(poles) < 1).all()


def test_published_gain():
    """Shahzad et al. 2022 print K = [-1, -2.02, 27.68, 3.56], arm before pendulum: Q = I, R = 1 gives it to 0.2 %."""
    a, b = furuta.linearize(furuta.Rig.load("shahzad2022-srv02"))
    k, _, _ = furuta.lqr(a, b, np.eye(4), [[1.0]])
    np.testing.assert_allclose(k[0, [0, 2, 1, 3]], [-1, -2.02, 27.68, 3.56], rtol=2e-3)


def test_the_gain_balances():
    rig = furuta.Rig.load("qube-servo-2")
    a, b = furuta.zero_order_hold(*furuta.linearize(rig), 0.002)
    k, _, _ = furuta.dlqr(a, b, np.diag([5.0, 1.0, 0.01, 0.01]), [[0.05]])
    x = np.array([0.0, 0.15, 0.0, 0.0])
    for _ in range(2000):
        x = furuta.simulate(rig, x, -k @ x, 0.002)[-1]
    assert np.abs(x).max() < 1e-2


@pytest.mark.parametrize(("design", "solve"), [(furuta.lqr, solve_continuous_are), (furuta.dlqr, solve_discrete_are)])
def test_cross_weight(design, solve):
    for seed in range(5):
        a, b, _, _ = problem(4, 2, 200 + seed)
        root = np.random.default_rng(seed).standard_normal((6, 6))
        weight = root @ root.T + 0.1 * np.eye(6)
        q, r, n = weight[:4, :4], weight[4:, 4:], weight[:4, 4:]
        _, s, _ = design(a, b, q, r, n)
        np.testing.assert_allclose(s, solve(a, b, q, r, s=n), rtol=1e-8, atol=1e-8 * np.abs(s).max())


@pytest.mark.parametrize(("n", "p"), [(n, p) for n, p in SIZES if n % 2 == 0])
def test_estimators_are_the_dual(n, p):
    for seed in range(5):
        rng = np.random.default_rng(seed)
        a, c, qn, rn = problem(n, p, 300 + seed)[0], rng.standard_normal((p, n)), *problem(2, p, 400 + seed)[2:]
        g = rng.standard_normal((n, 2))
        gain, covariance, poles = furuta.lqe(a, g, c, qn, rn)
        expected = solve_continuous_are(a.T, c.T, g @ qn @ g.T, rn)
        np.testing.assert_allclose(covariance, expected, rtol=1e-7, atol=1e-7 * np.abs(expected).max())
        np.testing.assert_allclose(gain, expected @ c.T @ np.linalg.inv(rn), rtol=1e-6, atol=1e-7 * np.abs(gain).max())
        assert (poles.real < 0).all()
        a = a / 2
        gain, covariance, poles = furuta.dlqe(a, g, c, qn, rn)
        expected = solve_discrete_are(a.T, c.T, g @ qn @ g.T, rn)
        np.testing.assert_allclose(covariance, expected, rtol=1e-7, atol=1e-7 * np.abs(expected).max())
        innovation = c @ expected @ c.T + rn
        np.testing.assert_allclose(
            gain, a @ expected @ c.T @ np.linalg.inv(innovation), rtol=1e-6, atol=1e-7 * np.abs(gain).max()
        )
        assert (np.abs(poles) < 1).all()


def test_correlated_noises():
    """The covariance that a long recursion of the Kalman filter with correlated noises settles at."""
    a, c = np.array([[0.9, 0.2], [-0.1, 0.8]]), np.array([[1.0, 0.5]])
    w, v, cross = np.diag([0.3, 0.2]), np.array([[0.5]]), np.array([[0.1], [-0.05]])
    gain, covariance, _ = furuta.dlqe(a, np.eye(2), c, w, v, cross)
    p = np.eye(2)
    for _ in range(500):
        k = (a @ p @ c.T + cross) @ np.linalg.inv(c @ p @ c.T + v)
        p = a @ p @ a.T + w - k @ (a @ p @ c.T + cross).T
    np.testing.assert_allclose(covariance, p, rtol=1e-12)
    np.testing.assert_allclose(gain, k, rtol=1e-12)


def test_an_estimator_names_what_is_wrong_in_its_own_words():
    a, c = np.diag([0.5, 1.5]), np.array([[1.0, 0.0]])
    with pytest.raises(furuta.DesignError, match="measurement does not show"):
        furuta.dlqe(a, np.eye(2), c, np.eye(2), [[1.0]])
    with pytest.raises(furuta.DesignError, match=r"V \(measurement noise\) must be positive definite"):
        furuta.dlqe(a, np.eye(2), c, np.eye(2), [[0.0]])
    with pytest.raises(furuta.DesignError, match=r"C\[0,1\] is not a finite number"):
        furuta.dlqe(a, np.eye(2), [[1.0, np.nan]], np.eye(2), [[1.0]])
    with pytest.raises(furuta.DesignError, match=r"QN has shape \(2, 2\); it must be \(1, 1\)"):
        furuta.lqe(a, [[1.0], [0.0]], c, np.eye(2), [[1.0]])


def test_integral_action():
    """Against python-control's recipe: the Riccati equation of the extended system, and no error under a constant
    torque."""
    rig = furuta.Rig.load("qube-servo-2")
    a, b = furuta.linearize(rig)
    c, q, r = np.array([[1.0, 0, 0, 0]]), np.diag([5.0, 1, 0.1, 0.1, 20]), np.array([[0.1]])
    extended = np.block([[a, np.zeros((4, 1))], [c, np.zeros((1, 1))]])
    k, s, poles = furuta.lqi(a, b, c, q, r)
    expected = solve_continuous_are(extended, np.vstack([b, [[0.0]]]), q, r)
    np.testing.assert_allclose(s, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
    assert k.shape == (1, 5) and (poles.real < 0).all()
    h = 0.002
    ad, bd = furuta.zero_order_hold(a, b, h)
    k, _, poles = furuta.lqi(ad, bd, c, q, r, dt=h)
    assert (np.abs(poles) < 1).all()
    x, total = np.zeros(4), 0.0
    for _ in range(10_000):
        u = -(k[:, :4] @ x + k[:, 4] * total)
        total += h * x[0]
        x = ad @ x + bd @ (u + 0.5)
    assert np.abs(x).max() < 1e-9, "half a volt of disturbance leaves nothing"
    with pytest.raises(furuta.DesignError, match="no weight"):
        furuta.lqi(a, b, c, np.diag([5.0, 1, 0.1, 0.1, 0.0]), r)
    with pytest.raises(furuta.DesignError, match="dt = 0 s"):
        furuta.lqi(a, b, c, q, r, dt=0.0)


@pytest.mark.parametrize("n", range(1, 9))
def test_pole_placement(n):
    """For one input the gain is unique: SciPy's, and the poles asked for."""
    for seed in range(10):
        rng = np.random.default_rng(100 * n + seed)
        a, b = rng.standard_normal((n, n)), rng.standard_normal((n, 1))
        pairs = rng.integers(0, n // 2 + 1)
        half = -rng.uniform(0.5, 3, pairs) + 1j * rng.uniform(0.5, 3, pairs)
        poles = np.concatenate([half, half.conj(), -np.sort(rng.uniform(0.5, 5, n - 2 * pairs))])
        k = furuta.place(a, b, poles)
        expected = place_poles(a, b, poles).gain_matrix
        # Seven and eight states through one input: SciPy's own poles are then off by as much.
        np.testing.assert_allclose(
            k, expected, rtol=1e-9 if n <= 5 else 1e-6, atol=(1e-10 if n <= 5 else 1e-7) * np.abs(expected).max()
        )


@pytest.mark.parametrize("name", furuta.Rig.VOLTAGE)
def test_poles_of_rigs(name):
    """To 1e-9 of the largest pole; a sampled rig's too."""
    a, b = furuta.linearize(furuta.Rig.load(name))
    wanted = np.array([-4 + 3j, -4 - 3j, -6, -25])
    k = furuta.place(a, b, wanted)
    np.testing.assert_allclose(np.sort_complex(np.linalg.eigvals(a - b @ k)), np.sort_complex(wanted), atol=1e-8)
    h = 0.002
    ad, bd = furuta.zero_order_hold(a, b, h)
    k = furuta.place(ad, bd, np.exp(wanted * h))
    np.testing.assert_allclose(
        np.sort_complex(np.linalg.eigvals(ad - bd @ k)), np.sort_complex(np.exp(wanted * h)), atol=1e-8
    )


def test_what_cannot_be_placed():
    a, b = np.diag([1.0, 2.0]), np.array([[1.0], [0.0]])
    with pytest.raises(furuta.DesignError, match="reaches only 1"):
        furuta.place(a, b, [-1, -2])
    with pytest.raises(furuta.DesignError, match="conjugate"):
        furuta.place(a, b, [-1 + 1j, -2])
    with pytest.raises(furuta.DesignError, match="3 poles for 2 states"):
        furuta.place(a, b, [-1, -2, -3])
    with pytest.raises(furuta.DesignError, match=r"B has shape \(2, 2\); it must be \(2, 1\)"):
        furuta.place(a, np.eye(2), [-1, -2])
    b = np.ones((2, 1))
    for unstable in ([3, -1], [1, 0.5], [-1, 0.5], [-1.5, 0]):
        with pytest.raises(furuta.DesignError, match=r"p\[0\] = .*|p\[1\] = .* is not stable"):
            furuta.place(a, b, unstable)
    for stable in ([-3, -1], [0.9, -0.5], [0, 0.2]):
        assert furuta.place(a, b, stable).shape == (1, 2)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([[1.0]], [[0.0]], [[1.0]], [[1.0]]), "stabilis"),
        (([[1.0]], [[1.0]], [[1.0]], [[0.0]]), "R must be positive definite"),
        (([[1.0, 2.0]], [[1.0]], [[1.0]], [[1.0]]), r"A has shape \(1, 2\)"),
        (([[np.nan]], [[1.0]], [[1.0]], [[1.0]]), "finite"),
        ((np.eye(9), np.ones((9, 1)), np.eye(9), [[1.0]]), "1 to 8 states"),
        ((np.eye(2), np.eye(2), [[1.0, 0.5], [0.0, 1.0]], np.eye(2)), "symmetric"),
    ],
)
def test_bad_problems_are_named(arguments, message):
    for design in (furuta.lqr, furuta.dlqr):
        with pytest.raises(furuta.DesignError, match=message):
            design(*arguments)
