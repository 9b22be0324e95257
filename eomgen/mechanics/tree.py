"""From a Scene to a tree of links: fixed joints merged, frames turned so that joint axes are coordinate axes.

A *link* is a rigid body together with everything fixed to it. Its frame sits on its joint; where the joint's axis is
no coordinate axis of the body, the link's frame is the body's turned so that the axis is its z. A *mount* says where
a body sits on its link.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from eomgen.mechanics.coordinates import Coordinates, joint_coordinates
from eomgen.mechanics.formulas import record
from eomgen.mechanics.joints import Column, Motion, columns_of, motions_of, pose_of
from eomgen.mechanics.rigid_body import Inertia, inertia_about_center
from eomgen.scene.formula_nodes import Formula, Symbol
from eomgen.scene.scene import BASE, Joint, Scene
from eomgen.symbolic.rotation import Rotation
from eomgen.symbolic.scalar import Algebra, Matrix, Scalar, Vector, apply, multiply, plus, transpose
from eomgen.system import Factor

ROOT = -1
CARRIER = -2
WORLD = -3
WORLD_NAME = "world"


@dataclass(frozen=True)
class Mount:
    """Constant pose of a body's frame in a link's frame.

    ``link`` is ROOT for what is fixed to the base that carries the tree, CARRIER for what is fixed to a base that does not:
    in absolute coordinates links hang in the world and the base moves past them. WORLD is what rests while the base moves.
    """

    link: int
    orientation: Matrix
    position: Vector


@dataclass(frozen=True)
class Link:
    """One moving link.

    Attributes
    ----------
    kind : the elementary motion that carries it
    rotation, position : pose in the parent link's frame (base frame at the root), functions of q
    columns : motion subspace in this frame
    coordinates, velocities, accelerations : of the elementary motion, one velocity component per column
    inertia : shape integrals about this frame's origin
    rotor_inertias : one for each column
    balanced : whether it turns about the centre of mass of all that it carries, so that what moves its origin is not coupled
    """

    name: str
    joint: Joint
    kind: str
    parent: int
    rotation: Rotation
    orientation: Matrix
    neutral_position: Vector
    position: Vector
    columns: tuple[Column, ...]
    coordinates: Coordinates
    velocities: tuple[Scalar, ...]
    accelerations: tuple[Scalar, ...]
    inertia: Inertia
    rotor_inertias: tuple[Scalar, ...]
    balanced: bool = False

    @property
    def dofs(self) -> tuple[int, ...]:
        return self.coordinates.dofs


@dataclass(frozen=True)
class Tree:
    """All links, parents before children, and the mounts of all bodies by name (``base`` included).

    Attributes
    ----------
    factors : of the configuration, in the order of the links that they move
    coordinates : of all moving joints by name, those that follow others included
    """

    algebra: Algebra
    links: tuple[Link, ...]
    mounts: dict[str, Mount]
    parameters: dict[str, Scalar]
    factors: tuple[Factor, ...]
    coordinates: dict[str, Coordinates]

    @property
    def nv(self) -> int:
        return sum(factor.v_size for factor in self.factors)

    @property
    def following(self) -> bool:
        """Whether any joint follows another, so that one velocity component moves several links."""
        return sum(len(link.columns) for link in self.links) > self.nv

    def by_dof(self, values: Mapping[int, Sequence[Scalar]]) -> list[Scalar]:
        """Return virtual work given per link (one value per column) as generalized forces, in the order of v."""
        total = [self.algebra.zero] * self.nv
        for index, link in enumerate(self.links):
            for dof, value in zip(link.dofs, values[index], strict=True):
                total[dof] = total[dof] + link.coordinates.ratio * value
        return total

    def dof_parents(self) -> tuple[int, ...]:
        """Return for each velocity component the nearest one before it that it is coupled with, -1 where there is none.

        Eliminating M from the last component to the first fills no place that is not on the way from a component along
        these parents. Where no joint follows another, they are the tree's own.
        """
        coupled: list[set[int]] = [set() for _ in range(self.nv)]
        above: list[frozenset[int]] = []
        for link in self.links:
            carrying = above[link.parent] if link.parent != ROOT else frozenset()
            every = carrying.union(link.dofs)
            above.append(every)
            for dof in link.dofs:
                for other in link.dofs if link.balanced else every:
                    coupled[max(dof, other)].add(min(dof, other))
        parents = [-1] * self.nv
        for dof in reversed(range(self.nv)):
            before = coupled[dof] - {dof}
            if before:
                parents[dof] = max(before)
                coupled[parents[dof]] |= before
        return tuple(parents)

    def children(self) -> list[list[int]]:
        """Return the child links of each link."""
        found: list[list[int]] = [[] for _ in self.links]
        for index, link in enumerate(self.links):
            if link.parent != ROOT:
                found[link.parent].append(index)
        return found


def parameter_scalars(algebra: Algebra, scene: Scene) -> dict[str, Scalar]:
    """Return each parameter: a constant when fixed, a component of the input block ``p`` when tunable."""
    scalars, position = {}, 0
    for parameter in scene.parameters:
        if parameter.tunable:
            scalars[parameter.name] = Scalar(algebra.tape, algebra.tape.input("p", position))
            position += 1
        else:
            scalars[parameter.name] = algebra.scalar(parameter.value)
    return scalars


def build_tree(algebra: Algebra, scene: Scene) -> Tree:
    """Return the tree of a scene on the algebra's tape."""
    parameters = parameter_scalars(algebra, scene)

    def number(formula: Formula) -> Scalar:
        return record(algebra, formula, lambda symbol: _parameter(algebra, parameters, symbol))

    def vector(formulas: Sequence[Formula]) -> Vector:
        return algebra.vector([number(formula) for formula in formulas])

    mounts = {
        BASE: Mount(ROOT, algebra.identity, algebra.zero_vector),
        WORLD_NAME: Mount(WORLD, algebra.identity, algebra.zero_vector),
    }
    factors, coordinates = joint_coordinates(algebra, scene.joints, number)
    links: list[Link] = []
    inertias: list[Inertia] = []
    for body, joint in zip(scene.bodies, scene.joints, strict=True):
        mount = mounts[joint.parent]
        orientation = multiply(mount.orientation, algebra.matrix(joint.orientation))
        position = plus(mount.position, apply(mount.orientation, vector(joint.position)))
        tensor = tuple(number(entry) for entry in body.inertia)
        inertia = inertia_about_center(algebra, number(body.mass), vector(body.center_of_mass), tensor)
        if joint.type == "fixed":
            mounts[body.name] = Mount(mount.link, orientation, position)
            if mount.link != ROOT:
                inertias[mount.link] = inertias[mount.link] + inertia.moved(orientation, position)
            continue
        turned, motions = motions_of(joint)
        axes, parent = algebra.matrix(turned), mount.link
        orientation = multiply(orientation, axes)
        rotors = tuple(number(formula) for formula in joint.each(joint.rotor_inertia))
        for place, motion in enumerate(motions):
            last = place == len(motions) - 1
            links.append(
                _link(
                    algebra, body.name if last else f"{body.name}, part {place + 1} of its joint", joint, motion, parent,
                    orientation, position, number(joint.pitch), coordinates[joint.name], rotors,
                )
            )  # fmt: skip
            inertias.append(inertia.moved(transpose(axes), algebra.zero_vector) if last else no_inertia(algebra))
            parent, orientation, position = len(links) - 1, algebra.identity, algebra.zero_vector
        mounts[body.name] = Mount(parent, transpose(axes), algebra.zero_vector)
    settled = [replace(link, inertia=cleaned(algebra, total)) for link, total in zip(links, inertias, strict=True)]
    return Tree(algebra, tuple(settled), mounts, parameters, factors, coordinates)


