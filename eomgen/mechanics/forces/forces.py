"""Forces and torques on bodies, by formulas."""

from __future__ import annotations

from eomgen.formula.evaluate import symbols
from eomgen.mechanics.forces.loads import Law, Loads, add_wrench
from eomgen.mechanics.forces.local_quantities import Local
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.scene.forces.forces import Force
from eomgen.symbolic.scalar import Vector, apply, cross, dot, multiply, plus, transpose


def add_force(loads: Loads, item: Force, quantities: Quantities) -> None:
    """Add a force and a torque on a body, and their power."""
    point, own_axes = quantities.vector(item.point), item.axes == "body"
    if any(symbol.kind == "local" for formula in (*item.force, *item.torque) for symbol in symbols(formula)):
        if quantities.tree.mount_at(item.body, point).link < 0:
            return
        local = _local(quantities, item.body, point, own_axes=own_axes)
        force, torque = local.vector(item.force), local.vector(item.torque)
        own_axes = True
    else:
        force, torque = quantities.vector(item.force), quantities.vector(item.torque)
    add_load(loads, quantities, item.body, point, force, torque, own_axes=own_axes)


def _local(quantities: Quantities, body: str, point: Vector, *, own_axes: bool) -> Local:
    """Return the frame of a body at one of its points."""
    kinematics, mount = quantities.kinematics, quantities.tree.mount_at(body, point)
    link, s = kinematics.local(body, point)
    axes = multiply(kinematics.base.orientation, multiply(kinematics.pose(link)[0], mount.orientation))
    omega, velocity = kinematics.inertial_twist(link)
    back, moving = transpose(mount.orientation), plus(velocity, cross(omega, s))
    position = kinematics.position(body, point)
    return Local(quantities.algebra, axes, position, apply(back, omega), apply(back, moving), own_axes, quantities)


def add_load(
    loads: Loads, quantities: Quantities, body: str, point: Vector, force: Vector, torque: Vector, *, own_axes: bool
) -> None:
    """Add a force, N, at a point of a body, m, a torque, N m, and their power; in axes of the world or its own."""
    kinematics = quantities.kinematics
    mount = quantities.tree.mount_at(body, point)
    link, s = kinematics.local(body, point)
    if link < 0:
        return
    if own_axes:
        force, torque = apply(mount.orientation, force), apply(mount.orientation, torque)
    else:
        to_link = transpose(kinematics.pose(link)[0])
        to_base = transpose(kinematics.base.orientation)
        force, torque = apply(to_link, apply(to_base, force)), apply(to_link, apply(to_base, torque))
    load = (plus(torque, cross(s, force)), force)
    add_wrench(loads.wrenches, link, load)
    add_wrench(loads.external, link, load)
    omega, velocity = kinematics.inertial_twist(link)
    loads.power = loads.power + dot(load[0], omega) + dot(load[1], velocity)


LAW = Law(Force, add_force, before_joints=True)
