"""Validation of simulation settings; sines and cosines beyond the argument range of the compiled code, for which they
are NaN, in formulas and joint angles.
"""

from __future__ import annotations

import functools
import math
import os
from collections.abc import Callable, Collection, Hashable, Iterator, Mapping
from typing import Any, TypeVar

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, field
from eomgen.compiled.arguments import number_of
from eomgen.compiled.model import CompiledModel
from eomgen.errors import ModelError, Problem, UsageError
from eomgen.formula.evaluate import SymbolValues, evaluate, value_in
from eomgen.formula.nodes import Application, Formula, Operation, Symbol
from eomgen.integrators.families.register import Method, canonical_name, method_named, method_parameters, terms_of
from eomgen.integrators.stepper_layout import checked_setting, default_settings
from eomgen.simulation.stepping.inputs import check_reach, jumps_known
from eomgen.simulation.stepping.run import Run
from eomgen.simulation.stepping.time_grid import TimeGrid, check_jumps
from eomgen.system.description import LARGEST_ANGLE, Description
from eomgen.system.terms import TERMS
from eomgen.toolchain.library import Library

#: Why there is no value, and a remedy.
REASON = f"sines and cosines are computed up to {LARGEST_ANGLE:g} rad: beyond, numbers differ by 2e-06 rad and more"
HINT = "an origin of time near the run, with the phase there in the formula"


def large_angles(description: Description, values: SymbolValues, inputs: Collection[str] = ()) -> str:
    """Return the sines and cosines in formulas whose arguments are too large, in words; empty if there are none.

    Parameters
    ----------
    values : numbers by kind, name and index of a symbol; arguments that need further symbols are left out
    inputs : inputs whose formulas are replaced
    """

    t, value_of = values["time", "", 0], functools.partial(value_in, values)
    result: dict[str, None] = {}
    for item in description.inputs:
        if item.name in inputs:
            continue
        beyond = [w * t for _, w, _ in item.harmonics if abs(w * t) > LARGEST_ANGLE]
        result |= dict.fromkeys(f"cos({angle:.6g}) in the input {item.name}" for angle in beyond[:1])
        if item.formula is not None:
            result |= dict.fromkeys(f"{taken} in the input {item.name}" for taken in _too_large(item.formula, value_of))
    for formula in (*description.formulas, *(part for item in description.outputs for part in item.values)):
        result |= dict.fromkeys(_too_large(formula, value_of))
    return " and ".join(list(result)[:3])


def _too_large(formula: Formula, value_of: Callable[[Symbol], float]) -> Iterator[str]:
    """Yield, as text with the angle in rad, the sines and cosines in a formula whose arguments are too large, except in
    unused branches of a ``select``. `value_of` gives the numbers of symbols."""
    if isinstance(formula, Application):
        yield from _too_large(formula.argument, value_of)
    if not isinstance(formula, Operation):
        return
    parts = formula.arguments
    try:
        if formula.name == "select":
            condition, then, otherwise = parts
            parts = (condition, then if evaluate(condition, value_of) != 0.0 else otherwise)
        elif formula.name in ("sin", "cos") and abs(angle := evaluate(parts[0], value_of)) > LARGEST_ANGLE:
            yield f"{formula.name}({angle:.6g})"
    except ArithmeticError:
        pass
    for part in parts:
        yield from _too_large(part, value_of)


def large_joint_angles(names: list[str], units: list[str], q: Array) -> str:
    """Return up to three joint angles in q (nq,) that are too large for their sines, in words; empty if there are none.
    Names and units belong to q."""
    result = [
        f"{name} is {value:.6g} rad"
        for name, unit, value in zip(names, units, q, strict=True)
        if unit == "rad" and abs(value) > LARGEST_ANGLE
    ]
    return " and ".join(result[:3])


def check_angles(
    description: Description, parameters: Mapping[str, float], inputs: Collection[str], start: float, end: float
) -> None:
    """Raise UsageError if formulas take sines of too large arguments at the times `start` or `end` of a run, s.
    `parameters` has tunable parameters by name, `inputs` the inputs whose formulas the caller replaces."""
    fixed = {("parameter", name, 0): value for name, value in description.values(parameters).items()}
    for key, t in (("t_start", start), ("t_end", end)):
        if too_large := large_angles(description, {**fixed, ("time", "", 0): t}, inputs):
            raise UsageError(Problem(key, f"{too_large} would be taken at t = {t:.9g} s; {REASON} [E2071]", HINT))


T = TypeVar("T")
K = TypeVar("K", bound=Hashable)


def positive(name: str, value: object) -> float:
    """Return a positive finite number of seconds. Raises UsageError."""
    number = number_of(name, value)
    if number <= 0.0:
        raise UsageError(Problem(name, f"the {name} must be positive, not {number:.9g} [E2072]", "1e-3"))
    return number


