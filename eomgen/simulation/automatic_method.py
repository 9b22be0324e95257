"""``method = "auto"``: the method of a run, chosen once before it from the eigenvalues of its equations at the start.

The choice is between the implicit method, which is stable at any step, and the explicit one of order 4, which is more
accurate if the step resolves the fastest motion and forces are smooth.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.compiled.equations import accelerations, free_directions, has_residual_partials, residual_partials
from eomgen.compiled.initial_state import InitialState, initial_state
from eomgen.errors import EomgenError
from eomgen.integrators.families.register import BUILT_IN, STANDARD, method_named

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel

#: Step times largest eigenvalue up to which an explicit method of order 4 resolves the fastest motion: a twelfth of its
#: period.
RESOLVED = 0.5
#: Parameters that no method takes among which ``auto`` chooses, and a method that takes each.
OF_OTHERS = {"alpha": "hht", "beta": "newmark", "gamma": "newmark", "order": "taylor"}


def choose_method(
    model: CompiledModel, initial: Mapping[str, Any] | None, p: Array, t: float, step: float
) -> tuple[str, str]:
    """Return the name of the method for a run with ``method = "auto"``, and a sentence with the reason of the choice.

    Explicit, if such a method runs on the scene, forces are smooth, and the step resolves the largest eigenvalue at the
    start; otherwise generalized-alpha.

    Parameters
    ----------
    initial, p, t : initial values by name, parameters (np,) and time in s at the start of the run
    step : s
    """
    facts = model.library.layout["facts"]
    explicit = _explicit(facts)
    if explicit is None:
        return _chosen(STANDARD, "no explicit method runs on this scene")
    if not facts["smooth"]:
        return _chosen(STANDARD, "forces have corners at places met by the motion: explicit methods lose order")
    fastest = largest_eigenvalue(model, initial_state(model, initial, p), t, p)
    if fastest is None:
        return _chosen(STANDARD, "the eigenvalues at the start are not known")
    reach = step * fastest
    told = f"step times the largest eigenvalue at the start, {fastest:.3g} 1/s, is {reach:.2g}"
    if reach > RESOLVED:
        return _chosen(STANDARD, f"{told}, above {RESOLVED:g}, which asks for an implicit method")
    return _chosen(explicit, f"{told}, so an explicit method resolves the motion")


def _chosen(name: str, why: str) -> tuple[str, str]:
    return name, f"method chosen before the run: {name}, because {why}"


def _explicit(facts: Mapping[str, Any]) -> str | None:
    """Return the name of the first explicit method with fixed steps that runs on a system with these facts; None
    without one."""
    for name in (row.name for family in BUILT_IN if not family.implicit for row in family.names()):
        method = method_named(name)
        if not method.chooses_steps and all(bool(facts[need.fact]) is need.value for need in method.needs):
            return name
    return None


def largest_eigenvalue(model: CompiledModel, state: InitialState, t: float, p: Array) -> float | None:
    """Return the largest modulus, 1/s, among eigenvalues of the equations linearised about a state: M, C and K on the
    tangent of the constraints, and the internal states. None if terms are missing or not finite."""
    q, v, z = state.q, state.v, state.z
    if not has_residual_partials(model):
        return None
    try:
        at: dict[str, Any] = {"z": z, "parameters": p}
        if model.multipliers:
            a, at["multipliers"] = model.constrained_dynamics(q, v, t, **at)
        else:
            a = accelerations(model, q, v, t, **at)
        K, C, M = residual_partials(model, q, v, a, t, **at)
        free = free_directions(model, q, t, p)
        K, C, M = (free.T @ matrix @ free for matrix in (K, C, M))
        count = len(M)
        solved = np.linalg.solve(M, np.concatenate([K, C], axis=1))
        companion = np.block([[np.zeros((count, count)), np.eye(count)], [-solved]])
        moduli = [np.abs(np.linalg.eigvals(companion)).max(initial=0.0)]
        if "internal_partials" in model.functions:
            by_state = model.internal_partials(q, v, z, t, parameters=p).rate_z
            moduli.append(np.abs(np.linalg.eigvals(by_state)).max(initial=0.0))
    except (EomgenError, np.linalg.LinAlgError, ValueError):
        return None
    largest = float(max(moduli))
    return largest if np.isfinite(largest) else None
