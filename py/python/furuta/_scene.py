"""A picture of the rig in a state: arm, pendulum and the arm's reference, as pixels. It needs matplotlib."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from furuta._furuta import Rig

PIXELS, DPI = 400, 100
# From where the rig is looked at: about the vertical, and above the horizon, rad.
AZIMUTH, ELEVATION = 0.5, 0.45
RIGHT = np.array([-np.sin(AZIMUTH), np.cos(AZIMUTH), 0.0])
UP = np.array([-np.sin(ELEVATION) * np.cos(AZIMUTH), -np.sin(ELEVATION) * np.sin(AZIMUTH), np.cos(ELEVATION)])
NEAR = np.cross(RIGHT, UP)


def points(rig: Rig, theta: float, alpha: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Where arm and pendulum end, m: x at theta = 0, z up, the arm's hinge at the origin.

    The pendulum is drawn as a rod whose mass is in its middle.
    """
    length, rod = rig["arm.length"], 2 * rig["pendulum.com"]
    outwards = np.array([np.cos(theta), np.sin(theta), 0.0])
    sideways = np.array([-np.sin(theta), np.cos(theta), 0.0])
    joint = length * outwards
    return joint, joint + rod * (-np.sin(alpha) * sideways + np.cos(alpha) * np.array([0.0, 0.0, 1.0]))


def reach(rig: Rig) -> float:
    """How far the picture goes from the arm's hinge, m."""
    return float(1.15 * np.hypot(rig["arm.length"], 2 * rig["pendulum.com"]))


class Scene:
    """One figure that shows state after state."""

    def __init__(self) -> None:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        figure = Figure(figsize=(PIXELS / DPI, PIXELS / DPI), dpi=DPI)
        self.canvas = FigureCanvasAgg(figure)
        self.axes = figure.add_axes((0, 0, 1, 1))
        self.axes.set_axis_off()
        ends: dict[str, Any] = {"solid_capstyle": "round"}
        (self.circle,) = self.axes.plot([], [], color="0.8", linewidth=1, zorder=0)
        (self.reference,) = self.axes.plot([], [], color="tab:green", linewidth=5, zorder=1, **ends)
        (self.post,) = self.axes.plot([], [], color="0.35", linewidth=14, zorder=2, solid_capstyle="butt")
        (self.arm,) = self.axes.plot([], [], color="0.5", linewidth=8, zorder=3, **ends)
        (self.pendulum,) = self.axes.plot([], [], color="tab:red", linewidth=6, zorder=4, **ends)
        (self.hinge,) = self.axes.plot([], [], "o", color="0.2", markersize=7, zorder=5)

    def draw(self, rig: Rig, x: NDArray[np.float64], reference: float = 0.0) -> NDArray[np.uint8]:
        """Pixels of the rig in state x, the arm's reference marked on its circle: shape (400, 400, 3)."""
        length, rod = rig["arm.length"], 2 * rig["pendulum.com"]
        joint, tip = points(rig, x[0], x[1])
        size = reach(rig)
        self.axes.set_xlim(-size, size)
        self.axes.set_ylim(-size, size)
        turn = np.linspace(0, 2 * np.pi, 73)
        self._line(self.circle, length * np.column_stack([np.cos(turn), np.sin(turn), 0 * turn]))
        mark = np.array([np.cos(reference), np.sin(reference), 0.0])
        self._line(self.reference, np.array([0.85 * length * mark, 1.15 * length * mark]))
        self.reference.set_zorder(7 if NEAR @ mark > 0 else 1)
        self._line(self.post, np.array([[0.0, 0.0, -0.8 * rod], [0.0, 0.0, 0.0]]))
        self._line(self.arm, np.array([0 * joint, joint]))
        self._line(self.pendulum, np.array([joint, tip]))
        self._line(self.hinge, joint[None])
        # Where the arm points away, pendulum and arm are behind the post.
        behind = NEAR @ joint < 0
        near = (self.post, self.arm, self.pendulum, self.hinge)
        for order, line in enumerate((self.pendulum, self.hinge, self.arm, self.post) if behind else near):
            line.set_zorder(2 + order)
        self.canvas.draw()
        return np.asarray(self.canvas.buffer_rgba())[..., :3].copy()

    def _line(self, line: Any, places: NDArray[np.float64]) -> None:
        line.set_data(places @ RIGHT, places @ UP)
