"""Maps of regions of attraction."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from furuta._furuta import region_of_attraction as computed
from furuta.plot._axes import axes
from furuta.plot._style import AFTER

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def region_of_attraction(*region: Any, ax: Any = None, **keywords: Any) -> Figure:
    """Draws from which angles and speeds of the pendulum a controller brings it upright.

    Parameters
    ----------
    *region
        A rig and a controller, or the three arrays that `furuta.region_of_attraction` returned.
    ax : matplotlib.axes.Axes, optional
    **keywords
        alpha, speed, points, progress, for `furuta.region_of_attraction`.

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> import furuta
    >>> rig = furuta.Rig.load("shahzad2022-srv02")
    >>> lqr = furuta.Controller.from_toml("", rig, dt=0.002)
    >>> figure = furuta.plot.region_of_attraction(rig, lqr, points=9)
    """
    from matplotlib.colors import ListedColormap

    if len(region) == 1 and isinstance(region[0], tuple):
        region = region[0]
    if len(region) == 2:
        region = computed(*region, **keywords)
    elif keywords:
        raise TypeError(f"{', '.join(keywords)}: only with a rig and a controller")
    if len(region) != 3:
        raise TypeError("a rig and a controller, or alpha, alpha_dot and inside, are expected")
    alpha, alpha_dot, inside = (np.asarray(part) for part in region)
    figure, (one,) = axes(ax, 1, (6, 5), "furuta.plot.region_of_attraction")
    one.pcolormesh(alpha, alpha_dot, inside, cmap=ListedColormap(["#eeeeee", AFTER]), vmin=0, vmax=1)
    one.set_xlabel("alpha [rad]")
    one.set_ylabel("alpha_dot [rad/s]")
    one.set_title(f"upright again from {100 * np.mean(inside):.0f} % of these starts (blue)", fontsize=10, loc="left")
    return figure
