"""Ray and Dask: the same tasks on an existing cluster."""

from __future__ import annotations

import queue
import time
import uuid
from typing import Any

from furuta._campaign._pool import Done, loaded
from furuta._campaign._task import Task, load_and_run

HEED = 2.0
"""How long the size of a cluster is taken as known, s."""


class _Size:
    """How many tasks a cluster is to have at a time: two for each of its cores, as it stands now."""

    def __init__(self) -> None:
        self.known, self.at = 1, -HEED

    def of(self, count: Any) -> int:
        if time.monotonic() - self.at > HEED:
            self.known, self.at = max(1, 2 * int(count())), time.monotonic()
        return self.known


class Ray:
    """A Ray cluster: the one Python is connected to, the one at an address, or a new one on this machine."""

    def __init__(self, work: bytes, address: str) -> None:
        try:
            import ray  # type: ignore
        except ImportError as e:
            raise ImportError(f'executor={address!r} needs Ray: pip install "furuta[ray]"') from e
        self.ray: Any = ray
        self.size = _Size()
        self.mine = not ray.is_initialized()
        if self.mine:
            ray.init(address=None if address == "ray" else address, log_to_driver=False)
        self.work = ray.put(work)
        # A task whose worker died is the campaign's to begin again: it counts how often.
        self.remote = ray.remote(max_retries=0)(load_and_run)
        self.tasks: dict[Any, int] = {}

    def room(self) -> int:
        return self.size.of(lambda: self.ray.cluster_resources().get("CPU", 1))

    def put(self, number: int, task: Task) -> None:
        self.tasks[self.remote.remote(self.work, task)] = number

    def take(self, patience: float) -> list[Done]:
        ready, _ = self.ray.wait(list(self.tasks), num_returns=1, timeout=patience)
        found = []
        for reference in ready:
            number = self.tasks.pop(reference)
            try:
                found.append(Done(number, loaded(self.ray.get(reference))))
            except self.ray.exceptions.RayError as e:
                found.append(Done(number, None, " ".join(str(e).split())[:200] or type(e).__name__))
        return found

    def close(self) -> None:
        for reference in self.tasks:
            self.ray.cancel(reference, force=True)
        self.tasks.clear()
        if self.mine:
            self.ray.shutdown()


class Dask:
    """A Dask cluster, by its client or its scheduler's address.

    Dask begins the task of a worker that died again by itself, as often as its `allowed-failures` says.
    """

    def __init__(self, work: bytes, client: Any) -> None:
        try:
            import distributed  # type: ignore
        except ImportError as e:
            raise ImportError(f'executor={client!r} needs Dask: pip install "furuta[dask]"') from e
        self.mine, self.size = isinstance(client, str), _Size()
        self.client: Any = distributed.Client(client.removeprefix("dask://")) if isinstance(client, str) else client
        self.work = work  # with every task: what is scattered is lost with the worker that holds it
        self.name = f"furuta-{uuid.uuid4().hex[:8]}"
        self.back: queue.Queue[int] = queue.Queue()
        self.tasks: dict[int, Any] = {}

    def room(self) -> int:
        return self.size.of(lambda: sum(self.client.nthreads().values()))

    def put(self, number: int, task: Task) -> None:
        future = self.client.submit(load_and_run, self.work, task, key=f"{self.name}-{number}", pure=False)
        self.tasks[number] = future
        future.add_done_callback(lambda _: self.back.put(number))

    def take(self, patience: float) -> list[Done]:
        found = []
        try:
            found.append(self._result(self.back.get(timeout=patience)))
            while True:
                found.append(self._result(self.back.get_nowait()))
        except queue.Empty:
            return found

    def _result(self, number: int) -> Done:
        future = self.tasks.pop(number)
        try:
            rows = future.result()
        except Exception as e:  # what a case raises is in its row: this is the cluster's
            return Done(number, None, f"{type(e).__name__}: {e}")
        return Done(number, loaded(rows))

    def close(self) -> None:
        self.client.cancel(list(self.tasks.values()), force=True)
        self.tasks.clear()
        if self.mine:
            self.client.close()
