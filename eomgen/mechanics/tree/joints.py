"""Joints as chains of elementary motions: pose and motion subspace of each, in the child frame, and their
coordinates on the tape.

Coordinates of joints on the tape: components of q, v and a; a dependent (mimic) joint uses its leader's.

A coordinate that follows, q = ratio q_leader + offset, is not an unknown. Efforts of its joint enter the leader's
equation by virtual work, times the ratio, so motion subspaces, inertia and forces need only the ratio of each joint.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, field, replace
from eomgen.formula.nodes import Formula
from eomgen.lie.product import Factor
from eomgen.mechanics.laws.derived import LAWS
from eomgen.scene.joint_types import GROUPS, MotionKind
from eomgen.scene.joints.model import Joint, Mimic
from eomgen.scene.rotations import CoordinateAxis, axis_beside, coordinate_axis, frame_about, rows
from eomgen.symbolic.operations import Op
from eomgen.symbolic.rotation import FactoredRotation, MatrixFactor, PlanarFactor
from eomgen.symbolic.scalar import Algebra, Matrix, Scalar, Vector, apply, plus, scaled

Direction = tuple[float, float, float]
IDENTITY: tuple[Direction, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True)
class JointMotion:
    """Elementary motion, with a motion subspace that is constant in the child frame.

    Attributes
    ----------
    kind : turn, travel (along one or more axes), screw, ball or free
    axes : unit vectors in the axes of the links
    components : components of the joint's velocity that drive the columns, in order
    """

    kind: MotionKind
    axes: tuple[Direction, ...]
    components: tuple[int, ...]

    @property
    def turn(self) -> CoordinateAxis | None:
        """Coordinate axis of rotation in link axes; None for motions that do not rotate about one axis."""
        return coordinate_axis(self.axes[0]) if self.kind in ("turn", "screw") else None


@dataclass(frozen=True)
class SubspaceColumn:
    """Column of the motion subspace in child axes: angular part, and velocity of the child's origin."""

    angular: Vector
    linear: Vector


def quaternion_matrix(algebra: Algebra, quaternion: list[Scalar]) -> Matrix:
    """Return the rotation matrix, (3, 3), body to reference axes, of a unit quaternion (w, x, y, z)."""
    r = LAWS["rotation_of_quaternion"].instantiate(algebra, dict(zip("wxyz", quaternion, strict=True)))
    return ((r[0], r[1], r[2]), (r[3], r[4], r[5]), (r[6], r[7], r[8]))


def motions_of(joint: Joint, *, along_z: bool = False) -> tuple[tuple[Direction, ...], tuple[JointMotion, ...]]:
    """Return the elementary motions of a joint from parent to child, with axes in child axes.

    With ``along_z`` the axis of the joint becomes the z axis of its links.

    Between two motions of a joint there is a massless link. A screw with two columns for a cylindrical joint would take
    as many operations, and more operations in partials.

    Returns
    -------
    axes : the axes of the joint's links in child axes, as columns: the body's own, unless a rotation axis is skew; then
            this axis is the links' z, and of two axes both are coordinate axes. If the axes are within tolerance of
            coordinate axes, the links' axes differ as little as possible from the body's
    motions : with axes in link axes; none for a fixed joint
    """
    axes, axis, second = (frame_of(joint), IDENTITY[2], IDENTITY[0]) if along_z else _link_axes(joint)
    directions = (axis, second, perpendicular(axis, second))
    chain = joint.kind.chain
    return axes, tuple(
        JointMotion(item.kind, tuple(directions[k] for k in item.axes), item.components) for item in chain
    )


