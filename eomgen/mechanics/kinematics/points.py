"""Positions, velocities and accelerations of points and bodies, each recorded at its first use."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from eomgen.lie import rotations
from eomgen.lie.algebra import TapeAlgebra
from eomgen.mechanics.kinematics.directions import configuration_directions, rates_of
from eomgen.mechanics.kinematics.fields import AccelerationField, LinkField, centripetal, relative, total_fields
from eomgen.mechanics.tree.base import BaseState
from eomgen.mechanics.tree.links import CARRIER, ROOT, WORLD, Mount, Tree
from eomgen.symbolic.calculus.partials import jacobian_vector
from eomgen.symbolic.operations import Op
from eomgen.symbolic.scalar import (
    Algebra,
    Matrix,
    Scalar,
    Vector,
    apply,
    cross,
    minus,
    multiply,
    negative,
    plus,
    transpose,
)


class LinkKinematics:
    """Poses and twists of links relative to a reference link, each quantity recorded at its first use.

    Parameters
    ----------
    poses, twists : known values by link, at least for the reference link
    """

    def __init__(
        self, tree: Tree, poses: dict[int, tuple[Matrix, Vector]], twists: dict[int, tuple[Vector, Vector]]
    ) -> None:
        self.tree = tree
        self.algebra = tree.algebra
        self._poses, self._twists = poses, twists

    def _path(self, link: int, known: dict[int, object]) -> list[int]:
        path = []
        while link not in known:
            path.append(link)
            link = self.tree.links[link].parent
        return path[::-1]

    def pose(self, link: int) -> tuple[Matrix, Vector]:
        """Return orientation, (3, 3), and origin, (3,), m, of a link in axes of the reference link."""
        for index in self._path(link, self._poses):  # type: ignore[arg-type]  # keys only
            item = self.tree.links[index]
            R, p = self._poses[item.parent]
            with self.algebra.tape.block(f"pose of link {item.name}"):
                orientation = multiply(R, item.rotation.matrix(self.algebra))
                position = plus(p, apply(R, item.position))
                self._poses[index] = (
                    self.algebra.named_matrix(f"R_{item.name}", orientation),
                    self.algebra.named(f"p_{item.name}", position),
                )
        return self._poses[link]

    def twist(self, link: int) -> tuple[Vector, Vector]:
        """Return the twist of a link's origin relative to the reference link, in link axes, rad/s and m/s."""
        for index in self._path(link, self._twists):  # type: ignore[arg-type]  # keys only
            item = self.tree.links[index]
            omega, velocity = self._twists[item.parent]
            with self.algebra.tape.block(f"twist of link {item.name}"):
                turn, slide = relative(self.algebra, item, item.velocities)
                carried = item.rotation.rotate_back(plus(velocity, cross(omega, item.position)))
                self._twists[index] = (
                    self.algebra.named(f"omega_{item.name}", plus(item.rotation.rotate_back(omega), turn)),
                    self.algebra.named(f"v_{item.name}", plus(carried, slide)),
                )
        return self._twists[link]


