"""The register of families: eomgen's own, and those of other distributions, which are looked for when a name is not eomgen's."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from functools import cache
from importlib.metadata import EntryPoint, entry_points

from eomgen.errors import Problem, UsageError
from eomgen.integrators.families.family import Family, MethodName
from eomgen.integrators.families.generalized_alpha import GeneralizedAlpha
from eomgen.integrators.families.hermite import Hermite
from eomgen.integrators.families.partitioned import PartitionedRungeKutta
from eomgen.integrators.families.runge_kutta import RungeKuttaMuntheKaas
from eomgen.integrators.families.taylor import Taylor
from eomgen.text import nearest, shown

#: The group of entry points under which a distribution gives its families: subclasses of ``Family``.
GROUP = "eomgen.integrator_families"
BUILT_IN: tuple[type[Family], ...] = (GeneralizedAlpha, RungeKuttaMuntheKaas, PartitionedRungeKutta, Hermite, Taylor)

Row = tuple[type[Family], MethodName]


@cache
def families_of_others() -> tuple[type[Family], ...]:
    """Return the families that installed distributions give. Raises UsageError naming the distribution of a broken one."""
    names = {family.family for family in BUILT_IN}
    known = set(_rows(BUILT_IN))
    found = []
    for entry in sorted(entry_points(group=GROUP), key=lambda entry: (entry.name, entry.value)):
        family = _loaded(entry)
        taken = sorted({family.family} & names) + sorted(set(_rows((family,))) & known)
        if taken:
            raise _broken(entry, f"takes the name {taken[0]}, which there is")
        names.add(family.family)
        known |= set(_rows((family,)))
        found.append(family)
    return tuple(found)


def family_named(name: str) -> type[Family]:
    """Return a family by its name. Raises UsageError."""
    for families in (BUILT_IN, families_of_others):
        for family in families() if callable(families) else families:
            if family.family == name:
                return family
    raise UsageError(Problem("method", f"there is no family of methods {shown(name)}", "the distribution that it came from"))


def row_of(name: str) -> Row:
    """Return the family of a method, and its names, by one of these. Raises UsageError with the nearest names."""
    key = str(name).lower().replace("-", "_")
    own = _own_rows()
    if key in own:
        return own[key]
    others = _rows(families_of_others())
    if key in others:
        return others[key]
    raise UsageError(Problem("method", f"there is no method {shown(str(name))}", nearest(key, {**own, **others})))


@cache
def _own_rows() -> Mapping[str, Row]:
    return _rows(BUILT_IN)


def _rows(families: tuple[type[Family], ...]) -> dict[str, Row]:
    return {name: (family, row) for family in families for row in family.names() for name in (row.name, *row.aliases)}


def _loaded(entry: EntryPoint) -> type[Family]:
    try:
        family = entry.load()
    except Exception as error:  # whatever a module of others does when it is imported
        raise _broken(entry, f"does not load: {type(error).__name__}: {error}") from error
    if not (inspect.isclass(family) and issubclass(family, Family)):
        raise _broken(entry, f"is no subclass of {Family.__module__}.Family")
    if inspect.isabstract(family):
        raise _broken(entry, f"lacks {', '.join(sorted(family.__abstractmethods__))}")
    return family


def _broken(entry: EntryPoint, what: str) -> UsageError:
    who = entry.dist.name if entry.dist is not None else entry.value.partition(":")[0]
    where = f"the integrator family {shown(entry.name)} ({entry.value}) of the distribution {who}"
    return UsageError(Problem("method", f"{where} {what}", f"another version of {who}, or uninstall it"))
