"""Random processes as inputs of a scene, and their variables as its parameters."""

from __future__ import annotations

import functools
import operator
from collections.abc import Sequence

from eomgen.base.standard_normals import standard_normals
from eomgen.formula.nodes import Application, Formula, Number, Symbol
from eomgen.products.reliability.section import schema as written
from eomgen.scene.formula.namespaces import mapped
from eomgen.system.random_processes import RandomProcess
from eomgen.system.signals import Input, Parameter

#: Largest nesting depth of a sum, because formulas are walked recursively.
_DEPTH = 257


def input_of(process: RandomProcess, entry: written.RandomProcess) -> Input:
    """Return a process as an input, whose formula it is."""
    return Input(process.name, _formula(process), entry.unit, entry.description, random=process)


def variables_as_parameters(process: RandomProcess) -> list[Parameter]:
    """Return the parameters that are the variables of a process."""
    names = process.own_variables
    values = standard_normals(process.seed, len(names), process.name).tolist()
    return [
        Parameter(name, value, True, "1", f"standard normal variable of mode {k} of {process.name}")
        for k, (name, value) in enumerate(zip(names, values, strict=True), 1)
    ]


def _formula(process: RandomProcess) -> Formula:
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
