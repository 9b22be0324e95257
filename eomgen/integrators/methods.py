"""Public names of the integration methods, and their parameters."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from eomgen.errors import ModelError, Problem, UsageError
from eomgen.integrators.families.family import Family
from eomgen.integrators.families.register import BUILT_IN, row_of
from eomgen.system.description import Simulation

if TYPE_CHECKING:
    from eomgen.system.system import Facts

#: A method of integration: see ``families.family``.
Method = Family
#: Name of the method that is chosen before each run, and the one that models are built with then.
AUTO, STANDARD = "auto", Simulation.method
#: Every name of eomgen's own methods, and the one it stands for.
METHOD_NAMES: Mapping[str, str] = {
    name: row.name for family in BUILT_IN for row in family.names() for name in (row.name, *row.aliases)
}


def check_needs(method: Method, facts: Facts) -> None:
    """Raise ModelError naming every need of the method that the system does not meet."""
    problems = [
        Problem(
            "method",
            f"{method.family} needs a system {'with' if need.value else 'without'} {need.fact.replace('_', ' ')}:"
            f" {need.reason}",
            need.alternative,
        )
        for need in method.needs
        if bool(getattr(facts, need.fact)) is not need.value
    ]
    if problems:
        raise ModelError(problems)


def canonical_name(name: str, tolerance: float | None = None) -> str:
    """Return the name of a method for an alias, or of the method for a given tolerance. Raises
    UsageError with the nearest names."""
    row = row_of(name)[1]
    return row.name if tolerance is None else row.by_tolerance or row.name


def method_named(name: str, rho_inf: float | None = Simulation.rho_inf, **parameters: float | None) -> Method:
    """Return a method with its parameters; None leaves a choice to the method, parameters of other methods are ignored.

    Raises
    ------
    UsageError
        An unknown name, or a parameter out of its range, with the reason.
    """
    row = row_of(name)[1]
    given = {"rho_inf": rho_inf, **parameters}
    return _made(row.name, tuple((key, given[key]) for key in row.parameters if given.get(key) is not None))


def method_compiled(name: str) -> Method:
    """Return a method with parameters that its stepper can be compiled with; runs give others. Raises UsageError."""
    row = row_of(name)[1]
    return _made(row.name, tuple(row.compiled_with.items())) if row.compiled_with else method_named(name)


@functools.lru_cache(maxsize=256)
def _made(name: str, parameters: tuple[tuple[str, float | None], ...]) -> Method:
    """Return a method; its exact coefficients take longer to be checked than a short run takes."""
    return row_of(name)[1].make(**dict(parameters))


#: Parameters with equivalent meanings.
_SAYING_THE_SAME = ({"rho_inf", "alpha", "beta", "gamma"}, {"order", "tolerance"})


def method_parameters(name: str, given: Mapping[str, float | None], scene: Mapping[str, Any]) -> dict[str, float]:
    """Return the parameters of a method: given ones, else the scene's, as far as the method takes them. If one is
    given that says the same as others, the scene's values of these are not taken.

    Raises
    ------
    UsageError
        A parameter is given that the method does not take, or two that say the same.
    """
    row = row_of(name)[1]
    specified = {key: value for key, value in given.items() if value is not None}
    for key in specified:
        if key == "tolerance" and row.fixed_steps:
            why, hint = row.fixed_steps
            raise UsageError(Problem(key, f"{row.name} takes no tolerance: {why}", hint))
        if key not in (*row.parameters, *row.idle):
            hint = f"only {', '.join(row.parameters)}" if row.parameters else "leave it out"
            raise UsageError(Problem(key, f"{row.name} takes no {key}", hint))
    if {"alpha", "rho_inf"} <= set(specified):
        fault = "alpha and rho_inf say the same: rho_inf = (1 - alpha)/(1 + alpha)"
        raise UsageError(Problem("alpha", fault, "one of them"))
    said = {key for group in _SAYING_THE_SAME if group & set(specified) for key in group}
    left = {key: value for key in row.parameters if key not in said and (value := scene.get(key)) is not None}
    return {**left, **specified}


def terms_of(name: str, constrained: bool = False, internal: bool = False, mass: bool = True) -> tuple[str, ...]:
    """Return the functions that the stepper of a method calls, for a scene with constraints, or with internal states.

    ``mass``: whether the inertia matrix is at hand and keeps its digits; else series take forward dynamics.
    """
    return (*row_of(name)[0].terms(constrained, internal, mass), *(("internal_rate",) if internal else ()))
