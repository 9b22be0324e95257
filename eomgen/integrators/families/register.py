"""The register of families, eomgen's own and entry points of other distributions, and public names of the
integration methods with their parameters."""

from __future__ import annotations

import functools
import hashlib
import inspect
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from eomgen.base.extensions import broken, extensions, load_row
from eomgen.base.messages import nearest, shown
from eomgen.base.products import fault_of_removed
from eomgen.errors import ModelError, Problem, UsageError
from eomgen.integrators.families.family import Family, MethodName
from eomgen.system.description import Simulation

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

    from eomgen.system.system import Facts


#: The group of entry points for families of other distributions: subclasses of ``Family``.
GROUP = "eomgen.integrator_families"


class _Families:
    """Families in the order in which their methods are looked for, each imported when it is reached: a run needs one of
    them, and most runs the first."""

    _TARGETS = (
        ("generalized_alpha", "GeneralizedAlpha"),
        ("adaptive_generalized_alpha", "AdaptiveGeneralizedAlpha"),
        ("runge_kutta", "RungeKuttaMuntheKaas"),
        ("embedded_pair", "EmbeddedRungeKutta"),
        ("partitioned", "PartitionedRungeKutta"),
        ("partitioned", "PartitionedEmbeddedRungeKutta"),
        ("rosenbrock", "Rosenbrock"),
        ("corrected_predictor", "CorrectedPredictor"),
        ("rattlie", "Rattlie"),
        ("composition", "SymplecticComposition"),
        ("discontinuous_galerkin", "DiscontinuousGalerkin"),
        ("taylor", "Taylor"),
    )

    def __iter__(self) -> Iterator[type[Family]]:
        for module, name in self._TARGETS:
            yield getattr(import_module(f"eomgen.integrators.families.{module}"), name)


BUILT_IN = _Families()

Row = tuple[type[Family], MethodName]


@cache
def families_of_others() -> tuple[type[Family], ...]:
    """Return the families of methods that installed distributions add by entry points. Raises UsageError naming the
    distribution if an entry lacks parts of a Family or takes a name that is used."""
    names = {family.family for family in BUILT_IN}
    known = set(method_names())
    families = []
    for entry in extensions(GROUP):
        family = _check_family(entry)
        taken = sorted({family.family} & names) + sorted(set(_rows((family,))) & known)
        if taken:
            raise broken(entry, f"takes the name {taken[0]}, which there is")
        names.add(family.family)
        known |= set(_rows((family,)))
        families.append(family)
    return tuple(families)


def family_named(name: str) -> type[Family]:
    """Return the class of a family of methods by its name, eomgen's own or another distribution's. Raises
    UsageError."""
    result = next((family for family in BUILT_IN if family.family == name), None)
    result = result or next((family for family in families_of_others() if family.family == name), None)
    if result is None:
        fault = f"there is no family of methods {shown(name)} [E0347]"
        raise UsageError(Problem("method", fault, "the distribution that it came from"))
    return result


def is_built_in(name: str) -> bool:
    """Return whether a public name belongs to a family of this package."""
    return _own_row(name) is not None


def stamp_of(name: str) -> str:
    """Return a digest of the module and templates of another distribution's method; empty for eomgen's own."""
    family = row_of(name)[0]
    if family in BUILT_IN:
        return ""
    files = [Path(inspect.getfile(family)), *sorted((family.templates or Path()).rglob("*.jinja"))]
    return hashlib.sha256(b"\0".join(file.read_bytes() for file in files)).hexdigest()


_STIFF = "generalized_alpha, for stiff motions"
_ADAPTIVE = "rk45, or taylor for small errors"
#: Methods of other tools, and their substitutes in eomgen.
_ELSEWHERE: Mapping[str, str] = {
    **dict.fromkeys(("bdf", "lsoda", "radau", "ode15s", "ode23t", "ida", "cvode"), _STIFF),
    **dict.fromkeys(("ode45", "rk23", "dop853", "rkf45", "ode113", "dp45"), _ADAPTIVE),
    **dict.fromkeys(("euler", "forward_euler", "semi_implicit_euler", "rk2", "rk"), "rk4"),
    **dict.fromkeys(("verlet", "velocity_verlet", "stoermer_verlet"), "leapfrog"),
    **dict.fromkeys(("forest_ruth", "ruth4"), "yoshida4"),
    **dict.fromkeys(("implicit_euler", "backward_euler"), _STIFF),
}


def row_of(name: str) -> Row:
    """Return the family and the names of a method by any of its names. Raises UsageError with the nearest names."""
    key = str(name).lower().replace("-", "_")
    row = _own_row(key)
    if row is not None:
        return row
    others = _rows(families_of_others())
    if key in others:
        return others[key]
    if gone := fault_of_removed("method", key):
        raise UsageError(Problem("method", *gone))
    hint = nearest(key, {**method_names(), **others}, _ELSEWHERE)
    raise UsageError(Problem("method", f"there is no method {shown(str(name))} [E0348]", hint))


@functools.lru_cache(maxsize=256)
def _own_row(key: str) -> Row | None:
    each = (_rows([family]) for family in BUILT_IN)
    return next((rows[key] for rows in each if key in rows), None)


def _rows(families: Iterable[type[Family]]) -> dict[str, Row]:
    return {name: (family, row) for family in families for row in family.names() for name in (row.name, *row.aliases)}


