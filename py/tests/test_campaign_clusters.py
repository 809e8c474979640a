"""Campaigns on a Ray and a Dask cluster of two workers, one of which is killed in the middle.

Skipped where Ray or Dask is not installed: `make test-clusters` installs both.
"""

from __future__ import annotations

import os
import pathlib

import furuta
import pytest
from campaign_work import Killer, draw, slowly

pytest.importorskip("pyarrow")

CASES = 300
PATHS = os.pathsep.join([str(pathlib.Path(__file__).parent), str(pathlib.Path(furuta.__file__).parents[1])])


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

    killer, rows, told = Killer(tmp_path, CASES), [], []
    table = furuta.campaign(
        slowly,
        killer.marks,
        out=tmp_path / "rows",
        seed=5,
        executor=request.getfixturevalue(cluster),
        on_row=rows.append,
        progress=lambda done, of: told.append((done, of)),
    )
    killer.judge(table)
    assert sorted(row["case"] for row in rows) == list(range(CASES)) and told[-1] == (CASES, CASES)
    assert sorted(pq.read_table(tmp_path / "rows")["case"].to_pylist()) == list(range(CASES))
    assert len(set(table["pid"].to_pylist())) >= 2
    # the same numbers as one case after the other, here
    alone = furuta.campaign(slowly, killer.marks[:20], seed=5, executor="serial")
    assert alone["drawn"].to_pylist() == table["drawn"].to_pylist()[:20]


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
