"""Distributed loads on beams: force per length, a polynomial along the beam times a formula."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, Literal

from eomgen.formula.nodes import Formula, Vector
from eomgen.scene.bodies.cosserat import CONSTRAINED
from eomgen.scene.forces.element import ForceElement, Row, Site
from eomgen.scene.formula.scope import FIXED_PARAMETERS, LOAD
from eomgen.scene.reading.key_metadata import Table, key
from eomgen.scene.reading.kinds import Triple, Values
from eomgen.text import key_of, nearest, shown


class DistributedLoadEntry(Table):
    """A force per length on a beam."""

    beam: str = key("what it acts on", refers="beams", kind="beam")
    force: Triple = key("per length", unit="N/m", names=LOAD)
    profile: Values = key(
        "polynomial in s, 0 to 1 along the beam, that multiplies the force",
        (1.0,),
        names=FIXED_PARAMETERS,
        kind="list of values of fixed parameters, constant first",
    )
    axes: Literal["world", "beam"] = key("axes of the force", "world")


@dataclass(frozen=True)
class DistributedLoad(ForceElement):
    """Force per length on the axis of a beam, N/m: a polynomial in s times formulas of everything but accelerations.

    Attributes
    ----------
    start, length : of the beam, m
    profile : coefficients of the polynomial in s = (x - start) / length, constant first
    axes : ``beam`` are those of its undeformed frame
    """

    section: ClassVar[str] = "distributed_loads"

    beam: str
    start: float
    length: float
    force: Vector
    profile: tuple[float, ...]
    axes: Literal["world", "beam"] = "world"

    def formulas(self) -> Iterator[tuple[Formula, int]]:
        yield from ((formula, 0) for formula in self.force)

    def passive(self) -> None:
        return None


def read_distributed_load(name: str, entry: DistributedLoadEntry, site: Site) -> DistributedLoad:
    """Return a distributed load."""
    place, values = key_of("distributed_loads", name), site.values
    start, length = 0.0, 1.0
    if entry.beam not in site.beams:
        what = (
            f"{shown(entry.beam)} is no beam" if entry.beam in site.bodies else f"there is no beam {shown(entry.beam)}"
        )
        hint = nearest(entry.beam, site.beams) or "a [beams] section; a rigid body takes [forces] at its centre"
        values.report.add(f"{place}.beam", what, hint)
    elif site.beams[entry.beam].model in CONSTRAINED:
        what = (
            f"the beam {entry.beam} is of the model {site.beams[entry.beam].model}, which distributed loads do not know"
        )
        values.report.add(f"{place}.beam", what, "[forces] at its nodes")
    elif not values.report.concerns(of_beam := key_of("beams", entry.beam)):
        start = values.constant(f"{of_beam}.start", site.beams[entry.beam].start)
        length = values.constant(f"{of_beam}.length", site.beams[entry.beam].length or 1.0)
    profile = tuple(values.constants(f"{place}.profile", entry.profile))
    if not profile:
        values.report.add(f"{place}.profile", "the list of coefficients is empty", "[1, -0.5]")
    elif all(math.isfinite(entry) for entry in profile) and not any(profile):
        values.report.add(f"{place}.profile", "all coefficients are zero, so there is no load", "[1], or no entry")
    force = values.vector(f"{place}.force", entry.force, LOAD)
    return DistributedLoad(name, entry.beam, start, length, force, profile, entry.axes)


ROW = Row(DistributedLoad, DistributedLoadEntry, read_distributed_load, {})
