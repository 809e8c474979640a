"""What draws rigs at random, about what is known of one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Literal

import numpy as np

from furuta._furuta import Calibration, Diagnosis, Rig, catalogue

Randomize = Literal["tolerance"] | Mapping[str, float] | Calibration | Diagnosis | Callable[[np.random.Generator], Rig]


def draws_of(randomize: Randomize | None, rig: Rig) -> Callable[[np.random.Generator], Rig]:
    """What draws the rig of an episode.

    Parameters
    ----------
    randomize : "tolerance", dict, Calibration, Diagnosis, callable or None
        "tolerance": the rig's numbers, each within the tolerance of its file. A dict: standard deviations by
        parameter, as shares of the values. A Calibration: its rig, with the covariance of its fit. A Diagnosis: its
        repaired rig, with effects that it could not exclude, up to their limits. A callable: takes the generator,
        gives a Rig. None: the rig.
    rig : Rig
        What is varied, except of a Calibration or a Diagnosis, which have their own.

    Returns
    -------
    callable
        Takes a numpy.random.Generator, gives a Rig.

    Examples
    --------
    >>> import numpy as np, furuta
    >>> from furuta.gym import draws_of
    >>> draw = draws_of({"pendulum.mass": 0.1}, furuta.Rig.load("qube-servo-2"))
    >>> bool(draw(np.random.default_rng(1))["pendulum.mass"] != 0.024)
    True
    """
    if randomize is None:
        return lambda rng: rig
    if isinstance(randomize, Calibration):
        return _of_calibration(randomize)
    if isinstance(randomize, Diagnosis):
        return _of_diagnosis(randomize)
    if callable(randomize):
        return randomize
    shares = rig.tolerance if randomize == "tolerance" else randomize
    if not isinstance(shares, Mapping):
        raise ValueError(f'randomize = {randomize!r} is none of "tolerance", a dict, Calibration, Diagnosis, callable')
    if unknown := sorted(set(shares) - set(rig.parameters)):
        raise ValueError(f"randomize: {', '.join(unknown)}: no parameters of a rig; see Rig.parameters")
    known = {name: share for name, share in shares.items() if share is not None and rig.parameters[name] != 0}

    def draw(rng: np.random.Generator) -> Rig:
        factors = np.exp(np.clip(rng.standard_normal(len(known)), -3, 3) * list(known.values()))
        values = {name: rig.parameters[name] * float(factor) for name, factor in zip(known, factors)}
        if "motor.efficiency" in values:
            values["motor.efficiency"] = min(values["motor.efficiency"], 1.0)
        return rig.with_parameters(values)

    return draw


def _of_calibration(found: Calibration) -> Callable[[np.random.Generator], Rig]:
    names = [
        name for name in found.fitted if found.parameters[name]["std"] is not None and name in found.rig.parameters
    ]
    places = [found.fitted.index(name) for name in names]
    correlation = np.array(found.correlation, dtype=float)[np.ix_(places, places)]
    std = np.array([found.parameters[name]["std"] for name in names], dtype=float)
    mean = np.array([found.parameters[name]["fitted"] for name in names])

    def draw(rng: np.random.Generator) -> Rig:
        values = mean + std * rng.multivariate_normal(np.zeros(len(names)), correlation, method="eigh")
        least = 1e-3 * mean  # a mass stays a mass
        return found.rig.with_parameters(dict(zip(names, np.maximum(values, least).tolist())))

    return draw


def _of_diagnosis(found: Diagnosis) -> Callable[[np.random.Generator], Rig]:
    repaired, details = found.repaired_rig, catalogue()
    limits = [limit for limit in found.limits if limit["at_most"] is not None and limit["id"] not in repaired.effects]

    def draw(rng: np.random.Generator) -> Rig:
        if not limits:
            return repaired
        limit = limits[rng.integers(len(limits))]  # one at a time: the limits hold beside what is named
        of = details[limit["id"]]["details"][limit["parameter"]]
        value = float(of["off"]) + float(limit["at_most"] or 0) * rng.uniform(-1, 1)
        if not of["min"] < value < of["max"]:  # of one sign
            value = 2 * float(of["off"]) - value
        typical = repaired.with_effect(limit["id"]).effects[limit["id"]]
        return repaired.with_effect(limit["id"], **{**typical, limit["parameter"]: value})

    return draw
