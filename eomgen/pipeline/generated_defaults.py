"""Values that generated C starts from: other defaults of tunable parameters, and the static equilibrium, which is found
when the folder is made, not by the C; and names, units and ranges of coordinates for its manifest.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from eomgen.base.data import replace
from eomgen.base.messages import first_of
from eomgen.compiled.arguments import Requirements, by_name, check_finite
from eomgen.compiled.coordinates import coordinate_names, coordinate_units
from eomgen.errors import EomgenError, Problem, UsageError
from eomgen.formula.evaluate import evaluate, symbols
from eomgen.formula.nodes import Formula
from eomgen.lie.product import Factor, turned
from eomgen.pipeline.front_end import Document
from eomgen.scene.scene import Scene
from eomgen.system.description import Description, Requirement
from eomgen.system.system import Quantity
from eomgen.system.terms import PURPOSES

if TYPE_CHECKING:
    from eomgen.codegen.program import Program
    from eomgen.pipeline.model import Model


def with_parameters(document: Document, described: Description, parameters: Mapping[str, float | str]) -> Scene:
    """Return a scene whose tunable parameters have other values.

    Parameters
    ----------
    document : prepared by the front end, so that calibrated gains follow the scene's values
    parameters : numbers, or texts with units

    Raises
    ------
    UsageError
        Unknown or fixed names, values that the scene would refuse, and documents of other front ends.
    """
    if not isinstance(document, Scene):
        fault = (
            f"{described.name} is not a scene, and only scenes are written with other values of their"
            f" parameters [E0541]"
        )
        raise UsageError(Problem("parameters", fault, "leave them out"))
    tunable = [item for item in document.parameters if item.tunable]
    names = [item.name for item in tunable]
    fixed = [item.name for item in document.parameters if not item.tunable]
    start = np.array([item.value for item in tunable])
    values = by_name("parameter", parameters, names, start, fixed, {item.name: item.unit for item in tunable})
    if values.ndim != 1:
        raise UsageError(
            Problem("parameters", "one set of parameters is needed, not a batch [E0542]", "a number for each name")
        )
    check_finite("parameters", values, [f"parameter {name}" for name in names])
    Requirements(described, names).check(values)
    values_by_name = dict(zip(names, values.tolist(), strict=True))
    changed = tuple(replace(item, value=values_by_name.get(item.name, item.value)) for item in document.parameters)
    return replace(document, parameters=changed)


def with_equilibrium_start(
    program: Program,
    build: Callable[[Sequence[str]], Model],
    parameters: Mapping[str, float | str] | None = None,
) -> Program:
    """Return a Program whose initial state is the static equilibrium, as of ``simulate``, with a text for the README.

    Velocities are the joints' own, of driven coordinates the drives'. Without an equilibrium the initial state is the
    joints' own; a RuntimeWarning and the README report that.

    Parameters
    ----------
    build : callable
        Builds the model in which the equilibrium is looked for, with the terms given.
    parameters : mapping
        Values of the program's parameters that are not the scene's own.
    """
    try:
        model = build(PURPOSES["equilibrium"])
        rest = model.equilibrium(parameters=parameters)
        q, v = rest.q, turned(model.factors, model.initial_v, model.initial_q, rest.q)
        v = np.where(rest.v != 0.0, rest.v, v)
        if model.multipliers:
            consistent = model.consistent(q, v, parameters=parameters)
            q, v = consistent.q, consistent.v
    except EomgenError as error:
        reason = str(replace(error.problems[0], hint=""))
        start = (
            "The scene asks for a start at static equilibrium, which was not found when this code was made, so it"
            f" starts at the initial state of the joints. The reason: {reason}"
        )
        warnings.warn(f"{program.prefix}: {start} [W0046]", RuntimeWarning, stacklevel=3)
        return replace(program, start=f"{start}.")
    left = f"below 1e{math.ceil(math.log10(rest.acceleration))}" if rest.acceleration else "zero"
    start = (
        f"It starts at static equilibrium, found when this code was made, {_at(program.parameters, program.inputs)}."
    )
    start += (
        f" The accelerations left unbalanced there, in m/s^2 or rad/s^2, are {left}; velocities are those of the"
        f" joints{' and of the drives' if np.any(rest.v) else ''}."
    )
    for note in rest.message.split("; ")[1:]:
        start += f" Note: {note}."
    if program.parameters or program.inputs:
        start += " Other values have their equilibrium elsewhere, and the C does not look for it."
    state = [tuple(map(float, values)) for values in (q, v, rest.z)]
    return replace(program, start=start, initial_q=state[0], initial_v=state[1], initial_z=state[2])


def with_interface(program: Program, described: Description) -> Program:
    """Return a Program with names, units and starts of q and v, and with the ranges of parameters and coordinates.

    The range of a parameter is the one in which the scene's requirements hold with the other parameters at the
    defaults; ends are in the range or next to it. The range of a coordinate is between its stops, which give way.
    """
    factors = [Factor(**factor) for factor in program.factors]
    q_names, v_names = coordinate_names(factors)
    q_units, v_units = coordinate_units(factors, described.coordinates)
    q_names += [f"q.{name}" for name in program.angles]
    q_units += ["rad"] * len(program.angles)
    coordinates = zip(q_names, program.initial_q, q_units, strict=True)
    velocities = zip(v_names, program.initial_v, v_units, strict=True)
    return replace(
        program,
        coordinates=tuple(Quantity(name, value, unit=unit) for name, value, unit in coordinates),
        velocities=tuple(Quantity(name, value, unit=unit) for name, value, unit in velocities),
        bounds={**_ranges_of_parameters(program, described), **_ranges_of_coordinates(program, described)},
    )


Range = tuple[float | None, float | None]


def _ranges_of_coordinates(program: Program, described: Description) -> dict[str, Range]:
    """Return (lower, upper) of coordinates with stops, by name, None for a side without, at a Program's parameters."""
    values = described.values({item.name: item.value for item in program.parameters})

    def end(formula: Formula | None) -> float | None:
        value = math.inf if formula is None else evaluate(formula, lambda symbol: values[symbol.name])
        return value if math.isfinite(value) else None

    return {item.coordinate: (end(item.lower), end(item.upper)) for item in described.limits}


