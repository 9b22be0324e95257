"""What a run is told, checked: numbers, counts, the time grid, the method with its parameters, and the stepper's settings."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from eomgen.errors import Problem, UsageError
from eomgen.integrators.families.generalized_alpha import INDEX_3, GeneralizedAlpha, Method
from eomgen.integrators.families.taylor import Taylor
from eomgen.integrators.methods import method_named, method_parameters
from eomgen.integrators.stepper_data import default_settings

#: Settings that are whole numbers, the least and the largest: what steppers bear, and what a C long holds anywhere.
_WHOLE = {"max_iterations": (1, 2**31 - 1), "max_halvings": (0, 30), "reuse": (0, 1), "perturb": (0, 1)}


def number_of(name: str, value: object, kind: str = "number of seconds") -> float:
    """Return a finite number. Raises UsageError."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        raise UsageError(Problem(name, f"a {kind} is needed, not {type(value).__name__}"))
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise UsageError(Problem(name, f"{name} is {number}, not a finite number"))
    return number


def positive(name: str, value: object) -> float:
    """Return a positive finite number of seconds. Raises UsageError."""
    number = number_of(name, value)
    if number <= 0.0:
        raise UsageError(Problem(name, f"the {name} must be positive, not {number:.9g}", "1e-3"))
    return number


def count_of(name: str, value: object) -> int:
    """Return a whole number from 1 on. Raises UsageError."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < 1:
        raise UsageError(Problem(name, f"{name} must be a whole number from 1 on, not {value!r}", "1"))
    return int(value)


def chosen_method(name: str, given: Mapping[str, float | None], scene: Mapping[str, Any], constrained: bool) -> Method:
    """Return the method of the run. Raises UsageError for parameters that it does not take or cannot bear, with the reason."""
    for key, value in given.items():
        if value is not None:
            number_of(key, value, "number")
    if given["rho_inf"] is not None and not 0.0 <= given["rho_inf"] <= 1.0:
        raise UsageError(Problem("rho_inf", f"rho_inf must lie between 0 and 1, not {given['rho_inf']:.9g}", "0.8"))
    method = method_named(name, **method_parameters(name, given, scene))
    if constrained and isinstance(method, GeneralizedAlpha) and method.case and not method.case.unconditionally_stable:
        need = method.needs[-1]
        raise UsageError(Problem("beta", f"{name} cannot run on constraints: {need.reason}", need.alternative))
    return method


def stepper_settings(data: Mapping[str, Any], step: float, method: Method, extra: Mapping[str, float]) -> dict[str, float]:
    """Return the settings of a stepper in their order: the method's parameters, and the caller's own. Raises UsageError."""
    values = default_settings(data)
    parameters = method.parameters if isinstance(method, GeneralizedAlpha | Taylor) else {}
    own = {name: float(value) for name, value in parameters.items()}
    known = [name for name in values if name != "step" and name not in own]
    for name, value in extra.items():
        if name not in known:
            hint = f"one of {', '.join(known)}" if known else ""
            raise UsageError(Problem("settings", f"{data['family']} has no setting {name!r}", hint))
        number = number_of(f"settings.{name}", value, "number")
        if number < 0.0:
            raise UsageError(Problem(f"settings.{name}", f"{name} is negative: {number:.9g}"))
        if name in _WHOLE:
            least, largest = _WHOLE[name]
            if not (number.is_integer() and least <= number <= largest):
                what = f"{name} must be {'0 or 1' if largest == 1 else f'a whole number from {least} to {largest}'}"
                raise UsageError(Problem(f"settings.{name}", f"{what}, not {number:.9g}", f"{values[name]:.0f}"))
        values[name] = number
    values["step"] = step
    return values | own


def warnings_of(method: Method, constrained: bool) -> tuple[str, ...]:
    """Return what the user of a method should know, one sentence each."""
    if not isinstance(method, GeneralizedAlpha) or (method.form == INDEX_3 and not constrained):
        return ()
    return method.warnings
