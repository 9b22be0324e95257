"""Trees of links, and the mounts of a scene's bodies on them.

A *link* is a rigid body together with everything fixed to it. Its frame sits on its joint; unless the joint's axis is a
coordinate axis of the body, the link's frame is the body's turned so that the axis is its z. A *mount* is the pose of a
body in the frame of its link.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

from eomgen.base.data import dataclass, field, replace
from eomgen.lie.product import Factor
from eomgen.mechanics.tree.beam_body import ElasticBody
from eomgen.mechanics.tree.beam_fields import StationMotion
from eomgen.mechanics.tree.inertia import RecordedInertia
from eomgen.mechanics.tree.joints import JointCoordinates, JointMotion, SubspaceColumn
from eomgen.scene.joints.model import Joint
from eomgen.scene.rotations import CoordinateAxis
from eomgen.scene.scene import Scene
from eomgen.symbolic.rotation import FactoredRotation
from eomgen.symbolic.scalar import Algebra, Matrix, Scalar, Vector, plus

ROOT, CARRIER, WORLD = range(-1, -4, -1)
WORLD_NAME = "world"
#: Trees with more velocity components are stepped with the sparse extended system, even if branches are short: above
#: this number, forming and factoring whole matrices takes longer.
MANY = 64


@dataclass(frozen=True)
class Mount:
    """Constant pose of a body's frame in a link's frame: orientation, (3, 3), and position, (3,), m.

    ``link`` is ROOT for bodies fixed to the base that carries the tree, CARRIER for bodies fixed to a base that does
    not carry the tree: in absolute coordinates links hang in the world and the base moves separately. WORLD is for
    bodies at rest while the base moves.
    """

    link: int
    orientation: Matrix
    position: Vector


@dataclass(frozen=True)
class Link:
    """One moving link.

    Attributes
    ----------
    kind : the elementary motion of the link
    rotation, position : pose in the parent link's frame (base frame at the root), functions of q
    neutral_position, travel : origin at neutral coordinates, and displacement from the neutral position
    columns : motion subspace in this frame
    coordinates, velocities, accelerations : of the elementary motion, one velocity component per column
    inertia : shape integrals about this frame's origin
    rotor_inertias : one for each column
    balanced : whether the link turns about the centre of mass of all carried bodies, so that translation of the origin
        is uncoupled from the rotation
    elastic : deformation, None for a rigid link; ``inertia`` is then the inertia of the deformed body
    station : motion due to elastic coordinates, for a place on a beam; None for a constant motion subspace
    turn : the coordinate axis of rotation, None without rotation about a single coordinate axis
    motion, pitch : of a joint; the pitch in m/rad
    """

    name: str
    joint: Joint
    kind: str
    parent: int
    rotation: FactoredRotation
    orientation: Matrix
    neutral_position: Vector
    travel: Vector
    position: Vector
    columns: tuple[SubspaceColumn, ...]
    coordinates: JointCoordinates
    velocities: tuple[Scalar, ...]
    accelerations: tuple[Scalar, ...]
    inertia: RecordedInertia
    rotor_inertias: tuple[Scalar, ...]
    balanced: bool = False
    elastic: ElasticBody | None = None
    station: StationMotion | None = None
    turn: CoordinateAxis | None = None
    motion: JointMotion | None = None
    pitch: Scalar | None = None

    @property
    def dofs(self) -> tuple[int, ...]:
        return self.coordinates.dofs

    def carrying(self, inertia: RecordedInertia) -> Link:
        """Return the link with another body's inertia added."""
        return replace(self, inertia=self.inertia + inertia)

    def deform(self) -> Link:
        """Return the link with the shape integrals of the deformed body."""
        return self if self.elastic is None else replace(self, inertia=self.elastic.deform(self.inertia))


