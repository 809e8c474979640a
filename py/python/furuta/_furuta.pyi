# Types of the private extension. The docstrings are in the extension itself (help(furuta.simulate)).
import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, Literal, Protocol, TypeAlias, TypedDict, final, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray
from typing_extensions import NotRequired, Self

__all__ = [
    "BatchSimulator",
    "CalibrateError",
    "Calibration",
    "Comparison",
    "Controller",
    "ControllerError",
    "DesignError",
    "DiagnoseError",
    "Diagnosis",
    "Estimator",
    "ExperimentPlan",
    "Frf",
    "FurutaError",
    "Hypothesis",
    "IdentificationError",
    "Interrupted",
    "RecordingError",
    "Replay",
    "Rig",
    "RigError",
    "SignalError",
    "SimulationError",
    "Simulator",
    "Supervisor",
    "SwingUp",
    "TransferFit",
    "Validation",
    "__version__",
    "_example",
    "_main",
    "_read_recording",
    "_write_data",
    "arm_step",
    "calibrate",
    "care",
    "catalogue",
    "closed_loop",
    "compare",
    "controllability",
    "controllers",
    "dare",
    "design_swing_up",
    "diagnose",
    "dlqe",
    "dlqr",
    "fit_transfer_function",
    "frf",
    "largest_sine",
    "linearize",
    "lqe",
    "lqi",
    "lqr",
    "measure",
    "place",
    "plan_experiment",
    "ramos_velasco",
    "ramos_velasco_draws",
    "region_of_attraction",
    "rehearse",
    "relay",
    "replay",
    "robust_lqr",
    "shahzad2022",
    "signal",
    "simulate",
    "simulate_batch",
    "spectra",
    "steady_motion",
    "timing",
    "validate",
    "whiteness",
    "zero_order_hold",
]

__version__: str

class FurutaError(ValueError): ...
class RigError(FurutaError): ...
class SimulationError(FurutaError): ...
class SignalError(FurutaError): ...
class RecordingError(FurutaError): ...
class CalibrateError(FurutaError): ...
class DiagnoseError(FurutaError): ...
class ControllerError(FurutaError): ...
class DesignError(FurutaError): ...
class IdentificationError(FurutaError): ...

class Interrupted(KeyboardInterrupt):
    diagnosis: Diagnosis
    run: Any

class _ParameterDetail(TypedDict):
    unit: str
    kind: Literal["real", "whole", "choice"]
    choices: list[str] | None
    min: float
    max: float
    off: float | str
    default: float | str | None

class _CatalogueEntry(TypedDict):
    name: str
    law: str
    sentence: str
    shows: str
    experiment: str
    look_alikes: list[str]
    follows_state: bool
    offered: Literal["always", "on request", "never"]
    kinds: list[str]
    parameters: dict[str, str]
    details: dict[str, _ParameterDetail]

_RigLike: TypeAlias = Rig | str | os.PathLike[str]
_Names: TypeAlias = str | Sequence[str]

@final
class Rig:
    BUILTIN: ClassVar[list[str]]
    VOLTAGE: ClassVar[list[str]]
    def __new__(cls, name_or_path: str | os.PathLike[str]) -> Self: ...
    @classmethod
    def load(cls, name_or_path: str | os.PathLike[str]) -> Self: ...
    @classmethod
    def from_toml(cls, text: str) -> Self: ...
    def to_toml(self) -> str: ...
    def save(self, path: _Path, *, force: bool = False) -> None: ...
    def to_mjcf(self, *, timestep: float = 0.0005) -> str: ...
    def to_urdf(self) -> str: ...
    def to_dict(self) -> dict[str, Any]: ...
    def to_ss(self, x: ArrayLike | None = None, *, dt: float | None = None) -> Any: ...
    def to_tf(self, output: Literal["alpha", "theta"] = "alpha", x: ArrayLike | None = None) -> Any: ...
    def __getitem__(self, key: str, /) -> Any: ...
    def __contains__(self, key: str, /) -> bool: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __hash__(self) -> int: ...
    def _repr_html_(self) -> str: ...
    @property
    def name(self) -> str: ...
    @property
    def source(self) -> str: ...
    @property
    def motor_kind(self) -> Literal["voltage", "torque", "acceleration"]: ...
    @property
    def command_unit(self) -> str: ...
    @property
    def parameters(self) -> dict[str, float]: ...
    @property
    def sensors(self) -> dict[str, float]: ...
    @property
    def limits(self) -> dict[str, float | None]: ...
    @property
    def tolerance(self) -> dict[str, float | None]: ...
    def with_tolerance(self, tolerance: dict[str, float]) -> Self: ...
    @property
    def effects(self) -> dict[str, dict[str, float | str]]: ...
    def with_parameters(self, parameters: dict[str, float]) -> Self: ...
    def with_effect(self, id: str | Hypothesis, /, **parameters: float | str) -> Self: ...
    def without_effects(self) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...