class Kinematics(LinkKinematics):
    """Kinematics of one tree on one base, each quantity recorded at its first use.

    Link quantities are relative to the base: orientations and origins in base axes, velocities in link axes. In
    absolute coordinates the world replaces the base (``base`` is at rest) and ``carrier`` is the prescribed base.
    """

    def __init__(self, tree: Tree, base: BaseState, carrier: BaseState | None = None) -> None:
        zero = tree.algebra.zero_vector
        super().__init__(tree, {ROOT: (tree.algebra.identity, zero)}, {ROOT: (zero, zero)})
        self.base = base
        self.carrier = carrier if carrier is not None else base
        if carrier is not None:
            self._poses[CARRIER] = (carrier.orientation, carrier.position)
            self._twists[CARRIER] = (carrier.omega, carrier.velocity)
        self._poses[WORLD], self._twists[WORLD] = self._world()
        self._fields: list[LinkField] | None = None

    def _world(self) -> tuple[tuple[Matrix, Vector], tuple[Vector, Vector]]:
        """Return pose and twist of the world relative to the base, the twist in world axes."""
        R, x = self.base.orientation, self.base.position
        turning = apply(R, self.base.omega)
        passing = minus(cross(turning, x), apply(R, self.base.velocity))
        back = transpose(R)
        return (back, negative(apply(back, x))), (negative(turning), passing)

    def local(self, body: str, r: Vector) -> tuple[int, Vector]:
        """Return the link of a point r of a body, and the position of the point in link axes, (3,), m."""
        mount: Mount = self.tree.mount_at(body, r)
        return mount.link, plus(mount.position, apply(mount.orientation, r))

    def position_in_base(self, body: str, r: Vector) -> Vector:
        """Return the position of a point relative to the base, (3,), m, in base axes."""
        link, s = self.local(body, r)
        R, p = self.pose(link)
        return plus(p, apply(R, s))

    def velocity_in_base(self, body: str, r: Vector) -> Vector:
        """Return the velocity of a point relative to the base, (3,), m/s, in base axes."""
        link, s = self.local(body, r)
        omega, velocity = self.twist(link)
        return apply(self.pose(link)[0], plus(velocity, cross(omega, s)))

    def position(self, body: str, r: Vector) -> Vector:
        """Return the position of a point, (3,), m, in world axes."""
        return plus(self.base.position, apply(self.base.orientation, self.position_in_base(body, r)))

    def origin(self, body: str) -> Vector:
        """Return the origin of a body's frame, (3,), m, in world axes; for a deformed beam no material point."""
        mount = self.tree.mounts[body]
        R, p = self.pose(mount.link)
        return plus(self.base.position, apply(self.base.orientation, plus(p, apply(R, mount.position))))

    def velocity(self, body: str, r: Vector) -> Vector:
        """Return the inertial velocity of a point, (3,), m/s, in world axes."""
        carried = plus(self.base.velocity, cross(self.base.omega, self.position_in_base(body, r)))
        return apply(self.base.orientation, plus(carried, self.velocity_in_base(body, r)))

    def acceleration(self, body: str, r: Vector) -> Vector:
        """Return the inertial acceleration of a point, (3,), m/s^2, in world axes (depends on the block ``a``)."""
        link, s = self.local(body, r)
        return self._in_world(link, lambda field: field.at(s))

    def _in_world(self, link: int, acceleration: Callable[[AccelerationField], Vector]) -> Vector:
        """Return an acceleration of a link by its acceleration field, in world axes."""
        if link == WORLD:
            return self.algebra.zero_vector
        if link < 0:
            return apply(self.carrier.orientation, acceleration(self.field(link)))
        return apply(self.base.orientation, apply(self.pose(link)[0], acceleration(self.field(link))))

    def axes(self, body: str) -> Matrix:
        """Return the axes of a rigid body, (3, 3), by columns, in world axes."""
        mount = self.tree.mounts[body]
        return multiply(self.base.orientation, multiply(self.pose(mount.link)[0], mount.orientation))

    def angular_velocity(self, body: str) -> Vector:
        """Return the inertial angular velocity of a rigid body, (3,), rad/s, in world axes."""
        link = self.tree.mounts[body].link
        turning = apply(self.pose(link)[0], self.inertial_twist(link)[0])
        return apply(self.base.orientation, turning)

    def angular_acceleration(self, body: str) -> Vector:
        """Return the inertial angular acceleration of a rigid body, (3,), rad/s^2, in world axes (depends on the block
        ``a``)."""
        return self._in_world(self.tree.mounts[body].link, lambda field: field.alpha)

    def field(self, link: int) -> AccelerationField:
        """Return the inertial acceleration field of a link in link axes; for negative numbers of the carrying base."""
        if link < 0:
            motion = self.carrier.motion()
            return AccelerationField(motion.acceleration, motion.alpha, centripetal(motion.omega))
        if self._fields is None:
            self._fields = total_fields(self.tree, self.base.motion(), accelerations=True, gravity=False)
        return self._fields[link]

    def rates(self, values: Sequence[Scalar]) -> list[Scalar]:
        """Return the time derivatives of values along the motion of the coordinates and of the base, v held."""
        tape = self.algebra.tape
        directions = rates_of(tape, configuration_directions(self.tree), self.carrier)
        return [Scalar(tape, ref) for ref in jacobian_vector(tape, [value.ref for value in values], directions)]

    def inertial_twist(self, link: int) -> tuple[Vector, Vector]:
        """Return inertial angular velocity and origin velocity of a link, in link axes."""
        omega, velocity = self.twist(link)
        R, p = self.pose(link)
        back = transpose(R)
        base_velocity = plus(self.base.velocity, cross(self.base.omega, p))
        return plus(omega, apply(back, self.base.omega)), plus(velocity, apply(back, base_velocity))


def rotation_vector(algebra: Algebra, R: Matrix) -> Vector:
    """Record the logarithm, (3,), rad, of a rotation matrix with an angle below pi."""
    trace = R[0][0] + R[1][1] + R[2][2]
    w = 0.5 * algebra.call(Op.SQRT, algebra.call(Op.MAX, trace + 1.0, algebra.scalar(1e-24)))
    share = algebra.one / (w * 4.0)
    skewed = (R[2][1] - R[1][2], R[0][2] - R[2][0], R[1][0] - R[0][1])
    quaternion = [w, *(entry * share for entry in skewed)]
    x, y, z = rotations.logarithm(TapeAlgebra(algebra.tape), quaternion)
    return x, y, z
