"""Motion of a pair of a shape and a surface: gap, rate of the gap, contact point, slip velocities, spin and camber.

The contact point is the point of the shape that is closest to the surface, or deepest in it. There the normals of both
are equal, so the rate of the gap is the relative velocity along the normal. Of a ``follower`` the point is along the
normal of the surface straight below the centre, and the gap is measured along the z axis of the surface.
"""

from __future__ import annotations

from functools import cached_property

from eomgen.errors import ModelError, Problem
from eomgen.formula.nodes import ZERO
from eomgen.mechanics.forces.contact_pairs import ROUND, body_contact, surface_at
from eomgen.mechanics.forces.frame_pairs import FramePair
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.products.contacts.section import SHAPES, Contact
from eomgen.products.contacts.surfaces import FOLLOWER
from eomgen.symbolic.operations import Op
from eomgen.symbolic.scalar import Algebra, Scalar, Vector, apply, cross, dot, minus, plus, scaled, transpose

#: Square of a length, m^2, in place of 0 below a fraction line.
_TINY = 1e-24


class PairMotion:
    """Motion of a contact on the tape, in the axes of the frame pair; vectors are (3,).

    Attributes
    ----------
    pair : poses and motions of both frames
    point : on the shape, m
    gap : distance of body and surface, m; negative if they overlap
    normal : out of the surface, to the second body
    steepness : change of the gap by the way along the normal; 1 unless the gap is measured along another direction
    gradient : ``normal`` times ``steepness``
    round : whether the centre of the shape is on the normal through the contact point
    """

    def __init__(self, quantities: Quantities, item: Contact, pair: FramePair) -> None:
        self.algebra: Algebra = quantities.algebra
        self.pair = pair
        self._quantities, self._item = quantities, item
        self.round = item.shape in (*ROUND, FOLLOWER)
        self.axis, self.steepness = self.pair.second.axis(2), self.algebra.one
        if item.housing:
            self._place_in_housing()
        elif item.shape == FOLLOWER:
            self._place_below_centre()
        else:
            contact = body_contact(quantities, item, self.pair)
            self.point, self.gap, self._tangents = contact.point, contact.height, contact.tangents
            self.normal = self.gradient = contact.normal

    def _place_in_housing(self) -> None:
        """Set the contact of a sphere in a hollow cylinder about the first frame's z axis, or in a hollow sphere."""
        first, offset = self.pair.first, minus(self.pair.second.origin, self.pair.first.origin)
        if self._item.housing == "cylinder":
            offset = minus(offset, scaled(dot(offset, first.axis(2)), first.axis(2)))
        outward = self._unit(offset)
        along = self._unit(cross(first.axis(1), outward)) if self._item.housing == "sphere" else first.axis(2)
        self.point = plus(self.pair.second.origin, scaled(self._quantities.formula(self._item.radius), outward))
        self.gap = self._quantities.formula(self._item.clearance) - dot(offset, outward)
        self._tangents = along, cross(along, outward)
        self.normal = self.gradient = scaled(-1.0, outward)

    def _place_below_centre(self) -> None:
        algebra, first, centre = self.algebra, self.pair.first, self.pair.second.origin
        x, y, z = self._place(centre)
        height, along_x, along_y, _ = surface_at(self._quantities, self._item.surface or ZERO, x, y)
        radius = self._quantities.formula(self._item.radius)
        self.gap = -(radius + height - z)
        self.steepness = algebra.call(Op.SQRT, along_x * along_x + along_y * along_y + 1.0)
        self.gradient = apply(first.axes, (-along_x, -along_y, algebra.one))
        self.normal = scaled(algebra.one / self.steepness, self.gradient)
        self.point = minus(centre, scaled(self.gap + radius, self.normal))

    def _unit(self, vector: Vector) -> Vector:
        square = self.algebra.call(Op.MAX, dot(vector, vector), self.algebra.scalar(_TINY))
        return scaled(self.algebra.one / self.algebra.call(Op.SQRT, square), vector)

    @cached_property
    def tangents(self) -> tuple[Vector, Vector]:
        """Directions of the surface; of a wheel heading and lateral direction. Raises ModelError for a wheel's axis
        normal to the surface."""
        if SHAPES[self._item.shape][1] != "z":
            return self._tangents
        sideways = minus(self.axis, scaled(dot(self.axis, self.normal), self.normal))
        level = self.algebra.length(sideways)
        if level.is_zero:
            fault = "the spin axis is normal to the road for all coordinates, so the wheel has no heading [E2168]"
            key = f"{self._item.section}.{self._item.name}.{self._item.axis_key}"
            raise ModelError(Problem(key, fault, "a level axis, as [0, 1, 0]"))
        sideways = scaled(self.algebra.one / level, sideways)
        return cross(sideways, self.normal), sideways

    @cached_property
    def slip(self) -> Vector:
        """Velocity of the second body against the first at the contact, m/s."""
        arm = minus(self.point, self.pair.second.origin)
        return plus(self._centre_velocity, cross(self.turning, arm))

    @cached_property
    def _centre_velocity(self) -> Vector:
        kinematics, second, centre = self.pair.kinematics, self._item.second, self.pair.second
        _, local = self._quantities.kinematics.local(second.body, self._quantities.vector(second.position))
        omega, velocity = kinematics.twist(centre.link)
        moving = apply(kinematics.pose(centre.link)[0], plus(velocity, cross(omega, local)))
        return minus(moving, self.pair.velocity_at(self.pair.first, centre.origin))

    @property
    def approach(self) -> Vector:
        """A velocity with the part of ``slip`` along the normal, m/s."""
        return self._centre_velocity if self.round else self.slip

    @cached_property
    def turning(self) -> Vector:
        """Angular velocity of the second body against the first, rad/s."""
        return minus(self.pair.angular_velocity(self.pair.second), self.pair.angular_velocity(self.pair.first))

    @cached_property
    def rate(self) -> Scalar:
        """Rate of the gap, m/s, by motion of the bodies, and by heights that change."""
        rate, item = dot(self.gradient, self.approach), self._item
        if not item.moving_surface:
            return rate
        touched = minus(self.point, scaled(self.gap, self.normal))
        x, y, _ = self._place(self.pair.second.origin if item.shape == FOLLOWER else touched)
        height, number = (item.surface or ZERO, 3) if item.surface_rate is None else (item.surface_rate, 0)
        moved = surface_at(self._quantities, height, x, y)[number]
        return rate - moved * dot(self.gradient, self.pair.first.axis(2))

    @cached_property
    def along_normal(self) -> dict[str, Scalar]:
        """Scalars of the local names of normal laws, and ``overlap``, m, which is negative in the air."""
        overlap = -self.gap
        deflection = self.algebra.call(Op.MAX, overlap, self.algebra.zero)
        return {"gap": self.gap, "overlap": overlap, "rate": self.rate, "deflection": deflection}

    @cached_property
    def local(self) -> dict[str, Scalar]:
        """Scalars of the local names of laws, but the normal force, and ``depth``, m, of the contact point below the
        surface; velocities at the shape's centre, m/s."""
        algebra, across = self.algebra, cross(self.axis, self.normal)
        level = algebra.call(Op.SQRT, dot(across, across))
        values = {
            **self.along_normal,
            "depth": algebra.zero if self._item.shape == FOLLOWER else self.along_normal["deflection"],
            "spin": dot(self.normal, self.turning),
            "wheel_speed": dot(self.axis, self.turning),
            "camber": algebra.call(Op.ATAN2, dot(self.axis, self.normal), level),
        }
        for name, tangent in zip("xy", self.tangents, strict=True):
            values[f"slip_velocity_{name}"] = dot(tangent, self.slip)
            values[f"turn_{name}"] = dot(tangent, self.turning)
            values[f"velocity_{name}"] = dot(tangent, self._centre_velocity)
        return values

    def _place(self, point: Vector) -> Vector:
        return apply(transpose(self.pair.first.axes), minus(point, self.pair.first.origin))

    @property
    def place(self) -> dict[str, Scalar]:
        """Coordinates of the contact point in the first frame, m, by axis."""
        return dict(zip("xyz", self._place(self.point), strict=True))
