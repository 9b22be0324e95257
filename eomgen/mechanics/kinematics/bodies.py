"""Poses and twists of all bodies in the world, for output; the quaternions' signs are continuous along motions.

Their sign at neutral coordinates is the sign of the joints' orientations, multiplied likewise. It does not depend on
the choice of the links' frames, which are turned against the bodies' if axes are skew.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from eomgen.lie import rotations
from eomgen.lie.algebra import TapeAlgebra
from eomgen.mechanics.kinematics.points import Kinematics
from eomgen.mechanics.tree.alike import generic_rows
from eomgen.mechanics.tree.base import quaternion_product
from eomgen.mechanics.tree.links import CARRIER, ROOT, WORLD, Link, Mount, Tree
from eomgen.scene.rotations import quaternion_of_matrix
from eomgen.scene.scene import Scene
from eomgen.symbolic.operations import Op
from eomgen.symbolic.scalar import Matrix, Scalar, Vector, apply, cross, plus, scaled, transpose
from eomgen.system.description import BASE


def constant_quaternion(R: Matrix) -> list[float]:
    """Return the unit quaternion (w, x, y, z) of a constant rotation matrix, as ``quaternion_of_matrix``."""
    return list(quaternion_of_matrix([[entry.number or 0.0 for entry in row] for row in R]))


def _scalars(tree: Tree, quaternions: Mapping[int, Sequence[float]], label: str) -> dict[int, list[Scalar]]:
    """Return constant quaternions, by link, as scalars. Of alike links the components are generic constants, so that
    their recordings are the same."""
    scalars = {index: [tree.algebra.scalar(part) for part in parts] for index, parts in quaternions.items()}
    for alike in tree.alike:
        members = [index for index in alike if index in scalars]
        rows = generic_rows(tree.algebra, members, [scalars[index] for index in members], label)
        scalars |= dict(zip(members, rows, strict=True))
    return scalars


def _joint_quaternion(tree: Tree, link: Link, constant: list[Scalar]) -> list[Scalar]:
    """Return a link's quaternion (w, x, y, z) relative to the parent: ``constant``, then the joint's rotation."""
    algebra = tree.algebra
    q = link.coordinates.q
    if link.turn is not None:
        half = q[0] * 0.5
        sine = algebra.call(Op.SIN, half)
        axis = link.columns[0].angular
        return quaternion_product(constant, [algebra.call(Op.COS, half), *(component * sine for component in axis)])
    if link.kind in ("travel", "elastic"):
        return constant
    if link.station is not None:
        on_tape = TapeAlgebra(algebra.tape)
        return quaternion_product(
            constant, [on_tape.scalar(part) for part in rotations.exponential(on_tape, link.station.angle)]
        )
    return quaternion_product(constant, list(q[:4]))


class Orientations:
    """Quaternions (w, x, y, z) of all links and bodies, to world axes, with signs that are continuous along motions."""

    def __init__(self, scene: Scene, tree: Tree, kinematics: Kinematics) -> None:
        self.tree = tree
        self.algebra = tree.algebra
        still = [self.algebra.one, *self.algebra.zero_vector]
        self.root = list(kinematics.base.struct[:4]) if kinematics.base.turning else still
        self.carrier = list(kinematics.carrier.struct[:4]) if kinematics.carrier.turning else still
        self.links: list[list[Scalar]] = []
        turned = {index: constant_quaternion(link.orientation) for index, link in enumerate(tree.links)}
        constants = _scalars(tree, turned, "quaternion of link")
        for index, link in enumerate(tree.links):
            above = self.root if link.parent == ROOT else self.links[link.parent]
            self.links.append(quaternion_product(above, _joint_quaternion(tree, link, constants[index])))
        mounted = _mount_quaternions(scene, tree)
        self.mounted = {name: [self.algebra.scalar(part) for part in parts] for name, parts in mounted.items()}
        of_links = {index: mounted[link.name] for index, link in enumerate(tree.links) if link.name in mounted}
        alike = _scalars(tree, of_links, "quaternion of body")
        self.mounted |= {tree.links[index].name: parts for index, parts in alike.items()}

    def at(self, name: str, r: Vector) -> list[Scalar]:
        """Return the quaternion to world axes of a body's frame at a point ``r`` of the body, (3,), m, in body axes. On
        an elastic body the frame turns with the section."""
        mount = self.tree.mount_at(name, r)
        if mount.link == self.tree.mounts[name].link:
            return self.body(name)
        parts = [self.algebra.scalar(part) for part in constant_quaternion(mount.orientation)]
        return quaternion_product(self.links[mount.link], parts)

    def body(self, name: str) -> list[Scalar]:
        """Return the quaternion (w, x, y, z), body to world axes, of the named body, of the base, or of the world."""
        link = self.tree.mounts[name].link
        if link == WORLD:
            return [self.algebra.one, *self.algebra.zero_vector]
        above = {ROOT: self.root, CARRIER: self.carrier}[link] if link < 0 else self.links[link]
        parts = self.mounted.get(name, [self.algebra.one, *self.algebra.zero_vector])
        return quaternion_product(above, parts)


def poses(scene: Scene, tree: Tree, kinematics: Kinematics) -> list[Scalar]:
    """Return quaternion (w, x, y, z; body to world) and world position, m, of each body, (bodies, 7) row by row."""
    orientations = Orientations(scene, tree, kinematics)
    values: list[Scalar] = []
    for body in scene.bodies:
        values += [*orientations.body(body.name), *kinematics.origin(body.name)]
    return values


def _mount_quaternions(scene: Scene, tree: Tree) -> dict[str, list[float]]:
    """Return the constant quaternion (w, x, y, z) of each body in its link, by name. At neutral coordinates the body
    has the sign given by the orientations of joints."""
    neutral: list[list[float]] = []
    for link in tree.links:
        turn = constant_quaternion(link.orientation)
        neutral.append(turn if link.parent == ROOT else rotations.quaternion_product(neutral[link.parent], turn))
    wanted = {BASE: [1.0, 0.0, 0.0, 0.0]}
    mounted: dict[str, list[float]] = {}
    for body, joint in zip(scene.bodies, scene.joints, strict=True):
        mount = tree.mounts[body.name]
        turn = constant_quaternion(mount.orientation)
        orientation = turn if mount.link < 0 else rotations.quaternion_product(neutral[mount.link], turn)
        if scene.coordinates == "absolute" and joint.kind.moves:
            wanted[body.name] = orientation  # a separate coordinate
        else:
            placed = constant_quaternion(tree.algebra.matrix(joint.orientation))
            wanted[body.name] = rotations.quaternion_product(wanted[joint.parent], placed)
        along = sum(x * y for x, y in zip(orientation, wanted[body.name], strict=True))
        mounted[body.name] = [-part for part in turn] if along < 0.0 else turn
    return mounted


def twists(scene: Scene, tree: Tree, kinematics: Kinematics) -> list[Scalar]:
    """Return the inertial twist of each body's frame in body axes, (bodies, 6) row by row, angular first; rad/s,
    m/s."""
    values: list[Scalar] = []
    for body in scene.bodies:
        mount = tree.mounts[body.name]
        if mount.link < 0:
            carrier = kinematics.carrier
            omega, velocity = carrier.omega, plus(carrier.velocity, cross(carrier.omega, mount.position))
        else:
            omega, velocity = kinematics.inertial_twist(mount.link)
            velocity = plus(velocity, cross(omega, mount.position))
        back = transpose(mount.orientation)
        values += [*apply(back, omega), *apply(back, velocity)]
    return values


def accelerations(scene: Scene, tree: Tree, kinematics: Kinematics) -> list[Scalar]:
    """Return inertial angular and linear acceleration of each body's origin, in body axes, (bodies, 6) row by row."""
    values: list[Scalar] = []
    for body in scene.bodies:
        mount = tree.mounts[body.name]
        field = kinematics.field(mount.link)
        back = transpose(mount.orientation)
        values += [*apply(back, field.alpha), *apply(back, field.at(mount.position))]
    return values


