"""Base classes for ``Solution`` (evaluated at first use, stored for tables and plots) and for the model that ran;
display of a solution in notebooks with its outcome and the start, end and range of each column."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.base.html import page, paragraph, table
from eomgen.compiled.beams import SectionLoads
from eomgen.compiled.coordinates import StateArrays
from eomgen.errors import Problem, UsageError
from eomgen.results.dense_output import Between
from eomgen.results.error_estimate import ErrorEstimate
from eomgen.results.events import Events
from eomgen.results.finding import Finding

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel
    from eomgen.results.poses import PosesAndScenery


class DeferredEvaluator(Protocol):
    """Evaluator of the attributes of a solution on the first request: ``simulation.outcome.JudgedRun``."""

    @property
    def outputs(self) -> Mapping[str, Array]: ...
    @property
    def energy(self) -> Mapping[str, Array]: ...
    @property
    def stats(self) -> Mapping[str, Any]: ...
    @property
    def findings(self) -> tuple[Finding, ...]: ...
    @property
    def message(self) -> str: ...
    @property
    def success(self) -> bool: ...
    @property
    def metadata(self) -> Mapping[str, Any]: ...
    @property
    def error(self) -> ErrorEstimate: ...


class RecordedSolution(DeferredEvaluator, Protocol):
    """Base of ``Solution``, with attributes that are evaluated at first use."""

    @property
    def t(self) -> Array: ...
    @property
    def q(self) -> Array: ...
    @property
    def v(self) -> Array: ...
    @property
    def a(self) -> Array: ...
    @property
    def z(self) -> Array: ...
    @property
    def multipliers(self) -> Array: ...
    @property
    def inputs(self) -> Mapping[str, Array]: ...
    @property
    def events(self) -> Events: ...

    def columns(self) -> dict[str, Array]: ...

    def units(self) -> dict[str, str]: ...


class ModelOfRun(Protocol):
    """The model of a run with inputs and parameters of the run, for quantities that rows do not hold."""

    @property
    def model(self) -> CompiledModel:
        """The compiled model."""

    @property
    def between(self) -> Between | None:
        """States between rows by the method itself; None if states are interpolated."""

    @property
    def has_poses(self) -> bool:
        """Whether poses need no compilation."""

    @property
    def alike(self) -> Callable[[], Sequence[Finding]]:
        """Return findings on motion that runs at other steps do not resolve either."""

    def poses_and_scenery(self, t: Array, q: Array) -> PosesAndScenery: ...

    def inputs(self, t: Array) -> dict[str, Array]: ...

    def outputs(self, state: StateArrays) -> dict[str, Array]: ...

    def given_at(self, state: StateArrays) -> tuple[Array | None, Array]:
        """Return the inputs of the run and the parameters at the times of a state."""

    def section_loads(self, state: StateArrays, multipliers: Array) -> Mapping[str, SectionLoads]: ...


class MotionWithModel(Protocol):
    """Interface of a ``Solution`` with states between rows."""

    @property
    def model(self) -> ModelOfRun | None: ...

    def at(self, t: ArrayLike) -> StateArrays: ...


def model_of(solution: MotionWithModel, call: str, need: str) -> ModelOfRun:
    """Return the model of the run of a solution. Raises UsageError for a stored solution, which has none; `call` and
    `need` are the call that needs the model, and words on its need, for the message."""
    if solution.model is None:
        fault = f"{need} the model and the inputs of the run, which a stored solution does not hold [E1296]"
        hint = "model.attach(solution), with inputs={...} for the functions and tables that drove the run"
        raise UsageError(Problem(call, fault, hint))
    return solution.model


#: Columns that are rates of other columns, and constraint forces: ``columns()`` has these columns, which would fill the
#: page.
_LEFT_OUT = ("a.", "multipliers")


def html(solution: RecordedSolution) -> str:
    """Return a page of HTML for notebooks: message, method, estimated error, energy balance and columns of a run."""
    data = solution.metadata
    settings = ", ".join(f"{name} {value:.4g}" for name, value in data.get("settings", {}).items())
    outcome = [
        ("outcome", solution.message),
        ("method", f"{data.get('method', '')}: {settings}" if settings else data.get("method", "")),
        ("estimated error", str(solution.error.largest or solution.error)),
        ("energy balance", str(data.get("energy_balance", ""))),
    ]
    return page(
        f"Solution of {data.get('scene', 'a scene')}",
        paragraph("" if solution.success else "The run is not a success."),
        table(("", ""), ((name, text) for name, text in outcome if text)),
        table(("column", "unit", "at the start", "at the end", "least", "largest"), _columns(solution)),
    )


def _columns(solution: RecordedSolution) -> Iterator[tuple[str, ...]]:
    units = solution.units()
    for name, values in solution.columns().items():
        if name.startswith(_LEFT_OUT) or not len(values):
            continue
        numbers = values[0], values[-1], np.min(values), np.max(values)
        yield name, units.get(name, ""), *(f"{value:.6g}" for value in numbers)
