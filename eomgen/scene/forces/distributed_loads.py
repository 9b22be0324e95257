"""Distributed loads on beams in scene files, keys and data: force per length, a polynomial along the beam times a
formula."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import ClassVar, Literal

from eomgen.base.data import dataclass
from eomgen.base.messages import key_of, nearest, shown
from eomgen.formula.nodes import ZERO_VECTOR, Formula, Vector
from eomgen.scene.bodies.cosserat import CONSTRAINED, Cosserat
from eomgen.scene.forces.element import ForceElement
from eomgen.scene.forces.element_section import ElementSection
from eomgen.scene.formula.scope import FIXED_PARAMETERS, LOAD, LOCAL_LOAD
from eomgen.scene.joints.frames import Site
from eomgen.scene.reading.key_metadata import Table, key
from eomgen.scene.reading.kinds import ORIGIN, Triple, Values
from eomgen.scene.reading.values import Values as Reader


class DistributedLoadEntry(Table):
    """A force per length on a beam."""

    beam: str = key("the beam under the load", refers="beams", kind="beam")
    force: Triple = key("force per length", unit="N/m", names=LOCAL_LOAD)
    moment: Triple = key("moment per length, of geometrically exact beams", ORIGIN, unit="N", names=LOCAL_LOAD)
    profile: Values = key(
        "polynomial in s, 0 to 1 along the beam, that multiplies the force",
        (1.0,),
        names=FIXED_PARAMETERS,
        kind="list of values of fixed parameters, constant first",
    )
    axes: Literal["world", "beam"] = key(
        "axes of force and moment; `beam`: of its frame, and of each section of a geometrically exact one", "world"
    )


@dataclass(frozen=True)
class NodeLoad:
    """The part of a load that a node of a geometrically exact beam bears: force and moment per length times a weight.

    Attributes
    ----------
    node : name of the node
    halves : m, weights of the element before the node and of the element after the node
    force, moment : per length, N/m and N
    """

    node: str
    halves: tuple[float, float]
    force: Vector
    moment: Vector

    @property
    def weight(self) -> float:
        """Weight of both elements, m."""
        return sum(self.halves)


@dataclass(frozen=True)
class DistributedLoad(ForceElement):
    """Force per length on the axis of a beam, N/m: a polynomial in s times formulas of everything but accelerations.

    Attributes
    ----------
    start, length : of the beam, m
    profile : coefficients of the polynomial in s = (x - start) / length, constant first
    axes : ``beam``: axes of the undeformed beam frame, or of each section of a geometrically exact beam
    nodes : of a geometrically exact beam, on which the whole load acts
    """

    section: ClassVar[str] = "distributed_loads"
    law: ClassVar[str] = "eomgen.mechanics.forces.distributed_loads:LAW"

    beam: str
    start: float
    length: float
    force: Vector
    profile: tuple[float, ...]
    axes: Literal["world", "beam"] = "world"
    nodes: tuple[NodeLoad, ...] = ()

    def formulas(self) -> Iterator[tuple[Formula, int]]:
        vectors = [self.force, *(vector for load in self.nodes for vector in (load.force, load.moment))]
        yield from ((formula, 0) for formula in dict.fromkeys(formula for vector in vectors for formula in vector))

    def passive(self) -> None:
        return None


def read_distributed_load(name: str, entry: DistributedLoadEntry, site: Site) -> DistributedLoad:
    """Return the distributed load of an entry of [distributed_loads]; on a geometrically exact beam as loads on the
    nodes. Unknown beams, and moments on other beams, are reported."""
    key, values = key_of("distributed_loads", name), site.values
    start, length, scope = 0.0, 1.0, LOAD
    if entry.beam not in site.beams:
        fault = f"there is no beam {shown(entry.beam)} [E1291]"
        if entry.beam in site.bodies:
            fault = f"{shown(entry.beam)} is not a beam [E1495]"
        hint = nearest(entry.beam, site.beams) or "a [beams] section; a rigid body takes [forces] at its centre"
        values.report.add(f"{key}.beam", fault, hint)
        scope = LOCAL_LOAD
    elif site.beams[entry.beam].model in CONSTRAINED:
        return _on_nodes(name, entry, site)
    elif not values.report.concerns(of_beam := key_of("beams", entry.beam)):
        start = values.constant(f"{of_beam}.start", site.beams[entry.beam].start)
        length = values.constant(f"{of_beam}.length", site.beams[entry.beam].length or 1.0)
    if "moment" in entry.model_fields_set:
        fault = "only geometrically exact beams take distributed moments [E1497]"
        values.report.add(f"{key}.moment", fault, 'model = "cosserat" of the beam')
    force = values.vector(f"{key}.force", entry.force, scope)
    return DistributedLoad(name, entry.beam, start, length, force, _profile(key, entry, values), entry.axes)


def _profile(key: str, entry: DistributedLoadEntry, values: Reader) -> tuple[float, ...]:
    profile = tuple(values.constants(f"{key}.profile", entry.profile))
    if not profile:
        values.report.add(f"{key}.profile", "the list of coefficients is empty [E1319]", "[1, -0.5]")
    elif all(math.isfinite(entry) for entry in profile) and not any(profile):
        fault = "all coefficients are zero, so there is no load [E1498]"
        values.report.add(f"{key}.profile", fault, "[1], or no entry")
    return profile


def _on_nodes(name: str, entry: DistributedLoadEntry, site: Site) -> DistributedLoad:
    """Return a load on the nodes of a geometrically exact beam, with force and moment evaluated at the place s of each
    node; without nodes if the beam has a fault."""
    key, beam = key_of("distributed_loads", name), site.exact.get(entry.beam)
    profile, varied = _profile(key, entry, site.values), True
    result: list[NodeLoad] = []
    if beam is None or site.values.report.concerns(key_of("beams", entry.beam)):
        return DistributedLoad(name, entry.beam, 0.0, 1.0, ZERO_VECTOR, profile, entry.axes)
    vectors = ZERO_VECTOR, ZERO_VECTOR
    for node, x, halves in zip(beam.nodes, beam.places, _weights(beam, profile), strict=True):
        if varied and not (result and site.values.report.concerns(key)):
            there = site.values.at(x / beam.length)
            vectors = (
                there.vector(f"{key}.force", entry.force, LOCAL_LOAD),
                there.vector(f"{key}.moment", entry.moment, LOCAL_LOAD),
            )
            varied = bool(there.varied)
        result.append(NodeLoad(node, halves, *vectors))
    return DistributedLoad(name, entry.beam, 0.0, beam.length, ZERO_VECTOR, profile, entry.axes, tuple(result))


def _weights(beam: Cosserat, profile: Sequence[float]) -> list[tuple[float, float]]:
    """Return for each node the integrals of a polynomial in s, coefficients ``profile``, times the node's hat function,
    over the element before and the element after the node, m."""
    whole, start = sum((part.length for part in beam.parts), Fraction(0)), Fraction(0)
    weights = [[Fraction(0), Fraction(0)] for _ in beam.nodes]
    numbers = [Fraction(number) if math.isfinite(number) else Fraction(0) for number in profile]
    for element, part in enumerate(beam.parts):
        end = start + part.length
        zeroth, first = (
            sum(
                (
                    number * (end ** (power + more) - start ** (power + more)) / ((power + more) * whole**power)
                    for power, number in enumerate(numbers)
                ),
                Fraction(0),
            )
            for more in (1, 2)
        )
        weights[element][1] = (end * zeroth - first) / part.length
        weights[element + 1][0] = (first - start * zeroth) / part.length
        start = end
    return [(float(before), float(beyond)) for before, beyond in weights]


SECTION = ElementSection(
    key="distributed_loads",
    entry=DistributedLoadEntry,
    model=DistributedLoad,
    reader=read_distributed_load,
    positional=("beam", "force"),
    documentation="""
    Add a force per length (N/m) on a beam, times a polynomial along it, in ``world`` or ``beam`` axes.""",
)
