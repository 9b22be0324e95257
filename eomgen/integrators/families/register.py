"""Register of families: eomgen's own, and entry points of other distributions, read for unknown names only."""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from eomgen.base.extensions import broken, extensions, loaded
from eomgen.base.text import nearest, shown
from eomgen.errors import Problem, UsageError
from eomgen.integrators.families.adaptive_discontinuous_galerkin import AdaptiveDiscontinuousGalerkin
from eomgen.integrators.families.adaptive_generalized_alpha import AdaptiveGeneralizedAlpha
from eomgen.integrators.families.composition import SymplecticComposition
from eomgen.integrators.families.corrected_predictor import CorrectedPredictor
from eomgen.integrators.families.discontinuous_galerkin import DiscontinuousGalerkin
from eomgen.integrators.families.embedded_pair import EmbeddedRungeKutta
from eomgen.integrators.families.family import Family, MethodName
from eomgen.integrators.families.generalized_alpha import GeneralizedAlpha
from eomgen.integrators.families.hermite import Hermite
from eomgen.integrators.families.partitioned import PartitionedRungeKutta
from eomgen.integrators.families.partitioned_pair import PartitionedEmbeddedRungeKutta
from eomgen.integrators.families.rattlie import Rattlie
from eomgen.integrators.families.rosenbrock import Rosenbrock
from eomgen.integrators.families.runge_kutta import RungeKuttaMuntheKaas
from eomgen.integrators.families.taylor import Taylor

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

#: The group of entry points under which a distribution gives its families: subclasses of ``Family``.
GROUP = "eomgen.integrator_families"
BUILT_IN: tuple[type[Family], ...] = (
    GeneralizedAlpha,
    AdaptiveGeneralizedAlpha,
    RungeKuttaMuntheKaas,
    EmbeddedRungeKutta,
    PartitionedRungeKutta,
    PartitionedEmbeddedRungeKutta,
    Hermite,
    Rosenbrock,
    CorrectedPredictor,
    Rattlie,
    SymplecticComposition,
    DiscontinuousGalerkin,
    AdaptiveDiscontinuousGalerkin,
    Taylor,
)

Row = tuple[type[Family], MethodName]


@cache
def families_of_others() -> tuple[type[Family], ...]:
    """Return the families of installed distributions. Raises UsageError naming the distribution of a broken one."""
    names = {family.family for family in BUILT_IN}
    known = set(_rows(BUILT_IN))
    families = []
    for entry in extensions(GROUP):
        family = _checked(entry)
        taken = sorted({family.family} & names) + sorted(set(_rows((family,))) & known)
        if taken:
            raise broken(entry, f"takes the name {taken[0]}, which there is")
        names.add(family.family)
        known |= set(_rows((family,)))
        families.append(family)
    return tuple(families)


def family_named(name: str) -> type[Family]:
    """Return a family by name. Raises UsageError."""
    result = next((family for family in BUILT_IN if family.family == name), None)
    result = result or next((family for family in families_of_others() if family.family == name), None)
    if result is None:
        fault = f"there is no family of methods {shown(name)}"
        raise UsageError(Problem("method", fault, "the distribution that it came from"))
    return result


def is_built_in(name: str) -> bool:
    """Return whether a public name belongs to a family of this package."""
    return name in _own_rows()


def stamp_of(name: str) -> str:
    """Return a digest of the module and templates of another distribution's method; empty for eomgen's own."""
    family = row_of(name)[0]
    if family in BUILT_IN:
        return ""
    files = [Path(inspect.getfile(family)), *sorted((family.templates or Path()).rglob("*.jinja"))]
    return hashlib.sha256(b"\0".join(file.read_bytes() for file in files)).hexdigest()


_STIFF = "generalized_alpha, for stiff motions"
_ADAPTIVE = "rk45, or taylor for small errors"
#: Methods of other tools, and their substitutes.
_ELSEWHERE: Mapping[str, str] = {
    **dict.fromkeys(("bdf", "lsoda", "radau", "ode15s", "ode23t", "ida", "cvode"), _STIFF),
    **dict.fromkeys(("ode45", "rk23", "dop853", "dopri5", "rkf45", "ode113", "dp45"), _ADAPTIVE),
    **dict.fromkeys(("euler", "forward_euler", "semi_implicit_euler", "rk2", "rk", "runge_kutta"), "rk4"),
    **dict.fromkeys(("verlet", "velocity_verlet", "stoermer_verlet"), "leapfrog"),
    **dict.fromkeys(("forest_ruth", "ruth4"), "yoshida4"),
    **dict.fromkeys(("implicit_euler", "backward_euler"), _STIFF),
}


def row_of(name: str) -> Row:
    """Return the family of a method, and its names, by one of these. Raises UsageError with the nearest names."""
    key = str(name).lower().replace("-", "_")
    own = _own_rows()
    if key in own:
        return own[key]
    others = _rows(families_of_others())
    if key in others:
        return others[key]
    hint = _ELSEWHERE.get(key) or nearest(key, {**own, **others})
    raise UsageError(Problem("method", f"there is no method {shown(str(name))}", hint))


@cache
def _own_rows() -> Mapping[str, Row]:
    return _rows(BUILT_IN)


def _rows(families: tuple[type[Family], ...]) -> dict[str, Row]:
    return {name: (family, row) for family in families for row in family.names() for name in (row.name, *row.aliases)}


def _checked(entry: EntryPoint) -> type[Family]:
    family = loaded(entry, object)
    if not (inspect.isclass(family) and issubclass(family, Family)):
        raise broken(entry, f"is no subclass of {Family.__module__}.Family")
    if inspect.isabstract(family):
        raise broken(entry, f"lacks {', '.join(sorted(family.__abstractmethods__))}")
    attributes = [name for name in ("family", "dense_output") if not hasattr(family, name)]
    if attributes:
        raise broken(entry, f"lacks the class attribute{'s' * (len(attributes) > 1)} {' and '.join(attributes)}")
    return family