#: Angular and linear part for each velocity component that moves a link.
Columns = dict[int, tuple[Vector, Vector]]


def link_columns(tree: Tree) -> list[Columns]:
    """Return for each link the partials of its twist relative to the base in v, as {velocity component: (angular,
    linear)}. All are in link axes at the link's origin; components that do not move the link are absent."""
    of_links: list[Columns] = []
    for link in tree.links:
        carried: Columns = {}
        with tree.algebra.tape.block(f"Jacobian of link {link.name}"):
            for k, (angular, linear) in (of_links[link.parent] if link.parent != ROOT else {}).items():
                moved = plus(linear, cross(angular, link.position))
                carried[k] = (link.rotation.rotate_back(angular), link.rotation.rotate_back(moved))
        ratio, still = link.coordinates.ratio, (tree.algebra.zero_vector, tree.algebra.zero_vector)
        for k, column in zip(link.dofs, link.columns, strict=True):
            angular, linear = carried.get(k, still)
            carried[k] = (plus(angular, scaled(ratio, column.angular)), plus(linear, scaled(ratio, column.linear)))
        of_links.append(carried)
    return of_links


def jacobian_of_mount(tree: Tree, columns: Sequence[Columns], mount: Mount) -> list[Scalar]:
    """Return the Jacobian of the twist of a mount on a link, in mount axes at its origin, (6, nv) row by row, angular
    first. ``columns`` is the result of ``link_columns``."""
    rows = [[tree.algebra.zero] * tree.nv for _ in range(6)]
    back = transpose(mount.orientation)
    for k, (angular, linear) in (columns[mount.link] if mount.link >= 0 else {}).items():
        moved = plus(linear, cross(angular, mount.position))
        for row, value in enumerate((*apply(back, angular), *apply(back, moved))):
            rows[row][k] = value
    return [value for row in rows for value in row]


def body_jacobians(scene: Scene, tree: Tree) -> list[Scalar]:
    """Return the Jacobian of each body's twist relative to the base, in body axes, (bodies, 6, nv), angular first."""
    columns = link_columns(tree)
    return [value for body in scene.bodies for value in jacobian_of_mount(tree, columns, tree.mounts[body.name])]
