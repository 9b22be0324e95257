"""Applied forces by virtual work: springs, dampers, actuators, forces and torques by formula, joint efforts."""

from __future__ import annotations

from eomgen.formula.nodes import Symbol
from eomgen.mechanics.forces.beams import add_structure
from eomgen.mechanics.forces.bushings import add_bushing
from eomgen.mechanics.forces.joints import add_joint
from eomgen.mechanics.forces.loads import Loads, add_effort, add_wrench, no_loads, push
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.mechanics.forces.tyres import add_tyre
from eomgen.mechanics.tree.links import WORLD_NAME, Tree
from eomgen.scene.forces.model import Force, Spring
from eomgen.scene.scene import Scene
from eomgen.symbolic.scalar import apply, cross, dot, negative, plus, scaled, transpose


def applied_loads(scene: Scene, tree: Tree, quantities: Quantities) -> Loads:
    """Return all applied loads on the tree, without gravity."""
    algebra = tree.algebra
    loads = no_loads(tree)
    for spring in scene.springs:
        with algebra.tape.block(f"spring {spring.name}"):
            _add_spring(loads, spring, quantities)
    for force in scene.forces:
        with algebra.tape.block(f"force {force.name}"):
            _add_force(loads, force, quantities)
    for joint in scene.joints:
        add_joint(loads, joint, quantities)
    for link in tree.links:
        if link.elastic is not None:
            with algebra.tape.block(f"stiffness and damping of {link.name}"):
                add_structure(loads, link.elastic, quantities)
    for torsion in scene.torsion_springs:
        with algebra.tape.block(f"torsion spring {torsion.name}"):
            angle, rate = (quantities(Symbol(kind, torsion.first, torsion.first_index)) for kind in "qv")
            if torsion.second:
                other_angle, other_rate = (quantities(Symbol(kind, torsion.second, torsion.second_index)) for kind in "qv")
                angle, rate = angle - other_angle, rate - other_rate
            stretch, stiffness = angle - quantities.formula(torsion.rest), quantities.formula(torsion.stiffness)
            damping = quantities.formula(torsion.damping)
            effort = stiffness * stretch + damping * rate
            add_effort(loads, quantities, torsion.first, -effort, torsion.first_index)
            if torsion.second:
                add_effort(loads, quantities, torsion.second, effort, torsion.second_index)
            loads.potential = loads.potential + 0.5 * (stiffness * (stretch * stretch))
            loads.power = loads.power - damping * (rate * rate)
    for bushing in scene.bushings:
        with algebra.tape.block(f"bushing {bushing.name}"):
            add_bushing(loads, bushing, quantities)
    for tyre in scene.tyres:
        with algebra.tape.block(f"tyre {tyre.name}"):
            add_tyre(loads, tyre, quantities)
    for effort_item in scene.efforts:
        with algebra.tape.block(f"effort {effort_item.name}"):
            value = quantities.formula(effort_item.effort)
            add_effort(loads, quantities, effort_item.joint, value, effort_item.index)
            loads.power = loads.power + value * quantities(Symbol("v", effort_item.joint, effort_item.index))
    return loads


def _add_spring(loads: Loads, spring: Spring, quantities: Quantities) -> None:
    mounts = quantities.tree.mounts
    if all(mounts[quantities.points[name].body].link < 0 for name in (spring.first, spring.second)):
        return  # between base and world: whoever moves the base strains it
    length, rate, direction = quantities.stretch(spring)
    tension = quantities.tension(spring)
    for what, value in (("length", length), ("rate", rate), ("tension", tension)):
        value.tape.name(value.ref, f"{what}_{spring.name}")
    pull = scaled(tension, direction)
    ends = ((spring.first, spring.second, pull), (spring.second, spring.first, negative(pull)))
    for name, other, force in ends:
        push(loads.wrenches, quantities, name, force)
        if quantities.points[other].body == WORLD_NAME:
            push(loads.external, quantities, name, force)
    stretch = length - quantities.formula(spring.length)
    loads.potential = loads.potential + 0.5 * (quantities.formula(spring.stiffness) * (stretch * stretch))
    dissipative = quantities.formula(spring.damping) * rate + quantities.formula(spring.force)
    loads.power = loads.power - dissipative * rate


def _add_force(loads: Loads, item: Force, quantities: Quantities) -> None:
    kinematics = quantities.kinematics
    point = quantities.vector(item.point)
    mount = quantities.tree.mount_at(item.body, point)
    link, s = kinematics.local(item.body, point)
    force, torque = quantities.vector(item.force), quantities.vector(item.torque)
    if link < 0:
        return
    if item.axes == "body":
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
