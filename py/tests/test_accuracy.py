"""The order of RK4 and its error at 1 ms, as docs/accuracy.md tabulates them."""

from __future__ import annotations

import pathlib

import furuta
import pytest
from accuracy import PERIODS, STARTS, error, order

TABLE = pathlib.Path(__file__).resolve().parents[2] / "docs/accuracy.md"

# Largest error of an angle over 10 s at 1 ms, rad: three times what is seen. The falling heavy pendulum of
# ramos-velasco multiplies a small difference by 2800.
BOUND = {"falling": 6e-9, "hanging": 1.2e-9}
HEAVY = {"falling": 1e-6, "hanging": 4e-8}


@pytest.mark.parametrize("start", STARTS)
@pytest.mark.parametrize("name", furuta.Rig.VOLTAGE)
def test_fourth_order(name, start):
    errors = {period: error(name, start, period) for period in PERIODS}
    bound = (HEAVY if name == "ramos-velasco" else BOUND)[start]
    assert errors[1e-3][:2].max() < bound
    orders = [order(errors[h].max(), errors[fine].max(), h / fine) for fine, h in zip(PERIODS[:-1], PERIODS[1:])]
    seen = [p for p in orders if p is not None]
    print(name, start, [f"{p:.2f}" for p in seen])
    assert len(seen) >= 3  # the rest is rounding
    assert min(seen) >= 3.8


def test_the_table_is_of_these_rigs():
    text = TABLE.read_text()
    for name in furuta.Rig.VOLTAGE:
        for start in STARTS:
            assert text.count(f"| {name} | {start} |") == len(PERIODS)
