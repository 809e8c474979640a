"""What draws rigs at random, about what is known of one."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from furuta._furuta import Calibration, Diagnosis, Rig, RigError, catalogue

Randomize = Literal["tolerance"] | Mapping[str, float] | Calibration | Diagnosis | Callable[[np.random.Generator], Rig]
# The most standard deviations by which a number of a rig varies.
_FARTHEST = 3.0


def draws_of(randomize: Randomize | None, rig: Rig) -> Callable[[np.random.Generator], Rig]:
    """What draws the rig of an episode.

    Parameters
    ----------
    randomize : "tolerance", dict, Calibration, Diagnosis, callable or None
        "tolerance": the rig's numbers, each within the tolerance of its file. A dict: standard deviations by
        parameter, as shares of the values, at least 0; None and 0 leave a parameter as it is. A Calibration: its
        rig, with the covariance of its fit. A Diagnosis: its repaired rig, with effects that it could not exclude, up
        to their limits. A callable: takes the generator, gives a Rig. None: the rig.
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
    if unknown := sorted(str(name) for name in set(shares) - set(rig.parameters)):
        raise ValueError(f"randomize: {', '.join(unknown)}: no parameters of a rig; see Rig.parameters")
    stated = {name: _share(name, share) for name, share in shares.items() if share is not None}
    known = {name: share for name, share in stated.items() if rig.parameters[name] != 0}
    if randomize != "tolerance":
        _check_farthest(rig, known)

    def draw(rng: np.random.Generator) -> Rig:
        away = np.clip(rng.standard_normal(len(known)), -_FARTHEST, _FARTHEST)
        return _moved(rig, known, away)

    return draw


def _share(name: str, given: Any) -> float:
    """A standard deviation as a share of a parameter's value."""
    try:
        share = math.nan if isinstance(given, (bool, str, bytes)) or np.ndim(given) else float(given)
    except (TypeError, ValueError, OverflowError):
        share = math.nan
    if not 0 <= share < math.inf:
        raise ValueError(
            f"randomize: {name} = {given!r} must be a finite number, at least 0: "
            "a standard deviation as a share of the value (0.05: 5 %)"
        )
    return share


def _moved(rig: Rig, shares: Mapping[str, float], away: ArrayLike) -> Rig:
    """The rig with each of these parameters `away` standard deviations from its value."""
    with np.errstate(over="ignore"):  # infinite is refused, by its name
        factors = np.exp(np.asarray(away) * list(shares.values()))
    values = {name: rig.parameters[name] * float(factor) for name, factor in zip(shares, factors)}
    if "motor.efficiency" in values:
        values["motor.efficiency"] = min(values["motor.efficiency"], 1.0)
    return rig.with_parameters(values)


def _check_farthest(rig: Rig, shares: Mapping[str, float]) -> None:
    """Each parameter alone must be one of a rig's as far away as it is ever drawn."""
    for name, share in shares.items():
        for away in (-_FARTHEST, _FARTHEST):
            try:
                _moved(rig, {name: share}, [away])
            except RigError as e:
                raise ValueError(
                    f"randomize: {name} = {share:g} is too large a share: "
                    f"{_FARTHEST:g} standard deviations away, where draws end, {e}"
                ) from e


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
