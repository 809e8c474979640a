"""Writes riccati.rs: Riccati problems with SciPy's answers, for tests/riccati.rs.

    python -m venv venv && venv/bin/pip install numpy scipy mpmath && venv/bin/python riccati.py > riccati.rs

SciPy orders the generalised Schur form of an extended pencil (QZ), so it shares neither method nor code with the
doubling iteration under test. Its answers are good to between 4e-9 and 1e-16 of their size, less than the doubling
iteration reaches, so each is refined with Newton's method in 40 digits first. Every number is written with 17 digits:
reading them back gives the same doubles.
"""

import mpmath as mp
import numpy as np
import scipy
from scipy.linalg import expm, solve_continuous_are, solve_discrete_are

mp.mp.dps = 40
rng = np.random.default_rng(20240607)


def refine(discrete, a, b, q, r, cross, x):
    """Newton's method (Kleinman, Hewer) from SciPy's solution: each step solves one linear equation for X."""
    n = a.shape[0]
    a, b, q, r, cross, x = (mp.matrix(m.tolist()) for m in (a, b, q, r, cross, x))
    one = mp.eye(n)
    kron = lambda p, s: mp.matrix(
        [[p[i, k] * s[j, l] for k in range(n) for l in range(n)] for i in range(n) for j in range(n)]
    )
    gain = lambda x: (r + b.T * x * b) ** -1 * (b.T * x * a + cross.T) if discrete else r**-1 * (b.T * x + cross.T)
    start = x
    for _ in range(4):
        k = gain(x)
        closed = a - b * k
        cost = q + k.T * r * k - cross * k - (cross * k).T
        left = kron(one, one) - kron(closed.T, closed.T) if discrete else -kron(closed.T, one) - kron(one, closed.T)
        flat_x = mp.lu_solve(left, mp.matrix(list(cost)))
        x = mp.matrix([[flat_x[i * n + j] for j in range(n)] for i in range(n)])
    assert mp.norm(x - start) < 1e-7 * mp.norm(x)
    array = lambda m: np.array(m.tolist(), dtype=float)
    return array(x), array(gain(x)), float(mp.norm(x - start) / mp.norm(x))


def zero_order_hold(a, b, h):
    n, m = b.shape
    block = np.zeros((n + m, n + m))
    block[:n, :n], block[:n, n:] = a, b
    e = expm(block * h)
    return e[:n, :n], e[:n, n:]


def flat(m):
    return "&[" + ", ".join(repr(float(v)) for v in np.asarray(m).ravel()) + "]"


def case(name, discrete, a, b, q, r, cross):
    solve = solve_discrete_are if discrete else solve_continuous_are
    x, k, scipy_error = refine(discrete, a, b, q, r, cross, solve(a, b, q, r, s=cross))
    n, m = b.shape
    print(f"    Case {{")
    print(f'        name: "{name}",')
    print(f"        discrete: {str(discrete).lower()},")
    print(f"        size: ({n}, {m}),")
    for label, value in dict(a=a, b=b, q=q, r=r, n=cross, x=x, k=k).items():
        print(f"        {label}: {flat(value)},")
    print(f"        scipy_error: {scipy_error:.1e},")
    print(f"    }},")


def weights(n, m, cross):
    """Random weights for which [Q N; N' R] is positive definite, so that a stabilising solution exists."""
    root = rng.normal(size=(n + m, n + m))
    block = root @ root.T + 0.1 * np.eye(n + m)
    block = 0.5 * (block + block.T)
    return block[:n, :n], block[n:, n:], block[:n, n:] if cross else np.zeros((n, m))


# The upright models that papers A and B print, state [theta, alpha, theta_dot, alpha_dot].
paper_a = (
    np.array([[0, 0, 1, 0], [0, 0, 0, 1], [0, 5.9796, -8.1419, -0.1098], [0, 57.6254, -6.9788, -1.0584]]),
    np.array([[0.0], [0.0], [28.8442], [24.7236]]),
)
paper_b = (
    np.array([[0, 0, 1, 0], [0, 0, 0, 1], [0, 54.06, -20.38, 0], [0, 109.56, -19.22, 0]]),
    np.array([[0.0], [0.0], [35.84], [33.81]]),
)

print("// Made by riccati.py with SciPy", scipy.__version__, "and NumPy", np.__version__ + "; do not edit.")
print("const CASES: &[Case] = &[")
for label, (a, b) in dict(paper_a=paper_a, paper_b=paper_b).items():
    q, r, zero = np.eye(4), np.eye(1), np.zeros((4, 1))
    case(f"{label} continuous", False, a, b, q, r, zero)
    for rate in (100, 500, 1000, 5000):
        case(f"{label} at {rate} Hz", True, *zero_order_hold(a, b, 1 / rate), q, r, zero)
for n, m in [(1, 1), (2, 1), (3, 1), (3, 2), (4, 1), (4, 2), (5, 1), (6, 2), (8, 1), (8, 3)]:
    for cross in (False, True):
        a, b = rng.normal(size=(n, n)), rng.normal(size=(n, m))
        for discrete in (False, True):
            case(f"random {n} x {m}{' with cross term' if cross else ''}", discrete, a, b, *weights(n, m, cross))
# A fast unstable mode that has no weight: the least costly input is 0, the stabilising solution is another one.
a, b = np.array([[2.0, 1.0], [0.0, 0.5]]), np.array([[1.0], [1.0]])
case("unstable mode without weight", True, a, b, np.zeros((2, 2)), np.eye(1), np.zeros((2, 1)))
case("unstable mode without weight", False, a, b, np.zeros((2, 2)), np.eye(1), np.zeros((2, 1)))
# Expensive control: closed-loop poles within 1e-3 of the stability boundary.
a, b = np.array([[0.0, 1.0], [-1.0, 0.0]]), np.array([[0.0], [1.0]])
case("expensive control", False, a, b, np.eye(2), 1e6 * np.eye(1), np.zeros((2, 1)))
case("expensive control", True, *zero_order_hold(a, b, 0.1), np.eye(2), 1e6 * np.eye(1), np.zeros((2, 1)))
print("];")