def _ranges_of_parameters(program: Program, described: Description) -> dict[str, Range]:
    """Return (lower, upper) of tunable parameters that requirements restrict, by name, None for a side without an end.
    The other parameters are at their defaults."""
    values = described.values({item.name: item.value for item in program.parameters})
    ranges: dict[str, Range] = {}
    for parameter in program.parameters:
        rules = [rule for rule in described.requirements if parameter.name in _names(rule)]

        def rules_hold(value: float, rules: Sequence[Requirement] = rules, name: str = parameter.name) -> bool:
            return all(_holds(rule, {**values, name: value}) for rule in rules)

        if rules and rules_hold(parameter.value):
            ranges[parameter.name] = (_end(rules_hold, parameter.value, -1.0), _end(rules_hold, parameter.value, 1.0))
    return ranges


def _names(rule: Requirement) -> set[str]:
    return {symbol.name for formula in rule.formulas for symbol in symbols(formula)}


def _holds(rule: Requirement, values: Mapping[str, float]) -> bool:
    """Return whether a requirement is met; a formula without a finite value meets none."""
    try:
        numbers = [evaluate(formula, lambda symbol: values[symbol.name]) for formula in rule.formulas]
    except (ArithmeticError, ValueError):
        return False
    return all(map(math.isfinite, numbers)) and (rule.rule is None or not bool(rule.rule.broken(numbers)))


def _end(met: Callable[[float], bool], start: float, sign: float) -> float | None:
    """Return the end, in direction ``sign``, of the range of numbers that meet requirements and contains ``start``.
    ``met`` returns whether a number meets the requirements. None without an end; the search halves the number of
    doubles in between."""
    largest = sign * 1e150  # squares of larger numbers overflow, for which alone numbers may be refused
    if met(largest):
        return None
    inside, outside = _place(start), _place(largest)
    while abs(outside - inside) > 1:
        middle = (inside + outside) // 2
        inside, outside = (middle, outside) if met(_double(middle)) else (inside, middle)
    return min((_double(outside), _double(inside)), key=lambda value: len(repr(value)))


def _place(number: float) -> int:
    """Return the place of a double in the order of all doubles, 0 for 0.0."""
    bits = int(np.float64(abs(number)).view(np.int64))
    return bits if number >= 0.0 else -bits


def _double(rank: int) -> float:
    """Return the double at a place in the order of all doubles."""
    return math.copysign(float(np.int64(abs(rank)).view(np.float64)), rank)


def _at(parameters: tuple[Quantity, ...], inputs: tuple[Quantity, ...]) -> str:
    """Return words on the parameters and inputs at which the equilibrium was found."""
    values = [f"{item.name} = {item.value:.9g}{f' {item.unit}' if item.unit else ''}" for item in parameters]
    listed = first_of(values, 12)
    at = f"at the default parameters ({listed})" if listed else "for the scene as it is"
    return f"{at} and the inputs of the scene at t = 0" if inputs else at