@final
class Hypothesis:
    def __new__(
        cls,
        id: str,
        *,
        arm: str | None = None,
        pendulum: str | None = None,
        voltage: str | None = None,
        parameters: Mapping[str, Mapping[str, Any]],
        constants: Mapping[str, Mapping[str, Any]] | None = None,
        state: Mapping[str, Any] | None = None,
        side: Literal["arm", "motor"] = "arm",
        name: str = "",
        experiment: str = "",
    ) -> Self: ...
    @classmethod
    def from_toml(cls, text: str, *, id: str | None = None) -> Self: ...
    @classmethod
    def load(cls, path: str | os.PathLike[str], *, id: str | None = None) -> Self: ...
    def to_toml(self) -> str: ...
    def save(self, path: _Path, *, force: bool = False) -> None: ...
    @property
    def id(self) -> str: ...
    @property
    def name(self) -> str: ...
    @property
    def law(self) -> str: ...
    @property
    def parameters(self) -> dict[str, dict[str, Any]]: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

def catalogue() -> dict[str, _CatalogueEntry]: ...
def signal(
    kind: Literal["zero", "step", "steps", "ramp", "chirp", "multisine", "prbs", "noise"],
    duration: float,
    dt: float,
    **parameters: float | str | tuple[float, float],
) -> NDArray[np.float64]: ...

@final
class Controller:
    KINDS: ClassVar[list[str]]
    @classmethod
    def from_file(cls, path: str | os.PathLike[str], rig: _RigLike, dt: float) -> Self: ...
    @classmethod
    def from_toml(cls, text: str, rig: _RigLike, dt: float) -> Self: ...
    @classmethod
    def lqr(cls, K: ArrayLike, rig: _RigLike, dt: float = 0.002) -> Self: ...
    def to_toml(self) -> str: ...
    def to_c(self, *, single: bool = False) -> str: ...
    def save(self, path: _Path, *, force: bool = False) -> None: ...
    @property
    def gain(self) -> NDArray[np.float64] | None: ...
    @property
    def rig(self) -> Rig: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    __hash__: ClassVar[None]  # type: ignore[assignment]
    def _repr_html_(self) -> str: ...
    @property
    def kind(self) -> str: ...
    @property
    def dt(self) -> float: ...
    @property
    def command_limit(self) -> float: ...
    def start(self) -> None: ...
    def update(
        self,
        x: ArrayLike,
        reference: ArrayLike | None = None,
        h: float | None = None,
        *,
        ahead: ArrayLike | None = None,
    ) -> float: ...

@final
class Supervisor:
    def __new__(
        cls, rig: _RigLike, controller: Controller | None = None, dt: float | None = None, *, start: bool = True
    ) -> Self: ...
    def step(
        self, t: float, theta: float, alpha: float, *, target: float = 0.0, held: float | None = None
    ) -> tuple[float, _Mode]: ...
    def request(self, what: Literal["start", "stop", "reset"]) -> bool: ...
    def reset(self) -> None: ...
    @property
    def mode(self) -> _Mode: ...
    @property
    def fault(self) -> str | None: ...
    @property
    def estimate(self) -> NDArray[np.float64] | None: ...
    @property
    def reference(self) -> float: ...
    @property
    def dt(self) -> float: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...

_Mode: TypeAlias = Literal["idle", "swing-up", "balance", "stopping", "braking", "fault"]

@final
class SwingUp:
    def __new__(cls, rig: _RigLike, dt: float = 0.002, **settings: float) -> Self: ...
    def update(self, x: ArrayLike) -> float: ...
    def missing_energy(self, x: ArrayLike) -> float: ...
    def start(self) -> None: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...