def _check_family(entry: EntryPoint) -> type[Family]:
    family = load_row(entry, object)
    if not (inspect.isclass(family) and issubclass(family, Family)):
        raise broken(entry, f"is not a subclass of {Family.__module__}.Family")
    if inspect.isabstract(family):
        raise broken(entry, f"lacks {', '.join(sorted(family.__abstractmethods__))}")
    attributes = [name for name in ("family", "dense_output") if not hasattr(family, name)]
    if attributes:
        raise broken(entry, f"lacks the class attribute{'s' * (len(attributes) > 1)} {' and '.join(attributes)}")
    return family


#: A method of integration: see ``families.family``.
Method = Family
#: Name of the choice before each run, and the method of the library that models are built with in this case.
AUTO, STANDARD = "auto", Simulation.method


@cache
def method_names() -> Mapping[str, str]:
    """Return every name of eomgen's own methods, with the principal name of the method."""
    return {name: row.name for name, (_, row) in _rows(BUILT_IN).items()}


def check_needs(method: Method, facts: Facts) -> None:
    """Raise ModelError naming every need of the method that the facts of a system do not meet."""
    problems = [
        Problem(
            "method",
            f"{method.family} needs a system {'with' if need.value else 'without'} {need.fact.replace('_', ' ')}:"
            f" {need.reason} [E0349]",
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
    """Return a method by any of its names, with its parameters.

    None as a value leaves the choice to the method; parameters that the method does not have are ignored.

    Raises
    ------
    UsageError
        An unknown name, or a parameter out of range, with the reason.
    """
    row = row_of(name)[1]
    values = {"rho_inf": rho_inf, **parameters}
    return _make_method(row.name, tuple((key, values[key]) for key in row.parameters if values.get(key) is not None))


def method_compiled(name: str) -> Method:
    """Return a method with valid parameters for the compilation of its stepper; runs set other parameters. Raises
    UsageError."""
    row = row_of(name)[1]
    return _make_method(row.name, tuple(row.compiled_with.items())) if row.compiled_with else method_named(name)


@functools.lru_cache(maxsize=256)
def _make_method(name: str, parameters: tuple[tuple[str, float | None], ...]) -> Method:
    """Return a method, cached, because a check of exact coefficients takes longer than a short run."""
    return row_of(name)[1].make(**dict(parameters))


#: Parameters of scenes that some methods take, and that no scene has unless it gives them.
_FOR_SOME = ("tolerance", "order", "alpha", "beta", "gamma")
#: Parameters with equivalent meanings.
_SAYING_THE_SAME = ({"rho_inf", "alpha", "beta", "gamma"}, {"order", "tolerance"})


def method_parameters(name: str, values: Mapping[str, float | None], scene: Mapping[str, Any]) -> dict[str, float]:
    """Return the parameters of a method by name: given ones, else values of the scene that the method has.

    None in `values` means not given. If a given parameter determines others, as ``rho_inf`` does, the scene's values of
    these are not taken.

    Raises
    ------
    UsageError
        A parameter is given that the method does not take, or two that say the same.
    """
    row = row_of(name)[1]
    specified = {key: value for key, value in values.items() if value is not None}
    for key in specified:
        if key == "tolerance" and row.fixed_steps:
            why, hint = row.fixed_steps
            raise UsageError(Problem(key, f"{row.name} takes no tolerance: {why} [E0350]", hint))
        if key not in (*row.parameters, *row.idle):
            hint = f"only {', '.join(row.parameters)}" if row.parameters else "leave it out"
            raise UsageError(Problem(key, f"{row.name} takes no {key} [E0351]", hint))
    if {"alpha", "rho_inf"} <= set(specified):
        fault = "alpha and rho_inf say the same: rho_inf = (1 - alpha)/(1 + alpha) [E0352]"
        raise UsageError(Problem("alpha", fault, "one of them"))
    said = {key for group in _SAYING_THE_SAME if group & set(specified) for key in group}
    left = {key: value for key in row.parameters if key not in said and (value := scene.get(key)) is not None}
    return {**left, **specified}


def without_effect(name: str, scene: Simulation) -> list[str]:
    """Return one sentence for each parameter of a scene that the scene's own method does not take.

    Empty if the run has another method than the scene.

    Parameters
    ----------
    name : of the method of the run
    scene : method and parameters of the scene
    """
    if scene.method != AUTO and canonical_name(scene.method, scene.tolerance) != name:
        return []
    row = row_of(name)[1]
    idle = {key: value for key in _FOR_SOME if (value := getattr(scene, key)) is not None and key not in row.parameters}
    hint = f"; try: {row.fixed_steps[1]}" if "tolerance" in idle and row.fixed_steps else ""
    return [
        f"the scene's {key} of {value:.6g} has no effect: {name} takes no {key}{hint}" for key, value in idle.items()
    ]


def terms_of(name: str, constrained: bool = False, internal: bool = False, mass: bool = True) -> tuple[str, ...]:
    """Return the functions that the stepper of a method calls, for a scene with constraints, or with internal states.

    ``mass``: whether the system has the inertia matrix with sufficient digits; else series take forward dynamics.
    """
    return (*row_of(name)[0].terms(constrained, internal, mass), *(("internal_rate",) if internal else ()))
