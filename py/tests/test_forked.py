"""A process that was forked from one that has worked on several threads works, too."""

from __future__ import annotations

import multiprocessing
import subprocess
import sys
import textwrap

import pytest

WORK = textwrap.dedent("""
    import multiprocessing
    import furuta, numpy as np

    X0 = np.tile([0, 3.0, 0, 0], (200, 1))

    def batch():
        return furuta.simulate_batch("qube-servo-2", X0, np.zeros(500), 0.002).sum()

    def large_batch():
        return furuta.simulate_batch("qube-servo-2", X0, np.zeros(20_000), 0.002).sum()

    def stepped():
        return furuta.BatchSimulator("qube-servo-2", X0, 0.002).step(np.zeros(200), 500).sum()

    def planned():
        return furuta.plan_experiment("qube-servo-2", free="arm.inertia", rate=100.0, experiments=1).sequence

    def answer(work, queue):
        queue.put(work())

    context = multiprocessing.get_context("fork")
    for work in (batch, large_batch, stepped, planned):
        here, queue = work(), context.SimpleQueue()
        for _ in range(2):
            child = context.Process(target=answer, args=(work, queue))
            child.start()
            child.join(60)
            assert child.exitcode == 0, (work.__name__, child.exitcode)
            assert queue.get() == here, work.__name__
    print("all the same")
""")


@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="no fork on this system")
def test_a_forked_process_works(tmp_path):
    (tmp_path / "work.py").write_text(WORK)
    done = subprocess.run([sys.executable, tmp_path / "work.py"], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0 and "all the same" in done.stdout, done.stderr
