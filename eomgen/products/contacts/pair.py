"""Motion of a pair of a shape and a surface: gap, rate of the gap, contact point, slip velocities, spin and camber.

The contact point is the point of the shape that is closest to the surface, or deepest in it. There the normals of both
are equal, so the rate of the gap is the relative velocity along the normal.
"""

from __future__ import annotations

from functools import cached_property

from eomgen.mechanics.forces.contact_pairs import BodyContact, body_contact
from eomgen.mechanics.forces.frame_pairs import FramePair
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.products.contacts.section import Contact
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
    tangents : of the surface; of a disc and a torus heading and lateral direction
    normal : out of the surface, to the second body
    gap : distance of body and surface, m; negative if they overlap
    """

    def __init__(self, quantities: Quantities, item: Contact, pair: FramePair) -> None:
        self.algebra: Algebra = quantities.algebra
        self.pair = pair
        contact = self._in_housing(quantities, item) if item.housing else body_contact(quantities, item, self.pair)
        self.point, self.gap = contact.point, contact.height
        self.normal, self.tangents = contact.normal, contact.tangents
        self.axis = self.pair.second.axis(2)
        if item.shape in ("disc", "torus"):
            heading = self._unit(cross(self.axis, self.normal))
            self.tangents = heading, cross(self.normal, heading)

    def _in_housing(self, quantities: Quantities, item: Contact) -> BodyContact:
        """Return the contact of a sphere in a hollow cylinder about the first frame's z axis, or in a hollow sphere."""
        first, offset = self.pair.first, minus(self.pair.second.origin, self.pair.first.origin)
        if item.housing == "cylinder":
            offset = minus(offset, scaled(dot(offset, first.axis(2)), first.axis(2)))
        outward = self._unit(offset)
        along = self._unit(cross(first.axis(1), outward)) if item.housing == "sphere" else first.axis(2)
        point = plus(self.pair.second.origin, scaled(quantities.formula(item.radius), outward))
        gap = quantities.formula(item.clearance) - dot(offset, outward)
        return BodyContact(point, (along, cross(along, outward)), gap)

    def _unit(self, vector: Vector) -> Vector:
        square = self.algebra.call(Op.MAX, dot(vector, vector), self.algebra.scalar(_TINY))
        return scaled(self.algebra.one / self.algebra.call(Op.SQRT, square), vector)

    def _relative_velocity(self, point: Vector) -> Vector:
        return minus(self.pair.velocity_at(self.pair.second, point), self.pair.velocity_at(self.pair.first, point))

    @cached_property
    def slip(self) -> Vector:
        """Velocity of the second body against the first at the contact, m/s."""
        return self._relative_velocity(self.point)

    @cached_property
    def _centre_velocity(self) -> Vector:
        return self._relative_velocity(self.pair.second.origin)

    @cached_property
    def turning(self) -> Vector:
        """Angular velocity of the second body against the first, rad/s."""
        return minus(self.pair.angular_velocity(self.pair.second), self.pair.angular_velocity(self.pair.first))

    @cached_property
    def local(self) -> dict[str, Scalar]:
        """Scalars of the local names of laws, but the normal force; velocities at the shape's centre, m/s."""
        algebra, across = self.algebra, cross(self.axis, self.normal)
        level = algebra.call(Op.SQRT, dot(across, across))
        values = {
            "gap": self.gap,
            "rate": dot(self.normal, self.slip),
            "deflection": algebra.call(Op.MAX, -self.gap, algebra.zero),
            "spin": dot(self.normal, self.turning),
            "wheel_speed": dot(self.axis, self.turning),
            "camber": algebra.call(Op.ATAN2, dot(self.axis, self.normal), level),
        }
        for name, tangent in zip("xy", self.tangents, strict=True):
            values[f"slip_velocity_{name}"] = dot(tangent, self.slip)
            values[f"velocity_{name}"] = dot(tangent, self._centre_velocity)
        return values

    @property
    def place(self) -> dict[str, Scalar]:
        """Coordinates of the contact point in the first frame, m, by axis."""
        place = apply(transpose(self.pair.first.axes), minus(self.point, self.pair.first.origin))
        return dict(zip("xyz", place, strict=True))
