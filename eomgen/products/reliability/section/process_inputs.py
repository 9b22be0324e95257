"""Random processes as inputs of a scene, with standard normal variables as parameters of the scene, and modes as
splines: tables in formulas and in C."""

from __future__ import annotations

import functools
import math
import operator
from collections.abc import Sequence

import numpy as np

from eomgen.base.random_inputs import standard_normals
from eomgen.formula.curves import Curve
from eomgen.formula.nodes import Application, Formula, Number, Symbol
from eomgen.products.reliability.random_processes import Expansion
from eomgen.products.reliability.section import schema as written
from eomgen.scene.formula.namespaces import mapped
from eomgen.system.signals import Input, NormalSeries, Parameter

#: Points of a table for each wave of the mode, and the least number of points.
_POINTS, _FEWEST = 8, 32
#: Most points of a table.
_MOST_POINTS = 4096
#: Error of a table, measured by the largest value of all modes; the same by the standard deviation that is left out.
_TABLE_ERROR, _OF_THE_REST = 1e-6, 1e-4


def mode_tables(name: str, expansion: Expansion, start: float) -> tuple[Curve, ...]:
    """Return the modes as splines over x from ``start`` on, each through as many points as its error requires: modes of
    short waves have small values, and need less accuracy relative to them."""
    count, points = len(expansion.eigenvalues), _FEWEST
    result: dict[int, Curve] = {}
    allowed = max(_TABLE_ERROR, _OF_THE_REST * math.sqrt(max(1.0 - float(expansion.captured[-1]), 0.0)))
    highest = 0.0
    while len(result) < count:
        x = np.linspace(0.0, expansion.duration, points + 1)
        between = 0.5 * (x[1:] + x[:-1])
        y, exact = expansion.modes(x), expansion.modes(between)
        highest = max(highest, float(np.max(np.abs(y))))
        last = 2 * points > _MOST_POINTS
        for k in range(count):
            # mode k has about k / 2 waves: fewer points than these may meet it by chance
            if k in result or (points < _POINTS * (k + 1) // 2 and not last):
                continue
            spline = Curve(f"{name} mode {k + 1}", start + x, y[k], smooth_ends=True)
            error = float(np.max(np.abs(spline(start + between) - exact[k])))
            if last or error <= allowed * highest:
                result[k] = spline
        points *= 2
    return tuple(result[k] for k in range(count))


#: Largest nesting depth of a sum, because formulas are walked recursively.
_DEPTH = 257


def input_of(process: NormalSeries, entry: written.RandomProcess) -> Input:
    """Return a process as an input, whose formula it is."""
    return Input(process.name, _formula(process), entry.unit, entry.description, series=process)


def variables_as_parameters(process: NormalSeries) -> list[Parameter]:
    """Return the parameters that are the variables of a process."""
    names = process.own_variables
    values = standard_normals(process.seed, len(names), process.name).tolist()
    return [
        Parameter(name, value, True, "1", f"standard normal variable of mode {k} of {process.name}", True)
        for k, (name, value) in enumerate(zip(names, values, strict=True), 1)
    ]


def _formula(process: NormalSeries) -> Formula:
    """Return a process as a formula of time and its variables."""
    x: Formula = Symbol("time")
    if process.speed:
        x = process.speed * x
    if process.lag:
        x = x - process.lag
    terms = [
        (Symbol("parameter", variable) if weight == 1.0 else weight * Symbol("parameter", variable))
        * Application(mode, x)
        for variable, weight, mode in zip(process.variables, process.weights, process.modes, strict=True)
    ]
    g: Formula = _sum([Number(process.mean), *terms] if process.mean else terms)
    if process.translation is None:
        return g
    return mapped(process.translation, lambda symbol: g if symbol.kind == "gaussian" else symbol)


def _sum(terms: Sequence[Formula]) -> Formula:
    """Return the sum of terms, nested such that the depth hardly grows with the number of terms."""
    parts = [functools.reduce(operator.add, terms[k : k + _DEPTH]) for k in range(0, len(terms), _DEPTH)]
    return parts[0] if len(parts) == 1 else _sum(parts)
