"""Tyres: the normal force of a point contact that can lift off, and where asked slip forces that saturate at the friction.

Slip follows the usual definitions (Pacejka, Tire and Vehicle Dynamics, 2012, section 1.2), with a speed added to the rolling one
so that a wheel at rest has a force too; forces grow in proportion to slip and load and approach friction times load smoothly.
"""

from __future__ import annotations

from eomgen.mechanics.forces.loads import Loads, add_wrench
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.mechanics.forces.tyre_contact import TyreContact, tyre_contact
from eomgen.scene.forces.elements import Slip, Tyre
from eomgen.symbolic.scalar import Vector, apply, cross, dot, minus, multiply, plus, scaled, transpose
from eomgen.symbolic.tape import Op


def add_tyre(loads: Loads, tyre: Tyre, quantities: Quantities) -> None:
    """Add the forces of a tyre on its wheel, their potential and power.

    On a road at rest the spring's part has a potential. A road that moves does work on the tyre, so there all of it is power.
    """
    algebra, kinematics = quantities.algebra, quantities.kinematics
    link, s = kinematics.local(*quantities.at(quantities.points[tyre.center]))
    if link < 0:
        return  # on a body that is fixed to the base
    state = tyre_contact(quantities, tyre)
    normal = scaled(state.contact.force, state.gradient)
    if tyre.moving_road:
        loads.power = loads.power + dot(normal, state.velocity)
    else:
        loads.potential = loads.potential + state.contact.potential
        loads.power = loads.power - (state.contact.force - state.contact.elastic) * state.rate
    force, moment = normal, algebra.zero_vector
    to_world = multiply(kinematics.base.orientation, kinematics.pose(link)[0])
    if tyre.slip is not None:
        arm, patch_velocity, grip = _slip(quantities, tyre, tyre.slip, state)
        loads.power = loads.power + dot(grip, patch_velocity)
        force, moment = plus(normal, grip), cross(arm, grip)
    to_link = transpose(to_world)
    force, moment = apply(to_link, force), apply(to_link, moment)
    load = (plus(moment, cross(s, force)), force)
    add_wrench(loads.wrenches, link, load)
    add_wrench(loads.external, link, load)


def _slip(quantities: Quantities, tyre: Tyre, slip: Slip, state: TyreContact) -> tuple[Vector, Vector, Vector]:
    """Return the contact from the centre, the velocity of its material point, and the force in the road's plane; world axes."""
    algebra, kinematics = quantities.algebra, quantities.kinematics
    mount = kinematics.tree.mount_at(*quantities.at(quantities.points[tyre.center]))
    up = scaled(algebra.one / state.steepness, state.gradient)
    to_world = multiply(kinematics.base.orientation, kinematics.pose(mount.link)[0])
    axis = apply(to_world, apply(mount.orientation, algebra.vector(slip.axis)))
    sideways = minus(axis, scaled(dot(axis, up), up))
    sideways = scaled(algebra.one / algebra.call(Op.SQRT, dot(sideways, sideways)), sideways)
    forward = cross(sideways, up)
    arm = scaled(state.deflection - quantities.formula(tyre.radius), up)
    omega, _ = kinematics.inertial_twist(mount.link)
    omega = apply(to_world, omega)
    patch_velocity = plus(state.velocity, cross(omega, arm))
    rolling, at_rest = dot(state.velocity, forward), quantities.formula(slip.velocity)
    speed = algebra.call(Op.SQRT, rolling * rolling + at_rest * at_rest)
    asked = [
        quantities.formula(stiffness) * dot(patch_velocity, direction) / speed
        for stiffness, direction in zip(slip.stiffness, (forward, sideways), strict=True)
    ]
    limit = quantities.formula(slip.friction)
    share = dot(asked, asked) / (limit * limit)
    size = -(state.load / algebra.call(Op.SQRT, share + 1.0))
    return arm, patch_velocity, scaled(size, plus(scaled(asked[0], forward), scaled(asked[1], sideways)))
