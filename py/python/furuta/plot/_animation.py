"""The pendulum moving: GIF, HTML, MP4."""

from __future__ import annotations

import os
import pathlib
from typing import Any

import numpy as np

from furuta._furuta import Rig
from furuta.plot._axes import new_figure
from furuta.plot._style import AFTER, BEFORE, FAINT, MEASURED

# Where no rig is known: lengths of arm and pendulum, m.
LENGTHS = (0.1, 0.15)


def animation(
    run: Any,
    path: str | os.PathLike[str] | None = None,
    *,
    rig: Rig | None = None,
    fps: float = 25.0,
    speed: float = 1.0,
) -> Any:
    """Draws arm and pendulum moving, and the angles beside them.

    Parameters
    ----------
    run : Trajectory, Recording, DataFrame or mapping of arrays
        With t, theta, alpha.
    path : path, optional
        Where to write it: `.gif`, `.html` (a page with a player, no network needed) or `.mp4` (where ffmpeg is
        installed).
    rig : Rig, optional
        For the lengths of arm and pendulum; the run's own if it has one.
    fps : float, optional
        Pictures a second.
    speed : float, optional
        2: twice as fast as it was.

    Returns
    -------
    matplotlib.animation.FuncAnimation

    Raises
    ------
    ValueError
        Another ending of the path, a number that is not above 0, or a run of fewer than two samples.
    RuntimeError
        `.mp4` without ffmpeg.

    Examples
    --------
    >>> import numpy as np, furuta
    >>> run = furuta.Trajectory.simulate("qube-servo-2", [0, 2, 0, 0], np.zeros(200), 0.002)
    >>> moving = furuta.plot.animation(run, "swing.gif")
    """
    for name, value in [("fps", fps), ("speed", speed)]:
        if not (value > 0 and np.isfinite(value)):
            raise ValueError(f"{name} = {value} must be a finite number above 0")
    ending = None if path is None else pathlib.Path(path).suffix.lower()
    if ending not in (None, ".gif", ".html", ".mp4"):
        raise ValueError(f"{path}: an animation is written as .gif, .html or .mp4")
    t, theta, alpha = (np.asarray(run[name], dtype=float) for name in ("t", "theta", "alpha"))
    if len(t) < 2:
        raise ValueError(f"run is empty: no sample follows the first of {len(t)}, and nothing moves")
    figure = new_figure((8, 4.2), "furuta.plot.animation")
    from matplotlib import animation as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    FigureCanvasAgg(figure)
    if ending == ".mp4" and not mpl.FFMpegWriter.isAvailable():
        raise RuntimeError(f"{path}: MP4 needs ffmpeg, which is not installed; write a .gif or .html")
    rig = rig or getattr(run, "rig", None)
    arm, rod = LENGTHS if rig is None else (rig["arm.length"], 2 * rig["pendulum.com"])
    times = np.arange(t[0], t[-1], speed / fps)
    frames = np.searchsorted(t, times)
    joints = _joints(theta, alpha, arm, rod)
    grid = figure.add_gridspec(2, 2, width_ratios=[1.1, 1])
    scene = figure.add_subplot(grid[:, 0], projection="3d")
    _frame(scene, arm, rod)
    (arm_line,) = scene.plot([], [], [], color=MEASURED, lw=4, solid_capstyle="round")
    (rod_line,) = scene.plot([], [], [], color=AFTER, lw=3, solid_capstyle="round")
    markers = []
    beside = [figure.add_subplot(grid[row, 1]) for row in (0, 1)]
    for ax, angle, label in zip(beside, (theta, alpha), ("theta [rad]", "alpha [rad]")):
        ax.plot(t, angle, color=FAINT, lw=1.0)
        markers.append((ax.plot([], [], "o", color=BEFORE, ms=5)[0], angle))
        ax.set_ylabel(label)
        ax.spines[["top", "right"]].set_visible(False)
    beside[-1].set_xlabel("time [s]")

    # Laid out once, not again for every picture.
    figure.draw_without_rendering()
    figure.set_layout_engine("none")

    def draw(k: int) -> list[Any]:
        hinge, tip = joints[0][k], joints[1][k]
        arm_line.set_data_3d([0, hinge[0]], [0, hinge[1]], [0, hinge[2]])
        rod_line.set_data_3d(*zip(hinge, tip))
        for marker, angle in markers:
            marker.set_data([t[k]], [angle[k]])
        return [arm_line, rod_line, *(marker for marker, _ in markers)]

    moving = mpl.FuncAnimation(figure, draw, frames=list(map(int, frames)), interval=1000 / fps, blit=False)
    if path is not None:
        _write(moving, pathlib.Path(path), ending, fps, mpl)
    return moving


def _joints(theta: Any, alpha: Any, arm: float, rod: float) -> tuple[Any, Any]:
    """Where hinge and tip are, m.

    The arm turns about the vertical, the pendulum in the plane that the arm is normal to.
    """
    along = np.stack([np.cos(theta), np.sin(theta), np.zeros_like(theta)], axis=1)
    across = np.stack([-np.sin(theta), np.cos(theta), np.zeros_like(theta)], axis=1)
    up = np.array([0.0, 0.0, 1.0])
    hinge = arm * along
    return hinge, hinge + rod * (np.sin(alpha)[:, None] * across + np.cos(alpha)[:, None] * up)


def _frame(scene: Any, arm: float, rod: float) -> None:
    reach = arm + rod
    scene.set_xlim(-reach, reach)
    scene.set_ylim(-reach, reach)
    scene.set_zlim(-rod, rod)
    scene.set_box_aspect((2 * reach, 2 * reach, 2 * rod), zoom=1.6)
    scene.plot([0, 0], [0, 0], [-rod, 0], color=FAINT, lw=6)
    scene.set_axis_off()


def _write(moving: Any, path: pathlib.Path, ending: str | None, fps: float, mpl: Any) -> None:
    if ending == ".html":
        head = "<!doctype html>\n<meta charset=utf-8>\n<title>rotary inverted pendulum</title>\n"
        path.write_text(head + moving.to_jshtml(fps=fps), encoding="utf-8")
    elif ending == ".gif":
        moving.save(path, writer=mpl.PillowWriter(fps=fps))
    else:
        moving.save(path, writer=mpl.FFMpegWriter(fps=fps))