def _link_axes(joint: Joint) -> tuple[tuple[Direction, ...], Direction, Direction]:
    """Return the axes of a joint's links in child axes, as columns, and in these link axes the joint's axis and second
    axis. These are the child's axes unless a rotation axis is skew."""
    turned_about = [(joint.axis, joint.second_axis)[k] for k in joint.kind.turned_about]
    if None not in map(coordinate_axis, turned_about):
        return IDENTITY, joint.axis, joint.second_axis
    beside = [axis for direction in turned_about if (axis := axis_beside(direction)) is not None]
    if len(beside) < len(turned_about):
        return frame_of(joint), IDENTITY[2], IDENTITY[0]
    columns: dict[int, Array] = {
        near.place: near.sense * np.array(direction) for near, direction in zip(beside, turned_about, strict=True)
    }
    first = beside[0].place
    third = beside[1].place if len(beside) > 1 else (first + 1) % 3
    if len(beside) == 1:
        across = np.eye(3)[third] - columns[first][third] * columns[first]
        columns[third] = across / np.linalg.norm(across)
    sense = 1.0 if third == (first + 1) % 3 else -1.0
    columns[3 - first - third] = sense * np.cross(columns[first], columns[third])
    axes = np.column_stack([columns[k] for k in range(3)])
    if len(beside) > 1:
        return rows(axes), beside[0].unit, beside[1].unit
    x, y, z = (0.0 if k == first else float(columns[k] @ joint.second_axis) for k in range(3))
    return rows(axes), beside[0].unit, (x, y, z)


def frame_of(joint: Joint) -> tuple[Direction, ...]:
    """Return a frame in child axes, (3, 3), with columns x, y, z: z is the joint's axis, x the second axis, if any."""
    if joint.kind.second_key:
        return tuple(zip(joint.second_axis, perpendicular(joint.axis, joint.second_axis), joint.axis, strict=True))
    return rows(frame_about(np.array(joint.axis)))


