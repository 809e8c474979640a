"""Controllability against NumPy's SVD, on systems whose rank is known by construction."""

from __future__ import annotations

import furuta
import numpy as np
import pytest

SIZES = [(n, m) for n in range(1, 9) for m in (1, 2, 3)]


def kalman(a, b):
    blocks = [b]
    while len(blocks) < len(a):
        blocks.append(a @ blocks[-1])
    return np.hstack(blocks)


def scaled_singular_values(a, b):
    """The same scaling as in the Rust code, with NumPy's own eigenvalues and singular values."""
    rate = np.abs(np.linalg.eigvals(np.abs(a))).max()
    size = np.linalg.norm(kalman(np.abs(a) / rate, np.abs(b)), axis=1)
    return np.linalg.svd(kalman(a / rate, b) / size[:, None], compute_uv=False)


@pytest.mark.parametrize(("n", "m"), SIZES)
def test_random_systems(n, m):
    rng = np.random.default_rng(n * 10 + m)
    for _ in range(5):
        a, b = rng.standard_normal((n, n)), rng.standard_normal((n, m))
        w, rank, condition = furuta.controllability(a, b)
        np.testing.assert_allclose(w, kalman(a, b), rtol=1e-12, atol=1e-12 * np.abs(w).max())
        assert rank == n
        s = scaled_singular_values(a, b)
        # NumPy finds the smallest singular value to eps times the largest; 1e-9 leaves room for conditions to 1e6.
        assert condition == pytest.approx(s[0] / s[-1], rel=1e-9)


@pytest.mark.parametrize(("n", "m"), [(n, m) for n, m in SIZES if n > 1])
def test_modes_that_no_input_reaches(n, m):
    rng = np.random.default_rng(n * 100 + m)
    for hidden in range(1, min(n, 3)):
        a, b = rng.standard_normal((n, n)), rng.standard_normal((n, m))
        a[n - hidden :, : n - hidden] = 0.0
        b[n - hidden :] = 0.0
        turn, _ = np.linalg.qr(rng.standard_normal((n, n)))  # the hidden modes are in no coordinate of their own
        _, rank, condition = furuta.controllability(turn @ a @ turn.T, turn @ b)
        assert rank == n - hidden
        assert condition == np.inf


def test_units_of_states_and_time_drop_out():
    a, b = furuta.linearize(furuta.Rig.load("shahzad2022-srv02"))
    _, rank, condition = furuta.controllability(a, b)
    d = np.array([1e3, 1e-4, 57.3, 1e5])
    _, other_rank, other = furuta.controllability(1e-6 * d[:, None] * a / d, d[:, None] * b)
    assert rank == other_rank == 4
    assert other == pytest.approx(condition, rel=1e-9)


@pytest.mark.parametrize("name", furuta.Rig.VOLTAGE)
def test_rigs_upright_and_hanging(name):
    rig = furuta.Rig.load(name)
    for alpha in (0.0, np.pi):
        a, b = furuta.linearize(rig, [0.0, alpha, 0.0, 0.0])
        w, rank, condition = furuta.controllability(a, b)
        assert rank == 4 and 1 < condition < 1e3
        assert np.linalg.matrix_rank(w) == 4
        # The dual: both encoders show everything, the arm's alone too, the pendulum's alone not the arm's angle.
        assert furuta.controllability(a.T, np.eye(4)[:, :2])[1] == 4
        assert furuta.controllability(a.T, np.eye(4)[:, :1])[1] == 4
        assert furuta.controllability(a.T, np.eye(4)[:, 1:2])[1] == 3


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([[1.0, 2.0]], [[1.0]]), r"A has shape \(1, 2\)"),
        (([[np.inf]], [[1.0]]), r"A\[0,0\] is not a finite number"),
        ((np.eye(9), np.ones((9, 1))), "1 to 8 states"),
    ],
)
def test_bad_problems_are_named(arguments, message):
    with pytest.raises(furuta.DesignError, match=message):
        furuta.controllability(*arguments)
