"""Regulators against SciPy's Riccati solvers, and the gain a paper published."""

from __future__ import annotations

import furuta
import numpy as np
import pytest
from scipy.linalg import solve_continuous_are, solve_discrete_are

SIZES = [(n, m) for n in range(1, 9) for m in (1, 2)]


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
        np.testing.assert_allclose(np.sort_complex(poles), np.sort_complex(np.linalg.eigvals(a - b @ k)), rtol=1e-6, atol=1e-8)
        assert k.shape == (m, n) and (poles.real < 0).all()


@pytest.mark.parametrize(("n", "m"), SIZES)
def test_discrete(n, m):
    for seed in range(5):
        a, b, q, r = problem(n, m, 100 + seed)
        k, s, poles = furuta.dlqr(a, b, q, r)
        expected = solve_discrete_are(a, b, q, r)
        np.testing.assert_allclose(s, expected, rtol=1e-8, atol=1e-8 * np.abs(expected).max())
        np.testing.assert_allclose(k, np.linalg.solve(r + b.T @ expected @ b, b.T @ expected @ a), rtol=1e-7, atol=1e-8 * np.abs(k).max())
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
