"""Geometrically exact beams: elements of constant strain between frames on SE(3), as one loop over all of them.

With d = log(H_A^-1 H_B), the strain of an element is (d - d_0)/l, and its potential l/2 strain.C strain, so whatever
bends an element to a helix is exact, and nothing locks. By d' = T^-1(d) v_B - T^-1(-d) v_A the nodes take -T^-T(d) s
and T^-T(-d) s, with s = C strain + D strain': Sonneville, Cardona and Bruls, Comput. Methods Appl. Mech. Engrg. 268
(2014) 451; Hante, Tumiotto and Arnold, Multibody Syst. Dyn. 54 (2022) 97. All of it depends on relative poses alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain, pairwise

from eomgen.lie.algebra import TapeAlgebra
from eomgen.lie.groups import SE3
from eomgen.lie.rotations import tangent_inverse
from eomgen.mechanics.forces.loads import Law, Loads, add_wrench
from eomgen.mechanics.forces.rotation_vectors import rotation_vector
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.mechanics.tree.links import Mount
from eomgen.scene.bodies.cosserat import Cosserat, Rows
from eomgen.scene.forces.cosserat_beams import CosseratBeam
from eomgen.symbolic.map import Map, add_map
from eomgen.symbolic.scalar import (
    Algebra,
    Matrix,
    Scalar,
    Vector,
    apply,
    cross,
    dot,
    minus,
    multiply,
    plus,
    transpose,
)
from eomgen.symbolic.tape import Ref, Tape

Six = Sequence[Scalar]
_POSE = 12
_TWIST = 6


@dataclass(frozen=True)
class _Node:
    """Frame of a section: axes by columns, origin, and its twist in its own axes, relative to the base."""

    axes: Matrix
    origin: Vector
    omega: Vector
    velocity: Vector

    @property
    def numbers(self) -> list[Scalar]:
        return [*chain.from_iterable(self.axes), *self.origin, *self.omega, *self.velocity]

    @classmethod
    def of(cls, numbers: Six) -> _Node:
        x, y, z, origin, omega, velocity = ((numbers[k], numbers[k + 1], numbers[k + 2]) for k in range(0, 18, 3))
        return cls((x, y, z), origin, omega, velocity)


@dataclass(frozen=True)
class _Section:
    """Stiffness and damping, (6, 6) each, of the elements of a beam, their length, m, and d_0, (6,)."""

    stiffness: Sequence[Six]
    damping: Sequence[Six]
    length: float
    rest: Sequence[float]

    @property
    def damped(self) -> bool:
        return any(not entry.is_zero for row in self.damping for entry in row)

    @property
    def rows(self) -> tuple[Sequence[Six], Sequence[Six]]:
        return self.stiffness, self.damping


class _Element:
    """Strain and strain rate of an element between two frames."""

    def __init__(self, algebra: Algebra, section: _Section, first: _Node, second: _Node) -> None:
        self.algebra, self.section = algebra, section
        back = transpose(first.axes)
        turn = rotation_vector(algebra, multiply(back, second.axes))
        shift = apply(back, minus(second.origin, first.origin))
        d = [*turn, *apply(transpose(algebra.matrix(tangent_inverse(turn))), shift)]
        self.to_second, self.to_first = (
            [
                [algebra.scalar(entry) for entry in row]
                for row in SE3.tangent_inverse(TapeAlgebra(algebra.tape), [sign * x for x in d])
            ]
            for sign in (1.0, -1.0)
        )
        inverse = 1.0 / section.length
        self.strain = [(x - at_rest) * inverse for x, at_rest in zip(d, section.rest, strict=True)]
        self.rate = (
            [
                (x - y) * inverse
                for x, y in zip(
                    _product(self.to_second, [*second.omega, *second.velocity]),
                    _product(self.to_first, [*first.omega, *first.velocity]),
                    strict=True,
                )
            ]
            if section.damped
            else [algebra.zero] * 6
        )

    def forces(self) -> list[Scalar]:
        """Return the generalized forces on both nodes, (12,), moment before force, in their own axes."""
        elastic, viscous = _product(self.section.stiffness, self.strain), _product(self.section.damping, self.rate)
        s = [x + y for x, y in zip(elastic, viscous, strict=True)]
        on_first, on_second = (
            _product(list(zip(*tangent, strict=True)), s) for tangent in (self.to_first, self.to_second)
        )
        return [*on_first, *(-x for x in on_second)]

    def energies(self) -> list[Scalar]:
        """Return the potential, J, and the power of damping, W."""
        elastic, viscous = _product(self.section.stiffness, self.strain), _product(self.section.damping, self.rate)
        length = self.section.length
        return [0.5 * length * dot(self.strain, elastic), -length * dot(self.rate, viscous)]


def add_cosserat_beam(loads: Loads, item: CosseratBeam, quantities: Quantities) -> None:
    """Add the wrenches of a beam on its nodes, its potential, J, and the power of its damping, W."""
    algebra, beam = quantities.algebra, item.beam
    mounts = [quantities.tree.mounts[name] for name in beam.nodes]
    nodes = [_node(quantities, mount) for mount in mounts]
    section = _section(quantities, beam)
    between = list(pairwise(range(len(nodes))))
    alone = [pair for pair in between if len(between) == 1 or any(_carried(quantities, mounts[end]) for end in pair)]
    repeated = [pair for pair in between if pair not in alone]
    forces: dict[tuple[int, int], Six] = {}
    for first, second in alone:
        element = _Element(algebra, section, nodes[first], nodes[second])
        forces[first, second] = element.forces()
        potential, power = element.energies()
        loads.potential, loads.power = loads.potential + potential, loads.power + power
    if repeated:
        rows = add_map(algebra.tape, _loop(section, nodes, repeated, f"elements of beam {beam.name}", forces=True)).rows
        forces |= {pair: [Scalar(algebra.tape, ref) for ref in row] for pair, row in zip(repeated, rows, strict=True)}
        label = f"energy of the elements of beam {beam.name}"
        sums = add_map(algebra.tape, _loop(section, nodes, repeated, label, forces=False)).sums
        potential, power = (Scalar(algebra.tape, ref) for ref in sums)
        loads.potential, loads.power = loads.potential + potential, loads.power + power
    for pair, both in forces.items():
        for node, load in zip(pair, (both[:6], both[6:]), strict=True):
            if mounts[node].link >= 0:
                _push(loads, mounts[node], load)


def _carried(quantities: Quantities, mount: Mount) -> bool:
    """Return whether a node moves with a link that is not its own, so that its element is unlike the others."""
    return mount.link >= 0 and quantities.tree.links[mount.link].kind not in ("free", "ball")


def _node(quantities: Quantities, mount: Mount) -> _Node:
    R, p = quantities.kinematics.pose(mount.link)
    omega, velocity = quantities.kinematics.twist(mount.link)
    back = transpose(mount.orientation)
    return _Node(
        multiply(R, mount.orientation),
        plus(p, apply(R, mount.position)),
        apply(back, omega),
        apply(back, plus(velocity, cross(omega, mount.position))),
    )


def _section(quantities: Quantities, beam: Cosserat) -> _Section:
    def scalars(rows: Rows) -> list[list[Scalar]]:
        return [[quantities.formula(entry) for entry in row] for row in rows]

    rest = [beam.spacing * part for part in (*beam.curvature, 1.0, 0.0, 0.0)]
    return _Section(scalars(beam.stiffness), scalars(beam.damping), beam.spacing, rest)


def _loop(
    section: _Section, nodes: Sequence[_Node], pairs: Sequence[tuple[int, int]], label: str, *, forces: bool
) -> Map:
    """Return the loop over elements that gives their forces for each, or the sums of their energies."""
    kernel = Tape()
    algebra = Algebra(kernel)
    shared: list[Ref] = []

    def inside(entry: Scalar) -> Scalar:
        if entry.constant is not None:
            return algebra.scalar(entry.constant)
        if entry.ref not in shared:
            shared.append(entry.ref)
        return Scalar(kernel, kernel.input("shared", shared.index(entry.ref)))

    stiffness, damping = ([[inside(entry) for entry in row] for row in rows] for rows in section.rows)
    size = _POSE + _TWIST if section.damped else _POSE
    numbers = algebra.block("gather", 2 * size)
    rest = [algebra.zero] * (_POSE + _TWIST - size)
    first, second = (_Node.of([*half, *rest]) for half in (numbers[:size], numbers[size:]))
    element = _Element(algebra, _Section(stiffness, damping, section.length, section.rest), first, second)
    gathered = [[number.ref for number in node.numbers[:size]] for node in nodes]
    rows = [[*gathered[first], *gathered[second]] for first, second in pairs]
    results = tuple(value.ref for value in (element.forces() if forces else element.energies()))
    return Map(
        kernel,
        len(pairs),
        shared=tuple(shared),
        gather=tuple(zip(*rows, strict=True)),
        sums=() if forces else results,
        stacked=results if forces else (),
        label=label,
    )


def _push(loads: Loads, mount: Mount, load: Six) -> None:
    """Add a generalized force on a node's frame to the link that the node is on."""
    moment, force = apply(mount.orientation, _vector(load[:3])), apply(mount.orientation, _vector(load[3:]))
    add_wrench(loads.wrenches, mount.link, (plus(moment, cross(mount.position, force)), force))


def _product(rows: Sequence[Six], values: Six) -> list[Scalar]:
    return [dot(row, values) for row in rows]


def _vector(values: Six) -> Vector:
    return values[0], values[1], values[2]


LAW = Law(CosseratBeam, add_cosserat_beam)
