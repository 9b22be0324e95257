"""Poses and twists of all bodies in the world, for output: quaternions multiplied along the tree, so their sign never jumps."""

from __future__ import annotations

import math

from eomgen.lie.algebra import TapeAlgebra
from eomgen.lie.rotations import exponential
from eomgen.mechanics.base import quaternion_product
from eomgen.mechanics.joints import TURNING
from eomgen.mechanics.kinematics import Kinematics
from eomgen.mechanics.tree import CARRIER, ROOT, Link, Tree
from eomgen.scene.scene import Scene
from eomgen.symbolic.scalar import Matrix, Scalar, apply, cross, plus, transpose
from eomgen.symbolic.tape import Op


def constant_quaternion(R: Matrix) -> list[float]:
    """Return the unit quaternion (w, x, y, z), w >= 0, of a constant rotation matrix (Shepperd's largest-component rule)."""
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
        (0, 1): m[2][1] - m[1][2], (0, 2): m[0][2] - m[2][0], (0, 3): m[1][0] - m[0][1],
        (1, 2): m[1][0] + m[0][1], (1, 3): m[0][2] + m[2][0], (2, 3): m[2][1] + m[1][2],
    }  # fmt: skip
    quaternion = [
        squares[largest] * scale if k == largest else pairs[min(k, largest), max(k, largest)] * scale for k in range(4)
    ]
    sign = -1.0 if quaternion[0] < 0 else 1.0
    return [sign * part for part in quaternion]


def _joint_quaternion(tree: Tree, link: Link) -> list[Scalar]:
    algebra = tree.algebra
    constant = [algebra.scalar(part) for part in constant_quaternion(link.orientation)]
    q = link.coordinates.q
    if link.kind in TURNING:
        half = q[0] * 0.5
        sine = algebra.call(Op.SIN, half)
        axis = link.columns[0].angular
        return quaternion_product(constant, [algebra.call(Op.COS, half), *(component * sine for component in axis)])
    if link.kind in ("prismatic", "elastic"):
        return constant
    if link.station is not None:
        on_tape = TapeAlgebra(algebra.tape)
        return quaternion_product(constant, [on_tape.scalar(part) for part in exponential(on_tape, link.station.angle)])
    return quaternion_product(constant, list(q[:4]))


def poses(scene: Scene, tree: Tree, kinematics: Kinematics) -> list[Scalar]:
    """Return quaternion (body to world) and position of each body of the scene, 7 numbers each."""
    algebra = tree.algebra
    still = [algebra.one, *algebra.zero_vector]
    root = algebra.block("base", 4) if kinematics.base.turning else still
    carrier = algebra.block("base", 4) if kinematics.carrier.turning else still
    of_links: list[list[Scalar]] = []
    for link in tree.links:
        above = root if link.parent == ROOT else of_links[link.parent]
        of_links.append(quaternion_product(above, _joint_quaternion(tree, link)))
    values: list[Scalar] = []
    for body in scene.bodies:
        mount = tree.mounts[body.name]
        above = {ROOT: root, CARRIER: carrier}[mount.link] if mount.link < 0 else of_links[mount.link]
        constant = [algebra.scalar(part) for part in constant_quaternion(mount.orientation)]
        values += quaternion_product(above, constant)
        values += kinematics.origin(body.name)
    return values


def twists(scene: Scene, tree: Tree, kinematics: Kinematics) -> list[Scalar]:
    """Return the inertial twist of each body in its own axes, 6 numbers each, angular first."""
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
    """Return angular acceleration of each body and acceleration of its origin, inertial, in its own axes, 6 numbers each."""
    values: list[Scalar] = []
    for body in scene.bodies:
        mount = tree.mounts[body.name]
        field = kinematics.field(mount.link)
        back = transpose(mount.orientation)
        values += [*apply(back, field.alpha), *apply(back, field.at(mount.position))]
    return values
