"""Riccati equations against SciPy and SLICOT on 200 random systems, and what has no solution."""

from __future__ import annotations

import furuta
import numpy as np
import pytest
import riccati_cases
from riccati_cases import cases, residual
from scipy.linalg import solve_discrete_lyapunov, solve_sylvester

CASES = cases(200)


def is_stable(c, poles):
    return (np.abs(poles) < 1).all() if c.discrete else (poles.real < 0).all()


def correction(c, x):
    """Newton's step from x, by SciPy's solvers of linear matrix equations: how far the solution is from x."""
    k = (
        np.linalg.solve(c.r + c.b.T @ x @ c.b, c.b.T @ x @ c.a + c.s.T)
        if c.discrete
        else np.linalg.solve(c.r, c.b.T @ x + c.s.T)
    )
    closed = c.a - c.b @ k
    # The cost of that gain, with the weights in the form that cannot become negative by cancellation.
    cost = c.q + k.T @ c.r @ k - c.s @ k - k.T @ c.s.T
    return (solve_discrete_lyapunov(closed.T, cost) if c.discrete else solve_sylvester(closed.T, closed, -cost)) - x


@pytest.mark.parametrize("c", CASES, ids=lambda c: c.name)
def test_random_systems(c):
    x, poles, gain = (furuta.dare if c.discrete else furuta.care)(c.a, c.b, c.q, c.r, c.s)
    assert residual(c, x) <= 1e-10
    assert (x == x.T).all() and is_stable(c, poles)
    assert gain.shape == c.b.T.shape


@pytest.mark.filterwarnings("ignore")  # SciPy's and SLICOT's, of the badly scaled ones
@pytest.mark.parametrize("library", ["scipy", "slicot"])
def test_other_libraries(library):
    """Where another library solves the equation well, it has the same solution; nowhere does it solve one notably
    better."""
    if library == "slicot":
        pytest.importorskip("slycot")
    compared = 0
    for c in CASES:
        x = riccati_cases.furuta_answer(c)
        try:
            theirs = getattr(riccati_cases, library)(c)
        except Exception:  # noqa: BLE001, S112 (each library has its own)
            continue
        assert residual(c, x) <= max(10 * residual(c, theirs), 1e-12), c.name
        # An error of X of the size of Newton's next step is theirs, not ours; both are counted in the units that
        # scaling took out.
        size = np.sqrt(np.outer(np.diag(x), np.diag(x)))
        error = np.abs((x - theirs) / size).max()
        doubt = np.abs(correction(c, theirs) / size).max() + np.abs(correction(c, x) / size).max()
        if doubt < 1e-7:
            compared += 1
            assert error <= 1e-9 + 10 * doubt, (c.name, error, doubt)
    assert compared >= 120


def turned(a, b, seed=0):
    """The system in coordinates in which nothing is 0."""
    turn, _ = np.linalg.qr(np.random.default_rng(seed).standard_normal(np.shape(a)))
    return turn @ a @ turn.T, turn @ b


@pytest.mark.parametrize("seed", range(5))
def test_what_has_no_solution(seed):
    eye, one = np.eye(3), [[1.0]]
    b = np.array([[1.0], [0.7], [0.0]])
    unstable = np.diag([-0.5, 0.3, 1.2])  # the input does not reach 1.2, in discrete and continuous time unstable
    for solve in (furuta.dare, furuta.care):
        with pytest.raises(furuta.DesignError, match="input cannot reach"):
            solve(*turned(unstable, b, seed), eye, one)
    # A mode on the boundary that can be reached but costs nothing: a slow drift would be for free.
    reach = np.array([[1.0], [0.7], [0.4]])
    for solve, boundary in ((furuta.dare, 1.0), (furuta.dare, -1.0), (furuta.care, 0.0)):
        a, b = turned(np.diag([-0.5, 0.3, boundary]), reach, seed)
        seen = turned(np.diag([1.0, 1.0, 0.0]), reach, seed)[0]
        with pytest.raises(furuta.DesignError, match="no weight"):
            solve(a, b, seen, one)
    # The same, seen: has a solution.
    furuta.care(*turned(np.diag([-0.5, 0.3, 0.0]), reach, seed), eye, one)


def test_indefinite_weights():
    with pytest.raises(furuta.DesignError, match="R must be positive definite, but its pivot 1"):
        furuta.care(np.eye(2), np.eye(2), np.eye(2), np.diag([1.0, -1.0]))
    # x' = -x + u with the reward 2 x^2: x'X x has no bound, the equation no real solution.
    with pytest.raises(furuta.DesignError, match="no stabilising solution"):
        furuta.care([[-1.0]], [[1.0]], [[-2.0]], [[1.0]])
    # With the reward 0.5 x^2 it has: X = -1 + sqrt(1/2).
    x, _, _ = furuta.care([[-1.0]], [[1.0]], [[-0.5]], [[1.0]])
    assert x[0, 0] == pytest.approx(-1 + np.sqrt(0.5), abs=1e-15)


def test_solution_of_an_unstable_mode_without_weight():
    """The least costly input is 0; the stabilising solution mirrors the mode: X = 2 a / b^2 (continuous), a^2 - 1
    (discrete)."""
    assert furuta.care([[3.0]], [[1.0]], [[0.0]])[0][0, 0] == pytest.approx(6, rel=1e-14)
    assert furuta.dare([[3.0]], [[1.0]], [[0.0]], [[1.0]])[0][0, 0] == pytest.approx(8, rel=1e-14)


def test_defaults_and_shapes():
    a, b, q = np.array([[0.0, 1.0], [2.0, 0.0]]), np.array([[0.0], [1.0]]), np.eye(2)
    np.testing.assert_array_equal(furuta.care(a, b, q)[0], furuta.care(a, b, q, [[1.0]], np.zeros((2, 1)))[0])
    with pytest.raises(furuta.DesignError, match=r"the cross term has shape \(1, 2\)"):
        furuta.care(a, b, q, [[1.0]], [[0.0, 0.0]])
