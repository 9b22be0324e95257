"""For ``eomgen info --method``: exact operations of a step of a method, part by part."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from eomgen.errors import Problem, UsageError
from eomgen.integrators.families.register import method_named, terms_of
from eomgen.integrators.newton.row_sums import with_row_sums
from eomgen.integrators.stepper_data import method_data
from eomgen.pipeline.pipeline import derive

if TYPE_CHECKING:
    from eomgen.scene.scene import Scene
    from eomgen.system.system import System

_OPERATIONS = ("additions", "multiplications", "divisions", "functions")


def operations_of_step(scene: Scene, name: str) -> dict[str, Any]:
    """Return the work of a step of a method, JSON types: ``parts`` with ``times`` and operations of one, ``total``.

    Parameters
    ----------
    name : of the method, with the parameters of the method

    Raises
    ------
    ModelError
        The method cannot run on the scene.
    UsageError
        The method does not exist, or has no count of the work of a step.
    """
    method, facts = method_named(name), derive(scene, []).facts
    terms = terms_of(name, facts.constraints, facts.internal_states, not facts.ill_scaled)
    system = method.prepared(derive(scene, list(terms)))
    work = method.work(system, method_data(method, system))
    if not work:
        fault = f"the work of a step of {name} is not counted [E0559]"
        raise UsageError(Problem("--method", fault, "rosenbrock or lsrt2; simulate --timing measures any method"))
    parts: list[dict[str, Any]] = []
    total = dict.fromkeys(_OPERATIONS, 0)
    for part in work:
        counts = system.counts[part.what] if part.of_model else part
        each = {key: int(getattr(counts, key)) for key in _OPERATIONS}
        parts.append({"what": part.what, "times": part.times, **each})
        total = {key: total[key] + part.times * each[key] for key in _OPERATIONS}
    flops = total["additions"] + total["multiplications"]
    return {"method": name, "parts": parts, "total": {**total, "flops": flops}}


def operations_of_calls(scene: Scene, method: str) -> dict[str, Any]:
    """Return the operations per call of each model function that steps of a method call, as JSON types.

    How often a step calls a function may depend on iterations and errors.

    Parameters
    ----------
    method : name of the method
    """
    facts = derive(scene, []).facts
    system = derive(scene, list(terms_of(method, facts.constraints, facts.internal_states, not facts.ill_scaled)))
    parts = [
        {"function": name, **{key: int(getattr(system.counts[name], key)) for key in _OPERATIONS}}
        for name in system.functions
    ]
    return {"method": method, "parts": parts}


def joined_coordinates(system: System) -> list[list[str]]:
    """Return the groups of names of coordinates that springs and dampers between them join. Steps with one
    factorization eliminate the equations of a group without subtraction (``row_sums``)."""
    return [[_coordinate(system, component) for component in group] for group in with_row_sums(system).relative]


def _coordinate(system: System, component: int) -> str:
    """Return the name of the coordinate whose rate a velocity component is."""
    factor = next(item for item in system.factors if item.v_start <= component < item.v_start + item.v_size)
    return factor.name if factor.v_size == 1 else f"{factor.name}[{component - factor.v_start}]"
