"""Colours and lines that the figures share; the colours are those of the reports."""

from __future__ import annotations

from typing import Any

MEASURED, BEFORE, AFTER, FLOOR, FAINT = "#23282e", "#d9730d", "#1f6fd6", "#2f9e6e", "#8d959e"
DASHED: Any = (0, (4, 2))
PARTS = {"theta": "arm", "alpha": "pendulum"}
ANGLES = ("arm, theta [rad]", "pendulum, alpha [rad]")
