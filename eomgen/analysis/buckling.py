"""Buckling loads of a compiled model: linear ones, about a preload."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.analysis.path_following import components_of, start_of_path
from eomgen.arrays import Array
from eomgen.compiled.arguments import number_of
from eomgen.compiled.terms import Inputs, Parameters
from eomgen.errors import NumericalError, Problem, UsageError
from eomgen.solvers.buckling import linear_buckling

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel


@dataclass(frozen=True, repr=False)
class BucklingLoads:
    """Linear buckling loads: where the stiffness, extrapolated from a preload, is singular.

    Attributes
    ----------
    parameter, unit : name and unit of what is varied
    at : its value of the preload
    values : (n,) of the parameter, nearest to the preload first
    modes : (nv, n) displacements, the largest component of each 1 rad, or the scene's length
    components : of each mode, the names of those that take the largest part
    """

    parameter: str
    unit: str
    at: float
    values: Array
    modes: Array
    components: tuple[tuple[str, ...], ...]

    def __repr__(self) -> str:
        values = ", ".join(f"{value:.6g}" for value in self.values)
        unit = f" {self.unit}" if self.unit not in ("", "1") else ""
        return f"<BucklingLoads: {self.parameter} = {values or 'none'}{unit if len(self.values) else ''}>"


def buckling_loads(
    model: CompiledModel,
    parameter: str,
    at: float = 0.0,
    count: int = 4,
    *,
    initial: Mapping[str, Any] | None = None,
    parameters: Parameters = None,
    t: float = 0.0,
    u: Inputs = None,
) -> BucklingLoads:
    """Return linear buckling loads; see ``Model.buckling_loads``."""
    if count < 1:
        raise UsageError(Problem("buckling_loads", f"{count} loads are asked for", "count=4"))
    value = number_of("at", at)
    varied, statics, start = start_of_path(
        model, "buckling_loads", parameter, value, max(abs(value), 1.0), initial, parameters, t, u
    )
    try:
        factors, modes = linear_buckling(statics, start.rest, count)
    except ArithmeticError as error:
        what = f"no buckling loads about {parameter} = {value:.6g}: {error}"
        raise NumericalError(Problem("buckling_loads", what, "another preload, at=...")) from None
    named = tuple(components_of(model, statics, mode) for mode in np.transpose(modes))
    return BucklingLoads(varied.name, varied.unit, value, value + factors, modes, named)
