"""Where tasks are worked on: what the driver asks of every kind of pool, and the processes of this machine."""

from __future__ import annotations

import contextlib
import json
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
from typing import Any, NamedTuple, Protocol

from furuta._campaign import _worker
from furuta._campaign._error import CampaignError
from furuta._campaign._task import Task, load_and_run


class Done(NamedTuple):
    """A task that came back, with its rows, or with why its worker was lost."""

    number: int
    rows: list[dict[str, Any]] | None
    lost: str | None = None


class Pool(Protocol):
    """Workers. Each task that was put in comes back once, done or lost."""

    def room(self) -> int:
        """How many tasks it is to have at a time."""
        ...

    def put(self, number: int, task: Task) -> None:
        """Begins a task, some time."""
        ...

    def take(self, patience: float) -> list[Done]:
        """What has come back, within this number of seconds; `CampaignError` where no worker can load the function."""
        ...

    def close(self) -> None:
        """Ends every worker at once."""
        ...


class Serial:
    """No worker at all: one case after the other, in the calling thread."""

    def __init__(self, work: bytes) -> None:
        self.work, self.waiting = work, list[tuple[int, Task]]()

    def room(self) -> int:
        return 1

    def put(self, number: int, task: Task) -> None:
        self.waiting.append((number, task))

    def take(self, patience: float) -> list[Done]:
        number, task = self.waiting.pop(0)
        return [Done(number, loaded(load_and_run(self.work, task)))]

    def close(self) -> None:
        self.waiting.clear()


def loaded(rows: list[dict[str, Any]] | str) -> list[dict[str, Any]]:
    """The rows, where the function could be loaded."""
    if isinstance(rows, str):
        raise CampaignError(
            f"a worker cannot load the function: {rows}; its module must be importable there, "
            "and furuta, and what the function imports, be installed"
        )
    return rows


BOOT = "import sys, json; sys.path[:] = json.loads(sys.argv.pop()); from furuta._campaign._worker import main; main()"
STILLBORN = 3
"""At most this number of workers in a row may die before they are ready."""
THREADS = ("RAYON_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def cores() -> int:
    """How many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class _Process:
    """A worker process and the thread that talks to it."""

    def __init__(self, work: bytes, environment: dict[str, str], answers: queue.Queue[tuple[_Process, Any]]) -> None:
        # A session of its own: Ctrl-C is the driver's, and what the worker starts ends with it.
        self.process = subprocess.Popen(
            [sys.executable, "-c", BOOT, json.dumps(sys.path)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=environment,
            start_new_session=os.name != "nt",
        )
        self.task: tuple[int, Task] | None = None
        self.ready = False
        self.answers = answers
        self.tasks: queue.Queue[bytes | None] = queue.Queue()
        self.tasks.put(work)
        threading.Thread(target=self._talk, daemon=True).start()

    def _talk(self) -> None:
        process = self.process
        while (content := self.tasks.get()) is not None:
            answer = self._answer(content)
            if answer is None:
                code = process.wait()
                self.answers.put((self, f"ended by signal {-code}" if code < 0 else f"ended with code {code}"))
                break
            self.answers.put((self, answer))
        for pipe in (process.stdin, process.stdout):
            with contextlib.suppress(OSError):
                if pipe is not None:
                    pipe.close()
        process.wait()

    def _answer(self, content: bytes) -> bytes | None:
        assert self.process.stdin is not None and self.process.stdout is not None
        try:
            _worker.send(self.process.stdin, content)
            return _worker.receive(self.process.stdout)
        except (OSError, ValueError):
            return None

    def kill(self) -> None:
        """Ends it and what it has started."""
        self.tasks.put(None)
        if os.name == "nt":
            self.process.kill()
            return
        try:
            os.killpg(self.process.pid, signal.SIGKILL)
        except (ProcessLookupError, PermissionError):
            pass


class Processes:
    """Worker processes of this machine. One that dies takes its own task alone with it, and is replaced.

    They are started by their program's name, not forked: threads of the driver, and a script without
    `if __name__ == "__main__"`, are no matter.
    """

    def __init__(self, work: bytes, workers: int) -> None:
        self.work = work
        self.answers: queue.Queue[tuple[_Process, Any]] = queue.Queue()
        share = str(max(1, cores() // workers))
        self.environment = {**dict.fromkeys(THREADS, share), **os.environ}
        self.waiting: list[tuple[int, Task]] = []
        self.stillborn = 0
        """How many have died before their first task since one was ready."""
        self.workers = [self._start() for _ in range(workers)]

    def _start(self) -> _Process:
        return _Process(self.work, self.environment, self.answers)

    def room(self) -> int:
        return 2 * len(self.workers)  # none waits while the driver writes

    def put(self, number: int, task: Task) -> None:
        self.waiting.append((number, task))
        self._give()

    def _give(self) -> None:
        import cloudpickle  # type: ignore

        for worker in self.workers:
            if self.waiting and worker.ready and worker.task is None:
                worker.task = self.waiting.pop(0)
                worker.tasks.put(cloudpickle.dumps(worker.task[1]))

    def take(self, patience: float) -> list[Done]:
        found: list[Done] = []
        try:
            found += self._heard(*self.answers.get(timeout=patience))
            while True:
                found += self._heard(*self.answers.get_nowait())
        except queue.Empty:
            pass
        self._give()
        return found

    def _heard(self, worker: _Process, answer: bytes | str) -> list[Done]:
        task, worker.task = worker.task, None
        if isinstance(answer, str):  # it died
            self.stillborn += not worker.ready
            if self.stillborn > STILLBORN:
                raise CampaignError(f"{self.stillborn} workers did not start: {sys.executable} {answer}")
            self.workers[self.workers.index(worker)] = self._start()
            return [] if task is None else [Done(task[0], None, answer)]
        content = pickle.loads(answer)
        if task is None:
            loaded([] if content is None else content)
            worker.ready, self.stillborn = True, 0
            return []
        return [Done(task[0], content)]

    def close(self) -> None:
        for worker in self.workers:
            worker.kill()
