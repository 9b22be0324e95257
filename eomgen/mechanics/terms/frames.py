"""Frames: poses, Jacobians with rates and drifts in three pairs of axes and point, inverse operational-space inertias.

J v is the twist of a frame against the base, angular first: in its own axes (``body``), in world axes about its own
origin (``local_world_aligned``), or in world axes about the world's origin (``world``). In world axes a column is the
axis of its joint and the displacement of the point. Rates are derivatives on the tape, along the motions of joints
and of the base: that takes fewer operations than the cross products with the angular velocities of the links.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property, partial

from eomgen.mechanics.dynamics.elimination import half_solved, ltdl
from eomgen.mechanics.dynamics.separated import zero_base
from eomgen.mechanics.kinematics.bodies import Orientations, jacobian_of_mount, link_columns
from eomgen.mechanics.kinematics.fields import AccelerationField, total_fields
from eomgen.mechanics.kinematics.points import Kinematics
from eomgen.mechanics.scene_tape import Derivation
from eomgen.mechanics.tree.base import quaternion_product
from eomgen.mechanics.tree.links import ROOT, Mount
from eomgen.symbolic.scalar import (
    Matrix,
    Scalar,
    Vector,
    apply,
    cross,
    dot,
    minus,
    multiply,
    negative,
    plus,
    scaled,
    transpose,
)
from eomgen.system.description import FixedFrame
from eomgen.system.system import Block
from eomgen.system.terms import REFERENCES

#: Angular part, and linear part at the origin of the link, of one column of a joint, in axes of the base.
Column = tuple[int, Vector, Vector]


class FrameMotion:
    """Jacobians of the twists of frames on one tree, and the rates of these Jacobians along the motion.

    A frame is a mount on a link, as of ``frame_mount``.

    Parameters
    ----------
    kinematics : Kinematics
    reference : str
        Axes and point of twists: ``body``, ``local_world_aligned`` or ``world``.
    """

    def __init__(self, kinematics: Kinematics, reference: str) -> None:
        self.kinematics = kinematics
        self.tree = kinematics.tree
        self.algebra = kinematics.algebra
        self.reference = reference
        self._links = link_columns(self.tree) if reference == "body" else []

    def jacobian(self, mount: Mount) -> list[Scalar]:
        """Return the Jacobian J, (6, nv) row by row, of the frame's twist relative to the base, angular first."""
        if self.reference == "body":
            return jacobian_of_mount(self.tree, self._links, mount)
        point, turn = self._point(mount), self.kinematics.base.orientation
        rows = [[self.algebra.zero] * self.tree.nv for _ in range(6)]
        for link in self._path(mount.link):
            origin = self.kinematics.pose(link)[1]
            for dof, angular, linear in self._columns(link):
                moved = plus(linear, cross(angular, minus(point, origin)))
                for row, value in zip(rows, (*apply(turn, angular), *apply(turn, moved)), strict=True):
                    row[dof] = row[dof] + value
        return [value for row in rows for value in row]

    def jacobian_rate(self, mount: Mount) -> list[Scalar]:
        """Return dJ/dt along v, (6, nv) row by row."""
        return self.kinematics.rates(self.jacobian(mount))

    def drift(self, mount: Mount) -> list[Scalar]:
        """Return dJ/dt v, (6,): the rate of the twist J v at constant v; zeros for frames on the base."""
        if self.kinematics.carrier.moving or self.reference == "body":
            return self.kinematics.rates(self._twist(mount))
        if mount.link < 0:
            return [self.algebra.zero] * 6
        field, R = self._fields[mount.link], self.kinematics.pose(mount.link)[0]
        alpha, acceleration = apply(R, field.alpha), apply(R, field.at(mount.position))
        if self.reference == "world":
            omega, velocity = self.kinematics.twist(mount.link)
            passing = apply(R, plus(velocity, cross(omega, mount.position)))
            moved = plus(cross(passing, apply(R, omega)), cross(self._position(mount), alpha))
            acceleration = plus(acceleration, moved)
        return [*alpha, *acceleration]

    @cached_property
    def _fields(self) -> Sequence[AccelerationField]:
        return total_fields(self.tree, zero_base(self.tree), accelerations=False, gravity=False)

    def _twist(self, mount: Mount) -> list[Scalar]:
        """Return the twist J v of a frame relative to the base, (6,), angular first, in the axes of ``reference``."""
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
        """Return the point at which the linear part of J v is taken, relative to the base, m, in base axes. It is the
        frame's origin for ``local_world_aligned``, else the world's origin."""
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
        """Return the columns of a link's joint in axes of the base, each with the index of its velocity component."""
        link, R = self.tree.links[index], self.kinematics.pose(index)[0]
        ratio = link.coordinates.ratio
        return [
            (dof, scaled(ratio, apply(R, column.angular)), scaled(ratio, apply(R, column.linear)))
            for dof, column in zip(link.dofs, link.columns, strict=True)
        ]


