"""From a derived System to one that can start: redundant constraint rows left out, the initial state consistent."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from eomgen.integrators.consistency import Constrained, assemble, redundant_rows
from eomgen.symbolic.evaluate import evaluate

if TYPE_CHECKING:
    from eomgen.system import System

Array = NDArray[np.float64]


def ready(derive: Callable[[Sequence[int]], System]) -> System:
    """Return a System without redundant rows and with a consistent initial state, notes saying what was done.

    Parameters
    ----------
    derive : callable
        Derives the System without the given rows.

    Raises
    ------
    ModelError
        The constraints contradict each other.
    """
    system = derive(())
    needed = {"mass", "constraint_jacobian", "constraint_velocity"}
    if not system.multipliers or not needed <= set(system.functions):
        return system
    start = np.array(system.initial_q)
    found = assemble(constrained(system), start, np.array(system.initial_v))
    dependent = redundant_rows(constrained(system), found.q)
    notes = [f"{name} follows from the constraints before it and is left out" for name in _names(system, dependent)]
    if dependent:
        system = derive(dependent)
    notes += found.corrections()
    return replace(
        system, initial_q=tuple(map(float, found.q)), initial_v=tuple(map(float, found.v)), notes=(*system.notes, *notes)
    )


def _names(system: System, rows: Sequence[int]) -> list[str]:
    return [system.multipliers[row] for row in rows]


def constrained(system: System) -> Constrained:
    """Return the constraints of a System at its default parameters, evaluated on its tape."""
    defaults: dict[str, Any] = {"p": np.array([parameter.value for parameter in system.parameters])}

    def at(function: str, t: float, **state: Array) -> Array:
        inputs: dict[str, Any] = {**defaults, **state, "t": np.array([t])}
        if "base" in system.functions[function].inputs:
            inputs["base"] = np.array(evaluate(system.tape, system.functions["base"].refs, inputs))
        return np.array(evaluate(system.tape, system.functions[function].refs, inputs), dtype=float)

    rows, nv = len(system.multipliers), system.nv
    return Constrained(
        factors=system.factors,
        names=system.multipliers,
        holonomic=system.holonomic,
        constraint=lambda q, t: at("constraint", t, q=q) if system.holonomic else np.zeros(0),
        velocity=lambda q, v, t: at("constraint_velocity", t, q=q, v=v),
        jacobian=lambda q, t: at("constraint_jacobian", t, q=q).reshape(rows, nv),
        mass=lambda q: at("mass", 0.0, q=q).reshape(nv, nv),
    )
