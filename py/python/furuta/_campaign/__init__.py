"""`campaign`: a function, or a diagnosis, a simulation, a study, of thousands of cases, here or on a cluster."""

from __future__ import annotations

import json
import os
import pathlib
import time
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from furuta._campaign import _identity
from furuta._campaign._error import CampaignError
from furuta._campaign._folder import Folder, arrow, kinds_of
from furuta._campaign._kinds import KINDS, Kind
from furuta._campaign._pool import Pool, Processes, Serial, cores
from furuta._campaign._progress import Shield, teller
from furuta._campaign._rows import Columns
from furuta._campaign._task import Task
from furuta._furuta import __version__

if TYPE_CHECKING:
    from pyarrow import Schema as _Schema  # type: ignore
    from pyarrow import Table as _Table  # type: ignore

__all__ = ["CampaignError", "campaign"]

PATIENCE = 0.03
"""How often Ctrl-C is looked for, s."""
WRITE = 1.0
"""Rows are written so often, s, and less often the longer it takes: after 1 % of the time so far."""
GRAIN = {"processes": 0.2, "cluster": 1.0}
"""How long a task is to be, s: cases that are shorter go to a worker several at a time."""
LONGEST_INPUT = 2000
"""Characters; of longer cases the column `input` holds the digest."""


def campaign(
    work: Callable[..., Any] | Literal["diagnose", "simulate", "study"],
    cases: Iterable[Any] | int,
    *,
    out: str | os.PathLike[str] | None = None,
    seed: int = 0,
    executor: Any = None,
    workers: int | None = None,
    retries: int = 2,
    again: bool = False,
    schema: _Schema | None = None,
    progress: bool | Callable[[int, int], object] | None = None,
    on_row: Callable[[dict[str, Any]], object] | None = None,
) -> _Table:
    """Computes a row for each of many cases: on all cores of this machine, or on a Ray or Dask cluster.

    Rows are written to the folder `out` while they come. The same call on the same folder computes what is not there.
    A case that raises has its error in its row; the others go on. It needs `pip install "furuta[campaign]"`.

    Parameters
    ----------
    work : callable, or "diagnose", "simulate", "study"
        What gives the row of a case: `work(case)`, or `work(case, rng=...)` where it has a parameter `rng`, a
        numpy.random.Generator. It returns a dict of None, numbers, text, and lists, arrays and dicts of these (nested
        ones become JSON text); a single number or text is the column `value`. Lambdas and functions of a notebook
        will do. For the three words, which need no function, see Notes.
    cases : iterable or int
        What the function is called with, each once. A number N stands for range(N).
    out : path, optional
        Folder of Parquet files. Without it, rows are in memory alone.
    seed : int, optional
        Case k has the generator of child k of `numpy.random.SeedSequence(seed)`: whoever computes it, and when.
    executor : str or distributed.Client, optional
        Where: the processes of this machine if not given; "serial" for the calling thread, as debuggers want it;
        "ray://host:port", "auto" (a running cluster) or "ray" (one on this machine, made and ended) for Ray;
        "dask://host:port" or a client for Dask. `furuta` and the function's module must be installed on a cluster.
    workers : int, optional
        How many processes here; one for each core if not given.
    retries : int, optional
        How often a case is begun again whose worker died: killed, out of memory, crashed. Then that is its error.
    again : bool, optional
        Compute the cases whose row in `out` is an error again.
    schema : pyarrow.Schema, optional
        Columns and their types. If not given, the rows show them; a row that does not fit those before is an error.
    progress : bool or callable, optional
        True: a bar on standard error. A callable hears how many rows are there and how many there will be, in the
        calling thread; an exception that it raises ends the call.
    on_row : callable, optional
        Called with each row that comes, as a dict, in the calling thread.

    Returns
    -------
    pyarrow.Table
        One row a case, in their order. Columns `case` (its place, from 0), `input` (the case as JSON, large arrays by
        their digest), `error` and `traceback` (empty where there is none), `seconds` (of computing; no other column
        depends on the machine), then those of the rows.

    Raises
    ------
    CampaignError
        The folder holds another campaign (what differs is said; cases may be added at the end), or is in use; a case
        of "diagnose", "simulate" or "study" with an entry that does not exist; a function that workers cannot load.
    ImportError
        pyarrow, Ray or Dask is not installed.

    Notes
    -----
    Ctrl-C raises KeyboardInterrupt within 0.1 s, on a cluster once its tasks are cancelled; rows that had come by then
    are in the folder.

    A case of "diagnose" has `rig`, `recordings`, and options of `furuta.diagnose` (`time_limit` is None if not given).
    A case of "simulate" has `rig`, and may have `parameters`, `effects` (as of `with_parameters`, `with_effect`),
    `vary` (draws the rig: see `furuta.gym.draws_of`), `x0`, `dt`, `seconds`, and one of `u` (a voltage, or an array),
    `gain` (u = -gain (x - reference) from true states), `controller` (a Controller, a path, or "standard"), with
    `reference` (of the arm, rad). A case of "study" has `study` ("swing-up", "region", "calibration", ...), `rig`, and
    options of `furuta study` of the command line (the program that FURUTA_CLI names, else `python -m furuta`).

    Examples
    --------
    >>> import numpy as np, furuta
    >>> sheet, sweep = "qube-servo-2", np.linspace(0.02, 0.03, 5)
    >>> cases = [{"rig": sheet, "parameters": {"pendulum.mass": m}, "u": 0.5, "seconds": 1} for m in sweep]
    >>> table = furuta.campaign("simulate", cases, executor="serial")
    >>> table.num_rows, bool(np.all(np.diff(table["theta"].to_numpy()) < 0))  # the heavier, the slower the arm
    (5, True)
    >>> def fall(case, rng):
    ...     x = furuta.simulate(sheet, [0, rng.normal(0, 0.01), 0, 0], np.zeros(500), 0.002)
    ...     return {"lean": abs(x[:, 1]).max()}
    >>> draws = furuta.campaign(fall, 20, seed=1, executor="serial")
    >>> draws["lean"].to_pylist() == furuta.campaign(fall, 20, seed=1, executor="serial")["lean"].to_pylist()
    True
    """
    arrow()
    kind = _kind_of(work)
    listed: list[Any] = list(range(cases) if isinstance(cases, (int, np.integer)) else cases)
    if kind is not None:
        for k, given in enumerate(listed):
            kind.check(k, given)
    columns = Columns(kind.columns, fixed=True) if kind is not None else Columns()
    if schema is not None:
        columns = Columns(kinds_of(schema), fixed=True)
    known = [_identity.case(given, kind.name if kind is not None else None) for given in listed]
    about = {
        "format": 1,
        "version of furuta": __version__,
        "seed": seed,
        "work": {"name": kind.name} if kind is not None else _identity.function(work),  # type: ignore[arg-type]
        "cases": [_identity.digest(one) for one in known],
    }
    load = _pickled(kind if kind is not None else work)
    folder = Folder(None if out is None else pathlib.Path(out), about, columns)
    try:
        there = folder.done()
        if again and (failed := {case for case, error in there.items() if error is not None}):
            folder.forget(failed)
            there = folder.done()
        todo = [case for case in range(len(listed)) if case not in there]
        driver = _Driver(folder, listed, known, todo, seed, retries, on_row)
        with teller(progress, len(listed)) as tell:
            tell(len(there))
            if todo:
                driver.run(lambda: _pool_of(executor, workers, load, len(todo)), _grain(executor), tell)
        return folder.table()
    finally:
        folder.close()