def chosen_method(name: str, values: Mapping[str, float | None], scene: Mapping[str, Any], constrained: bool) -> Method:
    """Return the method of a run by its name, with parameters from the caller or the scene.

    `values` has the parameters by name, None for the scene's value in `scene`, the defaults of the library.
    `constrained`: whether the model has constraints. Raises UsageError for parameters that the method does not have or
    cannot use, and for values that it refuses.
    """
    for key, value in values.items():
        if value is not None:
            number_of(key, value, "number")
    if values["rho_inf"] is not None and not 0.0 <= values["rho_inf"] <= 1.0:
        fault = f"rho_inf must lie between 0 and 1, not {values['rho_inf']:.9g} [E2073]"
        raise UsageError(Problem("rho_inf", fault, "0.8"))
    method = method_named(name, **method_parameters(name, values, scene))
    for need in method.needs:
        if need.parameter and need.fact == "constraints" and constrained is not need.value:
            fault = f"{name} cannot run on constraints: {need.reason} [E2074]"
            raise UsageError(Problem(need.parameter, fault, need.alternative))
    return method


def stepper_settings(
    data: Mapping[str, Any], step: float, method: Method, extra: Mapping[str, float]
) -> dict[str, float]:
    """Return the settings of a stepper by name, in the order of its memory: defaults, the method's parameters, and
    `extra`. `data` is the layout of the method, `step` in s, and `extra` the caller's settings. Raises UsageError for
    settings that the stepper does not have or refuses."""
    values = default_settings(data)
    parameters = {name: float(value) for name, value in method.parameters.items()}
    for name, value in extra.items():
        values[name] = checked_setting(data, name, number_of(f"settings.{name}", value, "number"))
    values["step"] = step
    return values | parameters


def stepper_library(model: CompiledModel, name: str, method: Method) -> Library:
    """Return the library with the stepper of a method: the model's own, or another one, compiled at first use. Raises
    UsageError if the model was built without terms that the method needs, and ModelError if the method cannot run on
    the scene."""
    layout = model.library.layout
    is_built = name == canonical_name(layout["built_method"])
    if is_built and layout["method"]:
        return model.library
    facts = layout["facts"]
    mass = "mass" in model.functions and not facts["ill_scaled"]
    needed = terms_of(name, facts["constraints"], facts["internal_states"], mass)
    missing = [term for term in needed if term not in model.functions]
    if "iteration" in model.functions and "partials" in missing:
        missing.remove("partials")
    withheld = [term for term in missing if not TERMS[term].on_request]
    if withheld and not facts["constraints"]:
        fault = f"{name} needs the terms {', '.join(withheld)}, which this model was built without [E2075]"
        hint = f"eomgen.build(scene, terms=[..., {', '.join(map(repr, withheld))}])"
        raise UsageError(Problem("simulate", fault, hint))
    library = model.library if is_built and not missing else model.stepper(name)
    if not library.layout["method"]:
        refusal = library.layout["stepper_refused"].removeprefix(f"{method.family} ")
        unmet = [need for need in method.needs if bool(facts.get(need.fact, need.value)) is not need.value]
        fault = refusal if refusal == library.layout["stepper_refused"] else f"it {refusal}"
        hint = unmet[0].alternative if unmet else method.instead
        raise ModelError(f"{name} cannot run on this scene: {fault} [E0860]", hint)
    return library


@dataclass(frozen=True)
class ChosenStepper:
    """A method for runs of a model with data derived from options, kept for the next run with the same options.

    Attributes
    ----------
    library : with the stepper
    settings : of the stepper, in order; the step is the library's default
    left_to_stepper : as of ``InputSignals``
    finds_bound : whether the steps of the run are to be bounded if steps pass over a law: the method chooses the steps,
        laws may be narrow, and neither the scene nor the caller sets ``largest_step``
    """

    name: str
    method: Method
    library: Library
    settings: Mapping[str, float]
    left_to_stepper: bool
    finds_bound: bool
    _cleared: dict[tuple[float, ...], bool] = field(default_factory=dict)
    _starts: dict[Hashable, Any] = field(default_factory=dict)

    def settings_at(self, step: float) -> dict[str, float]:
        """Return the settings with a step, s."""
        return {**self.settings, "step": step}

    def start(self, at: Hashable, evaluate: Callable[[], T]) -> T:
        """Return the start of runs with the scene's own parameters and inputs, evaluated once for each ``at``."""
        if at not in self._starts:
            _keep(self._starts, at, evaluate())
        start: T = self._starts[at]
        return start

    def check_span(self, run: Run, *, changed: bool) -> None:
        """Raise UsageError for the time span of a run, as the function ``check_span`` of this module.

        A time grid that passed with the scene's own parameters and inputs is not checked again.

        Parameters
        ----------
        changed : whether a caller gives parameters
        """
        key = (run.grid.start, run.grid.end, run.grid.step)
        of_scene = not changed and not run.signals.given
        if of_scene and key in self._cleared:
            return
        check_span(run, self.library)
        if of_scene:
            _keep(self._cleared, key, True)


