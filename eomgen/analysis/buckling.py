"""Buckling loads of a compiled model: linear ones, about a preload."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.analysis.path_following import components_of, start_of_path
from eomgen.base.arrays import Array
from eomgen.compiled.arguments import number_of
from eomgen.compiled.terms import Inputs, Parameters
from eomgen.errors import NumericalError, Problem, UsageError
from eomgen.solvers.bordered_newton import LoadedStatics, Rest
from eomgen.solvers.buckling import half_way, linear_buckling

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel


#: Part by which the lowest load may differ from the prediction half way there.
STEADY = 0.05


@dataclass(frozen=True, repr=False)
class BucklingLoads:
    """Linear buckling loads: values at which the stiffness, extrapolated from a preload, is singular.

    Attributes
    ----------
    parameter, unit : name and unit of the varied parameter
    at : its value of the preload
    values : (n,) of the parameter, nearest to the preload first
    modes : (nv, n) displacements, the largest component of each 1 rad, or the scene's length
    components : of each mode, the names of its largest components
    warning : that extrapolation misleads, as the load bends the structure on its way; empty if it does not
    """

    parameter: str
    unit: str
    at: float
    values: Array
    modes: Array
    components: tuple[tuple[str, ...], ...]
    warning: str = ""

    @property
    def reversed(self) -> tuple[bool, ...]:
        """Whether each critical value belongs to the reversed load."""
        return tuple(bool(value < 0.0) if self.at >= 0.0 else bool(value > 0.0) for value in self.values)

    def __repr__(self) -> str:
        pairs = zip(self.values, self.reversed, strict=True)
        values = ", ".join(f"{value:.6g}{' (reversed load)' if turned else ''}" for value, turned in pairs)
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
    """Return linear buckling loads, at which the stiffness, extrapolated along the path of a preload, is singular.

    They are accurate if the structure bends little up to these loads; ``equilibrium_path`` finds the bifurcations and
    limit points themselves.

    Parameters
    ----------
    parameter : str
        Load of the scene: a tunable parameter, an input, or ``t``.
    at : float
        Its value of the preload, SI.
    count : int
        Number of loads, the nearest to the preload.
    initial, parameters, t, u
        As of ``equilibrium``; the load is not among them.

    Raises
    ------
    NumericalError
        There is no equilibrium under the preload, or its stiffness is singular.
    UsageError
        There is no such parameter, or terms are missing.
    """
    if count < 1:
        raise UsageError(Problem("buckling_loads", f"{count} loads are asked for", "count=4"))
    value = number_of("at", at)
    varied, statics, start = start_of_path(
        model, "buckling_loads", parameter, value, max(abs(value), 1.0), initial, parameters, t, u
    )
    try:
        factors, modes = linear_buckling(statics, start.rest, count)
    except ArithmeticError as error:
        fault = f"no buckling loads about {parameter} = {value:.6g}: {error}"
        raise NumericalError(Problem("buckling_loads", fault, "another preload, at=...")) from None
    named = tuple(components_of(model, statics, mode) for mode in np.transpose(modes))
    warning = _misleads(statics, start.rest, varied.name, value, factors)
    if warning:
        warnings.warn(f"{model.name}: {warning}", RuntimeWarning, stacklevel=3)
    return BucklingLoads(varied.name, varied.unit, value, value + factors, modes, named, warning)


def _misleads(statics: LoadedStatics, rest: Rest, name: str, value: float, factors: Array) -> str:
    """Return a warning that another load is predicted half way to the lowest one; empty if it is the same."""
    if not len(factors):
        return ""
    lowest = float(factors[0])
    later = half_way(statics, rest, lowest)
    if later is not None and abs(later - lowest) <= STEADY * abs(lowest):
        return ""
    told = "there is none" if later is None else f"it is {value + later:.6g}"
    return (
        f"the lowest linear buckling load is {name} = {value + lowest:.6g} by the stiffness at {value:.6g}, and"
        f" half way there {told}: the load bends the structure, so extrapolation misleads; try: equilibrium_path, which"
        " finds limit points and bifurcations"
    )