@final
class Simulator:
    def __new__(cls, rig: _RigLike, x0: ArrayLike, dt: float, *, substeps: int = 1, run: int = 0) -> Self: ...
    def step(self, u: float) -> NDArray[np.float64]: ...
    def steps(self, u: ArrayLike) -> NDArray[np.float64]: ...
    @property
    def x(self) -> NDArray[np.float64]: ...
    @property
    def reading(self) -> NDArray[np.float64]: ...
    @property
    def t(self) -> float: ...
    @property
    def dt(self) -> float: ...
    def reset(self, x0: ArrayLike | None = None) -> None: ...
    def copy(self) -> Self: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def _repr_html_(self) -> str: ...

@final
class BatchSimulator:
    def __new__(cls, rig: _RigLike | Sequence[_RigLike], x0: ArrayLike, dt: float) -> Self: ...
    def step(self, u: ArrayLike, samples: int = 1) -> NDArray[np.float64]: ...
    @property
    def x(self) -> NDArray[np.float64]: ...
    @property
    def reading(self) -> NDArray[np.float64]: ...
    @property
    def rigs(self) -> list[Rig]: ...
    @property
    def dt(self) -> float: ...
    def reset(self, which: int, x0: ArrayLike, rig: _RigLike | None = None) -> None: ...
    def copy(self) -> Self: ...
    def __len__(self) -> int: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...

_Callable: TypeAlias = Callable[[float, Any], Any]
_Estimating: TypeAlias = Estimator | str | Callable[[float, float, float, float], Any]

class _ControllerParameter(TypedDict):
    unit: str
    sentence: str
    numbers: int
    words: list[str] | None
    min: float
    max: float
    default: float | None

class _ControllerKind(TypedDict):
    sentence: str
    parameters: dict[str, _ControllerParameter]

def region_of_attraction(
    rig: _RigLike,
    controller: Controller,
    *,
    alpha: float = 1.2,
    speed: float = 2.0,
    points: int = 61,
    progress: Callable[[int, int], object] | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]: ...
def controllers() -> dict[str, dict[str, _ControllerKind]]: ...
@overload
def simulate(
    rig: _RigLike,
    x0: ArrayLike,
    u: ArrayLike,
    dt: float,
    *,
    substeps: int = 1,
    run: int = 0,
    encoders: Literal[False] = False,
    controller: None = None,
    reference: None = None,
    ideal: Literal[False] = False,
    estimator: None = None,
) -> NDArray[np.float64]: ...
@overload
def simulate(
    rig: _RigLike,
    x0: ArrayLike,
    u: ArrayLike,
    dt: float,
    *,
    substeps: int = 1,
    run: int = 0,
    encoders: Literal[True],
    controller: None = None,
    reference: None = None,
    ideal: Literal[False] = False,
    estimator: None = None,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...
@overload
def simulate(
    rig: _RigLike,
    x0: ArrayLike,
    u: ArrayLike,
    dt: float,
    *,
    substeps: int = 1,
    run: int = 0,
    encoders: Literal[False] = False,
    controller: Controller | _Callable,
    reference: ArrayLike | None = None,
    ideal: bool = False,
    estimator: _Estimating | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.float64], list[str]]: ...
@overload
def simulate(
    rig: _RigLike,
    x0: ArrayLike,
    u: ArrayLike,
    dt: float,
    *,
    substeps: int = 1,
    run: int = 0,
    encoders: Literal[True],
    controller: Controller | _Callable,
    reference: ArrayLike | None = None,
    ideal: bool = False,
    estimator: _Estimating | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.float64], list[str], NDArray[np.float64]]: ...
