"""Rigs for `furuta.run`: a simulation without a clock, and one that keeps time."""

from __future__ import annotations

import time

import furuta
import numpy as np

RIG = furuta.Rig.load("qube-servo-2").with_parameters({"arm.viscous": 3e-4, "pendulum.viscous": 5e-5})
DT = 0.002


class Simulated:
    """A simulated rig; `at` maps a call's number, from 0, to what is done in the place of its answer."""

    def __init__(self, rig=RIG, at=None, dt=DT):
        self.plant = furuta.Simulator(rig, [0, np.pi, 0, 0], dt)
        self.at, self.volts, self.events = at or {}, [], []

    def exchange(self, volts):
        self.volts.append(volts)
        reading = self.plant.reading
        self.plant.step(volts)
        act = self.at.get(len(self.volts) - 1)
        answer = tuple(reading) if act is None else act(*reading)
        self.events.append("exchanged")
        return answer


class WithOff(Simulated):
    """The same, which can be switched off without being read."""

    def off(self):
        self.events.append("off")


class RealTime(Simulated):
    """The same, which waits for its next sample."""

    begun = None

    def exchange(self, volts):
        self.begun = time.perf_counter() if self.begun is None else self.begun
        time.sleep(max(self.begun + self.plant.t - time.perf_counter(), 0.0))
        return super().exchange(volts)


def late(seconds):
    """Waits, then answers."""

    def act(theta, alpha):
        time.sleep(seconds)
        return theta, alpha

    return act


def raising(error):
    def act(theta, alpha):
        raise error

    return act


def saying(value):
    return lambda theta, alpha: value