@dataclass(frozen=True)
class Tree:
    """Links, parents before children, and the mounts of all bodies by name (``base`` included).

    Attributes
    ----------
    factors : of the configuration, in the order of links
    coordinates : by name, of all moving joints, including dependent joints, and of beams
    stations : the link at the station x of a beam, by (body, x)
    alike : groups of links that are recorded with the same operations, for any numbers
    """

    algebra: Algebra
    links: tuple[Link, ...]
    mounts: dict[str, Mount]
    parameters: dict[str, Scalar]
    factors: tuple[Factor, ...]
    coordinates: dict[str, JointCoordinates]
    stations: Mapping[tuple[str, float], int] = field(default_factory=dict)
    alike: tuple[tuple[int, ...], ...] = ()

    @property
    def elastic(self) -> bool:
        """Whether any link deforms."""
        return any(link.elastic is not None for link in self.links)

    @property
    def rigid(self) -> bool:
        """Whether all inertia is rigid: no link deforms, and there is no added mass of water."""
        return not self.elastic and not any(link.inertia.added for link in self.links)

    @property
    def large(self) -> bool:
        """Whether partials of the whole tree are too large by default: then each step of the recursion is
        differentiated separately."""
        return self.deep or self.nv > MANY

    @property
    def deep(self) -> bool:
        """Whether the tree is so deep that terms quadratic in the depth are recorded on request only: articulated
        bodies have long won against a factored mass matrix."""
        return sum(depth * depth for depth in self.depths()) >= 20_000

    def depths(self) -> list[int]:
        """Return for each velocity component the number of components from the root to this component."""
        depths: list[int] = []
        for parent in self.dof_parents():
            depths.append(1 + (depths[parent] if parent >= 0 else 0))
        return depths

    def without_water(self) -> Tree:
        """Return the tree without added mass."""
        links = (replace(link, inertia=replace(link.inertia, added=())) for link in self.links)
        return replace(self, links=tuple(links))

    def mount_at(self, body: str, r: Vector) -> Mount:
        """Return the mount of a body's frame for a point r, (3,), m, of the body. For a point at a station of an
        elastic body it is the mount on the station, with the frame's origin at neutral coordinates; else the body's
        mount."""
        mount, x = self.mounts[body], r[0].constant
        link = None if x is None else self.stations.get((body, x))
        if link is None or link == mount.link:
            return mount
        return Mount(link, mount.orientation, plus(mount.position, (-r[0], self.algebra.zero, self.algebra.zero)))

    @property
    def nv(self) -> int:
        return sum(factor.v_size for factor in self.factors)

    @property
    def following(self) -> bool:
        """Whether any joint is dependent (mimic), so that one velocity component moves several links."""
        return sum(len(link.columns) for link in self.links) > self.nv

    def by_dof(self, values: Mapping[int, Sequence[Scalar]]) -> list[Scalar]:
        """Return generalized forces, (nv,), from virtual work by link number, with one value per column of the link."""
        total = [self.algebra.zero] * self.nv
        for index, link in enumerate(self.links):
            for dof, value in zip(link.dofs, values[index], strict=True):
                total[dof] = total[dof] + link.coordinates.ratio * value
        return total

    def angular(self) -> tuple[bool, ...]:
        """Return for each velocity component whether it is angular; elastic coordinates count as linear."""
        columns = [pair for link in self.links for pair in zip(link.dofs, link.columns, strict=True)]
        turning = {dof for dof, column in columns if not all(part.is_zero for part in column.angular)}
        return tuple(dof in turning for dof in range(self.nv))

    def dof_parents(self) -> tuple[int, ...]:
        """Return for each velocity component the nearest lower component coupled with it, -1 for none.

        Elimination of M from the last component to the first has fill-in only along these parents. Without dependent
        joints these are the parents in the tree.
        """
        if not self.following and not any(link.balanced for link in self.links):
            return self._nearest_above()
        coupled: list[set[int]] = [set() for _ in range(self.nv)]
        above: list[frozenset[int]] = []
        for link in self.links:
            carrying = above[link.parent] if link.parent != ROOT else frozenset()
            every = carrying.union(link.dofs)
            above.append(every)
            for dof in link.dofs:
                for other_dof in link.dofs if link.balanced else every:
                    coupled[max(dof, other_dof)].add(min(dof, other_dof))
        parents = [-1] * self.nv
        for dof in reversed(range(self.nv)):
            before = coupled[dof] - {dof}
            if before:
                parents[dof] = max(before)
                coupled[parents[dof]] |= before
        return tuple(parents)

    def _nearest_above(self) -> tuple[int, ...]:
        """Return, by velocity component, the nearest component towards the root, -1 for none. Valid if all components
        of a path from the root are coupled."""
        highest: list[int] = []  # largest component of each link and the carrying links
        joints: dict[str, tuple[int, list[int]]] = {}
        for link in self.links:
            above = highest[link.parent] if link.parent != ROOT else -1
            joints.setdefault(link.joint.name, (above, []))[1].extend(link.dofs)
            highest.append(max((above, *link.dofs)))
        parents = [-1] * self.nv
        for above, dofs in joints.values():  # joints of several motions: travel first, counted angles first
            ordered = sorted(dofs)
            for nearest, dof in zip([above, *ordered], ordered, strict=False):
                parents[dof] = nearest
        return tuple(parents)

    def inward(self) -> Iterator[tuple[int, Link]]:
        """Yield the number and the link of each link that another link carries, from the tips to the root."""
        return ((index, link) for index, link in reversed([*enumerate(self.links)]) if link.parent != ROOT)

    def rotors(self) -> Iterator[tuple[int, Scalar]]:
        """Yield velocity components and the inertias, kg m^2, that rotors add to them."""
        for link in self.links:
            ratio = link.coordinates.ratio
            yield from ((dof, ratio * ratio * rotor) for dof, rotor in zip(link.dofs, link.rotor_inertias, strict=True))


def parameter_scalars(algebra: Algebra, scene: Scene) -> dict[str, Scalar]:
    """Return the parameters by name: constants if fixed, components of the block ``p`` if tunable."""
    scalars, position = {}, 0
    for parameter in scene.parameters:
        if parameter.tunable:
            scalars[parameter.name] = Scalar(algebra.tape, algebra.tape.input("p", position))
            position += 1
        else:
            scalars[parameter.name] = algebra.scalar(parameter.value)
    return scalars


def no_inertia(algebra: Algebra) -> RecordedInertia:
    """Return the shape integrals of a massless body."""
    return RecordedInertia(algebra.zero, algebra.zero_vector, algebra.matrix([[0, 0, 0]] * 3))


def clean(algebra: Algebra, inertia: RecordedInertia) -> RecordedInertia:
    """Return shape integrals with constants at round-off level set to 0, which saves operations. The level is 1e-15 of
    the largest constant of the same kind; added masses are unchanged."""

    def snap(value: Scalar, scale: float) -> Scalar:
        number = value.constant
        return algebra.zero if number is not None and abs(number) <= 1e-15 * scale else value

    def size(values: Sequence[Scalar]) -> float:
        return max((abs(number) for value in values if (number := value.constant) is not None), default=0.0)

    second_size = size([entry for row in inertia.second for entry in row])
    first_size = max(size(inertia.first), math.sqrt(second_size) * math.sqrt(abs(inertia.mass.constant or 0.0)))
    x, y, z = (tuple(snap(entry, second_size) for entry in row) for row in inertia.second)
    d = tuple(snap(entry, first_size) for entry in inertia.first)
    return RecordedInertia(inertia.mass, d, (x, y, z), inertia.added)  # type: ignore[arg-type]  # three entries each
