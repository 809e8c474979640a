"""The kinds of campaign that need no function: "diagnose", "simulate", "study"."""

from __future__ import annotations

import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from furuta._campaign._error import CampaignError
from furuta._campaign._task import Task, failure, generator
from furuta._draws import draws_of
from furuta._furuta import Controller, Rig, SimulationError, diagnose, simulate, simulate_batch

NEAR = 0.2
"""As near to upright a pendulum counts as upright, rad."""
HELD = 0.5
"""So long it must have been upright at the end, s."""


def rig_of(given: Any) -> Rig:
    """A rig, its name or the path of its file."""
    return given if isinstance(given, Rig) else Rig.load(given)


class Kind:
    """A kind of campaign: its columns, the entries of its cases."""

    name: str
    needs: tuple[str, ...]
    takes: tuple[str, ...] | None
    columns: Mapping[str, str]

    def check(self, case: int, given: Any) -> None:
        """Refuses a case that no worker could begin."""
        if not isinstance(given, Mapping):
            raise CampaignError(f"case {case}: a case of {self.name!r} is a dict; a {type(given).__name__} was given")
        if missing := [name for name in self.needs if name not in given]:
            raise CampaignError(f"case {case}: a case of {self.name!r} needs {missing[0]!r}")
        unknown = [] if self.takes is None else [name for name in given if name not in (*self.needs, *self.takes)]
        if unknown:
            known = ", ".join((*self.needs, *(self.takes or ())))
            raise CampaignError(f"case {case}: {unknown[0]!r} is no entry of a case of {self.name!r}: it has {known}")


class Diagnose(Kind):
    """`furuta.diagnose` of a rig and its recordings."""

    name = "diagnose"
    needs = ("rig", "recordings")
    takes = ("verify", "plan", "same_zero", "time_limit", "thorough", "every", "span", "accept_suspicious")
    columns = {
        "rig": "text",
        "recordings": "list of text",
        "verdict": "text",
        "names": "list of text",
        "evidence": "json",
        "before_theta": "float",
        "before_alpha": "float",
        "after_theta": "float",
        "after_alpha": "float",
        "best": "text",
        "held_out": "json",
        "suspected": "json",
        "limits": "json",
        "next_experiment": "text",
        "unfinished": "list of text",
        "notices": "list of text",
        "repaired_rig": "text",
    }

    def __call__(self, case: Mapping[str, Any]) -> dict[str, Any]:
        given = dict(case)
        rig, recordings = rig_of(given.pop("rig")), given.pop("recordings")
        # A limit in seconds would make the answer depend on how busy the machine is.
        found = diagnose(recordings, rig, **{"time_limit": None, **given})
        gap = found.gap
        before, after = gap["nominal"], gap["augmented"] or gap["recalibrated"]
        return {
            "rig": rig.name,
            "recordings": list(_names(recordings)),
            "verdict": found.verdict,
            "names": [effect["id"] for effect in found.effects],
            "evidence": found.effects,
            "before_theta": before["theta"],
            "before_alpha": before["alpha"],
            "after_theta": after["theta"],
            "after_alpha": after["alpha"],
            "best": found.best,
            "held_out": found.held_out,
            "suspected": found.suspected,
            "limits": found.limits,
            "next_experiment": found.next_experiment,
            "unfinished": found.unfinished,
            "notices": found.notices,
            "repaired_rig": found.repaired_rig.to_toml(),
        }


def _names(recordings: Any) -> Iterable[str]:
    for k, one in enumerate(recordings if isinstance(recordings, (list, tuple)) else [recordings]):
        path = os.fspath(one) if isinstance(one, (str, os.PathLike)) else None
        yield path or getattr(one, "name", None) or f"recording-{k}"


class _Run(NamedTuple):
    """A simulation that is ready to begin."""

    rig: Rig
    x0: np.ndarray
    u: np.ndarray
    dt: float
    controller: Controller | None
    feedback: tuple[Any, Any, float] | None
    reference: float
    changed: dict[str, Any]