def simulate_batch(
    rig: _RigLike,
    x0: ArrayLike,
    u: ArrayLike | None,
    dt: float,
    *,
    parameters: Mapping[str, ArrayLike] | None = None,
    effects: Mapping[str, Mapping[str, ArrayLike | str]] | None = None,
    feedback: tuple[ArrayLike, ArrayLike, float] | None = None,
    samples: int | None = None,
    every: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> NDArray[np.float64]: ...
def measure(rig: _RigLike, x: ArrayLike) -> NDArray[np.float64]: ...
def linearize(
    rig: _RigLike, x: ArrayLike | None = None, u: float = 0.0, *, effects: bool | None = None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...
def zero_order_hold(A: ArrayLike, B: ArrayLike, dt: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...
def steady_motion(
    rig: _RigLike, lambda_: float, *, order: int = 5, planar: bool = False
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]: ...
def largest_sine(rig: _RigLike, lambda_: float, *, planar: bool = False) -> float | None: ...

class _Run(TypedDict):
    t: NDArray[np.float64]
    u: NDArray[np.float64]
    x: NDArray[np.float64]
    reference: NDArray[np.float64]

class _Draws(TypedDict):
    factors: NDArray[np.float64]
    bound: NDArray[np.float64]
    rms: NDArray[np.float64]
    chatter: NDArray[np.float64]

_Tracker: TypeAlias = Literal["regulator", "regulator_lqr", "normal_form", "layer", "twisting"]

class _ArmStepRun(_Run):
    settle: float | None
    overshoot: float
    alpha_max: float
    u_max: float
    violations: int
    saturated: int
    effort: float
    cost: float
    up: bool

class _ArmStep(TypedDict):
    pendulum_limit: float
    command_limit: float
    lqr: _ArmStepRun
    sliding: _ArmStepRun
    mpc_clarabel: _ArmStepRun
    mpc_active_set: _ArmStepRun

def shahzad2022(
    task: Literal["step", "steps", "push"] = "steps", on: Literal["linear", "nonlinear", "rig"] = "nonlinear"
) -> _Run: ...
def arm_step(
    rig: _RigLike,
    step: float = 0.5,
    *,
    q: Sequence[float] | None = None,
    r: float | None = None,
    pendulum_angle: float | None = None,
    rate: float = 500.0,
    duration: float = 5.0,
    iterations: int = 200,
) -> _ArmStep: ...
def ramos_velasco(
    controller: _Tracker = "normal_form",
    on: Literal["planar", "full", "rig"] = "planar",
    *,
    factors: tuple[float, float, float] | None = None,
    amplitude: float | None = None,
    order: int | None = None,
) -> _Run: ...
def ramos_velasco_draws(
    controller: _Tracker = "normal_form",
    on: Literal["planar", "full", "rig"] = "planar",
    *,
    draws: int = 500,
    spread: float = 0.2,
    seed: int = 1,
    amplitude: float | None = None,
    order: int | None = None,
) -> _Draws: ...

class _Robust(TypedDict):
    K: NDArray[np.float64]
    X: NDArray[np.float64]
    K_nominal: NDArray[np.float64]
    slowest: float
    slowest_nominal: float
    A: NDArray[np.float64]
    B: NDArray[np.float64]

def robust_lqr(
    rig: _RigLike,
    spread: float = 0.2,
    *,
    parameters: _Names | None = None,
    q: Sequence[float] | None = None,
    r: float | None = None,
) -> _Robust: ...

class _Margins(TypedDict):
    stable: bool
    gain: tuple[float, float]
    phase: float
    delay: float
    disk: float
    frequencies: list[float]

class _ObservedLoop(TypedDict):
    growth: float
    poles: NDArray[np.complex128]
    margins: _Margins

class _Loop(TypedDict):
    states: list[str]
    A: NDArray[np.float64]
    poles: NDArray[np.complex128]
    growth: float
    equilibrium: dict[str, float]
    delay: float
    remarks: dict[str, str]
    margins: _Margins
    with_estimator: NotRequired[_ObservedLoop]
    response: NotRequired[NDArray[np.complex128]]

class _Rehearsal(TypedDict):
    fell: float | None
    fault: str | None
    arm: float
    pendulum: float
    at_limit: float

def closed_loop(
    rig: _RigLike,
    K: ArrayLike | Controller | str | os.PathLike[str],
    *,
    rate: float | None = None,
    amplitudes: Sequence[float] | None = None,
    omega: ArrayLike | None = None,
) -> _Loop: ...
def rehearse(rig: _RigLike, K: ArrayLike, *, rate: float = 500.0) -> _Rehearsal: ...

class _Relay(TypedDict):
    ultimate_gain: float
    ultimate_period: float
    described_gain: float
    phase: float
    amplitude: float
    hysteresis: float
    lean: float
    arm: float
    time: float
    model: tuple[float, float] | None
    pendulum_gains: NDArray[np.float64]
    arm_gains: NDArray[np.float64]
    margins: _Margins

def relay(
    rig: _RigLike,
    *,
    rate: float = 500.0,
    amplitude: float | None = None,
    hysteresis: float = 0.0,
    time_limit: float = 10.0,
) -> _Relay: ...

class _OptimalSwingUp(TypedDict):
    seconds: float
    arrival: float
    t: NDArray[np.float64]
    x: NDArray[np.float64]
    u: NDArray[np.float64]
    K: NDArray[np.float64]
    arm: float
    gap: float
    cost: float
    optimal: bool
    left_out: list[str]
    controller: Controller

def design_swing_up(
    rig: _RigLike,
    controller: Controller | None = None,
    dt: float | None = None,
    *,
    reserve: float | None = None,
    effort: float | None = None,
    arm_limit: float | None = None,
    arm_speed: float | None = None,
    pendulum_speed: float | None = None,
    intervals: int = 100,
    when_lost: Literal["energy", "stop"] = "energy",
) -> _OptimalSwingUp: ...

_Design: TypeAlias = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.complex128]]
_Solution: TypeAlias = tuple[NDArray[np.float64], NDArray[np.complex128], NDArray[np.float64]]

def care(
    A: ArrayLike, B: ArrayLike, Q: ArrayLike, R: ArrayLike | None = None, S: ArrayLike | None = None
) -> _Solution: ...
def dare(A: ArrayLike, B: ArrayLike, Q: ArrayLike, R: ArrayLike, S: ArrayLike | None = None) -> _Solution: ...

class _System(Protocol):
    """What python-control's StateSpace has."""

    A: Any
    B: Any
    C: Any
    dt: Any

def lqr(
    A: ArrayLike | _RigLike | _System,
    B: ArrayLike | None = None,
    Q: ArrayLike | None = None,
    R: ArrayLike | None = None,
    N: ArrayLike | None = None,
) -> _Design: ...
def dlqr(
    A: ArrayLike | _System,
    B: ArrayLike | None = None,
    Q: ArrayLike | None = None,
    R: ArrayLike | None = None,
    N: ArrayLike | None = None,
) -> _Design: ...
def lqi(
    A: ArrayLike,
    B: ArrayLike,
    C: ArrayLike,
    Q: ArrayLike,
    R: ArrayLike,
    N: ArrayLike | None = None,
    *,
    dt: float | None = None,
    hold: float | None = None,
) -> _Design: ...
def lqe(
    A: ArrayLike | _RigLike | _System,
    G: ArrayLike | None = None,
    C: ArrayLike | None = None,
    QN: ArrayLike | None = None,
    RN: ArrayLike | None = None,
    NN: ArrayLike | None = None,
) -> _Design: ...
def dlqe(
    A: ArrayLike | _System,
    G: ArrayLike | None = None,
    C: ArrayLike | None = None,
    QN: ArrayLike | None = None,
    RN: ArrayLike | None = None,
    NN: ArrayLike | None = None,
) -> _Design: ...
def place(A: ArrayLike, B: ArrayLike, p: ArrayLike) -> NDArray[np.float64]: ...
def controllability(A: ArrayLike, B: ArrayLike) -> tuple[NDArray[np.float64], int, float]: ...

@final
class Estimator:
    KINDS: ClassVar[list[str]]
    def __new__(cls, kind: str, rig: _RigLike, dt: float, **settings: float | Sequence[float]) -> Self: ...
    @property
    def kind(self) -> str: ...
    def start(self) -> None: ...
    def update(
        self, theta: float, alpha: float, held: float, periods: int = 1
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], float]: ...
    @property
    def dt(self) -> float: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    __hash__: ClassVar[None]  # type: ignore[assignment]
    def _repr_html_(self) -> str: ...
    def filter(self, theta: ArrayLike, alpha: ArrayLike, u: ArrayLike) -> NDArray[np.float64]: ...

