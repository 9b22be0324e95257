"""Named constants of beams: shape integrals with mass and stiffness, by names for the C, and sentences on the effects
that the equations of a beam contain."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import combinations_with_replacement

import numpy as np

from eomgen.base.arrays import Array
from eomgen.formula.nodes import Formula
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.mechanics.shape_functions.shape_integrals import ShapeIntegrals
from eomgen.mechanics.tree.beam_body import ElasticBody, deformations
from eomgen.mechanics.tree.links import Tree
from eomgen.scene.bodies.model import Beam
from eomgen.symbolic.scalar import Scalar
from eomgen.system.system import BeamSlopes, Quantity

#: Meaning of each shape integral, and units with and without the mass per length.
_MASS = {
    "d": ("int f dm", "kg", "m"),
    "e": ("int x f dm", "kg m", "m^2"),
    "m": ("int f f dm", "kg", "m"),
    "g0": ("int H dm, stiffening by axial acceleration", "kg/m", "1"),
    "g1": ("int x H dm, centrifugal stiffening", "kg", "m"),
}


def named_constants(tree: Tree, quantities: Quantities) -> tuple[Quantity, ...]:
    """Return the shape integrals of all elastic bodies as named constants for the C, as magnitudes. Names begin with
    the name of the body. Numbers of at most eight digits stay literals and are left out."""
    constants: dict[str, Quantity] = {}
    for link in tree.links:
        if link.elastic is not None:
            stations = [
                x for (body, x), number in tree.stations.items() if body == link.name and tree.links[number].station
            ]
            for suffix, value, unit, meaning in _numbers(link.elastic, stations, quantities.formula):
                if len(repr(abs(value)).replace(".", "")) > 8:  # shorter numbers are clear without a name
                    name = f"{link.name}_{suffix}"
                    constants.setdefault(name, Quantity(name, abs(value), 1, unit, meaning))
    return tuple(constants.values())


def describe_beams(tree: Tree) -> tuple[str, ...]:
    """Return one sentence per beam on the effects in its equations."""
    return tuple(_describe(link.name, link.elastic.beam) for link in tree.links if link.elastic is not None)


def slopes(tree: Tree) -> tuple[BeamSlopes, ...]:
    """Return the squares of the slopes of all beams that bend."""
    return tuple(
        _slopes(link.name, link.elastic)
        for link in tree.links
        if link.elastic is not None and any(kind.startswith("bending") for kind in link.elastic.mass.integrals.kinds)
    )


def _slopes(name: str, body: ElasticBody) -> BeamSlopes:
    beam, at = body.beam, body.mass.integrals.at
    squares = at(beam.start + beam.length).shortening - at(beam.start).shortening
    return BeamSlopes(name, beam.length, tuple(map(tuple, squares.tolist())))


def _describe(name: str, beam: Beam) -> str:
    parts = [f"{item.modes} of {item.kind} ({item.shapes})" for item in beam.deformations]
    kept = (
        "kinetic energy to second order in them and their rates" if beam.order == 1 else "all that the kinematics has"
    )
    bends = any(item.kind.startswith("bending") for item in beam.deformations)
    shortening = ", the shortening of the bent axis " + ("kept" if beam.stiffening else "left out") if bends else ""
    return f"{name}: elastic coordinates {', '.join(parts)}; order {beam.order}, {kept}{shortening}"


def _numbers(
    body: ElasticBody, stations: list[float], number: Callable[[Formula], Scalar]
) -> Iterator[tuple[str, float, str, str]]:
    """Yield (name, value, unit, meaning) of each nonzero shape integral of an elastic body, and of its shape functions
    at ``stations``, m. ``number`` gives the value of a formula on the tape: constant mass, stiffness and polar inertia
    are part of the values."""
    integrals, unit = body.mass.integrals, body.mass.unit
    folded = number(body.beam.mass_per_length).constant is not None
    for field, (meaning, of_mass, of_length) in _MASS.items():
        for indices, value in _entries(getattr(integrals, field)):
            yield f"{field}_{indices}", unit * value, of_mass if folded else of_length, meaning
    for item, here in deformations(body.beam):
        factor = number(item.stiffness).constant
        label = f"stiffness of {item.kind}" + (" by its property" if factor is None else "")
        for indices, value in _entries(integrals.k[here.start : here.stop, here.start : here.stop], here.start):
            in_si = "N m/rad" if item.kind == "torsion" else "N/m"
            yield f"k_{indices}", value * (1.0 if factor is None else factor), "" if factor is None else in_si, label
    polar = number(body.beam.polar_inertia).constant
    for field in ("t0", "t2"):
        for indices, value in _entries(getattr(integrals, field)):
            folded_in = 1.0 if polar is None else polar
            yield f"{field}_{indices}", value * folded_in, "m" if polar is None else "kg m^2", "inertia of twist"
    for x in stations:
        yield from _at(integrals, x)


def _at(integrals: ShapeIntegrals, x: float) -> Iterator[tuple[str, float, str, str]]:
    station = integrals.at(x)
    where = f"at_{x:g}".replace(".", "p").replace("-", "m").replace("+", "")
    for field, quantity in (("value", "f"), ("slope", "slope of f"), ("shortening", "H")):
        for indices, value in _entries(getattr(station, field)):
            yield f"{field}_{indices}_{where}", value, "", f"{quantity} at x = {x:g} m"


def _entries(values: Array, first: int = 0) -> Iterator[tuple[str, float]]:
    """Yield the nonzero numbers of an array, each after its indices joined by "_"; entries of a symmetric matrix once.
    ``first`` is added to the indices."""
    size = len(values)
    indices = combinations_with_replacement(range(size), 2) if np.ndim(values) > 1 else ((k,) for k in range(size))
    for index in indices:
        if values[index] != 0.0:
            yield "_".join(str(first + k) for k in index), float(values[index])