def _kind_of(work: Any) -> Kind | None:
    if isinstance(work, str):
        if work not in KINDS:
            raise CampaignError(f"{work!r} is no kind of campaign: {', '.join(map(repr, KINDS))}, or a function")
        return KINDS[work]
    if not callable(work):
        raise CampaignError(f"a campaign is made by a function or one of {', '.join(map(repr, KINDS))}, not {work!r}")
    return None


def _pickled(work: Any) -> bytes:
    try:
        import cloudpickle  # type: ignore
    except ImportError as e:
        raise ImportError('furuta.campaign needs cloudpickle: pip install "furuta[campaign]"') from e
    try:
        return cloudpickle.dumps(work)
    except Exception as e:
        raise CampaignError(f"the function cannot go to a worker, for it cannot be pickled: {e}") from e


def _grain(executor: Any) -> float:
    return GRAIN["processes" if executor in (None, "processes", "serial") else "cluster"]


def _pool_of(executor: Any, workers: int | None, load: bytes, count: int) -> Pool:
    if workers is not None and workers < 1:
        raise CampaignError(f"workers = {workers}: at least 1")
    if executor is None or executor == "processes":
        return Processes(load, min(workers or cores(), count))
    if workers is not None:
        raise CampaignError("workers is the number of processes here; with an executor, the cluster decides")
    if executor == "serial":
        return Serial(load)
    from furuta._campaign._clusters import Dask, Ray

    if isinstance(executor, str) and (executor in ("ray", "auto") or executor.startswith("ray://")):
        return Ray(load, executor)
    if (isinstance(executor, str) and executor.startswith("dask://")) or hasattr(executor, "scheduler_info"):
        return Dask(load, executor)
    raise CampaignError(
        f"executor = {executor!r} is none of None, 'serial', 'ray', 'auto', 'ray://host:port', 'dask://host:port', "
        "a distributed.Client"
    )