def _link(
    algebra: Algebra, name: str, joint: Joint, motion: Motion, parent: int, orientation: Matrix, position: Vector, pitch: Scalar,
    coordinates: Coordinates, rotors: Sequence[Scalar],
) -> Link:  # fmt: skip
    """Return the link that one elementary motion of a joint carries, still without inertia."""
    own = coordinates.of(motion)
    axes = [algebra.vector(axis) for axis in motion.axes]
    rotation, moved_to = pose_of(algebra, motion.kind, axes, pitch, orientation, position, own.q)
    return Link(
        name=name, joint=joint, kind=motion.kind, parent=parent, rotation=rotation, orientation=orientation,
        neutral_position=position, position=moved_to, columns=columns_of(algebra, motion.kind, axes, pitch),
        coordinates=own, velocities=own.v, accelerations=own.a, inertia=no_inertia(algebra),
        rotor_inertias=tuple(rotors[k] for k in motion.components),
    )  # fmt: skip


def no_inertia(algebra: Algebra) -> Inertia:
    """Return the shape integrals of what has no mass."""
    return Inertia(algebra.zero, algebra.zero_vector, algebra.matrix([[0, 0, 0]] * 3))


def _parameter(algebra: Algebra, parameters: dict[str, Scalar], symbol: Symbol) -> Scalar:
    return parameters[symbol.name]


def cleaned(algebra: Algebra, inertia: Inertia) -> Inertia:
    """Return shape integrals without the constants that are round-off of zero, which would cost operations."""

    def snapped(value: Scalar, scale: float) -> Scalar:
        number = value.constant
        return algebra.zero if number is not None and abs(number) <= 1e-15 * scale else value

    def size(values: Sequence[Scalar]) -> float:
        return max((abs(number) for value in values if (number := value.constant) is not None), default=0.0)

    second_size = size([entry for row in inertia.second for entry in row])
    first_size = max(size(inertia.first), math.sqrt(second_size) * math.sqrt(abs(inertia.mass.constant or 0.0)))
    x, y, z = (tuple(snapped(entry, second_size) for entry in row) for row in inertia.second)
    d = tuple(snapped(entry, first_size) for entry in inertia.first)
    return Inertia(inertia.mass, d, (x, y, z))  # type: ignore[arg-type]  # three entries each
