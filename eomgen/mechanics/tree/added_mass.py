"""Added mass of slender hulls: the water that moves with a body, across the axis of each hull.

The inertia of a uniform member across its axis is a second moment, so two places by Gauss and Legendre's rule, each
with half of it, have the same inertia as the member.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from eomgen.formula.nodes import Formula
from eomgen.mechanics.tree.inertia import AddedMass
from eomgen.scene.forces.hulls import Hull
from eomgen.scene.scene import Scene
from eomgen.symbolic.operations import Op
from eomgen.symbolic.scalar import Algebra, Scalar, Vector, dot, matrix_plus, minus, outer, plus, scaled

#: Places in parts of a length.
_GAUSS = (0.5 - 0.5 / math.sqrt(3.0), 0.5 + 0.5 / math.sqrt(3.0))


@dataclass(frozen=True)
class Member:
    """A hull in numbers.

    Attributes
    ----------
    start : (3,) of its axis, in the body's frame
    axis : (3,) unit vector, in the body's axes
    length, diameter, area, density, added, drag : of the hull; the last two are coefficients
    wet : length that moves water at rest
    across, along : added mass across the axis, in all, and along it, at the start, kg
    """

    start: Vector
    axis: Vector
    length: Scalar
    diameter: Scalar
    area: Scalar
    density: Scalar
    added: Scalar
    drag: Scalar
    wet: Scalar
    across: Scalar
    along: Scalar

    @property
    def places(self) -> tuple[Scalar, Scalar]:
        """Distances from the start at which half of the added mass across the axis is, each."""
        return _GAUSS[0] * self.wet, _GAUSS[1] * self.wet


def member_of(algebra: Algebra, hull: Hull, number: Callable[[Formula], Scalar]) -> Member:
    """Return a hull in numbers; ``number`` evaluates a formula of parameters."""
    start, end = (algebra.vector([number(part) for part in place]) for place in (hull.start, hull.end))
    span = minus(end, start)
    length = algebra.call(Op.SQRT, dot(span, span))
    diameter, density, added = number(hull.diameter), number(hull.density), number(hull.added_mass)
    area = number(hull.area) if hull.area is not None else (0.25 * math.pi) * (diameter * diameter)
    wet = number(hull.wet) if hull.wet is not None else length
    return Member(
        start=start,
        axis=scaled(algebra.one / length, span),
        length=length,
        diameter=diameter,
        area=area,
        density=density,
        added=added,
        drag=number(hull.drag),
        wet=wet,
        across=density * added * area * wet,
        along=number(hull.axial_added_mass),
    )


def added_masses(
    algebra: Algebra, scene: Scene, body: str, number: Callable[[Formula], Scalar]
) -> tuple[AddedMass, ...]:
    """Return the added mass of the hulls of a body, in its frame."""
    result: list[AddedMass] = []
    for hull in scene.elements:
        if not isinstance(hull, Hull) or hull.body != body or not hull.moves_water:
            continue
        member = member_of(algebra, hull, number)
        along = outer(member.axis, member.axis)
        across = matrix_plus(algebra.identity, outer(scaled(-1.0, member.axis), member.axis))
        if not member.across.is_zero:
            half = 0.5 * member.across
            matrix = tuple(scaled(half, row) for row in across)
            result += [
                AddedMass(plus(member.start, scaled(place, member.axis)), (matrix[0], matrix[1], matrix[2]))
                for place in member.places
            ]
        if not member.along.is_zero:
            rows = tuple(scaled(member.along, row) for row in along)
            result.append(AddedMass(member.start, (rows[0], rows[1], rows[2])))
    return tuple(result)
