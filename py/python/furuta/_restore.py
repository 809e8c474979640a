"""What pickle calls to make objects again that are made with keyword arguments."""

from __future__ import annotations

from typing import Any

from furuta._furuta import Estimator, Rig


def estimator(kind: str, rig: Rig, dt: float, settings: dict[str, Any]) -> Estimator:
    """An estimator before its first sample."""
    return Estimator(kind, rig, dt, **settings)
