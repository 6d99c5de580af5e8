# Written by `stub()` of this module. Classes with an underscore exist for type checkers alone.
from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from typing import Any, ClassVar, Generic, Literal, TypeVar, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

__version__: str

Array = NDArray[np.float64]
Spline = Union[tuple[ArrayLike, ArrayLike], tuple[ArrayLike, ArrayLike, Any], Mapping[str, Any]]
Inputs = Union[ArrayLike, Mapping[str, ArrayLike]]
Release = Union[str, Sequence[str], Mapping[str, float]]
Direction = Literal["rising", "falling", "any"]
Method = Literal[
    METHODS
]

_S = TypeVar("_S", bound=State)
_M = TypeVar("_M", bound=Motion)

class SimulationError(RuntimeError):
    partial: Any
    kind: str | None
    time: float | None
    step: float | None
    state: Any

class StateError(ValueError): ...
class EvaluationError(RuntimeError): ...

class State:
    @property
    def t(self) -> float: ...
    @property
    def q(self) -> Array: ...
    @property
    def u(self) -> Array: ...
    @property
    def inputs(self) -> Array: ...
    @property
    def released(self) -> list[str]: ...
    def to_dict(self) -> dict[str, Any]: ...
    def replace(self: _S, *, t: float | None = None, **values: ArrayLike) -> _S: ...
    def __getitem__(self, name: str) -> Any: ...

class Event:
    @property
    def name(self) -> str: ...
    @property
    def t(self) -> float: ...
    @property
    def direction(self) -> Literal["rising", "falling"]: ...
    @property
    def before(self) -> Any: ...
    @property
    def after(self) -> Any: ...
    @property
    def energy_lost(self) -> float: ...
    @property
    def impacts(self) -> int: ...
    @property
    def stopped(self) -> bool: ...

class Summary:
    @property
    def model(self) -> str: ...
    @property
    def verified(self) -> bool: ...
    @property
    def interval(self) -> tuple[float, float]: ...
    @property
    def method(self) -> str: ...
    @property
    def reason(self) -> str: ...
    @property
    def switched(self) -> tuple[float, str] | None: ...
    @property
    def steps(self) -> int: ...
    @property
    def rejected(self) -> int: ...
    @property
    def evaluations(self) -> int: ...
    @property
    def wall_time(self) -> float | None: ...
    @property
    def energy_drift(self) -> float: ...
    @property
    def energy_scale(self) -> float: ...
    @property
    def conserved(self) -> dict[str, float]: ...
    @property
    def events(self) -> dict[str, int]: ...
    @property
    def stopped_by(self) -> str | None: ...
    @property
    def energy_lost(self) -> float: ...
    @property
    def warnings(self) -> list[str]: ...

class LivePage:
    @property
    def html(self) -> str: ...
    def write(self, path: str | PathLike[str]) -> None: ...
    def _repr_html_(self) -> str: ...

class Equilibrium:
    @property
    def state(self) -> Any: ...
    @property
    def stability(self) -> str: ...

class Linearization:
    @property
    def coordinates(self) -> list[str]: ...
    @property
    def mass(self) -> Array: ...
    @property
    def damping(self) -> Array: ...
    @property
    def stiffness(self) -> Array: ...
    @property
    def input(self) -> Array: ...
    @property
    def frequencies(self) -> Array: ...
    @property
    def damping_ratios(self) -> Array: ...

class Motion:
    @property
    def model(self) -> Any: ...
    @property
    def t(self) -> Array: ...
    @property
    def q(self) -> Array: ...
    @property
    def u(self) -> Array: ...
    @property
    def energy(self) -> Array: ...
    @property
    def start(self) -> Any: ...
    @property
    def end(self) -> Any: ...
    @property
    def interval(self) -> tuple[float, float]: ...
    @property
    def columns(self) -> list[str]: ...
    @property
    def events(self) -> list[Event]: ...
    @property
    def summary(self) -> Summary: ...
    def verify(self) -> Summary: ...
    def at(self, t: Any) -> Any: ...
    def get(self, name: str, times: ArrayLike | None = None) -> Array: ...
    def reaction(self, constraint: str, times: ArrayLike | None = None) -> Array: ...
    def to_numpy(
        self,
        times: ArrayLike | None = None,
        *,
        form: Literal["dict", "structured", "matrix"] = "dict",
        accelerations: bool = False,
        multipliers: bool = False,
    ) -> Any: ...
    def to_pandas(
        self, times: ArrayLike | None = None, *, accelerations: bool = False, multipliers: bool = False
    ) -> Any: ...
    def animate(self, path: str | PathLike[str]) -> None: ...
    def write_csv(self, path: str | PathLike[str]) -> None: ...
    def plot(
        self, path: str | PathLike[str], what: Literal["coordinates", "outputs", "energy"] = "coordinates"
    ) -> None: ...
    def live(self) -> LivePage: ...
    def __getitem__(self, name: str) -> Array: ...

