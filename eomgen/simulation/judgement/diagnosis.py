"""Diagnosis of a failed run or step: the first quantity that is not finite, a controller's C function, the evidence,
and a remedy.

Operations of formulas that have no value at a state: quotients by zero, roots and logarithms of negative numbers.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.messages import counted, listed
from eomgen.compiled.equations import accelerations
from eomgen.compiled.rest.state_warnings import inertia_warning
from eomgen.errors import EomgenError, Problem, UsageError
from eomgen.formula.curves import EDGE, Curve
from eomgen.formula.discontinuities import applications
from eomgen.formula.evaluate import apply, evaluate
from eomgen.formula.features import WITH_EDGE, rough_operations
from eomgen.formula.nodes import Application, Formula, Operation, Quantity, Symbol
from eomgen.integrators.events import CONTROLLER_ADVICE, CONTROLLER_FAILED
from eomgen.integrators.families.adaptive import MOST_STEPS
from eomgen.integrators.families.family import NOT_FINITE
from eomgen.integrators.families.register import Method
from eomgen.lie import product
from eomgen.lie.numeric import rotated
from eomgen.simulation.judgement.instability import Growth
from eomgen.simulation.judgement.starts import upright_tyres
from eomgen.simulation.stepping.run import Run
from eomgen.simulation.stepping.settings import HINT, REASON, large_angles, large_joint_angles
from eomgen.simulation.stepping.stepper import Stepper
from eomgen.system.description import BASE, Description, Point
from eomgen.system.terms import TERMS

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel
    from eomgen.simulation.stepping.inputs import InputSignals


Values = Mapping[tuple[str, str, int], float]
#: Remedy for operations without a value.
OTHER_FORMULA = "another start, or a formula that has a value there, such as max(x, 1e-3) in place of x"
_SAID = {name: f"{name}({{0}})" for name in WITH_EDGE} | {"pow": "({0}) ** ({1})"}
#: Displacements to the places around a centre, by the size of a body.
_AROUND = np.array([[0, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]], float)
#: Distance of ends in one place, in parts of their coordinates.
_MET = 8.0 * float(np.finfo(float).eps)
#: The pose of the world.
_STILL = np.array([1.0, 0, 0, 0, 0, 0, 0])
#: Arguments beyond this size come from a motion that has grown without end.
_GROWN = 1e12


def operations_without_value(description: Description, values: Values) -> str:
    """Return a description of the operations of formulas that have no value; empty if none is known.

    Parameters
    ----------
    values : numbers by kind, name and index of a symbol; operations that need further symbols are left out
    """

    def value_of(symbol: Symbol) -> float:
        try:
            return values[symbol.kind, symbol.name, symbol.index]
        except KeyError:
            raise ArithmeticError(f"{symbol.kind} {symbol.name}") from None

    result: dict[str, None] = {}
    formulas = (item.formula for item in description.inputs if item.formula is not None)
    for formula in (*formulas, *description.formulas):
        result |= dict.fromkeys(_without_value(formula, value_of))
    return " and ".join(list(result)[:3])


def _quantity_without_value(formula: Quantity, value_of: Callable[[Symbol], float]) -> Iterator[str]:
    names = formula.word.arguments_of(formula.item)
    numbers = [evaluate(part, value_of) for part in formula.arguments]
    value = evaluate(formula, value_of)
    if all(map(math.isfinite, numbers)) and not math.isfinite(value):
        place = ", ".join(f"{name} = {number:.6g}" for name, number in zip(names, numbers, strict=False))
        yield f"{formula.word.named(formula.item, formula.component)} is {value:g} at {place}"


def _without_value(formula: Formula, value_of: Callable[[Symbol], float]) -> Iterator[str]:
    if isinstance(formula, Application):
        yield from _without_value(formula.argument, value_of)
    if not isinstance(formula, Operation):
        return
    parts = formula.arguments
    try:
        if formula.name == "select":
            condition, then, otherwise = parts
            parts = (condition, then if evaluate(condition, value_of) != 0.0 else otherwise)
        elif isinstance(formula, Quantity):
            yield from _quantity_without_value(formula, value_of)
        elif formula.name == "div" or formula.name in _SAID:
            numbers = [evaluate(part, value_of) for part in parts]
            if max(map(abs, numbers)) < _GROWN:
                try:
                    apply(formula.name, numbers)
                except ArithmeticError:
                    texts = [f"{number:.6g}" for number in numbers]
                    said = f"{texts[0]} / {texts[1]}" if formula.name == "div" else _SAID[formula.name].format(*texts)
                    of = parts[-1:] if formula.name == "div" else parts
                    named = (symbol for part in of for symbol in _symbols(part))
                    names = dict.fromkeys(_named(symbol, value_of) for symbol in named)
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


def _named(symbol: Symbol, value_of: Callable[[Symbol], float]) -> str:
    name = {"time": "t", "q": f"q.{symbol.name}", "v": f"v.{symbol.name}"}.get(symbol.kind, symbol.name)
    return f"{name} = {value_of(symbol):.6g}"


#: Largest turn of a joint within a step that steppers count, rad.
COUNTED = 0.9 * 2.0 * np.pi
#: Remedy for joint angles beyond the range of sines.
SMALLER_ANGLES = "smaller initial angles and velocities, or a shorter run"
#: Remedy for tyres without directions of slip.
UPRIGHT = "the axis of the wheel's spin, in the axes of its body, and another initial state"
_ORDER = (
    ("mass", "M (the inertia matrix)"),
    ("coupling", "h (the coupling terms)"),
    ("base_motion", "b (the base-motion terms)"),
    ("force", "Q (the generalized force)"),
    ("internal_rate", "zdot (the rates of the internal states)"),
    ("forward_dynamics", "vdot (the acceleration)"),
    ("constraint", "Phi (the constraint equations)"),
)


#: Cause and remedy of a contact whose equations have no solution.
_NO_CONTACT = (
    ", and the body meets no single point of the surface, as in a valley that is narrower than the body",
    "a surface whose radius of curvature is above the radius of the body, or a smaller radius",
)


def first_non_finite(
    model: CompiledModel,
    t: float,
    state: tuple[Array, Array, Array, Array],
    step: float,
    p: Array,
    signals: InputSignals,
) -> tuple[str, bool, tuple[str, str]]:
    """Return the first block that is not finite, whether at the last good state or only after the next step, and the
    cause with a remedy, as far as formulas and angles show a cause.

    ``state`` is (q, v, a, z).

    The texts are empty if all blocks are finite, or if no cause is known.
    """
    q, v, a, z = state
    a = np.where(np.isfinite(a), a, 0.0)
    tyred = model
    model = model.having([term for term, _ in _ORDER if term in model.functions or not TERMS[term].quadratic])
    with np.errstate(all="ignore"):
        for ahead in (False, True):
            if ahead:
                u, known = signals.rows(np.array([t]))[0], "internal_rate" in model.functions
                rate = model.internal_rates(q, v, z, t, u, parameters=p) if known else np.zeros_like(z)
                q, v, z = (
                    product.update(model.factors, q, step * v + 0.5 * step * (step * a)),
                    v + step * a,
                    z + step * rate,
                )
            time = t + step if ahead else t
            block = _at(model, time, q, v, z, p, signals)
            if block:
                values = values_of(model, time, q, v, z, p, signals)
                cause = _cause(model, time, q, p, values)
                if not cause[0] and (tyres := upright_tyres(tyred, time, q, p)):
                    cause = f", where slip.axis of the tyre {tyres} is upright", UPRIGHT
                if not cause[0] and "contact with the surface" in block:
                    cause = _NO_CONTACT
                return f"{block} at t = {time:.9g} s", not ahead, cause
    return "", False, ("", "")


def doubtful_formulas(model: CompiledModel, status: int, block: str) -> str:
    """Return the operations of formulas that may be the reason of a number that is not finite, with a separator; empty
    for another status, or without such operations.

    ``block`` is not finite; without one a slope is not.
    """
    if status != NOT_FINITE.number:
        return ""
    named = rough_operations(model.description.formulas, quotients=bool(block))
    return f"; {named} may have no {'value' if block else 'slope'} there" if named else ""


def _cause(model: CompiledModel, t: float, q: Array, p: Array, values: Values) -> tuple[str, str]:
    """Return the cause of blocks that are not finite, as far as curves, formulas and angles show a cause, and a
    remedy."""
    values = {**values, **_positions(model, t, q, p, values)}
    if left := curves_outside_range(model.description, values) or _left_by_contacts(model, t, q, p, values):
        return f", where the curve {left}", 'points that reach further, or outside = "hold" or "periodic"'
    if met := _met_springs(model, t, q, p, values):
        fault = f": the ends of {met} meet, and a force along the line between them has no direction"
        return fault, "ends that stay apart; springs of length 0 without damping, whose force is 0 there"
    if taken := large_angles(model.description, values):
        return f", where formulas take {taken}: {REASON}", HINT
    if angles := large_joint_angles(model.q_names, model.q_units, q):
        return f", where {angles}: {REASON}", SMALLER_ANGLES
    if unknown := operations_without_value(model.description, values):
        return f", where in a formula {unknown}", OTHER_FORMULA
    return "", ""


def _positions(model: CompiledModel, t: float, q: Array, p: Array, values: Values) -> dict[tuple[str, str, int], float]:
    """Return the world positions of the points that arguments of curves mention."""
    formulas = (used.argument for formula in model.description.formulas for used in applications(formula))
    named = {symbol.name for formula in formulas for symbol in _symbols(formula) if symbol.kind == "position"}
    result: dict[tuple[str, str, int], float] = {}
    for item in model.description.drawing.points:
        if item.name in named and item.body in model.bodies:
            place = _numbers(values, item.position)
            position = model.point(item.body, place, q, t=t, parameters=p).position
            result |= {("position", item.name, k): float(position[k]) for k in range(3)}
    return result


def _met_springs(model: CompiledModel, t: float, q: Array, p: Array, values: Values) -> str:
    """Return the springs whose ends are in one place, in words; empty if there are none."""
    points, result = {point.name: point for point in model.description.drawing.points}, []
    for line in model.description.drawing.lines:
        try:
            places = [_place_of(model, points[end], t, q, p, values) for end in (line.first, line.second)]
        except (ArithmeticError, KeyError, EomgenError):  # of something that is not known here
            continue
        if line.elastic and np.ptp(places, axis=0).max() <= _MET * np.abs(places).max():
            result.append(line.name)
    return f"the spring{'s' * (len(result) > 1)} {listed(result)}" if result else ""


def _place_of(model: CompiledModel, point: Point, t: float, q: Array, p: Array, values: Values) -> Array:
    """Return the world position of a point, (3,) m."""
    place = np.array(_numbers(values, point.position))
    if point.body in model.bodies:
        return model.point(point.body, place, q, t=t, parameters=p).position
    pose = model.base(t, parameters=p)[:7] if point.body == BASE else _STILL
    return np.asarray(rotated(pose[:4], place) + pose[4:])


def _numbers(values: Values, formulas: Sequence[Formula]) -> list[float]:
    return [evaluate(part, lambda symbol: values[symbol.kind, symbol.name, symbol.index]) for part in formulas]


def _left_by_contacts(model: CompiledModel, t: float, q: Array, p: Array, values: Values) -> str:
    """Return a description of a curve whose ends a constraint between two frames leaves, with the constraint; empty
    without one."""
    for item in model.description.contacts:
        used = [(one.curve, one.argument) for one in applications(item.height) if isinstance(one.curve, Curve)]
        if not used or item.rider not in model.bodies:
            continue
        try:
            origin, center, (size,) = (_numbers(values, part) for part in (item.position, item.center, [item.size]))
            place = model.point(item.rider, center, q, t=t, parameters=p).position
            if item.body in (*model.bodies, BASE):
                at_base = item.body == BASE
                pose = model.base(t, parameters=p)[:7] if at_base else model.pose(item.body, q, t, parameters=p)
                place = rotated(pose[:4] * [1.0, -1.0, -1.0, -1.0], place - pose[4:])
            local = (place - np.array(origin)) @ np.array(item.axes)
            for curve, argument in used:
                arguments = [_numbers(_with_place(values, local + off), [argument])[0] for off in size * _AROUND]
                if _outside(curve, arguments):
                    near = f"within {size:.6g} m of" if size else "at"
                    return f"{_range_of(curve)} and is asked {near} {arguments[0]:.9g} by the constraint {item.name}"
        except (ArithmeticError, KeyError):  # of something that is not known here
            continue
    return ""


def _with_place(values: Values, place: Array) -> Values:
    return {**values, **{("local", "position", k): float(place[k]) for k in range(3)}}


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
    """Return the numbers that symbols of formulas have at a state, by kind, name and index."""
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


def _at(model: CompiledModel, t: float, q: Array, v: Array, z: Array, p: Array, signals: InputSignals) -> str:
    if not np.all(np.isfinite(q)):
        return "q (the configuration)"
    if not np.all(np.isfinite(v)):
        return "v (the velocity)"
    if not np.all(np.isfinite(z)):
        return "z (the internal states)"
    if not np.all(np.isfinite(model.base(t, parameters=p))):
        return "the motion of the base"
    try:
        u = signals.rows(np.array([t]))[0]
    except UsageError as error:
        return str(error.problems[0])
    if not np.all(np.isfinite(u)):
        return f"the input {model.inputs[int(np.argmin(np.isfinite(u)))]}"
    calls: dict[str, Callable[[], Array]] = {
        "mass": lambda: model.mass(q, parameters=p),
        "coupling": lambda: model.coupling(q, v, parameters=p),
        "base_motion": lambda: model.base_motion(q, v, t, parameters=p),
        "force": lambda: model.force(q, v, t, u, z=z, parameters=p),
        "internal_rate": lambda: model.internal_rates(q, v, z, t, u, parameters=p),
        "forward_dynamics": lambda: accelerations(model, q, v, t, u, z=z, parameters=p),
        "constraint": lambda: next(iter(model.evaluate("constraint", q, t=t, parameters=p).values())),
    }
    for term, label in _ORDER:
        if term in model.functions:
            value = calls[term]()
            if not np.all(np.isfinite(value)):
                place = [int(index) for index in np.argwhere(~np.isfinite(value))[0]]
                names = {
                    "internal_rate": [item["name"] for item in model.library.layout["states"]],
                    "constraint": model.multipliers,
                }.get(term, model.v_names)
                return f"{label}, component {' and '.join(dict.fromkeys(names[index] for index in place))}"
    return ""


def instability(growth: Growth, method: Method) -> tuple[str, str]:
    """Return a sentence on the growth by the method alone, and a remedy."""
    step = f"a step of {growth.finer:.2g} s or less" if math.isfinite(growth.finer_after) else "a much smaller step"
    return f"the method is unstable at this step: {growth}", f"{step}, or {method.more_stable}"


def fast_joint(model: CompiledModel, t: float, q: Array, v: Array, p: Array, step: float) -> str:
    """Return a sentence on the joint that turns too far within a step for its turns to be counted; empty without such a
    joint."""
    if not model.angles:
        return ""
    turns = step * np.abs(model.evaluator.angle_motion(q, v, t, p)[1])
    k = int(np.argmax(turns))
    return (
        f"the joint {model.angles[k].partition('.')[0]} turns by {turns[k]:.3g} rad in a step"
        if turns[k] > COUNTED
        else ""
    )


def advice(method: Method, status: int, settings: Mapping[str, float]) -> str:
    """Return the remedy for a status of the stepper."""
    known = {item.number: item for item in method.statuses(constrained=True, angles=True)}
    least = settings["step"] / MOST_STEPS
    if known[status].name == "TOO_MANY_STEPS" and 0.0 < settings.get("largest_step", 0.0) < least:
        return f"a largest_step of more than {least:.2g} s, or shorter rows"
    return known[status].advice.format(**settings)


def curves_outside_range(description: Description, values: Mapping[tuple[str, str, int], float]) -> str:
    """Return a description of the curves evaluated outside their range; empty without such curves.

    ``values`` are numbers by kind, name and index of a symbol; arguments that need further symbols are left out.
    """

    def value_of(symbol: Symbol) -> float:
        try:
            return values[symbol.kind, symbol.name, symbol.index]
        except KeyError:
            raise ArithmeticError(f"{symbol.kind} {symbol.name}") from None

    result: dict[str, str] = {}
    formulas = [item.formula for item in description.inputs if item.formula is not None]
    for formula in (*formulas, *description.formulas):
        for used in applications(formula):
            try:
                at = evaluate(used.argument, value_of)
            except ArithmeticError:
                continue
            if isinstance(curve := used.curve, Curve) and _outside(curve, [at]):
                result.setdefault(curve.name.partition(", ")[0], f"{_range_of(curve)} and is asked at {at:.9g}")
    return " and ".join(result.values())


class Failure(NamedTuple):
    """Description of a failure of a function, and its remedy."""

    fault: str
    hint: str


def failed_controller(stepper: Stepper) -> Failure:
    """Return the failure of the last function: the returned code, or the result that is not finite.

    Functions of Python raise errors of their own; if none could be raised, only the text of the status is known.
    """
    told = stepper.statistics
    number = int(told.get("failed_controller", 0))
    if not number:
        return Failure(stepper.status_text(CONTROLLER_FAILED), CONTROLLER_ADVICE)
    row = stepper.layout["method"]["samples"]["controllers"][number - 1]
    of = f"the function {row['function']} of {row['source']}" if row["function"] else "the function"
    who = f"{of}, the controller {row['name']},"
    if code := int(told["controller_returned"]):
        return Failure(
            f"{who} returned {code}, and only 0 goes on [E1387]", f"the reason for which it returns {code}, or return 0"
        )
    place = int(told["controller_not_finite"]) - 1
    behind = place - len(row["outputs"])
    if (beyond := behind - (size := len(row["memory_states"]))) >= 0:
        return _beyond(who, len(row["outputs"]), size, in_memory=beyond > 0)
    which = f"memory[{behind}]" if behind >= 0 else f"values[{place}], {row['outputs'][place]},"
    given = ", ".join(f"signals[{k}] = {name}" for k, name in enumerate(row["signals"])) or "it has no signals"
    hint = f"a check of its divisions, roots and unset values; {given}"
    return Failure(f"{who} gave {which} a value that is not a finite number [E1388]", hint)


def _beyond(who: str, values: int, memory: int, *, in_memory: bool) -> Failure:
    """Return the failure of a function that wrote beyond its values or its memory."""
    if in_memory:
        last = f"memory[{memory - 1}] is the last entry" if memory else "it has none"
        return Failure(
            f"{who} wrote beyond memory = {memory} [E1389]", f"memory = {memory + 1} in the scene; {last} so far"
        )
    fault = f"{who} wrote beyond its {counted(values, 'value')} [E1390]"
    return Failure(fault, f"writes up to values[{values - 1}], or outputs with a name for each value")


def failed_step(run: Run, stepper: Stepper, state: tuple[float, Array, Array, Array, Array], status: int) -> Problem:
    """Return the problem of the step from a state (t, q, v, a, z).

    Parameters
    ----------
    run : with the parameters and inputs of the step
    status : of the stepper
    """
    t, q, v, a, z = state
    if status == CONTROLLER_FAILED:
        failure = failed_controller(stepper)
        fault = f"the step from t = {t:.9g} s, of {stepper.step_size:.9g} s, failed: {failure.fault} [E2017]"
        return Problem("", fault, failure.hint)
    model, p, step = run.model, run.parameters, stepper.step_size
    block, already, cause = first_non_finite(model, t, (q, v, a, z), step, p, run.signals)
    inertia = None if block else inertia_warning(model, q, p, q, step)
    reason = inertia.text if inertia else fast_joint(model, t, q, v, p, step)
    details = f"; the first block that is not finite is {block}" if block else f"; {reason}" if reason else ""
    hint = inertia.hint if inertia else advice(run.method, status, {**run.settings, "step": step})
    details += cause[0] or doubtful_formulas(model, status, block)
    if cause[0]:
        hint = cause[1]
    elif already:
        hint = "other inputs, parameters or coordinates there: no smaller step helps"
    fault = f"the step from t = {t:.9g} s, of {step:.9g} s, failed: {stepper.status_text(status)}{details} [E2017]"
    return Problem("", fault, hint)
