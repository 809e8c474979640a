"""Figures, one call each, with matplotlib.

Every function takes `ax=`, to draw into axes that are there, and returns the figure; `animation` returns the animation.
No window opens and no global state changes; a notebook shows the figure that is returned.

>>> import numpy as np, furuta
>>> run = furuta.Trajectory.simulate("qube-servo-2", [0, np.pi - 1, 0, 0], np.zeros(500), 0.002)
>>> figure = furuta.plot.phase_portrait(run)
>>> figure.savefig("phase.png")
"""

from furuta.plot._animation import animation
from furuta.plot._before_after import before_after
from furuta.plot._bode import bode
from furuta.plot._evidence import evidence
from furuta.plot._gap import gap_map
from furuta.plot._margins import margins, nyquist
from furuta.plot._phase import phase_portrait
from furuta.plot._region import region_of_attraction
from furuta.plot._time import trajectory
from furuta.plot._torque import missing_torque

__all__ = [
    "animation",
    "before_after",
    "bode",
    "evidence",
    "gap_map",
    "margins",
    "missing_torque",
    "nyquist",
    "phase_portrait",
    "region_of_attraction",
    "trajectory",
]