class Simulate(Kind):
    """A run of a rig, under a command or a controller: where it ends, and whether upright."""

    name = "simulate"
    needs = ("rig",)
    takes = ("parameters", "effects", "vary", "x0", "u", "seconds", "dt", "controller", "gain", "reference")
    columns = {
        "rig": "text",
        "changed": "json",
        "theta": "float",
        "alpha": "float",
        "theta_dot": "float",
        "alpha_dot": "float",
        "arm_angle": "float",
        "command": "float",
        "upright": "bool",
        "up_at": "float",
        "mode": "text",
    }

    def check(self, case: int, given: Any) -> None:
        super().check(case, given)
        if sum(given.get(name) is not None for name in ("u", "controller", "gain")) > 1:
            raise CampaignError(f"case {case}: one of 'u', 'controller' and 'gain' moves the rig, not several")

    def begin(self, case: Mapping[str, Any], rng: np.random.Generator) -> _Run:
        """What is to be simulated: the rig drawn and changed, the arrays filled."""
        sheet = rig_of(case["rig"])
        rig = draws_of(case.get("vary"), sheet)(rng)
        rig = rig.with_parameters(dict(case.get("parameters") or {}))
        for id, numbers in (case.get("effects") or {}).items():
            rig = rig.with_effect(id, **dict(numbers))
        dt, seconds = float(case.get("dt", 0.002)), float(case.get("seconds", 5.0))
        x0 = np.asarray(case.get("x0", [0, np.pi, 0, 0]), dtype=float)
        given = case.get("u")
        u = np.asarray(0.0 if given is None else given, dtype=float)
        u = np.full(round(seconds / dt), float(u)) if u.ndim == 0 else u
        if x0.shape != (4,) or u.ndim != 1 or len(u) == 0:
            raise SimulationError(f"x0 has shape {x0.shape} and u {u.shape}: they are (4,) and (N,), N at least 1")
        reference, gain = float(case.get("reference") or 0.0), case.get("gain")
        controller, feedback = case.get("controller"), None
        if controller is not None and not isinstance(controller, Controller):
            # It is designed for the rig of the sheet: what is drawn or changed is unknown to it.
            path, controller = controller, Controller.from_toml("", sheet, dt)
            if path != "standard":
                controller = Controller.from_file(path, sheet, dt)
        if gain is not None:
            gain = np.asarray(gain, dtype=float).reshape(4)
            feedback = (gain, np.array([reference, 0.0, 0.0, 0.0]), rig.parameters["motor.command_limit"])
        numbers, acting = sheet.parameters, sheet.effects
        changed: dict[str, Any] = {name: value for name, value in rig.parameters.items() if value != numbers[name]}
        changed |= {id: of for id, of in rig.effects.items() if of != acting.get(id)}
        return _Run(rig, x0, u, dt, controller, feedback, reference, changed)

    def __call__(self, case: Mapping[str, Any], rng: np.random.Generator) -> dict[str, Any]:
        run = self.begin(case, rng)
        if run.controller is None:
            row = self.batch([run])[0]
            if isinstance(row, Exception):
                raise row
            return row
        reference = np.full(len(run.u), run.reference)
        x, u, modes = simulate(run.rig, run.x0, run.u, run.dt, controller=run.controller, reference=reference)
        return _judged(run, x, float(np.abs(u).max()), modes[-1])

    def batch(self, runs: Sequence[_Run]) -> list[Any]:
        """Rows of runs of one `key`, from one call of `simulate_batch`; an exception in place of one that grew."""
        first = runs[0]
        numbers, acting = [run.rig.parameters for run in runs], [run.rig.effects for run in runs]
        parameters = {
            name: np.array([of[name] for of in numbers])
            for name, value in numbers[0].items()
            if any(of[name] != value for of in numbers)
        }
        effects = {
            id: {
                name: value if isinstance(value, str) else np.array([each[id][name] for each in acting])
                for name, value in of.items()
            }
            for id, of in acting[0].items()
        }
        x = simulate_batch(
            first.rig,
            np.stack([run.x0 for run in runs]),
            first.u if first.feedback is None else None,
            first.dt,
            parameters=parameters,
            effects=effects,
            feedback=first.feedback,
            samples=None if first.feedback is None else len(first.u),
            every=1,
        )
        rows: list[Any] = []
        for run, states in zip(runs, x):
            if not np.isfinite(states).all():
                rows.append(SimulationError("the state grows beyond all numbers: take a shorter dt"))
                continue
            command = np.abs(run.u).max()
            if run.feedback is not None:
                gain, reference, limit = run.feedback
                command = min(np.abs((states[:-1] - reference) @ gain).max(), limit)
            rows.append(_judged(run, states, float(command), None))
        return rows

    def together(self, task: Task, single: Any) -> list[dict[str, Any]]:
        """The rows of a task; runs of the same command and the same effects in one call of `simulate_batch`."""
        rows: dict[int, dict[str, Any]] = {}
        groups: dict[Any, list[tuple[int, _Run]]] = {}
        for case, given in zip(task.cases, task.given):
            try:
                run = self.begin(given, generator(task.seed, case)) if given.get("controller") is None else None
            except Exception:
                run = None  # to be raised again where it becomes the row's error
            if run is None:
                rows[case] = single(self, case, given, task.seed)
            else:
                groups.setdefault(_key(run), []).append((case, run))
        given = dict(zip(task.cases, task.given))
        for group in groups.values():
            size = max(1, 2_000_000 // len(group[0][1].u))  # 64 MB of states
            for k in range(0, len(group), size):
                part, begin = group[k : k + size], time.perf_counter()
                try:
                    found = self.batch([run for _, run in part])
                except Exception:  # of one of them: each for itself
                    rows |= {case: single(self, case, given[case], task.seed) for case, _ in part}
                    continue
                seconds = (time.perf_counter() - begin) / len(part)
                for (case, _), row in zip(part, found):
                    own = failure(row) if isinstance(row, Exception) else {"error": None, "traceback": None, **row}
                    rows[case] = {"case": case, "seconds": seconds, **own}
        return [rows[case] for case in task.cases]


def _key(run: _Run) -> Any:
    """What runs of one batch have in common."""
    words = tuple((id, *(v if isinstance(v, str) else n for n, v in of.items())) for id, of in run.rig.effects.items())
    feedback = None
    if run.feedback is not None:
        feedback = (run.feedback[0].tobytes(), run.feedback[1].tobytes(), run.feedback[2])
    return run.rig.name, words, run.dt, run.u.tobytes(), feedback


def _judged(run: _Run, x: np.ndarray, command: float, mode: str | None) -> dict[str, Any]:
    """The row of a run."""
    leaning = np.abs((x[:, 1] + np.pi) % (2 * np.pi) - np.pi) >= NEAR
    since = int(np.flatnonzero(leaning)[-1]) + 1 if leaning.any() else 0
    upright = len(x) - since > min(round(HELD / run.dt), len(x) - 1) and mode != "fault"
    return {
        "rig": run.rig.name,
        "changed": run.changed,
        **dict(zip(("theta", "alpha", "theta_dot", "alpha_dot"), x[-1].tolist())),
        "arm_angle": float(np.abs(x[:, 0]).max()),
        "command": command,
        "upright": upright,
        "up_at": since * run.dt if upright else None,
        "mode": mode,
    }


SHARED = ("swing-up", "region", "calibration")
"""Studies of many runs, which the command line computes in parts."""


class Study(Kind):
    """`furuta study NAME --json` of the command line."""

    name = "study"
    needs = ("study",)
    takes = None
    columns = {"study": "text", "rig": "text", "seed": "int", "answer": "json"}

    def __call__(self, case: Mapping[str, Any], rng: np.random.Generator) -> dict[str, Any]:
        given = dict(case)
        drawn = int(rng.integers(2**31))
        # The parts of a study are of the same draws.
        if given["study"] == "swing-up" and "part" not in given:
            given.setdefault("seed", drawn)
        rig = given.get("rig")
        return {
            "study": given["study"],
            "rig": rig.name if isinstance(rig, Rig) else None if rig is None else os.fspath(rig),
            "seed": given.get("seed"),
            "answer": answers_of(given),
        }


def answers_of(case: Mapping[str, Any]) -> Any:
    """What the command prints for a case: one object, or a list of them.

    Raises ``RuntimeError`` with what it wrote to standard error where it fails.
    """
    given = dict(case)
    study, rig = given.pop("study"), given.pop("rig", None)
    # The workers share the cores already.
    alone = {"RAYON_NUM_THREADS": "1"} if "part" in given else {}
    with tempfile.TemporaryDirectory() as folder:
        if isinstance(rig, Rig):
            path = pathlib.Path(folder) / "rig.toml"
            rig.save(path)
        else:
            path = rig
        words = [*_command(), "study", str(study), *(["--rig", os.fspath(path)] if path is not None else [])]
        words += [word for name, value in given.items() for word in _option(name, value)]
        # Python finds the package where this process did.
        paths = os.pathsep.join([str(pathlib.Path(__file__).parents[2]), os.environ.get("PYTHONPATH", "")])
        done = subprocess.run(
            [*words, "--json"],
            capture_output=True,
            text=True,
            stdin=subprocess.DEVNULL,
            env=os.environ | alone | {"PYTHONPATH": paths.strip(os.pathsep)},
        )
    answers = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    if done.returncode != 0 or not answers:
        raise RuntimeError(f"furuta study {study}: {done.stderr.strip() or f'code {done.returncode}'}")
    return answers[0] if len(answers) == 1 else answers


def lines_of(answer: str) -> str:
    """The column `answer` of a row as the command printed it, line by line."""
    answers = json.loads(answer)
    return "".join(json.dumps(one) + "\n" for one in (answers if isinstance(answers, list) else [answers]))


def _command() -> list[str]:
    """The command line: the program that FURUTA_CLI names, else that of the package."""
    named = os.environ.get("FURUTA_CLI")
    return [named] if named else [sys.executable, "-m", "furuta"]


def _option(name: str, value: Any) -> list[str]:
    """An entry of a case as words of the command line: draws=100 is --draws 100, set={"a": 1} is --set a=1."""
    flag = "--" + name.replace("_", "-")
    if value is None or value is False:
        return []
    if value is True:
        return [flag]
    if isinstance(value, Mapping):
        return [word for key, of in value.items() for word in (flag, f"{key}={of}")]
    if isinstance(value, (list, tuple)):
        return [word for part in value for word in (flag, str(part))]
    return [flag, os.fspath(value) if isinstance(value, os.PathLike) else str(value)]


KINDS: dict[str, Kind] = {kind.name: kind for kind in (Diagnose(), Simulate(), Study())}