def perpendicular(a: Direction, b: Direction) -> Direction:
    """Return a x b for perpendicular unit vectors, the third axis of a right-handed frame."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def columns_of(algebra: Algebra, motion: JointMotion, pitch: Scalar) -> tuple[SubspaceColumn, ...]:
    """Return the motion subspace of an elementary motion in child axes; of ball and free joints along the link axes,
    angular columns first. ``pitch``, m/rad, is of screws."""
    zero, units = algebra.zero_vector, algebra.identity
    axes = [algebra.vector(axis) for axis in motion.axes]
    match motion.kind:
        case "turn":
            return (SubspaceColumn(axes[0], zero),)
        case "travel":
            return tuple(SubspaceColumn(zero, axis) for axis in axes)
        case "screw":
            return (SubspaceColumn(axes[0], scaled(pitch, axes[0])),)
        case "ball":
            return tuple(SubspaceColumn(unit, zero) for unit in units)
        case _:
            return tuple(SubspaceColumn(unit, zero) for unit in units) + tuple(
                SubspaceColumn(zero, unit) for unit in units
            )


def name_rotation(rotation: FactoredRotation, joint: str, matrix: str) -> None:
    """Name nodes of the tape: sine and cosine of a planar rotation by the joint, or the entries of another rotation.
    The rotation is the last factor; ``matrix`` is the name for the entries."""
    factor = rotation.factors[-1]
    if isinstance(factor, PlanarFactor):
        tape = factor.cosine.tape
        tape.name(factor.cosine.ref, f"cos_{joint}")
        tape.name(abs(factor.sine.ref), f"sin_{joint}")
    elif len(rotation.factors) > 1:
        Algebra(factor.matrix[0][0].tape).named_matrix(matrix, factor.matrix)


def pose_of(
    algebra: Algebra, motion: JointMotion, pitch: Scalar, orientation: Matrix, position: Vector, q: Sequence[Scalar]
) -> tuple[FactoredRotation, Vector]:
    """Return rotation and position, m, of the frame of an elementary motion in the parent frame, at coordinates q.

    Parameters
    ----------
    pitch : of screws, m/rad
    orientation, position : of the frame at neutral q
    q : coordinates of the motion; of a free joint quaternion and position
    """
    constant = MatrixFactor(orientation)
    axes = [algebra.vector(axis) for axis in motion.axes]
    if motion.kind == "travel":
        for axis, travel in zip(axes, q, strict=True):  # travels along several axes add up
            position = plus(position, apply(orientation, scaled(travel, axis)))
        return FactoredRotation((constant,)), position
    if motion.turn is not None:
        angle = q[0] if motion.turn.sense > 0.0 else -q[0]
        turn = PlanarFactor(motion.turn.place, algebra.call(Op.COS, angle), algebra.call(Op.SIN, angle))
        if motion.kind == "screw":
            position = plus(position, apply(orientation, scaled(q[0] * pitch, axes[0])))
        return FactoredRotation((constant, turn)), position
    turned = FactoredRotation((constant, MatrixFactor(quaternion_matrix(algebra, list(q[:4])))))
    if motion.kind == "ball":
        return turned, position
    return turned, plus(position, apply(orientation, (q[4], q[5], q[6])))


@dataclass(frozen=True)
class JointCoordinates:
    """Coordinates of one joint, recorded on the tape as they are read.

    Attributes
    ----------
    components : components of q for each coordinate
    dofs : component of v for each velocity component
    ratio, offset : q of the joint = ratio (component of q) + offset; 1 and 0 unless the joint follows another joint
    given : values in place of components of q, v and a, by block and number
    """

    algebra: Algebra
    components: tuple[int, ...]
    dofs: tuple[int, ...]
    ratio: Scalar
    offset: Scalar
    given: Mapping[tuple[str, int], Scalar] = field(default_factory=dict)

    @property
    def q(self) -> tuple[Scalar, ...]:
        return tuple(self.ratio * self._input("q", component) + self.offset for component in self.components)

    @property
    def v(self) -> tuple[Scalar, ...]:
        return tuple(self.ratio * self._input("v", dof) for dof in self.dofs)

    @property
    def a(self) -> tuple[Scalar, ...]:
        return tuple(self.ratio * self._input("a", dof) for dof in self.dofs)

    def _input(self, block: str, index: int) -> Scalar:
        if (block, index) in self.given:
            return self.given[block, index]
        return Scalar(self.algebra.tape, self.algebra.tape.input(block, index))

    def of(self, motion: JointMotion) -> JointCoordinates:
        """Return the coordinates of one elementary motion of the joint."""
        if motion.kind in GROUPS:
            return self
        components, dofs = (tuple(values[k] for k in motion.components) for values in (self.components, self.dofs))
        return replace(self, components=components, dofs=dofs)

    def following(self, multiplier: Scalar, offset: Scalar) -> JointCoordinates:
        """Return the coordinates of a joint that follows this one: ``multiplier`` times this joint's q, plus
        ``offset``.
        """
        return replace(self, ratio=multiplier * self.ratio, offset=multiplier * self.offset + offset)


def own_coordinates(algebra: Algebra, factor: Factor, values: Mapping[tuple[str, int], Scalar]) -> JointCoordinates:
    """Return the coordinates of an independent joint."""
    components, dofs = (
        range(factor.q_start, factor.q_start + factor.q_size),
        range(factor.v_start, factor.v_start + factor.v_size),
    )
    return JointCoordinates(algebra, tuple(components), tuple(dofs), algebra.one, algebra.zero, values)


def joint_coordinates(
    algebra: Algebra,
    joints: Sequence[Joint],
    number: Callable[[Formula], Scalar],
    elastic: Mapping[str, int],
    values: Mapping[tuple[str, int], Scalar],
) -> tuple[tuple[Factor, ...], dict[str, JointCoordinates]]:
    """Return the factors of the configuration in joint order, and the coordinates of moving joints and beams by name.

    A joint that follows another joint (``mimic``) has coordinates and no factor: its coordinates are ratio and offset
    on the components of its leader. ``number`` gives the scalar of a formula, and is called for the multiplier and the
    offset of such joints alone. ``elastic`` gives the number of elastic coordinates of a body, whose factor follows the
    factor of the body's joint. ``values`` holds values in place of components of q, v and a, by block and number.
    """
    moving = {joint.name: joint for joint in joints if joint.kind.moves}
    factors: list[Factor] = []
    q_start = v_start = 0
    for joint in joints:
        sizes = {}
        if joint.kind.moves and joint.mimic is None:
            sizes[joint.name] = (joint.kind.group, *joint.kind.sizes)
        if joint.child in elastic:
            sizes[joint.child] = ("R", elastic[joint.child], elastic[joint.child])
        for name, (group, q_size, v_size) in sizes.items():
            factors.append(Factor(group, name, q_start, q_size, v_start, v_size))
            q_start, v_start = q_start + q_size, v_start + v_size
    coordinates = {factor.name: own_coordinates(algebra, factor, values) for factor in factors}
    for joint in moving.values():
        followers: list[tuple[str, Mimic]] = []
        leader = joint
        while leader.name not in coordinates and leader.mimic is not None:
            followers.append((leader.name, leader.mimic))
            leader = moving[leader.mimic.joint]
        for follower, mimic in reversed(followers):
            coordinates[follower] = coordinates[mimic.joint].following(number(mimic.multiplier), number(mimic.offset))
    return tuple(factors), coordinates
