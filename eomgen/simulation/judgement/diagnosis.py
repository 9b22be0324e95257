"""Diagnosis of a failed run or step: the first quantity that is not finite, a controller's C function, the evidence,
and a remedy.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.messages import counted
from eomgen.base.products import objects_of
from eomgen.compiled.equations import accelerations
from eomgen.compiled.rest.state_warnings import inertia_warning
from eomgen.errors import Problem, UsageError
from eomgen.formula.features import rough_operations
from eomgen.integrators.events import CONTROLLER_ADVICE, CONTROLLER_FAILED
from eomgen.integrators.families.adaptive import CONTROL
from eomgen.integrators.families.family import NOT_FINITE
from eomgen.integrators.families.register import Method
from eomgen.lie import product
from eomgen.simulation.judgement.instability import Growth
from eomgen.simulation.stepping.run import Run
from eomgen.simulation.stepping.stepper import Stepper
from eomgen.system.terms import TERMS

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel
    from eomgen.simulation.stepping.inputs import InputSignals


#: Register of functions of model, block that is not finite, time, state (q, v, z), parameters and inputs; each returns
#: a cause and a remedy, both empty for none known.
CAUSES = "eomgen.causes"


#: Largest turn of a joint within a step that steppers count, rad.
COUNTED = 0.9 * 2.0 * np.pi
#: Remedy for joint angles beyond the range of sines.
SMALLER_ANGLES = "smaller initial angles and velocities, or a shorter run"
_ORDER = (
    ("mass", "M (the inertia matrix)"),
    ("coupling", "h (the coupling terms)"),
    ("base_motion", "b (the base-motion terms)"),
    ("force", "Q (the generalized force)"),
    ("internal_rate", "zdot (the rates of the internal states)"),
    ("forward_dynamics", "vdot (the acceleration)"),
    ("constraint", "Phi (the constraint equations)"),
)


def first_non_finite(
    model: CompiledModel,
    t: float,
    state: tuple[Array, Array, Array, Array],
    step: float,
    p: Array,
    signals: InputSignals,
) -> tuple[str, bool, tuple[str, str]]:
    """Return the first block of the equations that is not finite at a state, or else one step ahead.

    The result has the block with its time in words, whether the state itself already has it, and the pair of cause and
    remedy from formulas and angles. Texts are empty if all blocks are finite, or if no cause is known. The state ahead
    follows from the accelerations, of which NaN count as 0.

    Parameters
    ----------
    t, step : s
    state : q, v, a and z
    p : (np,) parameters
    signals : inputs of the run
    """
    q, v, a, z = state
    a = np.where(np.isfinite(a), a, 0.0)
    caller_model = model
    model = model.having([term for term, _ in _ORDER if term in model.functions or not TERMS[term].quadratic])
    with np.errstate(all="ignore"):
        for ahead in (False, True):
            if ahead:
                u, has_rates = signals.rows(np.array([t]))[0], "internal_rate" in model.functions
                rate = model.internal_rates(q, v, z, t, u, parameters=p) if has_rates else np.zeros_like(z)
                q, v, z = (
                    product.update(model.factors, q, step * v + 0.5 * step * (step * a)),
                    v + step * a,
                    z + step * rate,
                )
            time = t + step if ahead else t
            block = _at(model, time, q, v, z, p, signals)
            if block:
                causes = (cause(caller_model, block, time, (q, v, z), p, signals) for cause in objects_of(CAUSES))
                cause = next((pair for pair in causes if pair[0]), ("", ""))
                return f"{block} at t = {time:.9g} s", not ahead, cause
    return "", False, ("", "")


def doubtful_formulas(model: CompiledModel, status: int, block: str) -> str:
    """Return a clause on operations of formulas that may have given a number that is not finite, beginning with "; ".
    Empty if `status` is not the status of such numbers, or without such operations. `block` names the quantity that is
    not finite; if empty, slopes of formulas are suspected in place of values."""
    if status != NOT_FINITE.number:
        return ""
    named = rough_operations(model.description.formulas, quotients=bool(block))
    return f"; {named} may have no {'value' if block else 'slope'} there" if named else ""


def _at(model: CompiledModel, t: float, q: Array, v: Array, z: Array, p: Array, signals: InputSignals) -> str:
    """Return the first quantity that is not finite at a state, with its component, in words; empty if all are finite.
    Examined in order: q, v, z, the base, the inputs, then M, h, b, Q and further terms that the model has."""
    for label, part in (("q (the configuration)", q), ("v (the velocity)", v), ("z (the internal states)", z)):
        if not np.all(np.isfinite(part)):
            return label
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
                indices = [int(index) for index in np.argwhere(~np.isfinite(value))[0]]
                names = {
                    "internal_rate": [item["name"] for item in model.library.layout["states"]],
                    "constraint": model.multipliers,
                }.get(term, model.v_names)
                return f"{label}, component {' and '.join(dict.fromkeys(names[index] for index in indices))}"
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
    joint = model.angles[k].partition(".")[0]
    return f"the joint {joint} turns by {turns[k]:.3g} rad in a step" if turns[k] > COUNTED else ""


def advice(method: Method, status: int, settings: Mapping[str, float]) -> str:
    """Return the remedy for a status of the stepper."""
    known = {item.number: item for item in method.statuses(constrained=True, angles=True)}
    least = settings["step"] / CONTROL.most_steps
    if known[status].name == "TOO_MANY_STEPS" and 0.0 < settings.get("largest_step", 0.0) < least:
        return f"a largest_step of more than {least:.2g} s, or shorter rows"
    return known[status].advice.format(**settings)


class Failure(NamedTuple):
    """Description of a failure of a function, and its remedy."""

    fault: str
    hint: str


def failed_controller(stepper: Stepper) -> Failure:
    """Return the failure of the sampled controller's function that stopped the last step: fault and remedy in words.
    For functions in C these follow from the returned code, or from the value that is not finite. Functions of Python
    raise errors of their own; if none could be raised, only the text of the status is known."""
    statistics = stepper.statistics
    number = int(statistics.get("failed_controller", 0))
    if not number:
        return Failure(stepper.status_text(CONTROLLER_FAILED), CONTROLLER_ADVICE)
    row = stepper.layout["method"]["samples"]["controllers"][number - 1]
    of = f"the function {row['function']} of {row['source']}" if row["function"] else "the function"
    who = f"{of}, the controller {row['name']},"
    if code := int(statistics["controller_returned"]):
        fault = f"{who} returned {code}, and only 0 goes on [E1387]"
        return Failure(fault, f"the reason for which it returns {code}, or return 0")
    position = int(statistics["controller_not_finite"]) - 1
    behind = position - len(row["outputs"])
    if (beyond := behind - (size := len(row["memory_states"]))) >= 0:
        return _beyond(who, len(row["outputs"]), size, in_memory=beyond > 0)
    which = f"memory[{behind}]" if behind >= 0 else f"values[{position}], {row['outputs'][position]},"
    signals = ", ".join(f"signals[{k}] = {name}" for k, name in enumerate(row["signals"])) or "it has no signals"
    hint = f"a check of its divisions, roots and unset values; {signals}"
    return Failure(f"{who} gave {which} a value that is not a finite number [E1388]", hint)


def _beyond(who: str, values: int, memory: int, *, in_memory: bool) -> Failure:
    """Return the failure of a controller's function in C that wrote beyond its arrays. `who` names the function;
    `values` and `memory` are the sizes of its arrays; `in_memory`: whether the memory was exceeded."""
    if in_memory:
        last = f"memory[{memory - 1}] is the last entry" if memory else "it has none"
        fault = f"{who} wrote beyond memory = {memory} [E1389]"
        return Failure(fault, f"memory = {memory + 1} in the scene; {last} so far")
    fault = f"{who} wrote beyond its {counted(values, 'value')} [E1390]"
    return Failure(fault, f"writes up to values[{values - 1}], or outputs with a name for each value")


def failed_step(run: Run, stepper: Stepper, state: tuple[float, Array, Array, Array, Array], status: int) -> Problem:
    """Return the problem (fault and remedy, for an error) of a step that failed from a state (t, q, v, a, z).

    Parameters
    ----------
    run : with the parameters and inputs of the step
    stepper : that took the step
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
