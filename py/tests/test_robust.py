"""The robust regulator against Clarabel's semidefinite cone (its wheel brings LAPACK), and against eigenvalues by
NumPy."""

import numpy as np
import pytest
from scipy import sparse
from scipy.linalg import solve_continuous_lyapunov

import furuta


def triangle(m):
    """A symmetric matrix as Clarabel's cone wants it: the upper triangle by columns, off-diagonal entries times the
    root of 2."""
    n = len(m)
    return np.array([m[i, j] * (1.0 if i == j else np.sqrt(2.0)) for j in range(n) for i in range(j + 1)])


def least_guaranteed_cost(vertices_a, vertices_b, q, r, about):
    """min trace(W W0) over S, Y, W: [W I; I S] >= 0 and at every vertex the decay less the cost >= 0, as one
    semidefinite program.

    In coordinates z = T x in which `about` is the unit matrix: where angles and speeds have unlike sizes Clarabel ends
    early.
    """
    clarabel = pytest.importorskip("clarabel")
    n, basis = 4, [(i, j) for i in range(4) for j in range(i + 1)]
    into = np.linalg.cholesky(about).T
    back = np.linalg.inv(into)
    vertices_a, vertices_b = into @ vertices_a @ back, into @ vertices_b
    root_q = np.diag(np.sqrt(q)) @ back
    weight = into @ into.T / np.trace(about)
    unknowns = 2 * len(basis) + n

    def parts(x):
        w, s = np.zeros((n, n)), np.zeros((n, n))
        for k, (i, j) in enumerate(basis):
            w[i, j] = w[j, i] = x[k]
            s[i, j] = s[j, i] = x[len(basis) + k]
        return w, s, x[2 * len(basis) :].reshape(1, n)

    def blocks(x, constant):
        w, s, y = parts(x)
        one = np.eye(n) * constant
        yield np.block([[w, one], [one, s]])
        for a, b in zip(vertices_a, vertices_b, strict=True):
            moved = a @ s - b @ y
            cost = np.vstack([root_q @ s, np.sqrt(r) * y])
            yield np.block([[-(moved + moved.T), cost.T], [cost, np.eye(n + 1) * constant]])

    stack = [np.concatenate([triangle(m) for m in blocks(e, 0.0)]) for e in np.eye(unknowns)]
    constant = np.concatenate([triangle(m) for m in blocks(np.zeros(unknowns), 1.0)])
    cones = [clarabel.PSDTriangleConeT(len(m)) for m in blocks(np.zeros(unknowns), 0.0)]
    goal = np.array([np.trace(weight @ parts(e)[0]) for e in np.eye(unknowns)])
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    solver = clarabel.DefaultSolver(
        sparse.csc_matrix((unknowns, unknowns)), goal, sparse.csc_matrix(-np.array(stack).T), constant, cones, settings
    )
    solution = solver.solve()
    assert "Solved" in str(solution.status), solution.status
    return goal @ np.array(solution.x) * np.trace(about)


@pytest.mark.parametrize("name", ["fong2014-emecs", "shahzad2022-srv02", "qube-servo-2", "ramos-velasco"])
def test_the_guarantee_is_the_least_that_clarabel_finds(name):
    q, r = [16.0, 4.0, 0.5, 0.5], 0.1
    found = furuta.robust_lqr(furuta.Rig.load(name), 0.2, q=q, r=r)
    assert found["A"].shape == (27, 4, 4)
    # Clarabel stops at 1e-8 of its own scaled problem; costs of unlike rigs span five decades.
    assert np.trace(found["X"]) == pytest.approx(
        least_guaranteed_cost(found["A"], found["B"], q, r, found["X"]), rel=1e-4
    )
    k = found["K"].reshape(1, 4)
    spent = np.diag(q) + r * k.T @ k
    for a, b in zip(found["A"], found["B"], strict=True):
        closed = a - b @ k
        assert np.linalg.eigvals(closed).real.max() < 0
        left = found["X"] - solve_continuous_lyapunov(closed.T, -spent)
        assert np.linalg.eigvalsh(left).min() > -1e-6 * np.linalg.norm(found["X"])


def test_a_range_that_is_too_wide_says_how_wide_it_may_be():
    rig = furuta.Rig.load("ramos-velasco")
    with pytest.raises(furuta.DesignError, match="no common Lyapunov function.*largest spread with one is 0") as caught:
        furuta.robust_lqr(rig, 0.6)
    largest = float(str(caught.value).split()[-1])
    assert 0.2 < largest < 0.6 and furuta.robust_lqr(rig, 0.9 * largest)["slowest"] < 0
    with pytest.raises(furuta.DesignError, match="cannot be uncertain"):
        furuta.robust_lqr(rig, parameters=["pendulum.colour"])
    with pytest.raises(furuta.DesignError, match="allowed is more than 0"):
        furuta.robust_lqr(rig, -0.1)


def test_the_guarantee_names_the_effects_that_it_does_not_hold_with():
    rig = furuta.Rig.load("qube-servo-2")
    assert furuta.robust_lqr(rig, 0.1)["remarks"] == {}
    late = rig.with_effect("motor.delay", delay=0.025).with_effect("arm.spring", stiffness=0.005, rest=0.0)
    remarks = furuta.robust_lqr(late, 0.1)["remarks"]
    assert list(remarks) == ["motor.delay"]
    assert "left out" in remarks["motor.delay"]
