"""Furuta beside other packages, on the same work in one process: writes docs/benchmarks.md.

    make bench-peers
    PYTHONPATH=py/python .venv-peers/bin/python py/bench [--only steps,rollouts] [--rounds 7] [--write PAGE]

One file for each kind of work; `clock.py` measures, `table.py` writes. A package that is not installed is left out, and
the page says so.
"""

from __future__ import annotations

import argparse
import importlib
import os
import pathlib
import platform
import sys

# Small matrices: a library's own threads would wait for work in a loop, and that is processor time. To be said before
# the first import of NumPy.
for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")
os.environ.setdefault("NUMBA_NUM_THREADS", str(os.cpu_count() or 1))
os.environ.setdefault("NUMBA_THREADING_LAYER", "workqueue")
os.environ.setdefault("JAX_PLATFORMS", "cpu")

import clock  # noqa: E402
import table  # noqa: E402

KINDS = ("steps", "rollouts", "riccati", "mpc", "calibration", "response", "environment")
PACKAGES = (
    "numpy", "scipy", "numba", "mujoco", "jax", "diffrax", "control", "slycot", "daqp", "osqp", "clarabel", "piqp",
    "tinympc", "gymnasium",
)  # fmt: skip

INTRODUCTION = """
# Beside other packages: speed

Written by `make bench-peers`, which installs what it needs into `.venv-peers`. All contenders do the same work in one
process, in alternation ({rounds} rounds); each first has to find the same answer within the tolerance of its table
("off by", "allowed"). Times are processor time, all threads together, and medians; a ratio ("over ours") is the median
of the ratios of the rounds: above 1, furuta is faster. Compiling (numba, JAX) and setting up are not counted. **Ratios
count**: the machine, {machine} ({system}, Python {python}), did other work beside, and the absolute times are worth
little elsewhere.

How right a diagnosis is beside other methods: [peers.md](peers.md). Predictive control beside other solvers, and what
the differences come from: [mpc.md](mpc.md#what-it-costs). The hand-written native program is no package: it is what
this machine can do.
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default=",".join(KINDS), help="kinds of work, with commas: " + ", ".join(KINDS))
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--write", type=pathlib.Path, help="the page; without it, tables go to the standard output")
    a = parser.parse_args()
    wanted = a.only.split(",")
    missing = [f"{kind}: was not part of this run." for kind in KINDS if kind not in wanted]
    tables = []
    for kind in wanted:
        module = importlib.import_module(kind)
        made = module.tables(missing, a.rounds) if hasattr(module, "tables") else (
            table.of(work, clock.measure(work, a.rounds)) for work in module.works(missing)
        )  # fmt: skip
        for one in made:
            tables.append(one)
            print(table.markdown(one), "\n", file=sys.stderr, flush=True)
    if missing:
        missing = sorted(set(missing))
        tables.append(table.Table("Left out", "In this run:", ("what",), [[line] for line in missing]))
    introduction = INTRODUCTION.format(
        rounds=a.rounds, machine=table.processor(), system=platform.system(), python=platform.python_version()
    )
    import furuta

    text = table.page(introduction, tables, [("furuta", furuta.__version__), *table.versions(PACKAGES)])
    if a.write:
        a.write.write_text(text)
    else:
        print(text)


if __name__ == "__main__":
    main()