_Path: TypeAlias = str | os.PathLike[str]
_Recording: TypeAlias = _Path | Mapping[str, ArrayLike] | _Frame | NDArray[Any]
_Recordings: TypeAlias = _Recording | Sequence[_Recording] | Mapping[str, _Recording]

class _Frame(Protocol):
    """What a pandas.DataFrame has."""
    @property
    def columns(self) -> Any: ...
    def to_numpy(self) -> Any: ...
    def __getitem__(self, name: Any, /) -> Any: ...

def _read_recording(given: Any) -> tuple[str, dict[str, Any], list[str], object]: ...
def _example(name: str) -> list[tuple[str, str]]: ...
def _main(arguments: list[str]) -> int: ...
def _write_data(path: _Path, text: str, *, force: bool = False) -> None: ...

class _Estimate(TypedDict):
    value: float | None
    std: float | None
    unit: str

class _NamedEffect(TypedDict):
    id: str
    name: str
    parameters: dict[str, _Estimate]
    delta_bic: float | None
    held_out_gain: float | None
    confusable_with: list[str]

class _CustomTerm(TypedDict):
    id: str
    expression: str
    on: Literal["arm", "pendulum"]
    parameters: dict[str, _Estimate]

_Expression = TypedDict(
    "_Expression",
    {
        "terms": list[_CustomTerm],
        "held_out_gain": float | None,
        "without": dict[str, float | None],
        "with": dict[str, float | None],
    },
)