class _Driver:
    """Hands cases out, takes rows in, and writes them: it alone does."""

    def __init__(
        self,
        folder: Folder,
        given: Sequence[Any],
        known: Sequence[Any],
        todo: Sequence[int],
        seed: int,
        retries: int,
        on_row: Callable[[dict[str, Any]], object] | None,
    ) -> None:
        self.folder, self.given, self.known, self.seed = folder, given, known, seed
        self.retries, self.on_row = retries, on_row
        self.fresh, self.alone = deque(todo), deque[int]()
        """Cases not yet handed out, and those of lost tasks, which go one at a time."""
        self.deaths: dict[int, int] = {}
        self.running: dict[int, list[int]] = {}
        self.seconds: float | None = None
        """Of a case, as the last ones were."""
        self.count = len(given)

    def run(self, make: Callable[[], Pool], grain: float, tell: Callable[[int], None]) -> None:
        """Until every case has its row."""
        begin = written = time.monotonic()
        with Shield() as shield:
            number, there = 0, self.count - len(self.fresh)
            pool: Pool | None = None
            try:
                with shield.open(grain == GRAIN["cluster"]):
                    pool = make()
                while self.fresh or self.alone or self.running:
                    room = pool.room()
                    while len(self.running) < room and (self.fresh or self.alone):
                        self.running[number] = self._next(room, grain)
                        of = self.running[number]
                        pool.put(number, Task(of, [self.given[case] for case in of], self.seed))
                        number += 1
                    with shield.open(isinstance(pool, Serial)):
                        back = pool.take(PATIENCE)
                    shield.check()
                    before = there
                    for done in back:
                        cases = self.running.pop(done.number, [])
                        rows = self._lost(cases, done.lost or "") if done.rows is None else done.rows
                        there += len(rows)
                        for row in rows if cases else []:
                            self._take(row, shield)
                    now = time.monotonic()
                    if now - written > max(WRITE, 0.01 * (now - begin)):
                        self.folder.flush()
                        written = now
                    if there > before:
                        with shield.open():
                            tell(there)
            finally:
                try:
                    self.folder.flush()
                finally:
                    if pool is not None:
                        pool.close()

    def _next(self, room: int, grain: float) -> list[int]:
        """The cases of the next task: enough to outweigh its overhead, few enough that it does not end last."""
        if self.alone:
            return [self.alone.popleft()]
        size = 1 if self.seconds is None else min(int(grain / max(self.seconds, 1e-6)), 1000)
        size = max(1, min(size, len(self.fresh) // (2 * room)))
        return [self.fresh.popleft() for _ in range(size)]

    def _lost(self, cases: list[int], why: str) -> list[dict[str, Any]]:
        """Begins the cases of a lost task again, each alone: the one to blame is known then."""
        if len(cases) > 1:
            self.alone.extend(cases)
            return []
        for case in cases:
            self.deaths[case] = self.deaths.get(case, 0) + 1
            if self.deaths[case] > self.retries:
                text = f"WorkerLost: the worker was lost {self.deaths[case]} times at this case: {why}"
                return [{"case": case, "error": text, "traceback": None, "seconds": None}]
            self.alone.append(case)
        return []

    def _take(self, row: dict[str, Any], shield: Shield) -> None:
        case = row["case"]
        own = {name: row.pop(name) for name in ("case", "error", "traceback", "seconds")}
        if own["seconds"] is not None:
            before = own["seconds"] if self.seconds is None else self.seconds
            self.seconds = 0.8 * before + 0.2 * own["seconds"]
        if own["error"] is None and (misfit := self.folder.columns.take(case, row)) is not None:
            own["error"], row = f"TypeError: {misfit}", {}
        given = json.dumps(self.known[case])
        if len(given) > LONGEST_INPUT:
            given = json.dumps({"digest": _identity.digest(self.known[case])})
        whole = {**own, "input": json.loads(given), **row}
        self.folder.add(whole)
        if self.on_row is not None:
            with shield.open():
                self.on_row(dict(whole))
