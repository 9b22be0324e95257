"""Two frames of a scene as the nearest link that carries both of them sees them.

What carries both, however far from its origin and however it moves, is neither in their relative position nor in its
derivatives then: a loop far away from the base's origin, or on a body that flies, has the equations that it has anywhere.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from eomgen.mechanics.kinematics import LinkKinematics
from eomgen.mechanics.quantities import Quantities
from eomgen.mechanics.tree import CARRIER, ROOT, WORLD, Mount
from eomgen.scene.constraint import Frame
from eomgen.symbolic.scalar import Matrix, Scalar, Vector, apply, cross, minus, multiply, negative, plus
from eomgen.symbolic.tape import Op


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
    extent : m, the way from one origin to the other along the links between them
    """

    kinematics: LinkKinematics
    first: Placed
    second: Placed
    size: Scalar
    extent: Scalar

    def velocity_at(self, frame: Placed, point: Vector) -> Vector:
        """Return the velocity of what moves with one of the frames at ``point``, where it is now."""
        R, origin = self.kinematics.pose(frame.link)
        omega, velocity = self.kinematics.twist(frame.link)
        return plus(apply(R, velocity), cross(apply(R, omega), minus(point, origin)))


def place(quantities: Quantities, frame: Frame) -> Placed:
    """Return a frame in base axes, world axes in absolute coordinates."""
    return _Side.of(quantities, frame).placed(quantities, quantities.kinematics)


def placed(quantities: Quantities, first: Frame, second: Frame) -> Pair:
    """Return two frames as the nearest link that carries both sees them."""
    algebra, kinematics = quantities.algebra, quantities.kinematics
    sides = [_Side.of(quantities, frame) for frame in (first, second)]
    shared = sum(1 for one, other in zip(sides[0].way, sides[1].way, strict=False) if one == other)
    carrier = sides[0].way[shared - 1]
    starts = [side.start(quantities, shared) for side in sides]
    moves = [any(symbol.block != "p" for symbol in algebra.tape.depends_on(part.ref for part in start)) for start in starts]
    # a point of the carrier, so that places far away are subtracted from each other before all else
    origin = negative(starts[1] if moves[0] and not moves[1] else starts[0])
    poses: dict[int, tuple[Matrix, Vector]] = {carrier: (algebra.identity, origin)}
    twists: dict[int, tuple[Vector, Vector]] = {carrier: (algebra.zero_vector, algebra.zero_vector)}
    for link in {side.way[shared] for side in sides if len(side.way) > shared} & {CARRIER, WORLD}:
        R, p = kinematics.pose(link)
        poses[link], twists[link] = (R, plus(p, origin)), kinematics.twist(link)
    seen = LinkKinematics(quantities.tree, poses, twists)
    along = magnitude(part for side in sides for place in side.beyond(quantities, shared) for part in place)
    apart = magnitude(minus(starts[1], starts[0]))
    size = magnitude((*starts[0], *starts[1])) if any(moves) else apart
    return Pair(seen, sides[0].placed(quantities, seen), sides[1].placed(quantities, seen), size + along, apart + along)


def magnitude(values: Iterable[Scalar]) -> Scalar:
    """Return the sum of the magnitudes of some numbers, one at least."""
    first, *others = (Scalar(value.tape, value.tape.call(Op.ABS, value.ref)) for value in values)
    return sum(others, first)


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

    def start(self, quantities: Quantities, shared: int) -> Vector:
        """Return where the way to the frame leaves the link that carries both, or where the frame is on it."""
        if len(self.way) == shared:
            return self.place
        link = self.way[shared]
        if link >= 0:
            return quantities.tree.links[link].position
        R, p = quantities.kinematics.pose(link)
        return plus(p, apply(R, self.place))

    def beyond(self, quantities: Quantities, shared: int) -> list[Vector]:
        """Return the steps from there to the frame's origin, each in axes of its own."""
        own = [self.place] if len(self.way) > shared and self.mount.link >= 0 else []
        return [quantities.tree.links[link].position for link in self.way[shared + 1 :]] + own

    def placed(self, quantities: Quantities, seen: LinkKinematics) -> Placed:
        R, p = seen.pose(self.mount.link)
        turned = multiply(self.mount.orientation, quantities.algebra.matrix(self.frame.orientation))
        return Placed(self.mount.link, multiply(R, turned), plus(p, apply(R, self.place)))
