"""Rotary inverted pendulum (Furuta pendulum): model, control design, and the diagnosis of what a model is missing.

SI units and radians everywhere. State x = [theta, alpha, theta_dot, alpha_dot]: theta the arm's angle, alpha the pendulum's angle from
UPRIGHT (0 up, pi hanging); u the motor command in volts, held from one sample to the next.

>>> import numpy as np, furuta
>>> rig = furuta.Rig.load("qube-servo-2")
>>> A, B = furuta.linearize(rig)
>>> K, S, poles = furuta.lqr(A, B, np.diag([5, 1, 0.1, 0.1]), [[0.1]])
>>> bool((poles.real < 0).all())
True
"""

from furuta._furuta import (
    Controller,
    ControllerError,
    DesignError,
    DiagnoseError,
    Diagnosis,
    Estimator,
    FurutaError,
    RecordingError,
    Rig,
    RigError,
    SignalError,
    SimulationError,
    __version__,
    arm_step,
    care,
    catalogue,
    controllability,
    controllers,
    dare,
    diagnose,
    dlqe,
    dlqr,
    largest_sine,
    linearize,
    lqe,
    lqi,
    lqr,
    measure,
    place,
    ramos_velasco,
    ramos_velasco_draws,
    region_of_attraction,
    shahzad2022,
    signal,
    simulate,
    simulate_batch,
    steady_motion,
    zero_order_hold,
)

__all__ = [
    "Controller",
    "ControllerError",
    "DesignError",
    "DiagnoseError",
    "Diagnosis",
    "Estimator",
    "FurutaError",
    "RecordingError",
    "Rig",
    "RigError",
    "SignalError",
    "SimulationError",
    "__version__",
    "arm_step",
    "care",
    "catalogue",
    "controllability",
    "controllers",
    "dare",
    "diagnose",
    "dlqe",
    "dlqr",
    "largest_sine",
    "linearize",
    "lqe",
    "lqi",
    "lqr",
    "measure",
    "place",
    "ramos_velasco",
    "ramos_velasco_draws",
    "region_of_attraction",
    "shahzad2022",
    "signal",
    "simulate",
    "simulate_batch",
    "steady_motion",
    "zero_order_hold",
]
