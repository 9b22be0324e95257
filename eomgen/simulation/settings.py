"""Validation of simulation settings."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from eomgen.arrays import Array
from eomgen.compiled.arguments import number_of
from eomgen.compiled.model import CompiledModel
from eomgen.errors import ModelError, Problem, UsageError
from eomgen.integrators.methods import Method, canonical_name, method_named, method_parameters, terms_of
from eomgen.integrators.stepper_layout import checked_setting, default_settings
from eomgen.simulation.angle_range import check_angles
from eomgen.simulation.inputs import CheckedSignal, check_reach
from eomgen.simulation.time_grid import TimeGrid, check_jumps
from eomgen.toolchain.library import Library


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
    """Return the method of the run. Raises UsageError for parameters that it does not take or cannot bear, with the
    reason."""
    for key, value in given.items():
        if value is not None:
            number_of(key, value, "number")
    if given["rho_inf"] is not None and not 0.0 <= given["rho_inf"] <= 1.0:
        raise UsageError(Problem("rho_inf", f"rho_inf must lie between 0 and 1, not {given['rho_inf']:.9g}", "0.8"))
    method = method_named(name, **method_parameters(name, given, scene))
    for need in method.needs:
        if need.parameter and need.fact == "constraints" and constrained is not need.value:
            raise UsageError(
                Problem(need.parameter, f"{name} cannot run on constraints: {need.reason}", need.alternative)
            )
    return method


def stepper_settings(
    data: Mapping[str, Any], step: float, method: Method, extra: Mapping[str, float]
) -> dict[str, float]:
    """Return the settings of a stepper in their order: the method's parameters, and the caller's own. Raises
    UsageError."""
    values = default_settings(data)
    own = {name: float(value) for name, value in method.parameters.items()}
    for name, value in extra.items():
        values[name] = checked_setting(data, name, number_of(f"settings.{name}", value, "number"))
    values["step"] = step
    return values | own


def stepper_library(model: CompiledModel, name: str, method: Method) -> Library:
    """Return the model's own library where it has this method's stepper, else another one, compiled when first
    needed."""
    layout = model.library.layout
    own = name == canonical_name(layout["built_method"])
    if own and layout["method"]:
        return model.library
    needed = terms_of(
        name, layout["facts"]["constraints"], layout["facts"]["internal_states"], "mass" in model.functions
    )
    missing = [term for term in needed if term not in model.functions]
    if "iteration" in model.functions and "partials" in missing:
        missing.remove("partials")
    if missing and not layout["facts"]["constraints"]:
        what = f"{name} needs the terms {', '.join(missing)}, which this model was built without"
        raise UsageError(
            Problem("simulate", what, f"eomgen.build(scene, terms=[..., {', '.join(map(repr, missing))}])")
        )
    library = model.library if own and not missing else model.stepper(name)
    if not library.layout["method"]:
        raise ModelError(f"{name} cannot run on this scene: {library.layout['stepper_refused']}", method.instead)
    return library


def check_span(
    model: CompiledModel,
    library: Library,
    method: Method,
    p: Array,
    given: Mapping[str, CheckedSignal],
    grid: TimeGrid,
) -> None:
    """Raise UsageError where something that is prescribed over time does not serve a run from its start to its end.

    Parameters
    ----------
    library : with the stepper
    method : of the run
    p : (np,) parameters
    given : inputs from the caller, in the place of the scene's
    """
    start, end = grid.start, grid.reached
    check_reach(model.library.layout, given, start, end)
    if refused := followed_laws(model, method, p, grid)[0]:
        raise UsageError(refused)
    check_angles(model.description, dict(zip(model.parameters, p.tolist(), strict=True)), given, start, end)
    check_jumps(library.layout["method"], grid.step)


def followed_laws(model: CompiledModel, method: Method, p: Array, grid: TimeGrid) -> tuple[list[Problem], list[str]]:
    """Return what is wrong with the drives and the law of the base, and what there is to say about them, in a run.

    They may jump at the parameters of the run, (np,), or be too steep for the step; methods with steps of their own
    follow what is steep.
    """
    laws = [law for law in model.description.laws if not law.constant]
    if not laws:
        return [], []
    from eomgen.formula.jumps import jumps  # noqa: PLC0415  # most scenes need none of it
    from eomgen.formula.steepness import steep  # noqa: PLC0415

    values = model.description.values(dict(zip(model.parameters, p.tolist(), strict=True)))
    if refused := jumps(laws, values, grid.start, grid.reached):
        return refused, []
    if method.chooses_steps:
        return [], []
    return steep(laws, values, grid.start, grid.reached, grid.step)


def check_memory(rows: int, width: int) -> None:
    """Raise UsageError where the record of a run would not fit into this machine's memory."""
    needed = 8.0 * rows * width * 3.0
    available = float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")) if hasattr(os, "sysconf") else math.inf
    if needed > 0.8 * available:
        what = (
            f"{rows} rows of {width} numbers would take about {needed / 1e9:.3g} GB, this machine has"
            f" {available / 1e9:.3g}"
        )
        raise UsageError(
            Problem("record_every", what, f"record_every = {math.ceil(needed / (0.2 * available))} or more")
        )
