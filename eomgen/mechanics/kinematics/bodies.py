"""Poses and twists of all bodies in the world, for output; the quaternions' signs are continuous along motions.

Their sign at neutral coordinates is that of the joints' orientations, multiplied in the same way. It does not depend on
how the frames of links are chosen, which are turned against the bodies' where axes are skew.
"""

from __future__ import annotations

import math

from eomgen.lie import rotations
from eomgen.lie.algebra import TapeAlgebra
from eomgen.mechanics.kinematics.points import Kinematics
from eomgen.mechanics.tree.base import quaternion_product
from eomgen.mechanics.tree.links import CARRIER, ROOT, Link, Tree
from eomgen.scene.geometry.rotations import ALIKE, first_near
from eomgen.scene.scene import Scene
from eomgen.symbolic.operations import Op
from eomgen.symbolic.scalar import Matrix, Scalar, Vector, apply, cross, plus, scaled, transpose
from eomgen.system.description import BASE


def constant_quaternion(R: Matrix) -> list[float]:
    """Return the unit quaternion (w, x, y, z) of a constant rotation matrix (Shepperd's largest-component rule).

    Its w is positive; for angles within tolerance of pi, where w is about 0, the first of the largest components is, so
    that signs of poses do not change there.
    """
    m = [[entry.constant or 0.0 for entry in row] for row in R]
    squares = [
        1.0 + m[0][0] + m[1][1] + m[2][2],
        1.0 + m[0][0] - m[1][1] - m[2][2],
        1.0 - m[0][0] + m[1][1] - m[2][2],
        1.0 - m[0][0] - m[1][1] + m[2][2],
    ]
    largest = max(range(4), key=squares.__getitem__)
    scale = 0.5 / math.sqrt(squares[largest])
    pairs = {
        (0, 1): m[2][1] - m[1][2],
        (0, 2): m[0][2] - m[2][0],
        (0, 3): m[1][0] - m[0][1],
        (1, 2): m[1][0] + m[0][1],
        (1, 3): m[0][2] + m[2][0],
        (2, 3): m[2][1] + m[1][2],
    }
    quaternion = [
        squares[largest] * scale if k == largest else pairs[min(k, largest), max(k, largest)] * scale for k in range(4)
    ]
    sizes = [abs(part) for part in quaternion]
    leading = 0 if sizes[0] > ALIKE else first_near(sizes, max(sizes))
    sign = -1.0 if quaternion[leading] < 0.0 else 1.0
    return [sign * part for part in quaternion]


def _joint_quaternion(tree: Tree, link: Link) -> list[Scalar]:
    algebra = tree.algebra
    constant = [algebra.scalar(part) for part in constant_quaternion(link.orientation)]
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


def poses(scene: Scene, tree: Tree, kinematics: Kinematics) -> list[Scalar]:
    """Return quaternion (w, x, y, z; body to world) and world position, m, of each body, (bodies, 7) row by row."""
    algebra = tree.algebra
    still = [algebra.one, *algebra.zero_vector]
    root = list(kinematics.base.struct[:4]) if kinematics.base.turning else still
    carrier = list(kinematics.carrier.struct[:4]) if kinematics.carrier.turning else still
    of_links: list[list[Scalar]] = []
    for link in tree.links:
        above = root if link.parent == ROOT else of_links[link.parent]
        of_links.append(quaternion_product(above, _joint_quaternion(tree, link)))
    mounted = _mounted(scene, tree)
    values: list[Scalar] = []
    for body in scene.bodies:
        mount = tree.mounts[body.name]
        above = {ROOT: root, CARRIER: carrier}[mount.link] if mount.link < 0 else of_links[mount.link]
        values += quaternion_product(above, [algebra.scalar(part) for part in mounted[body.name]])
        values += kinematics.origin(body.name)
    return values


def _mounted(scene: Scene, tree: Tree) -> dict[str, list[float]]:
    """Return the constant quaternion of each body in its link, with the sign given by the joints' orientations."""
    neutral: list[list[float]] = []
    for link in tree.links:
        own = constant_quaternion(link.orientation)
        neutral.append(own if link.parent == ROOT else rotations.quaternion_product(neutral[link.parent], own))
    wanted = {BASE: [1.0, 0.0, 0.0, 0.0]}
    mounted: dict[str, list[float]] = {}
    for body, joint in zip(scene.bodies, scene.joints, strict=True):
        mount = tree.mounts[body.name]
        own = constant_quaternion(mount.orientation)
        orientation = own if mount.link < 0 else rotations.quaternion_product(neutral[mount.link], own)
        if scene.coordinates == "absolute" and joint.kind.moves:
            wanted[body.name] = orientation  # a coordinate of its own
        else:
            placed = constant_quaternion(tree.algebra.matrix(joint.orientation))
            wanted[body.name] = rotations.quaternion_product(wanted[joint.parent], placed)
        along = sum(x * y for x, y in zip(orientation, wanted[body.name], strict=True))
        mounted[body.name] = [-part for part in own] if along < 0.0 else own
    return mounted


def twists(scene: Scene, tree: Tree, kinematics: Kinematics) -> list[Scalar]:
    """Return the inertial twist of each body's frame in body axes, (bodies, 6) row by row, angular first."""
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
    """Return inertial angular and origin acceleration of each body in body axes, (bodies, 6) row by row."""
    values: list[Scalar] = []
    for body in scene.bodies:
        mount = tree.mounts[body.name]
        field = kinematics.field(mount.link)
        back = transpose(mount.orientation)
        values += [*apply(back, field.alpha), *apply(back, field.at(mount.position))]
    return values


#: Angular and linear part for each velocity component that moves a link.
Columns = dict[int, tuple[Vector, Vector]]


def body_jacobians(scene: Scene, tree: Tree) -> list[Scalar]:
    """Return the Jacobian of each body's twist relative to the base, in body axes, (bodies, 6, nv), angular first."""
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
    values: list[Scalar] = []
    for body in scene.bodies:
        mount = tree.mounts[body.name]
        rows = [[tree.algebra.zero] * tree.nv for _ in range(6)]
        back = transpose(mount.orientation)
        for k, (angular, linear) in (of_links[mount.link] if mount.link >= 0 else {}).items():
            moved = plus(linear, cross(angular, mount.position))
            for row, value in enumerate((*apply(back, angular), *apply(back, moved))):
                rows[row][k] = value
        values += [value for row in rows for value in row]
    return values
