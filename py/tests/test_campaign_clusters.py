"""Campaigns on a Ray and a Dask cluster of two workers, one of which is killed in the middle.

Skipped where Ray or Dask is not installed: `make test-clusters` installs both.
"""

from __future__ import annotations

import os
import pathlib
import signal

import furuta
import pytest
from campaign_work import draw, slowly

pytest.importorskip("pyarrow")

CASES = 300
PATHS = os.pathsep.join([str(pathlib.Path(__file__).parent), str(pathlib.Path(furuta.__file__).parents[1])])


class Killer:
    """Kills the worker of the hundredth row, once."""

    def __init__(self):
        self.rows, self.killed = 0, None

    def __call__(self, row):
        self.rows += 1
        if self.rows == 100 and self.killed is None:
            self.killed = row["pid"]
            os.kill(self.killed, signal.SIGKILL)


@pytest.fixture(scope="module")
def ray():
    ray = pytest.importorskip("ray")
    before = os.environ.get("PYTHONPATH")
    os.environ["PYTHONPATH"] = PATHS + (os.pathsep + before if before else "")
    ray.init(num_cpus=2, log_to_driver=False, include_dashboard=False)
    yield "auto"
    ray.shutdown()
    if before is None:
        del os.environ["PYTHONPATH"]
    else:
        os.environ["PYTHONPATH"] = before


@pytest.fixture(scope="module")
def dask():
    distributed = pytest.importorskip("distributed")
    environment = {"PYTHONPATH": PATHS + os.pathsep + os.environ.get("PYTHONPATH", "")}
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, env=environment
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client


@pytest.mark.parametrize("cluster", ["ray", "dask"])
def test_nothing_is_lost_and_nothing_twice_where_a_worker_is_killed(cluster, request, tmp_path):
    import pyarrow.parquet as pq

    executor = request.getfixturevalue(cluster)
    killer, told = Killer(), []
    marks = [str(tmp_path / f"begun-{case}") for case in range(CASES)]
    out = tmp_path / "rows"
    table = furuta.campaign(
        slowly,
        marks,
        out=out,
        seed=5,
        executor=executor,
        on_row=killer,
        progress=lambda done, of: told.append((done, of)),
    )
    assert killer.killed is not None and killer.rows == CASES
    on_disk = pq.read_table(out)
    assert sorted(on_disk["case"].to_pylist()) == list(range(CASES)) == table["case"].to_pylist()
    assert table["error"].null_count == CASES
    # the worker died amid a case, which was begun again elsewhere
    begun = [pathlib.Path(mark).read_text().split() for mark in marks]
    again = [pids for pids in begun if len(pids) > 1]
    assert again and all(int(pids[0]) == killer.killed for pids in again)
    pids = table["pid"].to_pylist()
    assert pids == [int(of[-1]) for of in begun] and len(set(pids)) >= 2
    # the same numbers as one case after the other, here
    alone = furuta.campaign(slowly, marks[:20], seed=5, executor="serial")
    assert alone["drawn"].to_pylist() == table["drawn"].to_pylist()[:20]
    assert told[-1] == (CASES, CASES)


@pytest.mark.parametrize("cluster", ["ray", "dask"])
def test_a_campaign_goes_on_elsewhere(cluster, request, tmp_path):
    executor = request.getfixturevalue(cluster)
    furuta.campaign(draw, 10, out=tmp_path, executor="serial")
    rows = []
    both = furuta.campaign(draw, 40, out=tmp_path, executor=executor, on_row=rows.append)
    assert sorted(row["case"] for row in rows) == list(range(10, 40))
    assert both["drawn"].to_pylist() == furuta.campaign(draw, 40, executor="serial")["drawn"].to_pylist()


@pytest.mark.parametrize("cluster", ["ray", "dask"])
def test_a_kind_without_a_function(cluster, request):
    executor = request.getfixturevalue(cluster)
    cases = [{"rig": "qube-servo-2", "u": 0.1 * k, "seconds": 0.5} for k in range(6)]
    there = furuta.campaign("simulate", cases, executor=executor).drop_columns("seconds")
    assert there == furuta.campaign("simulate", cases, executor="serial").drop_columns("seconds")
