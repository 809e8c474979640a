"""Random Riccati problems that have a stabilising solution, badly scaled ones among them, and other libraries' answers
to them.

    python py/tests/riccati_cases.py --count 8000     # a table of residuals: furuta, SciPy, SLICOT
"""

from __future__ import annotations

import argparse
import dataclasses
import warnings

import furuta
import numpy as np
from scipy.linalg import expm, solve_continuous_are, solve_discrete_are


@dataclasses.dataclass(frozen=True)
class Case:
    """One equation; `s` is the cross term."""

    name: str
    discrete: bool
    a: np.ndarray
    b: np.ndarray
    q: np.ndarray
    r: np.ndarray
    s: np.ndarray


def system(n: int, m: int, kind: str, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """x' = a x + b u; with kind 'hidden', the input does not reach a third of the states, which are stable."""
    a, b = rng.standard_normal((n, n)), rng.standard_normal((n, m))
    hidden = n // 3 if kind == "hidden" else 0
    if hidden:
        kept = n - hidden
        a[kept:, :kept], b[kept:] = 0.0, 0.0
        a[kept:, kept:] -= (np.linalg.eigvals(a[kept:, kept:]).real.max() + 0.5) * np.eye(hidden)
        turn, _ = np.linalg.qr(rng.standard_normal((n, n)))
        a, b = turn @ a @ turn.T, turn @ b
    return a, b


def zero_order_hold(a: np.ndarray, b: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
    n, m = b.shape
    e = expm(h * np.block([[a, b], [np.zeros((m, n + m))]]))
    return e[:n, :n], e[:n, n:]


KINDS = ("plain", "hidden", "states", "weights", "time", "sampled", "rank one", "cross")


def cases(count: int = 200, seed: int = 1) -> list[Case]:
    """Sizes 1 to 8, 1 to 3 inputs, both equations, and in turn: plain; modes that the input does not reach; states and
    inputs in units 1e8 apart; weights 1e8 apart; fast or slow by 1e3; sampled so quickly that A is near 1; only one
    output weighted; with a cross term.
    """
    rng = np.random.default_rng(seed)
    found = []
    for i in range(count):
        n, m, kind, discrete = 1 + i % 8, 1 + i // 8 % 3, KINDS[int(rng.integers(len(KINDS)))], bool(rng.integers(2))
        a, b = system(n, m, kind, rng)
        root = rng.standard_normal((n + m, n + m))
        weight = root @ root.T + 0.1 * np.eye(n + m)
        q, r, s = weight[:n, :n], weight[n:, n:], weight[:n, n:]
        if kind != "cross":
            s = np.zeros((n, m))
        if kind == "rank one":
            q = np.outer(root[0, :n], root[0, :n])
        if kind == "time":
            a, b = (10 ** rng.uniform(-3, 3) * x for x in (a, b))
        if discrete:
            # Held over a sample that is short against the system (sampled: very short), so that few poles are too
            # unstable to matter.
            a, b = zero_order_hold(a, b, (10 ** rng.uniform(-4, -2) if kind == "sampled" else 0.3) / np.linalg.norm(a))
        if kind == "states":
            d, e = (np.diag(10.0 ** rng.uniform(-4, 4, k)) for k in (n, m))
            inverse = np.diag(1 / np.diag(d))
            a, b, q, r, s = inverse @ a @ d, inverse @ b @ e, d @ q @ d, e @ r @ e, d @ s @ e
        if kind == "weights":
            d, e = (np.diag(10.0 ** rng.uniform(-2, 2, k)) for k in (n, m))
            q, r, s = d @ q @ d, e @ r @ e, d @ s @ e
        q, r = (q + q.T) / 2, (r + r.T) / 2
        found.append(
            Case(f"{i}: {kind}, n {n}, m {m}, {'discrete' if discrete else 'continuous'}", discrete, a, b, q, r, s)
        )
    return found


def residual(c: Case, x: np.ndarray) -> float:
    """What is left of the equation over its terms."""
    a, b, q, r, s = c.a, c.b, c.q, c.r, c.s
    if c.discrete:
        across = a.T @ x @ b + s
        terms = [a.T @ x @ a, -x, -across @ np.linalg.solve(r + b.T @ x @ b, across.T), q]
    else:
        across = x @ b + s
        terms = [a.T @ x + x @ a, -across @ np.linalg.solve(r, across.T), q]
    return np.linalg.norm(sum(terms)) / sum(map(np.linalg.norm, terms))


def slicot(c: Case) -> np.ndarray:
    """SLICOT's SG02AD, as python-control calls it."""
    import slycot

    n, m = c.b.shape
    dico = "D" if c.discrete else "C"
    answer = slycot.sg02ad(dico, "B", "N", "U", "N", "N", "S", "R", n, m, 0, c.a, np.eye(n), c.b, c.q, c.r, c.s)
    return answer[1]


def scipy(c: Case) -> np.ndarray:
    """SciPy's, which orders a generalised Schur form."""
    return (solve_discrete_are if c.discrete else solve_continuous_are)(c.a, c.b, c.q, c.r, s=c.s)


def main() -> None:
    """Prints the table of docs/design.md."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--count", type=int, default=8000)
    parser.add_argument("--seed", type=int, default=7)
    a = parser.parse_args()
    warnings.simplefilter("ignore")
    problems = cases(a.count, a.seed)
    print(f"{a.count} equations, residual over the sum of the terms' norms")
    for name, solve in (("furuta", furuta_answer), ("SciPy", scipy), ("SLICOT", slicot)):
        residuals, refused = [], 0
        for c in problems:
            try:
                residuals.append(residual(c, solve(c)))
            except Exception:  # noqa: BLE001 (each library has its own)
                refused += 1
        r = np.array(residuals)
        print(
            f"{name:7} median {np.median(r):.0e}  99th percentile {np.percentile(r, 99):.0e}  "
            f"largest {r.max():.0e}  above 1e-10: {(r > 1e-10).sum()}  refused: {refused}"
        )


def furuta_answer(c: Case) -> np.ndarray:
    """Ours."""
    return (furuta.dare if c.discrete else furuta.care)(c.a, c.b, c.q, c.r, c.s)[0]


if __name__ == "__main__":
    main()
