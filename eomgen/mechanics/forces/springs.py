"""Springs, dampers and actuators along the line between two points, many alike as one loop, and torsional ones
between the angles of joints.

A spring depends only on the poses and twists of the two links that it joins. In a net or a lattice these come in a
few kinds, so each kind is one ``Map`` with columns for its numbers (points, stiffnesses, lengths), and
its tangents are Maps as well. Actuators by formula stay alone, since a formula may read anything.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain

from eomgen.base.data import dataclass
from eomgen.errors import ModelError, Problem
from eomgen.formula.nodes import ZERO, Symbol
from eomgen.mechanics.forces.cosserat_beams import POSE, TWIST, LoopInputs, SectionFrame
from eomgen.mechanics.forces.loads import Law, Loads, add_effort, add_wrench, push
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.mechanics.kinematics.fields import Wrench
from eomgen.mechanics.tree.alike import FEWEST
from eomgen.mechanics.tree.links import ROOT, WORLD_NAME
from eomgen.scene.forces.springs import Spring, TorsionSpring
from eomgen.symbolic.map import Map, add_map
from eomgen.symbolic.scalar import (
    Algebra,
    Scalar,
    Vector,
    all_zero,
    apply,
    cross,
    dot,
    minus,
    negative,
    plus,
    scaled,
    transpose,
)
from eomgen.symbolic.tape import Tape

#: Numbers of the frame of a link, and of an end of a spring: the frame and a place.
_NODE = POSE + TWIST
_END = _NODE + 3
#: Kinds and freedoms of the links from a link to the base.
Chain = tuple[tuple[str, int], ...]


@dataclass(frozen=True)
class _SpringEnd:
    """The end of a spring: a link, negative for base and world, and a place in axes of the link."""

    body: str
    link: int
    position: Vector


def add_loops(loads: Loads, springs: Sequence[Spring], quantities: Quantities) -> list[Spring]:
    """Add springs as loops to ``loads``, in place, and return the springs that are left to be recorded one by one. A
    loop has at least ``FEWEST`` springs that differ in numbers alone; springs with an actuator are left."""
    kinds: dict[object, list[tuple[Spring, _SpringEnd, _SpringEnd]]] = {}
    alone: list[Spring] = []
    chains: dict[int, Chain] = {ROOT: ()}
    for spring in springs:
        if spring.force != ZERO:
            alone.append(spring)
            continue
        ends = _end(quantities, spring.first), _end(quantities, spring.second)
        links = [_chain(quantities, end.link, chains) for end in ends]
        freedoms = [sum(size for _, size in carried) for carried in links]
        if ends[0].link == ends[1].link or max(freedoms) > TWIST:  # more than a free body has
            alone.append(spring)
            continue
        still = tuple(min(end.link, 0) for end in ends)
        damped = not quantities.formula(spring.damping).is_zero
        of_length = not quantities.formula(spring.length).is_zero
        kinds.setdefault((tuple(links), still, damped, of_length), []).append((spring, *ends))
    for members in kinds.values():
        if len(members) < FEWEST:
            alone += [spring for spring, _, _ in members]
        else:
            _SpringKind(quantities, members).add(loads)
    return alone


def _end(quantities: Quantities, name: str) -> _SpringEnd:
    """Return the end of a spring at the point of the given name. At the centre of a ball joint, the end is moved to the
    link that carries the ball."""
    body, r = quantities.at(quantities.points[name])
    link, point = quantities.kinematics.local(body, r)
    while link >= 0 and quantities.tree.links[link].kind == "ball" and all_zero(point):
        link, point = quantities.tree.links[link].parent, quantities.tree.links[link].position
    return _SpringEnd(body, link, point)


def _chain(quantities: Quantities, link: int, known: dict[int, Chain]) -> Chain:
    """Return (kind, number of velocity components) of each link from a link to the base; cached in ``known``."""
    if link < 0:
        return ()
    if link not in known:
        frame = quantities.tree.links[link]
        known[link] = ((frame.kind, len(frame.dofs)), *_chain(quantities, frame.parent, known))
    return known[link]


class _SpringKind:
    """Springs that differ in numbers alone, recorded as loops."""

    def __init__(self, quantities: Quantities, members: Sequence[tuple[Spring, _SpringEnd, _SpringEnd]]) -> None:
        # in the order of the bodies, so that springs of a row of a net are neighbours
        self.quantities = quantities
        self.members = sorted(members, key=lambda item: sorted((item[1].link, item[2].link), reverse=True))
        self.names = f"{members[0][0].name} to {members[-1][0].name}"
        rows = [
            [*self._node(first), *self._node(second), *map(quantities.formula, (s.stiffness, s.damping, s.length))]
            for s, first, second in self.members
        ]
        algebra = Algebra(Tape())
        self.inputs = LoopInputs(algebra, [])
        numbers = [self.inputs.number(entries) for entries in zip(*rows, strict=True)]
        ends = [numbers[start : start + _END] for start in (0, _END)]
        self.results = _results(algebra, ends, numbers[2 * _END :])

    def _node(self, end: _SpringEnd) -> list[Scalar]:
        """Return orientation, origin and twist of the link at an end, and the position of the end in link axes: 21
        numbers."""
        orientation, origin = self.quantities.kinematics.pose(end.link)
        omega, velocity = self.quantities.kinematics.twist(end.link)
        return [*chain.from_iterable(orientation), *origin, *omega, *velocity, *end.position]

    def add(self, loads: Loads) -> None:
        """Add to ``loads``, in place, the forces of all springs, the potential energy and the power of dampers."""
        (of_first, of_second), potential, power = self.results
        wrenches = [part for load in (of_first, of_second) for part in chain.from_iterable(load)]
        rows = add_map(self.quantities.algebra.tape, self._loop("forces", stacked=wrenches)).rows
        for (_, *ends), row in zip(self.members, rows, strict=True):
            for end, opposite, start in zip(ends, reversed(ends), (0, 6), strict=True):
                if end.link >= 0:
                    x, y, z, *force = (Scalar(self.quantities.algebra.tape, ref) for ref in row[start : start + 6])
                    load = (x, y, z), (force[0], force[1], force[2])
                    add_wrench(loads.wrenches, end.link, load)
                    if opposite.body == WORLD_NAME:
                        add_wrench(loads.external, end.link, load)
        loads.potential = loads.potential + self._sum("energy", potential)
        loads.power = loads.power - self._sum("power of dampers", power)

    def _sum(self, label: str, term: Scalar) -> Scalar:
        tape = self.quantities.algebra.tape
        return Scalar(tape, add_map(tape, self._loop(label, sums=[term])).sums[0])

    def _loop(self, label: str, **results: Sequence[Scalar]) -> Map:
        count = len(self.members)
        return self.inputs.loop(count, f"{label} of {count} springs, {self.names}", **results)


def _results(
    algebra: Algebra, ends: Sequence[Sequence[Scalar]], law: Sequence[Scalar]
) -> tuple[tuple[Wrench, Wrench], Scalar, Scalar]:
    """Return the wrenches on both links, moment first, in link axes about the origins of the links; the potential, J;
    and the dissipated power, W, of one spring. ``ends`` have 21 numbers each, ``law`` is stiffness, damping and free
    length."""
    nodes = [SectionFrame.of(numbers[:_NODE]) for numbers in ends]
    places: list[Vector] = [(numbers[_NODE], numbers[_NODE + 1], numbers[_NODE + 2]) for numbers in ends]
    positions, velocities = [], []
    for node, point in zip(nodes, places, strict=True):
        # ``SectionFrame.axes`` are the rows of the orientation here, since poses are given as matrices
        positions.append(plus(node.origin, apply(node.axes, point)))
        velocities.append(apply(node.axes, plus(node.velocity, cross(node.omega, point))))
    stiffness, damping, slack = law
    span = minus(positions[1], positions[0])
    if slack.is_zero and damping.is_zero:  # the force of points that meet is 0, and needs no direction
        pull, potential, power = scaled(stiffness, span), 0.5 * (stiffness * dot(span, span)), algebra.zero
    else:
        length = algebra.length(span)
        direction = scaled(algebra.one / length, span)
        rate = dot(direction, minus(velocities[1], velocities[0]))
        extension = length - slack
        pull = scaled(stiffness * extension + damping * rate, direction)
        potential, power = 0.5 * (stiffness * (extension * extension)), damping * rate * rate
    wrenches = []
    for node, point, sign in zip(nodes, places, (algebra.one, -algebra.one), strict=True):
        force = apply(transpose(node.axes), scaled(sign, pull))
        wrenches.append((cross(point, force), force))
    return (wrenches[0], wrenches[1]), potential, power


def stretch(quantities: Quantities, spring: Spring) -> tuple[Scalar, Scalar, Vector]:
    """Return length, m, rate of length, m/s, and unit vector from first to second point, (3,), in base axes."""
    span, speed = _span(quantities, spring)
    length = quantities.algebra.length(span)
    inverse = quantities.algebra.one / length
    inverse.tape.name(inverse.ref, f"inverse_length_{spring.name}")
    direction = quantities.algebra.named(f"direction_{spring.name}", scaled(inverse, span))
    return length, dot(direction, speed), direction


def _span(quantities: Quantities, spring: Spring) -> tuple[Vector, Vector]:
    """Return the second point relative to the first one, m, and the rate, m/s, (3,) each, in base axes. Raises
    ModelError if the points coincide for all coordinates."""
    points = {name: quantities.at(quantities.points[name]) for name in (spring.first, spring.second)}
    algebra, kinematics = quantities.algebra, quantities.kinematics
    positions = [algebra.named(f"p_{name}", kinematics.position_in_base(*point)) for name, point in points.items()]
    velocities = [algebra.named(f"v_{name}", kinematics.velocity_in_base(*point)) for name, point in points.items()]
    span = minus(positions[1], positions[0])
    speed = minus(velocities[1], velocities[0])
    if all_zero(span):
        fault = (
            f"the points {spring.first} and {spring.second} coincide for all coordinates, so it has no"
            f" direction [E0501]"
        )
        raise ModelError(Problem(f"spring {spring.name}", fault, "points that can separate, or a torsion spring"))
    for quantity, vector in (("span", span), ("rate", speed)):
        quantities.algebra.named(f"{quantity}_{spring.name}", vector)
    return span, speed


def tension(quantities: Quantities, spring: Spring) -> Scalar:
    """Return the tension, N, of spring, damper and actuator together; positive pulls the points together."""
    length, rate, _ = stretch(quantities, spring)
    elastic = quantities.formula(spring.stiffness) * (length - quantities.formula(spring.length))
    return elastic + quantities.formula(spring.damping) * rate + quantities.formula(spring.force)


def add_spring(loads: Loads, spring: Spring, quantities: Quantities) -> None:
    """Add to ``loads``, in place, the tension on both points, the potential of the spring, and the power of damper and
    actuator. A spring between base and world adds none."""
    mounts = quantities.tree.mounts
    if all(mounts[quantities.points[name].body].link < 0 for name in (spring.first, spring.second)):
        return  # between base and world: strained by the prescribed motion of the base
    stiffness, damping, slack, active = (
        quantities.formula(item) for item in (spring.stiffness, spring.damping, spring.length, spring.force)
    )
    if slack.is_zero and damping.is_zero and active.is_zero:  # the force of points that meet is 0, without direction
        span, _ = _span(quantities, spring)
        pull, twice_potential, power = scaled(stiffness, span), stiffness * dot(span, span), quantities.algebra.zero
    else:
        length, rate, direction = stretch(quantities, spring)
        force = tension(quantities, spring)
        for quantity, value in (("length", length), ("rate", rate), ("tension", force)):
            value.tape.name(value.ref, f"{quantity}_{spring.name}")
        extension = length - slack
        pull, twice_potential = scaled(force, direction), stiffness * (extension * extension)
        power = (damping * rate + active) * rate
    pull = quantities.algebra.named(f"force_{spring.name}", pull)
    ends = ((spring.first, spring.second, pull), (spring.second, spring.first, negative(pull)))
    for name, partner, end_force in ends:
        push(loads.wrenches, quantities, name, end_force)
        if quantities.points[partner].body == WORLD_NAME:
            push(loads.external, quantities, name, end_force)
    loads.potential = loads.potential + 0.5 * twice_potential
    loads.power = loads.power - power


#: Quantities of springs in formulas.
_QUANTITIES = {
    "length": lambda quantities, spring: stretch(quantities, spring)[0],
    "rate": lambda quantities, spring: stretch(quantities, spring)[1],
    "tension": tension,
}
LAW = Law(Spring, add_spring, _QUANTITIES, add_loops, before_joints=True)


def add_torsion_spring(loads: Loads, torsion: TorsionSpring, quantities: Quantities) -> None:
    """Add to ``loads``, in place, opposite efforts on one or two joint angles, the potential energy and the power of
    damping."""
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


TORSION_LAW = Law(TorsionSpring, add_torsion_spring)