class _PlannedExperiment(TypedDict):
    excitation: str
    arguments: str
    seconds: float
    volts: float
    separates: list[str]
    expected_evidence: float | None
    if_true: list[float]

class _Limit(TypedDict):
    id: str
    parameter: str
    at_most: float | None
    std: float | None
    typical: float | None
    unit: str

class _ParameterEstimate(TypedDict):
    nominal: float | None
    fitted: float | None
    std: float | None
    unit: str
    identifiable: bool
    at_bound: bool

class _AtBound(TypedDict):
    model: Literal["refitted", "repaired"]
    parameter: str
    value: float | None
    unit: str
    reason: str

class _MissingTorque(TypedDict):
    axis: Literal["theta", "alpha"]
    state: Literal["theta", "theta_dot", "alpha", "alpha_dot", "u"]
    shape: Literal["constant", "proportional", "sign", "quadratic"] | None
    size: float | None
    unit: str
    share_of_gap: float | None

@final
class Diagnosis:
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def to_json(self) -> str: ...
    def to_dict(self) -> dict[str, Any]: ...
    def summary(self) -> str: ...
    def plot(self, *, run: str | None = None, seconds: float = 4.0, ax: Any = None) -> Any: ...
    def curves(self) -> dict[str, Any]: ...
    def _repr_html_(self) -> str: ...
    def report(self, path: _Path, *, force: bool = False) -> None: ...
    @property
    def repaired_rig(self) -> Rig: ...
    @property
    def verdict(self) -> Literal["no_gap", "parameters_only", "missing_effects", "unexplained"]: ...
    @property
    def effects(self) -> list[_NamedEffect]: ...
    @property
    def custom(self) -> _Expression | None: ...
    @property
    def parameters(self) -> dict[str, _ParameterEstimate]: ...
    @property
    def limits(self) -> list[_Limit]: ...
    @property
    def gap(self) -> dict[str, Any]: ...
    @property
    def held_out(self) -> dict[str, Any] | None: ...
    @property
    def where(self) -> list[dict[str, Any]]: ...
    @property
    def missing_torque(self) -> list[_MissingTorque]: ...
    @property
    def next_experiment(self) -> str | None: ...
    @property
    def plan(self) -> list[_PlannedExperiment]: ...
    @property
    def suspected(self) -> list[dict[str, Any]]: ...
    @property
    def zeros(self) -> list[dict[str, Any]]: ...
    @property
    def at_bound(self) -> list[_AtBound]: ...
    @property
    def best(self) -> str: ...
    @property
    def comparison(self) -> dict[str, Any] | None: ...
    @property
    def left_out(self) -> dict[str, Any] | None: ...
    @property
    def jitter(self) -> dict[str, float] | None: ...
    @property
    def verification(self) -> list[dict[str, Any]]: ...
    @property
    def notices(self) -> list[str]: ...
    @property
    def interrupted(self) -> bool: ...
    @property
    def unfinished(self) -> list[str]: ...
    @property
    def seconds(self) -> float: ...

def diagnose(
    recordings: _Recordings,
    rig: _RigLike,
    *,
    verify: _Recordings | None = None,
    compare: _Recordings | None = None,
    plan: bool = False,
    same_zero: bool = False,
    time_limit: float | None = 60.0,
    thorough: bool = False,
    candidates: str | os.PathLike[str] | Hypothesis | Sequence[str | os.PathLike[str] | Hypothesis] | None = None,
    pendulum: Literal["swings", "removed", "locked", "alone", "driven"] = "swings",
    every: int = 1,
    span: tuple[float, float] | None = None,
    command: Literal["held", "smooth"] = "held",
    accept_suspicious: bool = False,
    progress: Callable[[str, str | None, float], object] | None = None,
) -> Diagnosis: ...

