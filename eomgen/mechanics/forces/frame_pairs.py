"""Relative pose and motion of two frames, in the axes of the nearest link that carries both.

The motion of that link and its distance from the origin cancel in the relative pose and in its derivatives: a loop far
from the base's origin, or on a flying body, has the same equations as anywhere else.
"""

from __future__ import annotations

from collections.abc import Sequence

from eomgen.base.data import dataclass
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.mechanics.kinematics.points import LinkKinematics
from eomgen.mechanics.tree.links import ROOT
from eomgen.scene.joints.model import Frame
from eomgen.symbolic.operations import Op
from eomgen.symbolic.scalar import Matrix, Scalar, Vector, all_zero, apply, cross, minus, multiply, plus


@dataclass(frozen=True)
class FramePose:
    """Pose of a frame: ``axes`` (3, 3) by columns, ``origin`` (3,) in m, and the ``link`` to which the frame is
    fixed."""

    link: int
    axes: Matrix
    origin: Vector

    def axis(self, k: int) -> Vector:
        return (self.axes[0][k], self.axes[1][k], self.axes[2][k])


@dataclass(frozen=True)
class FramePair:
    """Poses of two frames in the axes of the nearest link that carries both, from an origin on this link near both
    frames.

    Attributes
    ----------
    size : m, sum of the magnitudes of the summands of both origins
    lever : m, bound of the displacement of the origins by rotations: the lengths of both chains from the common link's
        joints to the origins, without the distance between these joints; 0 if both bodies are held at their origins
    path_length : m, the path from one origin to the other origin along the links between the frames
    """

    kinematics: LinkKinematics
    first: FramePose
    second: FramePose
    size: Scalar
    lever: Scalar
    path_length: Scalar

    def angular_velocity(self, frame: FramePose) -> Vector:
        """Return the angular velocity of a frame, (3,), rad/s, relative to the common link, in axes of the common
        link."""
        return apply(self.kinematics.pose(frame.link)[0], self.kinematics.twist(frame.link)[0])

    def velocity_at(self, frame: FramePose, point: Vector) -> Vector:
        """Return the velocity of the material point of a frame at ``point``, (3,), m/s, in axes of the common link."""
        R, origin = self.kinematics.pose(frame.link)
        omega, velocity = self.kinematics.twist(frame.link)
        return plus(apply(R, velocity), cross(apply(R, omega), minus(point, origin)))


def frame_pose(quantities: Quantities, frame: Frame) -> FramePose:
    """Return the pose of a frame in base axes; in absolute coordinates in world axes."""
    return _Side(quantities, frame).pose(quantities.kinematics)


def frame_pair(quantities: Quantities, first: Frame, second: Frame) -> FramePair:
    """Return the poses of two frames in the axes of the nearest link that carries both bodies, with scales of lengths.
    Positions are relative to an origin near both frames."""
    algebra, zero = quantities.algebra, quantities.algebra.zero_vector
    sides = [_Side(quantities, frame) for frame in (first, second)]
    shared = sum(1 for left, right in zip(sides[0].chain, sides[1].chain, strict=False) if left == right)
    (position, travel), (other_position, other_travel) = (side.start(shared) for side in sides)
    # Origin: the start of the first chain, or of the second chain if only the second is fixed, so that large offsets
    # cancel first.
    if all_zero(travel) or not all_zero(other_travel):
        starts = [zero, plus(minus(other_position, position), minus(other_travel, travel))]
    else:
        starts = [plus(minus(position, other_position), minus(travel, other_travel)), zero]
    apart = starts[1] if all_zero(starts[0]) else starts[0]
    poses: dict[int, tuple[Matrix, Vector]] = {sides[0].chain[shared - 1]: (algebra.identity, zero)}
    twists: dict[int, tuple[Vector, Vector]] = {sides[0].chain[shared - 1]: (zero, zero)}
    for side, start in zip(sides, starts, strict=True):
        for link in side.chain[shared : shared + 1]:  # the first one after the common link
            if link >= 0:
                poses[link] = (quantities.tree.links[link].rotation.matrix(algebra), start)
            else:
                R, _ = quantities.kinematics.pose(link)
                poses[link] = (R, minus(start, apply(R, side.position)))
                twists[link] = quantities.kinematics.twist(link)
    relative = LinkKinematics(quantities.tree, poses, twists)
    steps = [step for side in sides for step in side.beyond(shared)]
    size = lengths((minus(other_position, position), travel, other_travel, *steps))
    frames = [
        side.pose(relative, None if side.beyond(shared) else start) for side, start in zip(sides, starts, strict=True)
    ]
    lever = lengths(steps) if steps else algebra.zero
    return FramePair(relative, frames[0], frames[1], size, lever, lengths((apart, *steps)))


def lengths(steps: Sequence[Vector]) -> Scalar:
    """Return the sum of the magnitudes of all components."""
    first, *others = (magnitude(part) for step in steps for part in step)
    return sum(others, first)


def magnitude(value: Scalar) -> Scalar:
    """Return the magnitude of a number."""
    return Scalar(value.tape, value.tape.call(Op.ABS, value.ref))


class _Side:
    """One of two frames: the chain of links from the root to the carrying link, the mount of the body, and the frame's
    origin, m, in link axes."""

    def __init__(self, quantities: Quantities, frame: Frame) -> None:
        self.quantities, self.frame, self.mount = quantities, frame, quantities.mount(frame)
        r = quantities.vector(frame.position)
        self.chain = [self.mount.link]
        while self.chain[0] != ROOT:
            self.chain.insert(0, quantities.tree.links[self.chain[0]].parent if self.chain[0] >= 0 else ROOT)
        self.position = plus(self.mount.position, apply(self.mount.orientation, r))

    def start(self, shared: int) -> tuple[Vector, Vector]:
        """Return the position of the chain's first joint on the common link at neutral coordinates, m, and its
        displacement. ``shared`` is the number of links that both chains have. Of a frame on the common link it is the
        frame's origin."""
        zero = self.quantities.algebra.zero_vector
        if len(self.chain) == shared:
            return self.position, zero
        link = self.chain[shared]
        if link >= 0:
            return self.quantities.tree.links[link].neutral_position, self.quantities.tree.links[link].travel
        R, p = self.quantities.kinematics.pose(link)
        return zero, plus(p, apply(R, self.position))

    def beyond(self, shared: int) -> list[Vector]:
        """Return the steps from the chain's first joint to the frame's origin, m, each in the axes of the link. Empty
        for a frame on the common link, the base or the world."""
        if len(self.chain) == shared or self.mount.link < 0:
            return []
        return [*(self.quantities.tree.links[link].position for link in self.chain[shared + 1 :]), self.position]

    def pose(self, kinematics: LinkKinematics, origin: Vector | None = None) -> FramePose:
        """Return the pose of the frame among links with known poses, at a given origin, m, if there is one."""
        turned = multiply(self.mount.orientation, self.quantities.algebra.matrix(self.frame.orientation))
        R, p = kinematics.pose(self.mount.link)
        axes = multiply(R, turned)
        return FramePose(self.mount.link, axes, origin or plus(p, apply(R, self.position)))
