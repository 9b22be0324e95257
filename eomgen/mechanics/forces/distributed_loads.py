"""Distributed loads on beams by virtual work: integrals of the shape functions against the load's profile.

With w = p(s) f the virtual work is f . delta int p r dx, r being the deformed axis: the integrals over p are those
that the beam's mass has over its mass per length, exact, the shortening of the bent axis among them.
"""

from __future__ import annotations

from fractions import Fraction

from eomgen.formula.nodes import ZERO_VECTOR
from eomgen.mechanics.forces.forces import add_load
from eomgen.mechanics.forces.loads import Law, Loads, add_wrench
from eomgen.mechanics.forces.node_loads import add_local_load, is_local
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.mechanics.tree.beam_fields import DistributedMass
from eomgen.scene.forces.distributed_loads import DistributedLoad
from eomgen.symbolic.scalar import apply, cross, dot, plus, scaled, transpose


def add_distributed_load(loads: Loads, item: DistributedLoad, quantities: Quantities) -> None:
    """Add a load on a beam's frame and on its elastic coordinates, or on its nodes, and its power."""
    if is_local(item):
        add_local_load(loads, item, quantities)
        return
    if item.nodes:
        _add_to_nodes(loads, item, quantities)
        return
    algebra, tree, kinematics = quantities.algebra, quantities.tree, quantities.kinematics
    mount, force = tree.mounts[item.beam], quantities.vector(item.force)
    if mount.link < 0:
        return
    body = tree.links[mount.link].elastic
    if item.axes == "beam":
        force = apply(mount.orientation, force)
    else:
        to_link = transpose(kinematics.pose(mount.link)[0])
        force = apply(to_link, apply(transpose(kinematics.base.orientation), force))
    total, first = _moments(item)
    straight = apply(mount.orientation, algebra.vector([first, 0.0, 0.0]))
    arm = plus(scaled(algebra.one * total, mount.position), straight)
    if body is not None:
        from eomgen.mechanics.shape_functions.integrals import weighted_integrals  # noqa: PLC0415  # imports SciPy

        over = DistributedMass(algebra, weighted_integrals(body.beam, item.profile), 1.0, second_order=False)
        x, y, z = (over.first(component) for component in body.deflections.position())
        arm = plus(arm, (x, y, z))
        for k, (dof, rate) in enumerate(zip(body.coordinates.dofs, body.coordinates.v, strict=True)):
            x, y, z = (over.first(component) for component in body.deflections.variation(k))
            work = dot(force, (x, y, z))
            loads.efforts[dof] = loads.efforts[dof] + work
            loads.power = loads.power + rate * work
    load = (cross(arm, force), scaled(algebra.one * total, force))
    add_wrench(loads.wrenches, mount.link, load)
    add_wrench(loads.external, mount.link, load)
    omega, velocity = kinematics.inertial_twist(mount.link)
    loads.power = loads.power + dot(load[0], omega) + dot(load[1], velocity)


def _add_to_nodes(loads: Loads, item: DistributedLoad, quantities: Quantities) -> None:
    algebra = quantities.algebra
    for load in item.nodes:
        force, moment = (
            scaled(algebra.scalar(load.weight), quantities.vector(vector)) for vector in (load.force, load.moment)
        )
        origin = quantities.vector(ZERO_VECTOR)
        add_load(loads, quantities, load.node, origin, force, moment, own_axes=item.axes == "beam")


def _moments(item: DistributedLoad) -> tuple[float, float]:
    """Return the integrals of the profile, m, and of the profile times x, m^2, along the straight beam."""
    start, length = Fraction(item.start), Fraction(item.length)
    profile = [Fraction(entry) for entry in item.profile]
    zeroth = sum((entry / (power + 1) for power, entry in enumerate(profile)), Fraction(0))
    first = sum((entry / (power + 2) for power, entry in enumerate(profile)), Fraction(0))
    return float(length * zeroth), float(length * (start * zeroth + length * first))


LAW = Law(DistributedLoad, add_distributed_load, before_joints=True)