@final
class Frf:
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def _repr_html_(self) -> str: ...
    def __new__(
        cls, frequency: ArrayLike, response: ArrayLike, std: ArrayLike | None = None, *, sample_period: float = 0.0
    ) -> Self: ...
    @property
    def frequency(self) -> NDArray[np.float64]: ...
    @property
    def response(self) -> NDArray[np.complex128]: ...
    @property
    def coherence(self) -> NDArray[np.float64]: ...
    @property
    def std(self) -> NDArray[np.float64]: ...
    @property
    def distortion(self) -> NDArray[np.float64]: ...
    @property
    def averages(self) -> float: ...
    @property
    def sample_period(self) -> float: ...
    @property
    def method(self) -> str: ...
    @property
    def notices(self) -> list[str]: ...
    def confidence(self, probability: float = 0.95) -> NDArray[np.float64]: ...
    def band(self, low: float, high: float) -> Frf: ...
    def magnitude_db(self) -> NDArray[np.float64]: ...
    def phase_degrees(self) -> NDArray[np.float64]: ...
    def summary(self) -> str: ...
    def report(self, path: _Path, fit: TransferFit | None = None, *, force: bool = False) -> None: ...
    def plot(self, *, ax: Any = None, **models: TransferFit | ArrayLike) -> Any: ...
    def to_control(self) -> Any: ...
    @classmethod
    def from_control(cls, system: Any, frequency: ArrayLike | None = None) -> Frf: ...

@final
class TransferFit:
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def _repr_html_(self) -> str: ...
    @property
    def numerator(self) -> NDArray[np.float64]: ...
    @property
    def denominator(self) -> NDArray[np.float64]: ...
    @property
    def numerator_std(self) -> NDArray[np.float64]: ...
    @property
    def denominator_std(self) -> NDArray[np.float64]: ...
    @property
    def delay(self) -> float: ...
    @property
    def delay_std(self) -> float: ...
    @property
    def poles(self) -> NDArray[np.complex128]: ...
    @property
    def poles_std(self) -> NDArray[np.complex128]: ...
    @property
    def zeros(self) -> NDArray[np.complex128]: ...
    @property
    def zeros_std(self) -> NDArray[np.complex128]: ...
    @property
    def chi2(self) -> float: ...
    @property
    def aic(self) -> float: ...
    @property
    def bic(self) -> float: ...
    @property
    def relative_error(self) -> float: ...
    @property
    def stable(self) -> bool: ...
    @property
    def notices(self) -> list[str]: ...
    def response(self, frequency: ArrayLike) -> NDArray[np.complex128]: ...
    def to_control(self) -> Any: ...
    def summary(self) -> str: ...
    def __iter__(self) -> Any: ...

@final
class Comparison:
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def _repr_html_(self) -> str: ...
    @property
    def as_given_error(self) -> float: ...
    @property
    def explanations(self) -> list[dict[str, Any]]: ...
    @property
    def frequency(self) -> NDArray[np.float64]: ...
    @property
    def measured(self) -> NDArray[np.complex128]: ...
    def summary(self) -> str: ...
    def plot(self, *, ax: Any = None) -> Any: ...
    def report(self, path: _Path, *, force: bool = False) -> None: ...

def spectra(
    u: ArrayLike, y: ArrayLike, dt: float, segment: int, *, overlap: int | None = None, window: str = "hann"
) -> dict[str, Any]: ...
def frf(
    recordings: _Recordings,
    *,
    output: str = "alpha",
    input: str = "u",
    reference: str | None = None,
    estimator: Literal["local", "H1", "H2", "h1", "h2"] = "local",
    resolution: float | None = None,
    window: str | None = None,
    overlap: float | None = None,
    period: float | None = None,
    discard: int = 1,
    band: tuple[float, float] | None = None,
    accept_suspicious: bool = False,
) -> Frf: ...
def fit_transfer_function(
    frf: Frf,
    zeros: int | None = None,
    poles: int | None = None,
    *,
    delay: float | Literal["fit"] | None = None,
    hold: bool | None = None,
) -> TransferFit: ...
def compare(
    measured: Frf | TransferFit | tuple[ArrayLike, ArrayLike] | Literal["fong2014"] | Any,
    rig: _RigLike,
    *,
    output: Literal["alpha", "theta"] = "alpha",
    band: tuple[float, float] = (0.1, 23.0),
) -> Comparison: ...

class _Calibrated(TypedDict):
    nominal: float
    fitted: float
    std: float | None
    interval: list[float] | None
    unit: str
    identifiable: bool
    at_bound: bool