def frame_mount(derivation: Derivation, frame: FixedFrame) -> Mount:
    """Return the mount of a frame on a link; on a beam, on the station at the frame's origin."""
    position = derivation.quantities.vector(frame.position)
    mount = derivation.tree.mount_at(frame.body, position)
    orientation = multiply(mount.orientation, derivation.algebra.matrix(frame.orientation))
    return Mount(mount.link, orientation, plus(mount.position, apply(mount.orientation, position)))


def frame_poses(derivation: Derivation) -> list[Block]:
    """Return the block ``frame_pose``, (frames, 7), as a list: quaternion (w, x, y, z; to world axes) and world
    position, m. Rows are the task frames, or all bodies and then all frames if the scene has no task frames."""
    orientations = Orientations(derivation.scene, derivation.tree, derivation.kinematics)
    values: list[Scalar] = []
    for frame in derivation.scene.frames_of_terms():
        turned = [derivation.algebra.scalar(part) for part in frame.quaternion]
        position = derivation.quantities.vector(frame.position)
        values += quaternion_product(orientations.at(frame.body, position), turned)
        values += derivation.kinematics.position(frame.body, position)
    return [_block(derivation, "frame_pose", (7,), values, "quaternion (w, x, y, z) and position")]


def frame_mobilities(derivation: Derivation) -> list[Block]:
    """Return the block of J M^-1 J^T of each frame, (frames, 6, 6), the inverse operational-space inertia. J is in
    world axes about the origin of the frame, angular first."""
    nv = derivation.tree.nv
    (J,) = _frame_motion(derivation, "local_world_aligned", "frame_jacobians")
    rows = derivation.mass_rows
    values: list[Scalar] = []
    with derivation.tape.block("inverse operational-space inertias: M = L^T D L, halves L^-T J^T"):
        factors, inverse = ltdl(rows, derivation.tree.dof_parents())
        for start in range(0, len(J.refs), 6 * nv):
            refs = [J.refs[start + nv * k : start + nv * (k + 1)] for k in range(6)]
            halves = [half_solved(factors, [Scalar(derivation.tape, ref) for ref in row]) for row in refs]
            weighted = [[x * d for x, d in zip(half, inverse, strict=True)] for half in halves]
            upper = {(i, j): dot(weighted[i], halves[j]) for i in range(6) for j in range(i, 6)}
            values += [upper[min(i, j), max(i, j)] for i in range(6) for j in range(6)]
    return [_block(derivation, "mobility", (6, 6), values, "J M^-1 J^T")]


#: Quantities of the motion of frames: name of the block, method, whether there is a column for each component of v,
#: words.
_OF_MOTION: Mapping[str, tuple[str, Callable[[FrameMotion, Mount], list[Scalar]], bool, str]] = {
    "frame_jacobians": ("J", FrameMotion.jacobian, True, "twist per unit of v"),
    "frame_jacobian_rates": ("J_dot", FrameMotion.jacobian_rate, True, "dJ/dt"),
    "frame_drifts": ("drift", FrameMotion.drift, False, "dJ/dt v"),
}


def _frame_motion(derivation: Derivation, reference: str, term: str) -> list[Block]:
    """Return the block of a quantity of ``_OF_MOTION`` of each frame, (frames, 6, nv) or (frames, 6)."""
    name, of, has_columns, description = _OF_MOTION[term]
    motion, values = FrameMotion(derivation.kinematics, reference), list[Scalar]()
    for frame in derivation.scene.frames_of_terms():
        mount = frame_mount(derivation, frame)
        with derivation.tape.block(f"{description} of frame {frame.name}"):
            values += of(motion, mount)
    return [_block(derivation, name, (6, derivation.tree.nv) if has_columns else (6,), values, description)]


def _block(derivation: Derivation, name: str, shape: tuple[int, ...], values: list[Scalar], description: str) -> Block:
    names = [frame.name for frame in derivation.scene.frames_of_terms()]
    return derivation.block(name, (len(names), *shape), values, f"{description} of {', '.join(names)}")


FRAME_RECORDERS: Mapping[str, Callable[[Derivation], list[Block]]] = {
    "frame_poses": frame_poses,
    **{
        f"{term}{ending}": partial(_frame_motion, reference=reference, term=term)
        for term in _OF_MOTION
        for reference, (ending, _) in REFERENCES.items()
    },
    "frame_mobilities": frame_mobilities,
}
