"""Applied forces by virtual work: springs, dampers, actuators, forces and torques by formula, joint efforts."""

from __future__ import annotations

from dataclasses import dataclass, field

from eomgen.mechanics.formulas import record
from eomgen.mechanics.kinematics import Kinematics
from eomgen.mechanics.terms import Wrench
from eomgen.mechanics.tree import ROOT, Tree
from eomgen.scene.formula_nodes import Formula, Symbol
from eomgen.scene.scene import Force, Point, Scene, Spring
from eomgen.symbolic.scalar import (
    Algebra,
    Scalar,
    Vector,
    apply,
    cross,
    dot,
    minus,
    negative,
    plus,
    scaled,
    transpose,
)  # fmt: skip
from eomgen.symbolic.tape import Op


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


class Quantities:
    """What names in formulas mean on the tape: coordinates, points, springs, parameters, inputs and time."""

    def __init__(self, scene: Scene, tree: Tree, kinematics: Kinematics) -> None:
        self.scene = scene
        self.tree = tree
        self.kinematics = kinematics
        self.algebra: Algebra = tree.algebra
        self.factors = {link.joint.name: link.factor for link in tree.links}
        self.points = {point.name: point for point in scene.points}
        self.springs = {spring.name: spring for spring in scene.springs}
        self.input_numbers = {item.name: number for number, item in enumerate(scene.inputs)}
        self.energies: dict[str, Scalar] = {}

    def _input(self, block: str, index: int = 0) -> Scalar:
        return Scalar(self.algebra.tape, self.algebra.tape.input(block, index))

    def __call__(self, symbol: Symbol) -> Scalar:
        match symbol.kind:
            case "time":
                return self._input("t")
            case "parameter":
                return self.tree.parameters[symbol.name]
            case "input":
                return self._input("u", self.input_numbers[symbol.name])
            case "q":
                return self._input("q", self.factors[symbol.name].q_start + symbol.index)
            case "v" | "a":
                return self._input(symbol.kind, self.factors[symbol.name].v_start + symbol.index)
            case "position":
                return self.kinematics.position(*self.at(self.points[symbol.name]))[symbol.index]
            case "velocity":
                return self.kinematics.velocity(*self.at(self.points[symbol.name]))[symbol.index]
            case "acceleration":
                return self.kinematics.acceleration(*self.at(self.points[symbol.name]))[symbol.index]
            case "length":
                return self.stretch(self.springs[symbol.name])[0]
            case "rate":
                return self.stretch(self.springs[symbol.name])[1]
            case "tension":
                return self.tension(self.springs[symbol.name])
            case _:
                return self.energies[symbol.name]

    def formula(self, formula: Formula) -> Scalar:
        return record(self.algebra, formula, self)

    def vector(self, formulas: Vector | tuple[Formula, Formula, Formula]) -> Vector:
        return self.algebra.vector([self.formula(item) for item in formulas])  # type: ignore[arg-type]  # formulas

    def at(self, point: Point) -> tuple[str, Vector]:
        return point.body, self.vector(point.position)

    def stretch(self, spring: Spring) -> tuple[Scalar, Scalar, Vector]:
        """Return length, rate of length, and unit vector from first to second point in base axes."""
        first, second = self.at(self.points[spring.first]), self.at(self.points[spring.second])
        span = minus(self.kinematics.position_in_base(*second), self.kinematics.position_in_base(*first))
        speed = minus(self.kinematics.velocity_in_base(*second), self.kinematics.velocity_in_base(*first))
        length = self.algebra.call(Op.SQRT, dot(span, span))
        direction = scaled(self.algebra.one / length, span)
        return length, dot(direction, speed), direction

    def tension(self, spring: Spring) -> Scalar:
        length, rate, _ = self.stretch(spring)
        elastic = self.formula(spring.stiffness) * (length - self.formula(spring.length))
        return elastic + self.formula(spring.damping) * rate + self.formula(spring.force)


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
    for link in tree.links:
        _add_joint(loads, scene, link.joint.name, quantities)
    for torsion in scene.torsion_springs:
        with algebra.tape.block(f"torsion spring {torsion.name}"):
            first, second = quantities.factors[torsion.first], quantities.factors.get(torsion.second)
            angle, rate = quantities(Symbol("q", torsion.first)), quantities(Symbol("v", torsion.first))
            if second is not None:
                angle, rate = angle - quantities(Symbol("q", torsion.second)), rate - quantities(Symbol("v", torsion.second))
            stretch, stiffness = angle - quantities.formula(torsion.rest), quantities.formula(torsion.stiffness)
            damping = quantities.formula(torsion.damping)
            effort = stiffness * stretch + damping * rate
            loads.efforts[first.v_start] = loads.efforts[first.v_start] - effort
            if second is not None:
                loads.efforts[second.v_start] = loads.efforts[second.v_start] + effort
            loads.potential = loads.potential + 0.5 * (stiffness * (stretch * stretch))
            loads.power = loads.power - damping * (rate * rate)
    for effort_item in scene.efforts:
        with algebra.tape.block(f"effort {effort_item.name}"):
            dof = quantities.factors[effort_item.joint].v_start + effort_item.index
            value = quantities.formula(effort_item.effort)
            loads.efforts[dof] = loads.efforts[dof] + value
            loads.power = loads.power + value * Scalar(algebra.tape, algebra.tape.input("v", dof))
    return loads


def _add_joint(loads: Loads, scene: Scene, name: str, quantities: Quantities) -> None:
    joint = next(item for item in scene.joints if item.name == name)
    stiffness, damping = quantities.formula(joint.stiffness), quantities.formula(joint.damping)
    if stiffness.is_zero and damping.is_zero:
        return
    dof = quantities.factors[name].v_start
    with quantities.algebra.tape.block(f"spring and damper of joint {name}"):
        stretch = quantities(Symbol("q", name)) - quantities.formula(joint.rest)
        rate = quantities(Symbol("v", name))
        loads.efforts[dof] = loads.efforts[dof] - (stiffness * stretch + damping * rate)
        loads.potential = loads.potential + 0.5 * (stiffness * (stretch * stretch))
        loads.power = loads.power - damping * (rate * rate)


def _add_spring(loads: Loads, spring: Spring, quantities: Quantities) -> None:
    length, rate, direction = quantities.stretch(spring)
    pull = scaled(quantities.tension(spring), direction)
    for name, force in ((spring.first, pull), (spring.second, negative(pull))):
        _push(loads.wrenches, quantities, name, force)
    stretch = length - quantities.formula(spring.length)
    loads.potential = loads.potential + 0.5 * (quantities.formula(spring.stiffness) * (stretch * stretch))
    dissipative = quantities.formula(spring.damping) * rate + quantities.formula(spring.force)
    loads.power = loads.power - dissipative * rate


def _push(wrenches: list[Wrench | None], quantities: Quantities, name: str, force_in_base: Vector) -> None:
    link, s = quantities.kinematics.local(*quantities.at(quantities.points[name]))
    if link != ROOT:
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
    if link == ROOT:
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
