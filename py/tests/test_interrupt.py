"""Ctrl-C ends every call that takes long. What was begun goes on unseen to its end, so that none is longer than some
seconds."""

from __future__ import annotations

import os
import signal
import threading

import furuta
import numpy as np
import pytest

RIG = furuta.Rig.load("qube-servo-2")
DT = 0.002


def recording(seconds=20.0):
    t = DT * np.arange(int(seconds / DT))
    u = furuta.signal("multisine", seconds, DT, amplitude=1.5)
    x, y = furuta.simulate(RIG.with_effect("arm.coulomb"), [0, np.pi, 0, 0], u[:-1], DT, encoders=True)
    return {"t": t, "u": u, "theta": y[:, 0], "alpha": y[:, 1]}


LONG = {
    "simulate": lambda: furuta.simulate(RIG, [0, 3, 0, 0], np.zeros(10_000_000), 1e-4),
    "controller": lambda: furuta.simulate(
        "shahzad2022-srv02",
        [0, 3, 0, 0],
        np.zeros(5_000_000),
        DT,
        controller=furuta.Controller.from_toml("", "shahzad2022-srv02", DT),
    ),
    "callable": lambda: furuta.simulate(RIG, [0, 3, 0, 0], np.zeros(5_000_000), DT, controller=lambda t, x: 0.0),
    "calibrate": lambda: furuta.calibrate([{**DATA, "theta": DATA["theta"] + 0.1 * k} for k in range(8)], RIG),
    "plan": lambda: furuta.plan_experiment(RIG, rate=5000.0),
    "region": lambda: furuta.region_of_attraction(RIG, furuta.Controller.from_toml("", RIG, DT), points=201),
    "arm_step": lambda: furuta.arm_step(RIG, duration=500.0),
    "compare": lambda: [furuta.compare("fong2014", "fong2014-emecs") for _ in range(50)],
    "fit": lambda: [furuta.fit_transfer_function(furuta.frf(DATA)) for _ in range(50)],
    "draws": lambda: furuta.papers.ramos_velasco_draws(draws=2000),
    "batch": lambda: furuta.simulate_batch(RIG, np.zeros((4000, 4)), np.zeros(20_000), DT),
}
DATA = recording()


def test_progress_of_a_region():
    told = []
    controller = furuta.Controller.from_toml("", RIG, DT)
    furuta.region_of_attraction(RIG, controller, points=41, progress=lambda done, of: told.append((done, of)))
    assert told and all(of == 1681 and 0 < done <= of for done, of in told)

    def stop(done, of):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        furuta.region_of_attraction(RIG, controller, points=201, progress=stop)


@pytest.mark.parametrize("what", LONG)
def test_ctrl_c(what, interruptible):
    timer = threading.Timer(0.4, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            LONG[what]()
    finally:
        timer.cancel()