@final
class Calibration:
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def to_json(self) -> str: ...
    def to_dict(self) -> dict[str, Any]: ...
    def summary(self) -> str: ...
    def plot(self, *, run: str | None = None, ax: Any = None) -> Any: ...
    def curves(self) -> list[dict[str, Any]]: ...
    def _repr_html_(self) -> str: ...
    def report(self, path: _Path, *, force: bool = False) -> None: ...
    @property
    def rig(self) -> Rig: ...
    @property
    def parameters(self) -> dict[str, _Calibrated]: ...
    @property
    def fitted(self) -> list[str]: ...
    @property
    def correlation(self) -> list[list[float | None]]: ...
    @property
    def combinations(self) -> list[dict[str, Any]]: ...
    @property
    def identifiability(self) -> dict[str, Any]: ...
    @property
    def fit(self) -> list[dict[str, Any]]: ...
    @property
    def chi(self) -> float: ...
    @property
    def profiles(self) -> list[dict[str, Any]]: ...
    @property
    def verification(self) -> dict[str, Any] | None: ...
    @property
    def notices(self) -> list[str]: ...
    @property
    def seconds(self) -> float: ...

@final
class Validation:
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def _repr_html_(self) -> str: ...
    def to_json(self) -> str: ...
    def to_dict(self) -> dict[str, Any]: ...
    def summary(self) -> str: ...
    def plot(self, *, ax: Any = None) -> Any: ...
    @property
    def channels(self) -> list[dict[str, Any]]: ...
    @property
    def notices(self) -> list[str]: ...

@final
class ExperimentPlan:
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def _repr_html_(self) -> str: ...
    def to_json(self) -> str: ...
    def to_dict(self) -> dict[str, Any]: ...
    def summary(self, rig: str = "RIG") -> str: ...
    @property
    def parameters(self) -> list[str]: ...
    @property
    def experiments(self) -> list[dict[str, Any]]: ...
    @property
    def sequence(self) -> list[int]: ...
    @property
    def after(self) -> list[list[float]]: ...

def calibrate(
    recordings: _Recordings,
    rig: _RigLike,
    *,
    free: _Names | None = None,
    fix: _Names | None = None,
    profile: _Names | None = None,
    horizon: float = 2.0,
    body_length: float | None = None,
    verify: _Recordings | None = None,
    pendulum: Literal["swings", "removed", "locked", "alone", "driven"] = "swings",
    same_zero: bool = False,
    removed: _Recordings | None = None,
    locked: _Recordings | None = None,
    alone: _Recordings | None = None,
    driven: _Recordings | None = None,
    every: int = 1,
    span: tuple[float, float] | None = None,
    command: Literal["held", "smooth"] = "held",
    accept_suspicious: bool = False,
    progress: Callable[[str, float], object] | None = None,
    hold: _Names | None = None,
) -> Calibration: ...
def validate(
    recordings: _Recordings,
    rig: _RigLike,
    *,
    pendulum: Literal["swings", "removed", "locked", "alone", "driven"] = "swings",
    same_zero: bool = False,
    every: int = 1,
    span: tuple[float, float] | None = None,
    command: Literal["held", "smooth"] = "held",
    accept_suspicious: bool = False,
) -> Validation: ...
def plan_experiment(
    rig: _RigLike,
    *,
    free: _Names | None = None,
    fix: _Names | None = None,
    rate: float = 500.0,
    experiments: int = 2,
    horizon: float = 2.0,
    hold: _Names | None = None,
) -> ExperimentPlan: ...

@final
class Replay:
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def _repr_html_(self) -> str: ...
    def summary(self) -> str: ...
    def columns(self) -> dict[str, Any]: ...
    @property
    def identical(self) -> bool: ...
    @property
    def same_pilot(self) -> bool: ...
    @property
    def pilot(self) -> str: ...
    @property
    def samples(self) -> int: ...
    @property
    def equal(self) -> int: ...
    @property
    def first(self) -> dict[str, Any] | None: ...
    @property
    def largest(self) -> dict[str, Any] | None: ...
    @property
    def missing(self) -> dict[str, Any] | None: ...
    @property
    def fault(self) -> dict[str, Any] | None: ...
    @property
    def notice(self) -> str | None: ...

def replay(
    path: _Path,
    *,
    controller: _Path | None = None,
    rig: _RigLike | None = None,
    any_rig: bool = False,
    any_version: bool = False,
) -> Replay: ...
def whiteness(residual: ArrayLike, lags: int = 25) -> dict[str, Any]: ...
def timing(path: str | os.PathLike[str]) -> dict[str, Any]: ...