def _keep(kept: dict[K, T], key: K, value: T) -> None:
    """Store a value under a key; all stored values are dropped first if there are too many."""
    if len(kept) >= 64:
        kept.clear()
    kept[key] = value


def chosen_stepper(
    model: CompiledModel, method: str | None, options: Mapping[str, float | None], settings: Mapping[str, float] | None
) -> ChosenStepper:
    """Return the stepper for a run; a stepper other than the model's own is compiled at first use.

    Parameters
    ----------
    method : by default the method of the model's library
    options : parameters of the method, None for the scene's value
    settings : the caller's own

    Raises
    ------
    UsageError, ModelError
        As of ``chosen_method``, ``stepper_library`` and ``stepper_settings``; settings that are not a mapping.
    """
    store: dict[Hashable, ChosenStepper] = model.functions.library.kept.setdefault("chosen steppers", {})
    values = (method, *options.values(), *(settings.items() if isinstance(settings, Mapping) else (settings,)))
    key = (values, tuple(map(type, values)))  # True differs from 1 here
    try:
        if key in store and store[key].library.successor is None:
            return store[key]
    except TypeError:  # values without a hash are not valid options either
        pass
    defaults = model.library.layout["defaults"]
    name = canonical_name(model.library.layout["built_method"] if method is None else method, options["tolerance"])
    stepped_by = chosen_method(name, options, defaults, bool(model.multipliers))
    library = stepper_library(model, name, stepped_by)
    if settings is not None and not isinstance(settings, Mapping):
        fault = f"a mapping is needed, not {type(settings).__name__} [E0090]"
        raise UsageError(Problem("settings", fault, 'settings={"rtol": 1e-9}'))
    chosen = stepper_settings(library.layout["method"], defaults["step"], stepped_by, settings or {})
    bounded = "largest_step" in (settings or {}) or chosen.get("largest_step") != 0.0
    finds_bound = stepped_by.chooses_steps and not bounded and bool(model.description.fast_laws())
    result = ChosenStepper(name, stepped_by, library, chosen, jumps_known(library), finds_bound)
    _keep(store, key, result)
    return result


def check_span(run: Run, library: Library) -> None:
    """Raise UsageError if a prescribed law of time does not cover a run from its start to the end or is too steep, if
    an angle leaves the range of the compiled code, or if forces jump too often within a step.

    Parameters
    ----------
    library : library with the stepper
    """
    model, inputs, p = run.model, run.signals.given, run.parameters
    start, end = run.grid.start, run.grid.reached
    check_reach(model.library.layout, inputs, start, end)
    if refused := followed_laws(model, run.method, p, run.grid)[0]:
        raise UsageError(refused)
    check_angles(model.description, dict(zip(model.parameters, p.tolist(), strict=True)), inputs, start, end)
    check_jumps(library.layout["method"], run.grid.step)


def followed_laws(model: CompiledModel, method: Method, p: Array, grid: TimeGrid) -> tuple[list[Problem], list[str]]:
    """Return the problems of prescribed motions in a run, and notes on doubtful ones. Drives and the law of the base
    have a problem if they have no value or jump at the parameters p (np,), or are too steep for the step of the grid;
    adaptive methods follow steep laws. Both lists are empty for laws that are good."""
    laws = [law for law in model.description.laws if not law.constant]
    if not laws:
        return [], []
    from eomgen.formula.motion_faults import jumps, steep, undefined_laws  # noqa: PLC0415  # most scenes need none of it

    values = model.description.values(dict(zip(model.parameters, p.tolist(), strict=True)))
    looked_at = laws, values, grid.start, grid.reached
    if refused := undefined_laws(*looked_at) or jumps(*looked_at):
        return refused, []
    if method.chooses_steps:
        return [], []
    return steep(laws, values, grid.start, grid.reached, grid.step)


@functools.cache
def _memory() -> float:
    """Return the bytes of memory that this machine has; infinite if the system does not report it."""
    return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")) if hasattr(os, "sysconf") else math.inf


def check_memory(rows: int, width: int) -> None:
    """Raise UsageError if `rows` rows of `width` doubles, with copies, would take most of this machine's memory."""
    needed, available = 8.0 * rows * width * 3.0, _memory()
    if needed > 0.8 * available:
        memory = f"about {needed / 1e9:.3g} GB, this machine has {available / 1e9:.3g}"
        fault = f"{rows} rows of {width} numbers would take {memory} [E2076]"
        hint = f"record_every = {math.ceil(needed / (0.2 * available))} or more"
        raise UsageError(Problem("record_every", fault, hint))
