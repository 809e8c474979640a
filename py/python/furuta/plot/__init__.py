"""Figures, one call each, with matplotlib. Every function takes `ax=` to draw into axes that are there, and returns the figure.

No window opens and no global state changes; a notebook shows the figure that is returned.

>>> import numpy as np, furuta
>>> run = furuta.Trajectory.simulate("qube-servo-2", [0, np.pi - 1, 0, 0], np.zeros(500), 0.002)
>>> figure = furuta.plot.phase_portrait(run)  # doctest: +SKIP
>>> figure.savefig("phase.png")  # doctest: +SKIP
"""

from furuta.plot._animation import animation
from furuta.plot._bode import bode
from furuta.plot._diagnosis import before_after, evidence, gap_map, missing_torque
from furuta.plot._phase import phase_portrait
from furuta.plot._region import region_of_attraction
from furuta.plot._time import trajectory

__all__ = [
    "animation",
    "before_after",
    "bode",
    "evidence",
    "gap_map",
    "missing_torque",
    "phase_portrait",
    "region_of_attraction",
    "trajectory",
]
