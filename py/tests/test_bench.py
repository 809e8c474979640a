"""The tool behind docs/benchmarks.md: what it measures with and how it writes, on work that takes no time."""

from __future__ import annotations

import importlib
import pathlib
import runpy
import subprocess
import sys

import numpy as np
import pytest

BENCH = pathlib.Path(__file__).resolve().parents[1] / "bench"


@pytest.fixture
def bench(monkeypatch):
    """Imports the tool's files, which find each other as a program's do."""
    monkeypatch.syspath_prepend(str(BENCH))
    before = set(sys.modules)
    yield importlib.import_module
    for name in set(sys.modules) - before:
        if str(BENCH) in str(getattr(sys.modules[name], "__file__", "")):
            del sys.modules[name]


def ticking(costs):
    """A clock that each call moves on by the cost of what was called before it."""
    state = {"now": 0.0}

    def call(name):
        def run():
            state["now"] += costs[name]
            return [1.0, 2.0]

        return run

    return call, lambda: state["now"]


def test_times_are_medians_in_alternation(bench):
    clock = bench("clock")
    call, now = ticking({"ours": 0.2, "theirs": 0.6})
    order = []

    def logged(name):
        run = call(name)
        return lambda: (order.append(name), run())[1]

    work = clock.Work(
        "w", "", [1.0, 2.0],
        [
            clock.Contender("ours", logged("ours"), lambda x: x),
            clock.Contender("theirs", logged("theirs"), lambda x: np.array(x) + 1e-12, share=0.01),
        ],
    )  # fmt: skip
    ours, theirs = clock.measure(work, 3, now)
    assert order[4:] == ["ours", "theirs"] * 3
    assert ours.seconds == pytest.approx(0.2) and ours.ratio == pytest.approx(1) and ours.error == 0
    assert theirs.seconds == pytest.approx(60) and theirs.ratio == pytest.approx(300)
    assert theirs.error == pytest.approx(1e-12, rel=1e-3)


@pytest.mark.parametrize("wrong", [[1.0, 2.1], [1.0, np.nan], [1.0, 2.0, 3.0]])
def test_who_finds_another_answer_is_not_timed(bench, wrong):
    clock = bench("clock")
    work = clock.Work("w", "", [1.0, 2.0], [clock.Contender("it", lambda: wrong, lambda x: x, 1e-3)])
    with pytest.raises(clock.Disagreement, match="off by|shape"):
        clock.measure(work, 1)


def test_the_page(bench):
    clock, table = bench("clock"), bench("table")
    work = clock.Work("A work", "What it is.", None, [], ["A remark."])
    timed = [clock.Timed("us", 8.13e-7, 1.0, None, None), clock.Timed("a|b", 1.234, 1517.3, 2.2e-11, 1e-9)]
    text = table.page("# Title\n\nBegins.", [table.of(work, timed)], [("numpy", "2.0")])
    assert text == (
        "# Title\n\nBegins.\n\n## Where furuta is slower\n\nNowhere in this run.\n\n## A work\n\nWhat it is.\n\n"
        "|  | processor time | over ours | off by | allowed |\n| --- | ---: | ---: | ---: | ---: |\n"
        "| us | 813 ns | 1.00 |  |  |\n| a\\|b | 1.23 s | 1,517 | 2e-11 | 1e-09 |\n\n- A remark.\n\n"
        "## Versions\n\nWhat was compared.\n\n| package | version |\n| --- | ---: |\n| numpy | 2.0 |\n"
    )
    ahead = [clock.Timed("us", 1.0, 1.0, None, None), clock.Timed("they", 0.3, 0.3, None, None)]
    made = table.page("# T", [table.of(work, [*ahead, clock.Timed("an empty call", 1e-8, 1e-8, None, None)])], [])
    assert "## Where furuta is slower\n\n- A work: they, 0.30 of our time\n\n## A work" in made
    bare = clock.Work("w", "", None, [], count=500)
    made = table.of(bare, [clock.Timed("us", 0.25, 1.0, None, None)])
    assert made.header == ["", "processor time", "over ours", "a second"] and made.rows[0][-1] == "2,000"
    with pytest.raises(ValueError, match="1 cells, the header 2"):
        table.markdown(table.Table("t", "", ("a", "b"), [["x"]]))
    assert [table.duration(s) for s in (2e-9, 9.996e-7, 9.9e-3, 61.0)] == ["2.00 ns", "1.00 us", "9.90 ms", "61.0 s"]
    assert dict(table.versions(["numpy", "no-such-package"])) == {
        "numpy": np.__version__,
        "no-such-package": "not installed",
    }


def test_one_kind_of_work_from_end_to_end(tmp_path):
    pytest.importorskip("scipy")
    page = tmp_path / "page.md"
    command = [sys.executable, BENCH, "--only", "riccati", "--rounds", "1", "--write", page]
    subprocess.run(command, check=True, capture_output=True)
    rows = [line for line in page.read_text().splitlines() if line.startswith("| furuta `")]
    assert [row.split("|")[3].strip() for row in rows] == ["1.00"] * 3


def test_the_page_that_is_kept_names_every_kind_of_work(bench):
    text = (BENCH.parents[1] / "docs" / "benchmarks.md").read_text()
    headings = {
        "steps": ("One RK4 step", "10,000 RK4 steps"),
        "rollouts": ("rollouts",),
        "riccati": ("regulator", "Riccati"),
        "mpc": ("Predictive control",),
        "calibration": ("Six parameters",),
        "response": ("Spectra",),
        "environment": ("Gymnasium",),
    }
    assert tuple(headings) == runpy.run_path(str(BENCH / "__main__.py"))["KINDS"]
    for kind, wanted in headings.items():
        for heading in wanted:
            found = any(line.startswith("## ") and heading in line for line in text.splitlines())
            assert found or f"| {kind}: was not part of this run. |" in text, heading
    assert "| mujoco | " in text and "Versions" in text


def test_the_hand_written_equations_are_the_models(bench):
    """What others are given to simulate is the same rig, by equations written a second time."""
    import furuta

    plant = bench("plant")
    _, step = plant.plain()
    for name in furuta.Rig.VOLTAGE:
        rig = furuta.Rig.load(name)
        c, x, u = plant.coefficients(rig.parameters), np.array([0.1, 2.9, -0.3, 0.4]), 0.3
        commands = np.full(50, u)
        expected = furuta.simulate(rig, x, commands, 1e-3)[-1]
        for u in commands:
            x = np.array(step(*x, u, 1e-3, c))
        assert np.allclose(x, expected, rtol=0, atol=1e-11), name
