"""Bushings: springs and dampers in all six directions between two frames, by the virtual work of one potential.

The deformation e = (phi, d) is seen from the first frame: phi is the rotation vector of the second frame against its
rest, d the displacement of its origin. The potential is e.K e / 2 - p.e, the damper's force is -D e'; so both hold at
large rotations. With w the relative angular velocity in the first frame's axes, phi' = T(phi)^-T w: Bruls, Cardona and
Arnold, Mech. Mach. Theory 48 (2012) 121, with the transpose because w is the spatial one.
"""

from __future__ import annotations

from collections.abc import Sequence

from eomgen.lie import rotations
from eomgen.mechanics.forces.frame_pairs import FramePose, frame_pose
from eomgen.mechanics.forces.loads import Law, Loads, add_wrench
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.mechanics.kinematics.points import rotation_vector
from eomgen.mechanics.tree.links import WORLD_NAME
from eomgen.scene.forces.bushings import Bushing
from eomgen.symbolic.scalar import Scalar, Vector, apply, cross, dot, minus, multiply, negative, plus, transpose

Rows = list[list[Scalar]]


def add_bushing(loads: Loads, bushing: Bushing, quantities: Quantities) -> None:
    """Add to ``loads``, in place, the wrenches of a bushing on both bodies, the potential energy, J, and the power, W.
    A bushing between base and world adds none. The power is minus the dissipated power."""
    algebra = quantities.algebra
    if all(quantities.mount(frame).link < 0 for frame in (bushing.first, bushing.second)):
        return  # between base and world: strained by the prescribed motion of the base
    K, D = (
        [[quantities.formula(entry) for entry in row] for row in rows] for rows in (bushing.stiffness, bushing.damping)
    )
    preload = [quantities.formula(entry) for entry in bushing.preload]
    first, second = frame_pose(quantities, bushing.first), frame_pose(quantities, bushing.second)
    to_first = transpose(first.axes)
    shift = minus(apply(to_first, minus(second.origin, first.origin)), quantities.vector(bushing.rest))
    turning, moving = _relative_motion(quantities, bushing, second)
    turning, moving = apply(to_first, turning), apply(to_first, moving)
    turns = any(not entry.is_zero for row in (*K[:3], *D[:3], preload[:3]) for entry in row)
    angle, angle_rate, pull_back = algebra.zero_vector, algebra.zero_vector, algebra.identity
    if turns:
        relative_orientation = multiply(
            multiply(to_first, second.axes), transpose(algebra.matrix(bushing.rest_orientation))
        )
        angle = rotation_vector(algebra, relative_orientation)
        pull_back = algebra.matrix(rotations.tangent_inverse(angle))
        angle_rate = apply(transpose(pull_back), turning)
    e, rate = [*angle, *shift], [*angle_rate, *moving]
    elastic, viscous = _product(K, e), _product(D, rate)
    response = [pre - spring - damper for pre, spring, damper in zip(preload, elastic, viscous, strict=True)]
    moment = apply(first.axes, apply(pull_back, _vector(response[:3])))
    force = apply(first.axes, _vector(response[3:]))
    for here, there, sign in ((bushing.second, bushing.first, 1.0), (bushing.first, bushing.second, -1.0)):
        link = quantities.mount(here).link
        if link < 0:  # base and world take no load
            continue
        R, origin = quantities.kinematics.pose(link)
        turn, push = (moment, force) if sign > 0 else (negative(moment), negative(force))
        back = transpose(R)
        wrench = (apply(back, plus(turn, cross(minus(second.origin, origin), push))), apply(back, push))
        add_wrench(loads.wrenches, link, wrench)
        if there.body == WORLD_NAME:
            add_wrench(loads.external, link, wrench)
    loads.potential = loads.potential + 0.5 * dot(e, elastic) - dot(preload, e)
    loads.power = loads.power - dot(rate, viscous)


def _relative_motion(quantities: Quantities, bushing: Bushing, second: FramePose) -> tuple[Vector, Vector]:
    """Return angular velocity, rad/s, and velocity, m/s, (3,) each, of the second body relative to the first, in base
    axes. Velocities are taken at the second frame's origin."""
    motions, kinematics = [], quantities.kinematics
    for frame in (bushing.first, bushing.second):
        link = quantities.mount(frame).link
        R, origin = kinematics.pose(link)
        omega, velocity = (apply(R, part) for part in kinematics.twist(link))
        motions.append((omega, plus(velocity, cross(omega, minus(second.origin, origin)))))
    (turn_first, move_first), (turn_second, move_second) = motions
    return minus(turn_second, turn_first), minus(move_second, move_first)


def _product(rows: Rows, values: Sequence[Scalar]) -> list[Scalar]:
    return [dot(row, values) for row in rows]


def _vector(values: Sequence[Scalar]) -> Vector:
    return (values[0], values[1], values[2])


LAW = Law(Bushing, add_bushing)
