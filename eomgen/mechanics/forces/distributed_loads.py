"""Distributed loads on beams by virtual work, on geometrically exact beams by loads on nodes and wrenches on halves of
elements.

With w = p(s) f the virtual work is f . delta int p r dx, r being the deformed axis: the integrals over p are those
that the beam's mass has over its mass per length, exact, the shortening of the bent axis among them.

Numbers that differ among nodes (weights, and values of formulas of s) are columns of the loop. A load is a
function of its node's pose and twist, so its tangents are tangents of a ``Map`` over the numbers that reach a node.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction

from eomgen.base.data import dataclass
from eomgen.formula.evaluate import symbols
from eomgen.formula.nodes import ZERO_VECTOR, Formula, Symbol
from eomgen.formula.recording import Resolver
from eomgen.formula.substitution import pattern
from eomgen.mechanics.forces.cosserat_beams import LoopInputs, SectionFrame, Six, is_carried, node_at, push_on_node
from eomgen.mechanics.forces.forces import LoadPointFrame, add_load
from eomgen.mechanics.forces.loads import Law, Loads, add_wrench
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.mechanics.tree.beam_fields import DistributedMass
from eomgen.mechanics.tree.links import Mount
from eomgen.scene.forces.distributed_loads import DistributedLoad, NodeLoad
from eomgen.symbolic.map import Map, add_map
from eomgen.symbolic.scalar import Algebra, Scalar, apply, cross, dot, multiply, plus, scaled, transpose
from eomgen.symbolic.tape import Tape

#: Three formulas of a force and three of a moment.
Formulas = tuple[Formula, ...]


def is_local(item: DistributedLoad) -> bool:
    """Return whether a load depends on the motion of the sections under the load."""
    formulas = {formula for load in item.nodes for formula in (*load.force, *load.moment)}
    return any(symbol.kind == "local" for formula in formulas for symbol in symbols(formula))


def add_local_load(loads: Loads, item: DistributedLoad, quantities: Quantities) -> None:
    """Add a load that depends on the motion of sections to the nodes of a beam, with the power of the load. ``loads``
    is changed in place. Nodes with loads that differ in numbers alone are recorded as one loop."""
    alike: dict[object, list[NodeLoad]] = {}
    for load in item.nodes:
        mount = quantities.tree.mounts[load.node]
        shape, _ = pattern((*load.force, *load.moment))
        if mount.link >= 0:
            alike.setdefault((shape, load.node if is_carried(quantities, mount) else ""), []).append(load)
    for group in alike.values():
        _LoadedNodes(item, group, quantities).add(loads)


def wrenches_per_length(item: DistributedLoad, quantities: Quantities) -> list[list[Scalar]]:
    """Return moment and force per length on each node of a beam, (6,), in the axes of the node."""
    result: list[list[Scalar]] = []
    for load in item.nodes:
        group = _LoadedNodes(item, [load], quantities)
        result.append(group.alone(load, quantities.algebra.one)[:6])
    return result


@dataclass(frozen=True)
class _LoadedNodes:
    """Nodes of a beam with loads that differ in numbers alone, recorded as a loop."""

    item: DistributedLoad
    nodes: Sequence[NodeLoad]
    quantities: Quantities

    def add(self, loads: Loads) -> None:
        loop = self._loop() if len(self.nodes) > 1 else None
        if loop is None:
            for load in self.nodes:
                self._push(loads, load, self.alone(load, self.quantities.algebra.scalar(load.weight)))
            return
        tape = self.quantities.algebra.tape
        wrenches, power = (add_map(tape, part) for part in loop)
        for load, row in zip(self.nodes, wrenches.rows, strict=True):
            self._push(loads, load, [Scalar(tape, ref) for ref in row])
        loads.power = loads.power + Scalar(tape, power.sums[0])

    def _push(self, loads: Loads, load: NodeLoad, wrench: Six) -> None:
        mount = self._mount(load)
        for wrenches in (loads.wrenches, loads.external):
            push_on_node(wrenches, mount, wrench[:6])
        if len(wrench) > 6:
            loads.power = loads.power + wrench[6]

    def _mount(self, load: NodeLoad) -> Mount:
        return self.quantities.tree.mounts[load.node]

    def alone(self, load: NodeLoad, weight: Scalar) -> list[Scalar]:
        """Return the wrench on one node for a quadrature weight, moment first, in node axes, and its power, W: seven
        numbers."""
        quantities, base = self.quantities, _numbers_of_base(self.quantities)
        node = node_at(quantities, self._mount(load))
        formulas = (*load.force, *load.moment)
        return self._wrench(node, base, formulas, weight, quantities)

    def _loop(self) -> tuple[Map, Map] | None:
        """Return the loop over the wrenches of all nodes, and the loop that sums their power. None if the load has a
        loop in its formulas, such as waves."""
        kernel = Tape()
        algebra, quantities = Algebra(kernel), self.quantities
        rows = [[number.ref for number in node_at(quantities, self._mount(load)).numbers] for load in self.nodes]
        inputs = LoopInputs(algebra, list(zip(*rows, strict=True)))
        node = SectionFrame.of(algebra.block("gather", len(rows[0])))
        patterns = [pattern((*load.force, *load.moment)) for load in self.nodes]
        numbers = [self._column(inputs, column) for column in zip(*(values for _, values in patterns), strict=True)]
        weight = self._column(inputs, (load.weight for load in self.nodes))
        base = [inputs.number([number]) for number in _numbers_of_base(quantities)]

        def resolve(symbol: Symbol) -> Scalar:
            return numbers[symbol.index] if symbol.kind == "number" else inputs.number([quantities(symbol)])

        *wrench, power = self._wrench(node, base, patterns[0][0], weight, resolve)
        if kernel.maps:  # waves are loops
            return None
        wrenches = inputs.loop(len(rows), self.item.label, stacked=wrench)
        return wrenches, inputs.loop(len(rows), f"power of {self.item.label}", sums=[power])

    def _wrench(
        self, node: SectionFrame, base: Six, formulas: Formulas, weight: Scalar, elsewhere: Resolver
    ) -> list[Scalar]:
        """Return moment and force on a node in node axes, (6,), and the power of both, W: seven numbers.

        Parameters
        ----------
        base : (18,), axes by rows, position, angular velocity and velocity of the base
        formulas : three of the force and three of the moment per length
        weight : m, of the quadrature
        elsewhere : gives the values of symbols that are not of the node's motion
        """
        algebra = Algebra(weight.tape)
        x, y, z, origin, omega, velocity = ((base[k], base[k + 1], base[k + 2]) for k in range(0, 18, 3))
        back = transpose(node.axes)
        turning = plus(node.omega, apply(back, omega))
        moving = plus(node.velocity, apply(back, plus(velocity, cross(omega, node.origin))))
        axes, point = multiply((x, y, z), node.axes), plus(origin, apply((x, y, z), node.origin))
        local = LoadPointFrame(algebra, axes, point, turning, moving, self.item.axes == "beam", elsewhere)
        force, moment = (
            scaled(weight, local.vector((part[0], part[1], part[2]))) for part in (formulas[:3], formulas[3:])
        )
        return [*moment, *force, dot(moment, turning) + dot(force, moving)]

    def _column(self, inputs: LoopInputs, numbers: Iterable[float]) -> Scalar:
        return inputs.number([self.quantities.algebra.scalar(number) for number in numbers])


def _numbers_of_base(quantities: Quantities) -> list[Scalar]:
    base = quantities.kinematics.base
    return [*(entry for row in base.orientation for entry in row), *base.position, *base.omega, *base.velocity]


def add_distributed_load(loads: Loads, item: DistributedLoad, quantities: Quantities) -> None:
    """Add a distributed load on a beam to ``loads``, in place, with the power of the load. On a geometrically exact
    beam it acts on the nodes; on an elastic body on the frame and on the elastic coordinates."""
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
