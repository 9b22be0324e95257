"""Jacobians of frames, their time derivatives and drifts, in three pairs of axes and point.

J v is the twist of a frame against the base, angular first: in its own axes (``body``), in world axes about its own
origin (``local_world_aligned``), or in world axes about the world's origin (``world``). In world axes a column is the
axis of its joint and the displacement of the point. Rates are derivatives on the tape, along the motions of joints
and of the base: that takes fewer operations than the cross products with the angular velocities of the links.
"""

from __future__ import annotations

from collections.abc import Sequence

from eomgen.mechanics.kinematics.bodies import jacobian_of_mount, link_columns
from eomgen.mechanics.kinematics.directions import configuration_directions, rates_of
from eomgen.mechanics.kinematics.fields import Field, total_fields
from eomgen.mechanics.kinematics.points import Kinematics
from eomgen.mechanics.tree.base import BaseMotion
from eomgen.mechanics.tree.links import ROOT, Mount
from eomgen.symbolic.calculus.partials import jacobian_vector
from eomgen.symbolic.scalar import (
    Matrix,
    Scalar,
    Vector,
    apply,
    cross,
    minus,
    multiply,
    negative,
    plus,
    scaled,
    transpose,
)

#: Angular part, and linear part at the origin of the link, of one column of a joint, in axes of the base.
Column = tuple[int, Vector, Vector]


class FrameMotion:
    """Twists of mounts on one tree per unit of v, and their rates along the motion.

    Parameters
    ----------
    kinematics : Kinematics
    reference : str
        ``body``, ``local_world_aligned`` or ``world``.
    """

    def __init__(self, kinematics: Kinematics, reference: str) -> None:
        self.kinematics = kinematics
        self.tree = kinematics.tree
        self.algebra = kinematics.algebra
        self.reference = reference
        self._fields: Sequence[Field] | None = None
        self._links = link_columns(self.tree) if reference == "body" else []

    def jacobian(self, mount: Mount) -> list[Scalar]:
        """Return J, (6, nv) row by row; rad and m per unit of v."""
        if self.reference == "body":
            return jacobian_of_mount(self.tree, self._links, mount)
        point, turn = self._point(mount), self.kinematics.base.orientation
        rows = self._zeros()
        for link in self._path(mount.link):
            origin = self.kinematics.pose(link)[1]
            for dof, angular, linear in self._columns(link):
                moved = plus(linear, cross(angular, minus(point, origin)))
                self._add(rows, dof, (apply(turn, angular), apply(turn, moved)))
        return [value for row in rows for value in row]

    def jacobian_rate(self, mount: Mount) -> list[Scalar]:
        """Return dJ/dt along v, (6, nv) row by row."""
        return self._differentiated(self.jacobian(mount))

    def drift(self, mount: Mount) -> list[Scalar]:
        """Return dJ/dt v, (6,): the rate of J v with v held."""
        if self.kinematics.carrier.moving or self.reference == "body":
            return self._differentiated(self._twist(mount))
        if mount.link < 0:
            return [self.algebra.zero] * 6
        if self._fields is None:
            still = BaseMotion(*(self.algebra.zero_vector,) * 4)
            self._fields = total_fields(self.tree, still, accelerations=False, gravity=False)
        field, R = self._fields[mount.link], self.kinematics.pose(mount.link)[0]
        alpha, acceleration = apply(R, field.alpha), apply(R, field.at(mount.position))
        if self.reference == "world":
            omega, velocity = self.kinematics.twist(mount.link)
            passing = apply(R, plus(velocity, cross(omega, mount.position)))
            moved = plus(cross(passing, apply(R, omega)), cross(self._position(mount), alpha))
            acceleration = plus(acceleration, moved)
        return [*alpha, *acceleration]

    def _twist(self, mount: Mount) -> list[Scalar]:
        """Return J v, (6,)."""
        if mount.link < 0:
            return [self.algebra.zero] * 6
        omega, velocity = self.kinematics.twist(mount.link)
        velocity = plus(velocity, cross(omega, mount.position))
        axes: Matrix = transpose(mount.orientation)
        if self.reference != "body":
            axes = multiply(self.kinematics.base.orientation, self.kinematics.pose(mount.link)[0])
        omega, velocity = apply(axes, omega), apply(axes, velocity)
        if self.reference == "world":
            base = self.kinematics.base
            at = plus(base.position, apply(base.orientation, self._position(mount)))
            velocity = plus(velocity, cross(at, omega))
        return [*omega, *velocity]

    def _position(self, mount: Mount) -> Vector:
        """Return the origin of a mount relative to the base, in base axes."""
        R, p = self.kinematics.pose(mount.link)
        return plus(p, apply(R, mount.position))

    def _point(self, mount: Mount) -> Vector:
        """Return the reference point of the velocity J v, relative to the base, in base axes."""
        if self.reference == "local_world_aligned":
            return self._position(mount)
        base = self.kinematics.base
        return negative(apply(transpose(base.orientation), base.position))

    def _path(self, link: int) -> list[int]:
        path = []
        while link > ROOT:
            path.append(link)
            link = self.tree.links[link].parent
        return path[::-1]

    def _columns(self, index: int) -> list[Column]:
        """Return the columns of a link's joint in axes of the base, each with its velocity component."""
        link, R = self.tree.links[index], self.kinematics.pose(index)[0]
        ratio = link.coordinates.ratio
        return [
            (dof, scaled(ratio, apply(R, column.angular)), scaled(ratio, apply(R, column.linear)))
            for dof, column in zip(link.dofs, link.columns, strict=True)
        ]

    def _zeros(self) -> list[list[Scalar]]:
        return [[self.algebra.zero] * self.tree.nv for _ in range(6)]

    @staticmethod
    def _add(rows: list[list[Scalar]], dof: int, parts: tuple[Vector, Vector]) -> None:
        for row, value in enumerate((*parts[0], *parts[1])):
            rows[row][dof] = rows[row][dof] + value

    def _differentiated(self, values: Sequence[Scalar]) -> list[Scalar]:
        """Return the time derivatives of values along the motion of the coordinates and of the base, v held."""
        tape = self.algebra.tape
        directions = rates_of(tape, configuration_directions(self.tree), self.kinematics.carrier)
        rates = jacobian_vector(tape, [value.ref for value in values], directions)
        return [Scalar(tape, ref) for ref in rates]