class Model(Generic[_S, _M]):
    EQUATIONS: ClassVar[str]
    LATEX: ClassVar[str]
    REPORT: ClassVar[str]
    LISTING: ClassVar[str]
    COORDINATES: ClassVar[tuple[str, ...]]
    INPUTS: ClassVar[tuple[str, ...]]
    PARAMETERS: ClassVar[tuple[str, ...]]
    OUTPUTS: ClassVar[tuple[str, ...]]
    EVENTS: ClassVar[tuple[str, ...]]
    CONSTRAINTS: ClassVar[tuple[str, ...]]
    CONSERVED: ClassVar[tuple[str, ...]]
    UNITS: ClassVar[dict[str, str]]
    def to_dict(self) -> dict[str, Any]: ...
    def simulate(
        self,
        start: _S,
        *,
        until: float,
        tolerance: float | None = None,
        tolerances: tuple[float, float] | None = None,
        method: Method | tuple[Method, float] | None = None,
        fixed_step: float | None = None,
        first_step: float | None = None,
        max_step: float | None = None,
        max_steps: int | None = None,
        times: ArrayLike | None = None,
        every: float | None = None,
        inputs: ArrayLike
        | Mapping[str, ArrayLike]
        | Callable[[float, _S], ArrayLike | Mapping[str, ArrayLike]]
        | None = None,
        events: Mapping[str, Callable[[_S], float]] | None = None,
        on_event: Mapping[
            str,
            Callable[[_S], _S | Literal["stop"] | None]
            | tuple[Direction, Callable[[_S], _S | Literal["stop"] | None]],
        ]
        | None = None,
        stop_at: str | Sequence[str] | Mapping[str, Direction] | None = None,
        contact: Mapping[str, float] | None = None,
        stick_slip: Mapping[str, str] | None = None,
        formulation: Literal["projected", "embedded", "augmented", "baumgarte"]
        | tuple[Literal["baumgarte"], float, float]
        | None = None,
        drift_limit: float | None = None,
        consistent_output: bool = False,
        estimate_error: bool = False,
    ) -> _M: ...
    def accelerations(
        self,
        q: ArrayLike | _S,
        u: ArrayLike | None = None,
        t: ArrayLike | None = None,
        inputs: Inputs | None = None,
        *,
        release: Release | None = None,
    ) -> Array: ...
    def mass_matrix(
        self,
        q: ArrayLike | _S,
        t: ArrayLike | None = None,
        inputs: Inputs | None = None,
        *,
        release: Release | None = None,
    ) -> Array: ...
    def evaluate(
        self,
        what: Literal[
            EVALUATIONS
        ],
        q: ArrayLike | _S,
        u: ArrayLike | None = None,
        t: ArrayLike | None = None,
        inputs: Inputs | None = None,
        *,
        release: Release | None = None,
    ) -> Any: ...
    def equilibrium(self, near: _S) -> Equilibrium: ...
    def linearize(self, at: _S) -> Linearization: ...
    def live(
        self,
        start: _S,
        *,
        title: str | None = None,
        ranges: Mapping[str, tuple[float, float]] | None = None,
        hold: Sequence[str] | None = None,
        plot: Sequence[str] | None = None,
        phase: str | None = None,
        tolerance: float | None = None,
        until: float | None = None,
        contact: Mapping[str, float] | None = None,
        stick_slip: Mapping[str, str] | None = None,
        stop_at: str | Sequence[str] | Mapping[str, Direction] | None = None,
        height: int = 640,
    ) -> LivePage: ...
    def _repr_latex_(self) -> str: ...

def stub() -> str: ...
