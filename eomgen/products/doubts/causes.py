"""Causes of values that are not finite: curves left, springs whose ends meet, angles too large for sines, tyres without
a slip direction, and formulas without a value: quotients by zero, roots and logarithms of negative numbers."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cache, partial
from typing import TYPE_CHECKING

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.messages import listed
from eomgen.base.rounding import COMPUTED
from eomgen.errors import UsageError
from eomgen.formula.curves import EDGE, Curve
from eomgen.formula.discontinuities import applications
from eomgen.formula.evaluate import SymbolValues, apply, evaluate, value_in
from eomgen.formula.features import WITH_EDGE
from eomgen.formula.nodes import ZERO, Application, EntryQuantity, Formula, Operation, Symbol
from eomgen.lie.numeric import rotated
from eomgen.products.doubts.places import BACK, place, poses_of
from eomgen.simulation.judgement.diagnosis import SMALLER_ANGLES
from eomgen.simulation.stepping.settings import HINT, REASON, large_angles, large_joint_angles
from eomgen.system.description import Description, HeightSurface

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel
    from eomgen.simulation.stepping.inputs import InputSignals


_SAID = {name: f"{name}({{0}})" for name in WITH_EDGE} | {"pow": "({0}) ** ({1})"}


def cause_of(
    model: CompiledModel, block: str, t: float, state: tuple[Array, Array, Array], p: Array, signals: InputSignals
) -> tuple[str, str]:
    """Return the cause, as a clause, of a block that is not finite at a state (q, v, z), and a remedy; empty texts if
    curves, springs, formulas, tyres and angles show no cause. ``block`` is the name of the block in messages, ``p``
    (np,) are parameters, ``signals`` the inputs."""
    q, v, z = state
    poses = cache(lambda: poses_of(model.having(("poses",)), t, q, p))
    values: SymbolValues = values_of(model, t, q, v, z, p, signals)
    values = {**values, **_positions(model, poses, values)}
    if left := curves_outside_range(model.description, values) or _left_by_contacts(model, poses, values):
        return f", where the curve {left}", 'points that reach further, or outside = "hold" or "periodic"'
    if met := _met_springs(model, poses, values):
        fault = f": the ends of {met} meet, and a force along the line between them has no direction"
        return fault, "ends that stay apart; springs of length 0 without damping, whose force is 0 there"
    if taken := large_angles(model.description, values):
        return f", where formulas take {taken}: {REASON}", HINT
    if angles := large_joint_angles(model.q_names, model.q_units, q):
        return f", where {angles}: {REASON}", SMALLER_ANGLES
    unknown = operations_without_value(model.description, values) or _surfaces_without_value(model, poses, values)
    if unknown:
        hint = "another start, or a formula that has a value there, such as max(x, 1e-3) in place of x"
        return f", where in a formula {unknown}", hint
    if tyres := _upright_tyres(model, poses):
        hint = "the axis of the wheel's spin, in the axes of its body, and another initial state"
        return f", where slip.axis of the tyre {tyres} is upright", hint
    surfaces = any(item.size != ZERO for item in model.description.contacts)
    if "contact with the surface" in block or (surfaces and block.startswith("Q ")):
        fault = ", and the body meets no single point of the surface, as in a valley that is narrower than the body"
        return fault, "a surface whose radius of curvature is above the radius of the body, or a smaller radius"
    return "", ""


def operations_without_value(description: Description, values: SymbolValues) -> str:
    """Return the operations of formulas that have no value, in words, three at most; empty if none is known.

    Parameters
    ----------
    values : numbers by kind, name and index of a symbol; operations that need further symbols are left out
    """
    result, value_of = dict[str, None](), partial(value_in, values)
    for formula in _formulas(description):
        result |= dict.fromkeys(_without_value(formula, value_of))
    return " and ".join(list(result)[:3])


def _quantity_without_value(formula: EntryQuantity, value_of: Callable[[Symbol], float]) -> Iterator[str]:
    numbers, value = [evaluate(part, value_of) for part in formula.arguments], evaluate(formula, value_of)
    if all(map(math.isfinite, numbers)) and not math.isfinite(value):
        pairs = zip(formula.word.arguments_of(formula.item), numbers, strict=False)
        texts = [f"{name} = {number:.6g}" for name, number in pairs]
        yield f"{formula.word.named(formula.item, formula.component)} is {value:g} at {', '.join(texts)}"


def _without_value(formula: Formula, value_of: Callable[[Symbol], float]) -> Iterator[str]:
    """Yield a text for each operation within a formula that has no value at its operands; ``value_of`` gives numbers of
    symbols."""
    if isinstance(formula, Application):
        yield from _without_value(formula.argument, value_of)
    if not isinstance(formula, Operation):
        return
    parts = formula.arguments
    try:
        if formula.name == "select":
            condition, then, otherwise = parts
            parts = (condition, then if evaluate(condition, value_of) != 0.0 else otherwise)
        elif isinstance(formula, EntryQuantity):
            yield from _quantity_without_value(formula, value_of)
        elif formula.name == "div" or formula.name in _SAID:
            numbers = [evaluate(part, value_of) for part in parts]
            if max(map(abs, numbers)) < 1e12:  # else of a motion that has grown without end
                try:
                    apply(formula.name, numbers)
                except ArithmeticError:
                    texts = [f"{number:.6g}" for number in numbers]
                    said = f"{texts[0]} / {texts[1]}" if formula.name == "div" else _SAID[formula.name].format(*texts)
                    of = parts[-1:] if formula.name == "div" else parts
                    named = (symbol for part in of for symbol in _symbols(part))
                    names = dict.fromkeys(_value_text(symbol, value_of) for symbol in named)
                    yield f"{said} has no value{' at ' if names else ''}{', '.join(list(names)[:3])}"
    except ArithmeticError:  # of something that is not known here
        pass
    for part in parts:
        yield from _without_value(part, value_of)


def _symbols(formula: Formula) -> Iterator[Symbol]:
    if isinstance(formula, Symbol):
        yield formula
    elif isinstance(formula, Operation):
        for part in formula.arguments:
            yield from _symbols(part)


def _value_text(symbol: Symbol, value_of: Callable[[Symbol], float]) -> str:
    coordinate = "xyz"[symbol.index] if symbol.kind == "local" else ""
    names = {"time": "t", "q": f"q.{symbol.name}", "v": f"v.{symbol.name}", "local": coordinate}
    name = names.get(symbol.kind, symbol.name)
    return f"{name} = {value_of(symbol):.6g}"


def _positions(
    model: CompiledModel, poses: Callable[[], Mapping[str, Array]], values: SymbolValues
) -> dict[tuple[str, str, int], float]:
    """Return the world positions, m, of the points that arguments of curves mention, by ("position", name, index)."""
    formulas = (used.argument for formula in model.description.formulas for used in applications(formula))
    named = {symbol.name for formula in formulas for symbol in _symbols(formula) if symbol.kind == "position"}
    return {
        ("position", item.name, k): float(x)
        for item in model.description.drawing.points
        if item.name in named
        for k, x in enumerate(place(poses()[item.body], _numbers(values, item.position)))
    }


def _met_springs(model: CompiledModel, poses: Callable[[], Mapping[str, Array]], values: SymbolValues) -> str:
    """Return the springs whose ends are in one place, in words; empty if there are none."""
    points, result = {point.name: point for point in model.description.drawing.points}, []
    for line in model.description.drawing.lines:
        ends = [points[line.first], points[line.second]]
        with suppress(ArithmeticError, KeyError):  # of something that is not known here
            places = [place(poses()[end.body], _numbers(values, end.position)) for end in ends]
            if line.elastic and np.ptp(places, axis=0).max() <= 8.0 * np.finfo(float).eps * np.abs(places).max():
                result.append(line.name)
    return f"the spring{'s' * (len(result) > 1)} {listed(result)}" if result else ""


def _numbers(values: SymbolValues, formulas: Sequence[Formula]) -> list[float]:
    return [evaluate(part, lambda symbol: values[symbol.kind, symbol.name, symbol.index]) for part in formulas]


def _places_on_surfaces(
    model: CompiledModel, poses: Callable[[], Mapping[str, Array]], values: SymbolValues
) -> Iterator[tuple[HeightSurface, float, Array]]:
    """Yield surfaces, with the size of the body and its place in their axes, (3,), m."""
    for item in model.description.contacts:
        with suppress(ArithmeticError, KeyError):  # of something that is not known here
            origin, center, (size,) = (_numbers(values, part) for part in (item.position, item.center, [item.size]))
            pose = poses()[item.body]
            in_body = rotated(pose[:4] * BACK, place(poses()[item.rider], center) - pose[4:])
            yield item, size, (in_body - np.array(origin)) @ np.array(item.axes)


def _at(values: SymbolValues, local: Array) -> SymbolValues:
    return {**values, **{("local", "position", k): float(x) for k, x in enumerate(local)}}


def _left_by_contacts(model: CompiledModel, poses: Callable[[], Mapping[str, Array]], values: SymbolValues) -> str:
    """Return, in words, a curve of a surface that a contact leaves at its ends, with the constraint; empty without
    one."""
    for item, size, local in _places_on_surfaces(model, poses, values):
        used = [(use.curve, use.argument) for use in applications(item.height) if isinstance(use.curve, Curve)]
        with suppress(ArithmeticError, KeyError):  # of something that is not known here
            for curve, argument in used:
                arguments = []
                for off in size * np.array([[0, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]]):
                    arguments += _numbers(_at(values, local + off), [argument])
                if _outside(curve, arguments):
                    near = f"within {size:.6g} m of" if size else "at"
                    return f"{_range_of(curve)} and is asked {near} {arguments[0]:.9g} by the constraint {item.name}"
    return ""


def _surfaces_without_value(
    model: CompiledModel, poses: Callable[[], Mapping[str, Array]], values: SymbolValues
) -> str:
    """Return operations without a value in heights of surfaces below bodies, in words; empty if none is known."""
    result = dict[str, None]()
    for item, _, local in _places_on_surfaces(model, poses, values):
        said = _without_value(item.height, partial(value_in, _at(values, local)))
        result |= dict.fromkeys(f"of the surface of {item.name} {text}" for text in said)
    return " and ".join(list(result)[:3])


def _outside(curve: Curve, arguments: Sequence[float]) -> bool:
    """Return whether the curve has no value at one of the arguments."""
    margin = EDGE * (curve.end - curve.start)
    within = all(curve.start - margin <= at <= curve.end + margin for at in arguments)
    return curve.outside == "error" and not within


def _range_of(curve: Curve) -> str:
    name = curve.name.partition(", ")[0]  # lines of one surface have a common name
    return f"{name} has points from {curve.start:.9g} to {curve.end:.9g}"


def values_of(
    model: CompiledModel, t: float, q: Array, v: Array, z: Array, p: Array, signals: InputSignals
) -> dict[tuple[str, str, int], float]:
    """Return the numbers that symbols of formulas have at a state, by kind, name and index; without inputs that have no
    value at t."""
    values = {("time", "", 0): t}
    values |= {("parameter", item.name, 0): item.value for item in model.description.parameters}
    values |= {("parameter", name, 0): float(value) for name, value in zip(model.parameters, p, strict=True)}
    for factor in model.factors:
        values |= {("q", factor.name, index): float(value) for index, value in enumerate(q[factor.q])}
        values |= {("v", factor.name, index): float(value) for index, value in enumerate(v[factor.v])}
    for number, label in enumerate(model.angles, model.nq - len(model.angles)):
        joint, _, index = label.partition(".angle")
        values["q", joint, int(index.strip("[]") or 0)] = float(q[number])
    values |= {
        ("state", item["name"], 0): float(value) for item, value in zip(model.library.layout["states"], z, strict=True)
    }
    try:
        u = signals.rows(np.array([t]))[0]
    except UsageError:
        return values
    return values | {("input", name, 0): float(value) for name, value in zip(model.inputs, u, strict=True)}


def curves_outside_range(description: Description, values: SymbolValues) -> str:
    """Return, in words, the curves with ``outside = "error"`` that formulas evaluate outside their range; empty without
    such curves. ``values`` are numbers by kind, name and index of a symbol; arguments that need further symbols are
    left out."""
    result, value_of = dict[str, str](), partial(value_in, values)
    for used in (use for formula in _formulas(description) for use in applications(formula)):
        with suppress(ArithmeticError):
            at = evaluate(used.argument, value_of)
            if isinstance(curve := used.curve, Curve) and _outside(curve, [at]):
                result.setdefault(curve.name.partition(", ")[0], f"{_range_of(curve)} and is asked at {at:.9g}")
    return " and ".join(result.values())


def _formulas(description: Description) -> Iterator[Formula]:
    yield from (item.formula for item in description.inputs if item.formula is not None)
    yield from description.formulas


def _upright_tyres(model: CompiledModel, poses: Callable[[], Mapping[str, Array]]) -> str:
    """Return the tyres whose axis is upright, so that their slip has no directions; empty for none."""
    points, named = {point.name: point for point in model.description.drawing.points}, []
    for wheel in model.description.drawing.wheels:
        if wheel.axis is not None:
            axis = rotated(poses()[points[wheel.center].body][:4], np.array(wheel.axis))
            if np.hypot(axis[0], axis[1]) <= COMPUTED * np.linalg.norm(axis):
                named.append(wheel.name)
    return ", ".join(named)
