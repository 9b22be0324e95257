"""What a run needs before its first step: a library with the method's stepper, and memory for what it records."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from eomgen.compiled.model import Model
from eomgen.errors import ModelError, Problem, UsageError
from eomgen.integrators.methods import canonical_name, terms_of
from eomgen.scene.prescribed_motion import laws_of, smooth
from eomgen.simulation.angle_range import check_angles
from eomgen.simulation.inputs import CheckedSignal, check_reach
from eomgen.simulation.time_grid import TimeGrid, check_jumps
from eomgen.toolchain.library import Library

Array = NDArray[np.float64]


def stepper_library(model: Model, name: str) -> Library:
    """Return the model's own library where it has this method's stepper, else another one, compiled when first needed."""
    layout = model.library.layout
    own = name == canonical_name(layout["built_method"])
    if own and layout["method"]:
        return model.library
    needed = terms_of(name, layout["facts"]["constraints"], layout["facts"]["internal_states"], "mass" in model.functions)
    missing = [term for term in needed if term not in model.functions]
    if "iteration" in model.functions and "partials" in missing:
        missing.remove("partials")
    if missing and not layout["facts"]["constraints"]:
        what = f"{name} needs the terms {', '.join(missing)}, which this model was built without"
        raise UsageError(Problem("simulate", what, f"eomgen.build(scene, terms=[..., {', '.join(map(repr, missing))}])"))
    library = model.library if own and not missing else model.stepper(name)
    if not library.layout["method"]:
        other = "another method" if name.startswith("generalized_alpha") else "generalized_alpha"
        raise ModelError(f"{name} cannot run on this scene: {library.layout['stepper_refused']}", other)
    return library


def check_span(model: Model, library: Library, p: Array, given: Mapping[str, CheckedSignal], grid: TimeGrid) -> None:
    """Raise UsageError where something that is prescribed over time does not serve a run from its start to its end.

    Parameters
    ----------
    library : with the stepper
    p : (np,) parameters
    given : inputs from the caller, in the place of the scene's
    """
    start, end = grid.start, grid.reached
    check_reach(model.library.layout, given, start, end)
    _check_laws(model, p, start, end)
    check_angles(model.scene, dict(zip(model.parameters, p.tolist(), strict=True)), given, start, end)
    check_jumps(library.layout["method"], grid.step)


def _check_laws(model: Model, p: Array, start: float, end: float) -> None:
    """Raise UsageError where a drive, or the law of the base, jumps between two times at the parameters of a run, (np,)."""
    if all(smooth(law.formula) for law in laws_of(model.scene)):
        return
    from eomgen.mechanics.prescribed_motion import jumps  # noqa: PLC0415  # most scenes need none of it

    values = {item.name: item.value for item in model.scene.parameters}
    problems = jumps(model.scene, values | dict(zip(model.parameters, p.tolist(), strict=True)), start, end)
    if problems:
        raise UsageError(problems)


def check_memory(rows: int, width: int) -> None:
    """Raise UsageError where the record of a run would not fit into this machine's memory."""
    needed = 8.0 * rows * width * 3.0
    available = float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")) if hasattr(os, "sysconf") else math.inf
    if needed > 0.8 * available:
        what = f"{rows} rows of {width} numbers would take about {needed / 1e9:.3g} GB, this machine has {available / 1e9:.3g}"
        raise UsageError(Problem("record_every", what, f"record_every = {math.ceil(needed / (0.2 * available))} or more"))
