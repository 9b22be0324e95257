"""Short ways to write formulas and scenes by hand, and their values over numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from eomgen.formula.nodes import Formula, Number, Operation, Symbol
from eomgen.scene.bodies.model import Body

TIME = Symbol("time")


def number(value: float) -> Formula:
    return Number(float(value))


def vector(values: Sequence[float | Formula]) -> tuple[Formula, Formula, Formula]:
    x, y, z = (value if isinstance(value, Number | Symbol | Operation) else number(value) for value in values)
    return x, y, z


def parameter(name: str) -> Formula:
    return Symbol("parameter", name)


def plus(first: Formula, second: Formula) -> Formula:
    return Operation("add", (first, second))


def times(first: Formula | float, second: Formula) -> Formula:
    return Operation("mul", (first if not isinstance(first, float | int) else number(first), second))


def call(name: str, *arguments: Formula) -> Formula:
    return Operation(name, arguments)


def rigid_body(
    name: str, mass: float, center: Sequence[float] = (0, 0, 0), inertia: Sequence[float] = (0, 0, 0, 0, 0, 0)
) -> Body:
    """Return a body of numbers; inertia (xx, yy, zz, xy, xz, yz) about the centre of mass."""
    # six
    return Body(name, number(mass), vector(center), tuple(number(entry) for entry in inertia))  # type: ignore[arg-type]


def value_of(formula: Formula, parameters: Mapping[str, float]) -> float:
    """Return the value of a formula of numbers and parameters."""
    if isinstance(formula, Number):
        return formula.value
    if isinstance(formula, Symbol):
        return parameters[formula.name]
    x, y = (value_of(argument, parameters) for argument in formula.arguments)
    return {"add": x + y, "mul": x * y}[formula.name]
