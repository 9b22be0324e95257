"""Applied forces by virtual work: springs, dampers, actuators, forces and torques by formula, joint efforts."""

from __future__ import annotations

from dataclasses import dataclass, field

from eomgen.mechanics.quantities import Quantities
from eomgen.mechanics.terms import Wrench
from eomgen.mechanics.tree import WORLD_NAME, Tree
from eomgen.scene.formula_nodes import Symbol
from eomgen.scene.scene import Force, Joint, Scene, Spring
from eomgen.symbolic.scalar import (
    Scalar,
    Vector,
    apply,
    cross,
    dot,
    negative,
    plus,
    scaled,
    transpose,
)  # fmt: skip


@dataclass
class Loads:
    """What acts on the tree besides gravity.

    Attributes
    ----------
    wrenches : by link; moment about the link's origin and force, in link axes; None where nothing acts
    efforts : by velocity component
    potential : energy of springs, J
    power : of everything that is not conservative, W (dampers, actuators, formulas)
    """

    wrenches: list[Wrench | None]
    efforts: list[Scalar]
    potential: Scalar
    power: Scalar
    external: list[Wrench | None] = field(default_factory=list)


def applied_loads(scene: Scene, tree: Tree, quantities: Quantities) -> Loads:
    """Return everything that acts on the tree, gravity excepted."""
    algebra = tree.algebra
    loads = Loads([None] * len(tree.links), [algebra.zero] * tree.nv, algebra.zero, algebra.zero, [None] * len(tree.links))
    for spring in scene.springs:
        with algebra.tape.block(f"spring {spring.name}"):
            _add_spring(loads, spring, quantities)
    for force in scene.forces:
        with algebra.tape.block(f"force {force.name}"):
            _add_force(loads, force, quantities)
    for joint in scene.joints:
        _add_joint(loads, joint, quantities)
    for torsion in scene.torsion_springs:
        with algebra.tape.block(f"torsion spring {torsion.name}"):
            angle, rate = quantities(Symbol("q", torsion.first)), quantities(Symbol("v", torsion.first))
            if torsion.second:
                angle, rate = angle - quantities(Symbol("q", torsion.second)), rate - quantities(Symbol("v", torsion.second))
            stretch, stiffness = angle - quantities.formula(torsion.rest), quantities.formula(torsion.stiffness)
            damping = quantities.formula(torsion.damping)
            effort = stiffness * stretch + damping * rate
            _add_effort(loads, quantities, torsion.first, -effort)
            if torsion.second:
                _add_effort(loads, quantities, torsion.second, effort)
            loads.potential = loads.potential + 0.5 * (stiffness * (stretch * stretch))
            loads.power = loads.power - damping * (rate * rate)
    for effort_item in scene.efforts:
        with algebra.tape.block(f"effort {effort_item.name}"):
            value = quantities.formula(effort_item.effort)
            _add_effort(loads, quantities, effort_item.joint, value, effort_item.index)
            loads.power = loads.power + value * quantities(Symbol("v", effort_item.joint, effort_item.index))
    return loads


def _add_effort(loads: Loads, quantities: Quantities, joint: str, value: Scalar, index: int = 0) -> None:
    for dof, factor in quantities.work_of(joint, index).items():
        loads.efforts[dof] = loads.efforts[dof] + factor * value


def _add_joint(loads: Loads, joint: Joint, quantities: Quantities) -> None:
    name = joint.name
    stiffness, damping = quantities.formula(joint.stiffness), quantities.formula(joint.damping)
    if stiffness.is_zero and damping.is_zero:
        return
    with quantities.algebra.tape.block(f"spring and damper of joint {name}"):
        stretch = quantities(Symbol("q", name)) - quantities.formula(joint.rest)
        rate = quantities(Symbol("v", name))
        _add_effort(loads, quantities, name, -(stiffness * stretch + damping * rate))
        loads.potential = loads.potential + 0.5 * (stiffness * (stretch * stretch))
        loads.power = loads.power - damping * (rate * rate)


def _add_spring(loads: Loads, spring: Spring, quantities: Quantities) -> None:
    length, rate, direction = quantities.stretch(spring)
    pull = scaled(quantities.tension(spring), direction)
    ends = ((spring.first, spring.second, pull), (spring.second, spring.first, negative(pull)))
    for name, other, force in ends:
        _push(loads.wrenches, quantities, name, force)
        if quantities.points[other].body == WORLD_NAME:
            _push(loads.external, quantities, name, force)
    stretch = length - quantities.formula(spring.length)
    loads.potential = loads.potential + 0.5 * (quantities.formula(spring.stiffness) * (stretch * stretch))
    dissipative = quantities.formula(spring.damping) * rate + quantities.formula(spring.force)
    loads.power = loads.power - dissipative * rate


def _push(wrenches: list[Wrench | None], quantities: Quantities, name: str, force_in_base: Vector) -> None:
    link, s = quantities.kinematics.local(*quantities.at(quantities.points[name]))
    if link >= 0:
        force = apply(transpose(quantities.kinematics.pose(link)[0]), force_in_base)
        _add_wrench(wrenches, link, (cross(s, force), force))


def _add_wrench(wrenches: list[Wrench | None], link: int, load: Wrench) -> None:
    present = wrenches[link]
    wrenches[link] = load if present is None else (plus(present[0], load[0]), plus(present[1], load[1]))


def _add_force(loads: Loads, item: Force, quantities: Quantities) -> None:
    kinematics = quantities.kinematics
    mount = quantities.tree.mounts[item.body]
    link, s = kinematics.local(item.body, quantities.vector(item.point))
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
    _add_wrench(loads.wrenches, link, load)
    _add_wrench(loads.external, link, load)
    omega, velocity = kinematics.inertial_twist(link)
    loads.power = loads.power + dot(load[0], omega) + dot(load[1], velocity)
