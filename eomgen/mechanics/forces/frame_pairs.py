"""Two frames of a scene as the nearest link that carries both of them sees them.

What carries both, however far from its origin and however it moves, is neither in their relative position nor in its
derivatives then: a loop far away from the base's origin, or on a body that flies, has the equations that it has anywhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from eomgen.mechanics.forces.symbols import Quantities
from eomgen.mechanics.kinematics.points import LinkKinematics
from eomgen.mechanics.tree.links import ROOT, Mount
from eomgen.scene.joints.constraint_model import Frame
from eomgen.symbolic.operations import Op
from eomgen.symbolic.scalar import Matrix, Scalar, Vector, apply, cross, minus, multiply, plus


@dataclass(frozen=True)
class Placed:
    """A frame where it is now: axes as columns, and origin; ``link`` is what it moves with."""

    link: int
    axes: Matrix
    origin: Vector

    def axis(self, k: int) -> Vector:
        return (self.axes[0][k], self.axes[1][k], self.axes[2][k])


@dataclass(frozen=True)
class Pair:
    """Two frames in the axes of the nearest link that carries both, seen from a point of that link near them.

    Attributes
    ----------
    size : m, what the magnitudes of the summands of both origins add up to
    lever : m, the way from where each origin's links leave the nearest one to that origin: what turning may move it by. How
        far apart those places are is no part of it, and 0 where bodies are held at their origins
    way : m, the lever and how far apart those places are: from one origin to the other along the links between them
    """

    kinematics: LinkKinematics
    first: Placed
    second: Placed
    size: Scalar
    lever: Scalar
    way: Scalar

    def angular_velocity(self, frame: Placed) -> Vector:
        """Return the angular velocity of what moves with one of the frames."""
        return apply(self.kinematics.pose(frame.link)[0], self.kinematics.twist(frame.link)[0])

    def velocity_at(self, frame: Placed, point: Vector) -> Vector:
        """Return the velocity of what moves with one of the frames at ``point``, where it is now."""
        R, origin = self.kinematics.pose(frame.link)
        omega, velocity = self.kinematics.twist(frame.link)
        return plus(apply(R, velocity), cross(apply(R, omega), minus(point, origin)))


def place(quantities: Quantities, frame: Frame) -> Placed:
    """Return a frame in base axes, world axes in absolute coordinates."""
    side, kinematics = _Side.of(quantities, frame), quantities.kinematics
    R, p = kinematics.pose(side.mount.link)
    turned = multiply(side.mount.orientation, quantities.algebra.matrix(frame.orientation))
    return Placed(side.mount.link, multiply(R, turned), plus(p, apply(R, side.place)))


def placed(quantities: Quantities, first: Frame, second: Frame) -> Pair:
    """Return two frames as the nearest link that carries both sees them."""
    algebra, zero = quantities.algebra, quantities.algebra.zero_vector
    sides = [_Side.of(quantities, frame) for frame in (first, second)]
    shared = sum(1 for one, other in zip(sides[0].way, sides[1].way, strict=False) if one == other)
    (place, travel), (other_place, other_travel) = (side.start(quantities, shared) for side in sides)
    # seen from where the first one's way starts, or the second's if only that one stays: places far away are subtracted first
    if _is_zero(travel) or not _is_zero(other_travel):
        starts = [zero, plus(minus(other_place, place), minus(other_travel, travel))]
    else:
        starts = [plus(minus(place, other_place), minus(travel, other_travel)), zero]
    apart = starts[1] if _is_zero(starts[0]) else starts[0]
    poses: dict[int, tuple[Matrix, Vector]] = {sides[0].way[shared - 1]: (algebra.identity, zero)}
    twists: dict[int, tuple[Vector, Vector]] = {sides[0].way[shared - 1]: (zero, zero)}
    for side, start in zip(sides, starts, strict=True):
        side.begin(quantities, shared, start, poses, twists)
    seen = LinkKinematics(quantities.tree, poses, twists)
    steps = [step for side in sides for step in side.beyond(quantities, shared)]
    size = _lengths((minus(other_place, place), travel, other_travel, *steps))
    frames = [side.placed(quantities, shared, seen, start) for side, start in zip(sides, starts, strict=True)]
    lever = _lengths(steps) if steps else algebra.zero
    return Pair(seen, frames[0], frames[1], size, lever, _lengths((apart, *steps)))


def _lengths(steps: Sequence[Vector]) -> Scalar:
    """Return the sum of the magnitudes of all components."""
    first, *others = (magnitude(part) for step in steps for part in step)
    return sum(others, first)


def _is_zero(x: Vector) -> bool:
    return all(part.is_zero for part in x)


def magnitude(value: Scalar) -> Scalar:
    """Return the magnitude of a number."""
    return Scalar(value.tape, value.tape.call(Op.ABS, value.ref))


@dataclass(frozen=True)
class _Side:
    """A frame, the links from the root to the one that it is on, and its origin there."""

    frame: Frame
    way: tuple[int, ...]
    mount: Mount
    place: Vector

    @classmethod
    def of(cls, quantities: Quantities, frame: Frame) -> _Side:
        mount = quantities.mount(frame)
        r = quantities.vector(frame.position)
        way = [mount.link]
        while way[0] != ROOT:
            way.insert(0, quantities.tree.links[way[0]].parent if way[0] >= 0 else ROOT)
        return cls(frame, tuple(way), mount, plus(mount.position, apply(mount.orientation, r)))

    def start(self, quantities: Quantities, shared: int) -> tuple[Vector, Vector]:
        """Return where the way to the frame leaves the link that carries both, or where the frame is on it, at neutral
        coordinates, and how far it has moved from there."""
        zero = quantities.algebra.zero_vector
        if len(self.way) == shared:
            return self.place, zero
        link = self.way[shared]
        if link >= 0:
            return quantities.tree.links[link].neutral_position, quantities.tree.links[link].travel
        R, p = quantities.kinematics.pose(link)
        return zero, plus(p, apply(R, self.place))

    def begin(
        self, quantities: Quantities, shared: int, start: Vector, poses: dict[int, tuple[Matrix, Vector]],
        twists: dict[int, tuple[Vector, Vector]],
    ) -> None:  # fmt: skip
        """Enter the pose of the first link of the way, which starts at ``start``; of the base and the world their twist too."""
        if len(self.way) == shared:
            return
        link = self.way[shared]
        if link >= 0:
            poses[link] = (quantities.tree.links[link].rotation.matrix(quantities.algebra), start)
            return
        R, _ = quantities.kinematics.pose(link)
        poses[link], twists[link] = (R, minus(start, apply(R, self.place))), quantities.kinematics.twist(link)

    def beyond(self, quantities: Quantities, shared: int) -> list[Vector]:
        """Return the steps from there to the frame's origin, each in axes of its own."""
        if len(self.way) == shared or self.mount.link < 0:
            return []
        return [*(quantities.tree.links[link].position for link in self.way[shared + 1 :]), self.place]

    def placed(self, quantities: Quantities, shared: int, seen: LinkKinematics, start: Vector) -> Placed:
        turned = multiply(self.mount.orientation, quantities.algebra.matrix(self.frame.orientation))
        R, p = seen.pose(self.mount.link)
        if len(self.way) == shared or self.mount.link < 0:
            return Placed(self.mount.link, multiply(R, turned), start)
        return Placed(self.mount.link, multiply(R, turned), plus(p, apply(R, self.place)))
