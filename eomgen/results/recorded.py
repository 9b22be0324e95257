"""Base classes of ``Solution``, which is evaluated at first use and stored for tables and plots; its display in
notebooks: outcome, and start, end and range of each column."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Protocol

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.html import page, paragraph, table
from eomgen.results.error_estimate import ErrorEstimate
from eomgen.results.events import Events
from eomgen.results.finding import Finding


class DeferredEvaluator(Protocol):
    """Evaluator of the attributes of a solution on the first request: ``simulation.outcome.Outcome``."""

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
    """A ``Solution``: see there."""

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


#: Columns that are rates of other columns, and constraint forces: ``columns()`` has these columns, which would fill the
#: page.
_LEFT_OUT = ("a.", "multipliers")


def html(solution: RecordedSolution) -> str:
    """Return message, method, estimated error and columns of a run."""
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
