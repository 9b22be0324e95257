"""From a Scene to a tree of links: fixed joints merged, frames turned so that joint axes are coordinate axes.

A *link* is a rigid body together with everything fixed to it. Its frame sits on its joint; where the joint's axis is
no coordinate axis of the body, the link's frame is the body's turned so that the axis is its z. A *mount* says where
a body sits on its link.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from eomgen.mechanics.formulas import record
from eomgen.mechanics.joints import GROUPS, Column, columns_of, pose_of
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
    rotation, position : pose in the parent link's frame (base frame at the root), functions of q
    columns : motion subspace in this frame, one column per velocity component
    velocities : components of v of this joint
    inertia : shape integrals about this frame's origin
    """

    name: str
    joint: Joint
    parent: int
    rotation: Rotation
    orientation: Matrix
    neutral_position: Vector
    position: Vector
    columns: tuple[Column, ...]
    factor: Factor
    velocities: tuple[Scalar, ...]
    accelerations: tuple[Scalar, ...]
    inertia: Inertia
    rotor_inertia: Scalar


@dataclass(frozen=True)
class Tree:
    """All links, parents before children, and the mounts of all bodies by name (``base`` included)."""

    algebra: Algebra
    links: tuple[Link, ...]
    mounts: dict[str, Mount]
    parameters: dict[str, Scalar]

    @property
    def nv(self) -> int:
        return sum(len(link.columns) for link in self.links)

    def dof_links(self) -> list[tuple[int, int]]:
        """Return (link, column) of each velocity component."""
        found = {link.factor.v_start + k: (i, k) for i, link in enumerate(self.links) for k in range(len(link.columns))}
        return [found[dof] for dof in range(self.nv)]

    def by_dof(self, values: Mapping[int, Sequence[Scalar]]) -> list[Scalar]:
        """Return values given per link (one per column) in the order of v."""
        return [values[index][k] for index, k in self.dof_links()]

    def dof_parents(self) -> tuple[int, ...]:
        """Return for each velocity component the nearest one towards the root that it is coupled with, -1 where there is none.

        The turning and the translating link of an absolute body on R^3 x SO(3) are not coupled, and come in the other order.
        """
        parents: list[int] = []
        for index, k in self.dof_links():
            above = self.links[index].parent
            last = -1 if above == ROOT else self.links[above].factor.v_start + self.links[above].factor.v_size - 1
            nearest = last if k == 0 else len(parents) - 1
            parents.append(nearest if nearest < len(parents) else -1)
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
    links: list[Link] = []
    inertias: list[Inertia] = []
    q_start = v_start = 0
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
        turn, axis = _aligned(algebra, joint)
        orientation = multiply(orientation, turn)
        group, q_size, v_size = GROUPS[joint.type]
        factor = Factor(group, joint.name, q_start, q_size, v_start, v_size)
        q = [Scalar(algebra.tape, algebra.tape.input("q", q_start + k)) for k in range(q_size)]
        rotation, moved_to = pose_of(algebra, joint.type, axis, orientation, position, q)
        mounts[body.name] = Mount(len(links), transpose(turn), algebra.zero_vector)
        inertias.append(inertia.moved(transpose(turn), algebra.zero_vector))
        links.append(
            Link(
                name=body.name, joint=joint, parent=mount.link, rotation=rotation, orientation=orientation,
                neutral_position=position, position=moved_to,
                columns=columns_of(algebra, joint.type, axis), factor=factor,
                velocities=_components(algebra, "v", v_start, v_size), accelerations=_components(algebra, "a", v_start, v_size),
                inertia=inertia, rotor_inertia=number(joint.rotor_inertia),
            )
        )  # fmt: skip
        q_start, v_start = q_start + q_size, v_start + v_size
    settled = [replace(link, inertia=cleaned(algebra, total)) for link, total in zip(links, inertias, strict=True)]
    return Tree(algebra, tuple(settled), mounts, parameters)


def _parameter(algebra: Algebra, parameters: dict[str, Scalar], symbol: Symbol) -> Scalar:
    return parameters[symbol.name]


def _components(algebra: Algebra, block: str, start: int, size: int) -> tuple[Scalar, ...]:
    return tuple(Scalar(algebra.tape, algebra.tape.input(block, start + k)) for k in range(size))


def _aligned(algebra: Algebra, joint: Joint) -> tuple[Matrix, Vector]:
    """Return the turn from link to body axes that makes a skew revolute axis the link's z, and the axis in link axes."""
    if joint.type != "revolute" or any(abs(component) == 1.0 for component in joint.axis):
        return algebra.identity, algebra.vector(joint.axis)
    return algebra.matrix(aligning_turn(joint.axis)), algebra.vector((0.0, 0.0, 1.0))


def aligning_turn(axis: tuple[float, float, float]) -> tuple[tuple[float, float, float], ...]:
    """Return a constant rotation whose third column is ``axis``; exact for coordinate axes."""
    smallest = min(range(3), key=lambda k: abs(axis[k]))
    first = [-axis[smallest] * component for component in axis]
    first[smallest] += 1.0
    length = math.sqrt(sum(component * component for component in first))
    x = [component / length for component in first]
    y = [axis[1] * x[2] - axis[2] * x[1], axis[2] * x[0] - axis[0] * x[2], axis[0] * x[1] - axis[1] * x[0]]
    return tuple((x[k], y[k], axis[k]) for k in range(3))


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
