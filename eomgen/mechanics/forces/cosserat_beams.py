"""Geometrically exact beams: elements between frames on SE(3), with constant strain or linear section loads, as a loop
over all elements; stiffness and damping follow from the section matrices.

With linear section loads An element has one strain, and would have one wrench. By equilibrium the wrench is W + s ad^T
W at the distance s from its middle, ad being the adjoint of the initial shape's twist by length. It adds to the
flexibility of the section, S^-1, the matrix (l^2/12) ad S^-1 ad^T up to (l kappa)^4: the residual bending flexibility
of MacNeal, Comput. Struct. 8 (1978) 175, for curved and twisted beams. (The quadratic part of the wrench cancels with
the logarithm's.) With it small deflections of straight beams by loads on nodes are exact for any number of elements,
and large ones far closer; and however much a section resists shear, its elements bend.

If sections vary within an element, the mean of (1 + s ad) S^-1 (1 + s ad^T) is the flexibility, by the means of S^-1,
s S^-1 and s^2 S^-1. The mean of s S^-1 couples shear with bending: strains gamma without stiffness follow then from the
others, gamma = G kappa, and their multipliers exert -G^T lam in addition.

With d = log(H_A^-1 H_B), the strain of an element is (d - d_0)/l, and its potential l/2 strain.C strain, so bending to
a helix is exact, without locking; C comes from ``element_stiffness``. By
d' = T^-1(d) v_B - T^-1(-d) v_A the nodes take -T^-T(d) s and T^-T(-d) s, with s = C strain + D strain': Sonneville,
Cardona and Bruls, Comput. Methods Appl. Mech. Engrg. 268 (2014) 451; Hante, Tumiotto and Arnold, Multibody Syst. Dyn.
54 (2022) 97. All of it depends on relative poses alone.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import chain, pairwise
from typing import TypeVar

import numpy as np

from eomgen.base.data import dataclass, field, replace
from eomgen.lie.algebra import TapeAlgebra
from eomgen.lie.groups import SE3
from eomgen.lie.numeric import skew
from eomgen.lie.rotations import tangent_inverse
from eomgen.mechanics.forces.loads import Law, Loads, add_wrench
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.mechanics.kinematics.fields import Wrench
from eomgen.mechanics.kinematics.points import rotation_vector
from eomgen.mechanics.tree.links import Mount
from eomgen.scene.bodies.cosserat import BeamElement, Cosserat, Rows
from eomgen.scene.forces.cosserat_beams import CosseratBeam
from eomgen.symbolic.calculus.loops import compact
from eomgen.symbolic.map import Map, add_map
from eomgen.symbolic.scalar import (
    Algebra,
    Matrix,
    Scalar,
    Vector,
    all_zero,
    apply,
    cross,
    dot,
    minus,
    multiply,
    plus,
    transpose,
)
from eomgen.symbolic.tape import Ref, Tape

ScalarRows = Sequence[Sequence[Scalar]]
_SIX = range(6)


@dataclass(frozen=True)
class RecordedStiffness:
    """Stiffness and damping of an element against its strains.

    Attributes
    ----------
    stiffness, damping : (6, 6) each, symmetric, rotations first
    of_section : (6, 6), maps the strain of the element to the strain of the section in its middle
    following : (6, 6), G, rows of the strains that the beam does not have; empty without variation of the sections
    """

    stiffness: list[list[Scalar]]
    damping: list[list[Scalar]]
    of_section: list[list[Scalar]]
    following: list[list[Scalar]] = field(default_factory=list)


def with_linear_moments(
    algebra: Algebra,
    stiffness: ScalarRows,
    damping: ScalarRows,
    length: float,
    initial: Sequence[float] = (0, 0, 0, 1, 0, 0),
) -> RecordedStiffness:
    """Return stiffness and damping of an element with equal sections and linear section loads, by equilibrium.

    Both are against the strain of the element; the stiffness has zeros for strains that the beam does not have, and
    ``following`` of the result is empty.

    Parameters
    ----------
    stiffness, damping : of sections, (6, 6) each, symmetric, by strains of twist, bending about y and z, stretch, shear
        along y and z; rows of zeros for strains that the beam does not have
    length : m, of the element
    initial : (6,), twist by length of the element in the initial shape of the beam, rotations (1/m) first
    """
    free = _free_strains(stiffness)
    section = _inverse(algebra, stiffness, free)
    along = [[algebra.scalar(entry) for entry in row] for row in _adjoint(initial)]
    share = length**2 / 12.0
    residual = _congruent(section, along)
    flexibility = [[section[i][j] + share * residual[i][j] for j in _SIX] for i in _SIX]
    result = _inverse(algebra, flexibility, free)
    for i in free:  # zeros and equal entries stay out of the tape: 1/(1/x) need not be x
        if residual[i][i].is_zero and all(stiffness[i][j].is_zero for j in free if j != i):
            result[i][i] = stiffness[i][i]
    of_section = _matrix_product(section, result)
    for i in _SIX:
        if i not in free or result[i][i].ref == stiffness[i][i].ref:
            of_section[i][i] = algebra.one
    if all_zero(*damping):
        return RecordedStiffness(result, [list(row) for row in damping], of_section)
    # Rates of strain in the middle, and s times the rates of its change along the element.
    varying = _matrix_product(section, _matrix_product(list(zip(*along, strict=True)), result))
    middle, change = _congruent(damping, _transpose(of_section)), _congruent(damping, _transpose(varying))
    damped = [[x + share * y for x, y in zip(*rows, strict=True)] for rows in zip(middle, change, strict=True)]
    return RecordedStiffness(result, damped, of_section)


def _free_strains(stiffness: ScalarRows) -> list[int]:
    """Return the indices of the strains that a beam has: rows of the stiffness that are not zero."""
    return [i for i in _SIX if not all_zero(stiffness[i])]


def with_varying_sections(
    algebra: Algebra,
    stiffness: ScalarRows,
    compliance: Sequence[ScalarRows],
    dissipation: Sequence[ScalarRows],
    initial: Sequence[float],
) -> RecordedStiffness:
    """Return stiffness and damping of an element whose sections vary, against the strain of the element.

    The stiffness is the inverse of the mean flexibility. Strains that the beam does not have, with rows of zeros in
    ``stiffness``, have zeros in stiffness and damping; their rows of ``following`` give these strains by the others,
    and other rows are zero.

    Parameters
    ----------
    stiffness : (6, 6) of the section in the middle, S, symmetric
    compliance : means over the element of S^-1, s S^-1 and s^2 S^-1, (6, 6) each, at the distance s from the middle, m
    dissipation : the same means for S^-1 D S^-1, D being the damping of the sections
    initial : (6,), twist by length of the element in the initial shape of the beam, rotations (1/m) first
    """
    free = _free_strains(stiffness)
    along = [[algebra.scalar(entry) for entry in row] for row in _adjoint(initial)]

    def shift(means: Sequence[ScalarRows]) -> list[list[Scalar]]:
        mean, first, second = means
        changed, squared = _matrix_product(along, first), _congruent(second, along)
        return [[mean[i][j] + changed[i][j] + changed[j][i] + squared[i][j] for j in _SIX] for i in _SIX]

    result = _inverse(algebra, shift(compliance), free)
    of_section = _matrix_product(_inverse(algebra, stiffness, free), result)
    following = _matrix_product(_matrix_product(along, compliance[1]), result)
    for i in _SIX:
        if i in free:
            following[i] = [algebra.zero] * 6
        else:
            of_section[i][i] = algebra.one
    damping = [] if all_zero(*chain.from_iterable(dissipation)) else _congruent(shift(dissipation), result)
    return RecordedStiffness(result, damping or [[algebra.zero] * 6 for _ in _SIX], of_section, following)


def _adjoint(twist: Sequence[float]) -> np.ndarray:
    """Return the adjoint matrix ad, (6, 6), of a twist, (6,), rotations first."""
    turned, shifted = (skew(np.array(part)) for part in (twist[:3], twist[3:]))
    return np.block([[turned, np.zeros((3, 3))], [shifted, turned]])


def _inverse(algebra: Algebra, matrix: ScalarRows, rows: Sequence[int]) -> list[list[Scalar]]:
    """Return the inverse, (6, 6), of the block of a symmetric positive definite matrix in the rows and columns
    ``rows``, with zeros in all other rows and columns."""
    left = {(i, j): matrix[i][j] for i in rows for j in rows}
    right = {(i, j): algebra.one if i == j else algebra.zero for i in rows for j in rows}
    for pivot in rows:
        over = algebra.one / left[pivot, pivot]
        for i in rows:
            if i == pivot or left[i, pivot].is_zero:
                continue
            factor = left[i, pivot] * over
            for j in rows:
                left[i, j] = left[i, j] - factor * left[pivot, j] if j != pivot else algebra.zero
                right[i, j] = right[i, j] - factor * right[pivot, j]
        for j in rows:
            left[pivot, j], right[pivot, j] = left[pivot, j] * over, right[pivot, j] * over
    return _symmetric([[right.get((i, j), algebra.zero) for j in _SIX] for i in _SIX])


def _matrix_product(rows: ScalarRows, others: ScalarRows) -> list[list[Scalar]]:
    return [[dot(row, column) for column in zip(*others, strict=True)] for row in rows]


def _transpose(rows: ScalarRows) -> list[list[Scalar]]:
    return [list(column) for column in zip(*rows, strict=True)]


def _congruent(matrix: ScalarRows, others: ScalarRows) -> list[list[Scalar]]:
    """Return A S A^T of a symmetric S (``matrix``) and a matrix A (``others``)."""
    return _symmetric(_matrix_product(others, _matrix_product(matrix, _transpose(others))))


def _symmetric(rows: ScalarRows) -> list[list[Scalar]]:
    """Return the matrix with the entries above the diagonal copied below the diagonal."""
    return [[rows[min(i, j)][max(i, j)] for j in _SIX] for i in _SIX]


T = TypeVar("T")
Six = Sequence[Scalar]
#: Function that records a requested quantity of an element; further arguments are numbers of the quantity.
Results = Callable[..., list[Scalar]]
#: Numbers of the pose and of the twist of a frame.
POSE, TWIST = 12, 6


@dataclass(frozen=True)
class SectionFrame:
    """Frame of a section of a beam: axes by columns, origin, m, and twist (omega, velocity) in section axes, relative
    to the base."""

    axes: Matrix
    origin: Vector
    omega: Vector
    velocity: Vector

    @property
    def numbers(self) -> list[Scalar]:
        return [*chain.from_iterable(self.axes), *self.origin, *self.omega, *self.velocity]

    @classmethod
    def of(cls, numbers: Six) -> SectionFrame:
        x, y, z, origin, omega, velocity = ((numbers[k], numbers[k + 1], numbers[k + 2]) for k in range(0, 18, 3))
        return cls((x, y, z), origin, omega, velocity)


@dataclass(frozen=True)
class SectionNumbers:
    """Numbers of an element of a beam.

    Attributes
    ----------
    stiffness, damping, of_section : (6, 6) each; the last maps the strain of the element to the strain of its middle
        section
    length, inverse : length, m, and 1 / length
    rest : (6,), d_0, the logarithm of the relative pose of the nodes without load
    following : (6, 6), rows by which absent strains follow from other strains; empty if they are 0
    """

    stiffness: Sequence[Six]
    damping: Sequence[Six]
    of_section: Sequence[Six]
    length: Scalar
    inverse: Scalar
    rest: Six
    following: Sequence[Six] = ()

    @property
    def has_damping(self) -> bool:
        return not all_zero(*self.damping)

    @property
    def numbers(self) -> list[Scalar]:
        rows = (*self.stiffness, *self.damping, *self.of_section, self.rest)
        return [*chain.from_iterable(rows), self.length, self.inverse, *chain.from_iterable(self.following)]

    @classmethod
    def of(cls, numbers: Six) -> SectionNumbers:
        rows = [numbers[start : start + 6] for start in range(0, 114, 6)]
        following = [numbers[start : start + 6] for start in range(116, len(numbers), 6)]
        return cls(rows[:6], rows[6:12], rows[12:18], numbers[114], numbers[115], rows[18], following)


class ElementStrain:
    """Strain, (6,), and strain rate of a beam element between two frames, with the forces and energies that follow."""

    def __init__(self, algebra: Algebra, section: SectionNumbers, first: SectionFrame, second: SectionFrame) -> None:
        """Record the strain of an element, and the rate if the section has damping, from the frames at both ends.
        Without damping the rate is zero.
        """
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
        self.strain = [(x - at_rest) * section.inverse for x, at_rest in zip(d, section.rest, strict=True)]
        self.rate = (
            [
                (x - y) * section.inverse
                for x, y in zip(
                    _product(self.to_second, [*second.omega, *second.velocity]),
                    _product(self.to_first, [*first.omega, *first.velocity]),
                    strict=True,
                )
            ]
            if section.has_damping
            else [algebra.zero] * 6
        )

    def gap(self, strain: int) -> Scalar:
        """Return the residual, m, of a constrained strain (index 0 to 5): length times (strain - value by other
        strains)."""
        gap = self.strain[strain]
        if self.section.following:
            gap = gap - dot(self.section.following[strain], self.strain)
        return self.section.length * gap

    def held_forces(self, multipliers: Mapping[int, Scalar]) -> list[Scalar]:
        """Return the section forces, (6,), of the multipliers of constrained strains, by index of the strain."""
        result = [multipliers.get(k, self.algebra.zero) for k in _SIX]
        for strain, force in multipliers.items() if self.section.following else ():
            result = [
                x if share.is_zero else x - share * force
                for x, share in zip(result, self.section.following[strain], strict=True)
            ]
        return result

    def forces(self) -> list[Scalar]:
        """Return the elastic and viscous wrenches on both nodes, (12,), moment before force, in node axes."""
        elastic, viscous = _product(self.section.stiffness, self.strain), _product(self.section.damping, self.rate)
        return self.node_forces([x + y for x, y in zip(elastic, viscous, strict=True)])

    def node_forces(self, section_forces: Six) -> list[Scalar]:
        """Return the forces on both nodes, (12,), that balance a section's moment and force, (6,). First node first,
        moment before force, each in the axes of the node."""
        on_first, on_second = (
            _product(list(zip(*tangent, strict=True)), section_forces) for tangent in (self.to_first, self.to_second)
        )
        return [*on_first, *(-x for x in on_second)]

    def sections(self, elsewhere: Mapping[int, Scalar]) -> list[Scalar]:
        """Return strain and load of the middle section, (6,) each, then the loads at the first and the last node,
        (12,).

        The load is the wrench of the outer part of the beam, moment first, in section axes. As no load acts between the
        nodes, static equilibrium makes s the mean over the element of the section forces.

        Parameters
        ----------
        elsewhere : entries of s that do not follow from strains, the multipliers of constrained strains, by index
        """
        held = self.held_forces(elsewhere)
        elastic, viscous = _product(self.section.stiffness, self.strain), _product(self.section.damping, self.rate)
        s = [
            held[k] if k in elsewhere else x + y if held[k].is_zero else x + y + held[k]
            for k, (x, y) in enumerate(zip(elastic, viscous, strict=True))
        ]
        on_both = self.node_forces(s)
        return [*_product(self.section.of_section, self.strain), *s, *on_both[:6], *(-x for x in on_both[6:])]

    def energies(self) -> list[Scalar]:
        """Return the potential energy of an element, J, and the power of damping, W, which is negative."""
        elastic, viscous = _product(self.section.stiffness, self.strain), _product(self.section.damping, self.rate)
        length = self.section.length
        return [0.5 * length * dot(self.strain, elastic), -length * dot(self.rate, viscous)]


def add_cosserat_beam(loads: Loads, item: CosseratBeam, quantities: Quantities) -> None:
    """Add to ``loads``, in place, the wrenches of a beam on the nodes, the potential energy, J, and the power of
    damping, W."""
    beam = item.beam
    elements = Chain.of(quantities, beam)
    forces = elements.each(ElementStrain.forces, f"elements of beam {beam.name}")
    potential, power = elements.total(ElementStrain.energies, f"energy of the elements of beam {beam.name}")
    loads.potential, loads.power = loads.potential + potential, loads.power + power
    elements.push(loads.wrenches, forces)


@dataclass(frozen=True)
class Chain:
    """The elements of a beam in a tree, recorded as one loop: their operations are the same, their numbers may differ.

    Elements with a node on a link that carries it, or a single element, are recorded one by one.

    Attributes
    ----------
    sections : numbers of each element, in order along the beam
    mounts, nodes : for each node, the mount on the link, and the frame with twist
    """

    quantities: Quantities
    sections: Sequence[SectionNumbers]
    mounts: Sequence[Mount]
    nodes: Sequence[SectionFrame]

    @classmethod
    def of(cls, quantities: Quantities, beam: Cosserat) -> Chain:
        mounts = [quantities.tree.mounts[name] for name in beam.nodes]
        return cls(quantities, _sections(quantities, beam), mounts, [node_at(quantities, mount) for mount in mounts])

    @property
    def pairs(self) -> list[tuple[int, int]]:
        """The numbers of the first and the second node of each element."""
        return list(pairwise(range(len(self.nodes))))

    @property
    def _alone(self) -> list[tuple[int, int]]:
        """Node pairs of the elements that are not in the loop: with a node on a link of another body, or a single
        element."""
        single = len(self.nodes) == 2
        carried = [is_carried(self.quantities, mount) for mount in self.mounts]
        return [pair for pair in self.pairs if single or any(carried[end] for end in pair)]

    @property
    def _repeated_pairs(self) -> list[tuple[int, int]]:
        alone = self._alone
        return [pair for pair in self.pairs if pair not in alone]

    def each(self, results: Results, label: str, more: Sequence[Six] = ()) -> list[list[Scalar]]:
        """Return the results of a function of an element, a list for each element.

        Parameters
        ----------
        results : function of the element's strain, and of its further numbers, that records a list of scalars
        label : name of the loop
        more : further numbers for each element, which ``results`` takes
        """
        result: dict[tuple[int, int], list[Scalar]] = {}
        numbers = dict(zip(self.pairs, more or [()] * len(self.pairs), strict=True))
        for pair in self._alone:
            result[pair] = results(self._element(pair), *numbers[pair])
        if repeated := self._repeated_pairs:
            tape = self.quantities.algebra.tape
            loop = self._loop(label, results, [numbers[pair] for pair in repeated])
            rows = add_map(tape, loop).rows
            result |= {pair: [Scalar(tape, ref) for ref in row] for pair, row in zip(repeated, rows, strict=True)}
        return [result[pair] for pair in self.pairs]

    def total(self, results: Results, label: str) -> list[Scalar]:
        """Return the sums over all elements of each scalar that ``results``, a function of an element's strain,
        records. ``label`` names the loop."""
        algebra = self.quantities.algebra
        result = [results(self._element(pair)) for pair in self._alone]
        if self._repeated_pairs:
            sums = add_map(algebra.tape, self._loop(label, results, summed=True)).sums
            result.append([Scalar(algebra.tape, ref) for ref in sums])
        return [sum(parts, algebra.zero) for parts in zip(*result, strict=True)]

    def _loop(self, label: str, results: Results, more: Sequence[Six] = (), *, summed: bool = False) -> Map:
        """Return the loop over the repeated elements that records ``results`` for each. ``more``: further numbers for
        each element, which ``results`` takes. ``summed``: the loop gives sums over the elements."""
        sections, nodes, pairs = self.sections, self.nodes, self._repeated_pairs
        kernel = Tape()
        algebra = Algebra(kernel)
        size = POSE + TWIST if any(sections[first].has_damping for first, _ in pairs) else POSE
        gathered = [[number.ref for number in node.numbers[:size]] for node in nodes]
        rows = [[*gathered[first], *gathered[second]] for first, second in pairs]
        if more:
            rows = [[*row, *(number.ref for number in extra)] for row, extra in zip(rows, more, strict=True)]
        columns = LoopInputs(algebra, list(zip(*rows, strict=True)))
        numbers = algebra.block("gather", len(rows[0]))
        of_sections = zip(*(sections[first].numbers for first, _ in pairs), strict=True)
        section = SectionNumbers.of([columns.number(entries) for entries in of_sections])
        rest = [algebra.zero] * (POSE + TWIST - size)
        first, second = (SectionFrame.of([*half, *rest]) for half in (numbers[:size], numbers[size : 2 * size]))
        outputs = results(ElementStrain(algebra, section, first, second), *numbers[2 * size :])
        return columns.loop(len(pairs), label, **{"sums" if summed else "stacked": outputs})

    def _element(self, pair: tuple[int, int]) -> ElementStrain:
        first, second = pair
        return ElementStrain(self.quantities.algebra, self.sections[first], self.nodes[first], self.nodes[second])

    def push(self, wrenches: list[Wrench | None], forces: Sequence[Six]) -> None:
        """Add to ``wrenches`` (by link, or None), in place, forces on both nodes of each element, (12,) each, in node
        axes. Nodes on base or world take none."""
        for pair, both in zip(self.pairs, forces, strict=True):
            for node, load in zip(pair, (both[:6], both[6:]), strict=True):
                if self.mounts[node].link >= 0:
                    push_on_node(wrenches, self.mounts[node], load)


def is_carried(quantities: Quantities, mount: Mount) -> bool:
    """Return whether a node is fixed to a link that is not a free body or a ball, such as the end of an arm. The
    adjacent element then differs from the other elements, and is recorded separately."""
    return mount.link >= 0 and quantities.tree.links[mount.link].kind not in ("free", "ball")


def node_at(quantities: Quantities, mount: Mount) -> SectionFrame:
    """Return the frame of a node mounted on a link: pose in axes of ``kinematics.pose``, twist in node axes."""
    R, p = quantities.kinematics.pose(mount.link)
    omega, velocity = quantities.kinematics.twist(mount.link)
    back = transpose(mount.orientation)
    return SectionFrame(
        multiply(R, mount.orientation),
        plus(p, apply(R, mount.position)),
        apply(back, omega),
        apply(back, plus(velocity, cross(omega, mount.position))),
    )


def _sections(quantities: Quantities, beam: Cosserat) -> list[SectionNumbers]:
    """Return the numbers of each element of a beam; equal elements share an object. All have rows ``following`` as soon
    as one has such rows and strains are constrained, else none."""
    known: dict[int, SectionNumbers] = {}
    for part in beam.parts:
        if id(part) not in known:
            known[id(part)] = _section(quantities, part)
    result = [known[id(part)] for part in beam.parts]
    if not beam.absent_strains or not any(section.following for section in result):
        return [replace(section, following=()) if section.following else section for section in result]
    none = [[quantities.algebra.zero] * 6 for _ in _SIX]  # the elements of a loop have as many numbers
    return [section if section.following else replace(section, following=none) for section in result]


def _section(quantities: Quantities, part: BeamElement) -> SectionNumbers:
    def scalars(rows: Rows) -> list[list[Scalar]]:
        return [[quantities.formula(entry) for entry in row] for row in rows]

    algebra, length = quantities.algebra, float(part.length)
    strained = [algebra.scalar(length) * quantities.formula(strain) for strain in part.section.prestrain]
    rest = [algebra.scalar(initial) - strain for initial, strain in zip(part.twist, strained, strict=True)]
    stiffness, initial = scalars(part.section.stiffness), [float(number) / length for number in part.twist]
    if part.moments is None:
        result = with_linear_moments(algebra, stiffness, scalars(part.section.damping), length, initial)
    else:
        means = [[scalars(rows) for rows in each] for each in (part.moments.compliance, part.moments.dissipation)]
        result = with_varying_sections(algebra, stiffness, means[0], means[1], initial)
    sizes = algebra.scalar(length), algebra.scalar(1.0 / length)
    return SectionNumbers(result.stiffness, result.damping, result.of_section, *sizes, rest, result.following)


class LoopInputs:
    """Arguments of the kernel of a loop: a column for numbers that vary among elements, single numbers if shared.
    Constants that vary are ``elements``, other values that vary ``gather``, and equal values that vary with the motion
    or parameters ``shared``."""

    def __init__(self, algebra: Algebra, gather: list[tuple[Ref, ...]]) -> None:
        self.algebra, self.gather = algebra, gather
        self.shared: list[Ref] = []
        self.elements: list[tuple[float, ...]] = []

    def number(self, entries: Sequence[Scalar]) -> Scalar:
        """Return the scalar in the kernel for a quantity with the given value for each element. It is a constant if all
        values are one constant, else an input, which is added to the columns."""
        refs = tuple(entry.ref for entry in entries)
        constants = [entry.number for entry in entries]
        if len(set(refs)) == 1:
            constant = constants[0]
            return self._input("shared", self.shared, refs[0]) if constant is None else self.algebra.scalar(constant)
        numbers = tuple(constant for constant in constants if constant is not None)
        if len(numbers) == len(refs):
            return self._input("element", self.elements, numbers)
        return self._input("gather", self.gather, refs)

    def loop(self, count: int, label: str, *, sums: Sequence[Scalar] = (), stacked: Sequence[Scalar] = ()) -> Map:
        """Return the loop over ``count`` elements with the given results of the kernel."""
        columns = tuple(self.elements), tuple(self.shared), tuple(self.gather)
        of_sums, of_rows = (tuple(value.ref for value in values) for values in (sums, stacked))
        loop = Map(self.algebra.tape, count, *columns, sums=of_sums, stacked=of_rows, label=label)
        # a gathered value without use (twists, by results of strains alone) would count as an argument of the loop
        return compact(loop, ())

    def _input(self, block: str, known: list[T], entry: T) -> Scalar:
        if entry not in known:
            known.append(entry)
        kernel = self.algebra.tape
        return Scalar(kernel, kernel.input(block, known.index(entry)))


def push_on_node(wrenches: list[Wrench | None], mount: Mount, load: Six) -> None:
    """Add to ``wrenches`` (by link), in place, a moment and a force on a node's frame, (6,), in node axes."""
    moment, force = apply(mount.orientation, _vector(load[:3])), apply(mount.orientation, _vector(load[3:]))
    add_wrench(wrenches, mount.link, (plus(moment, cross(mount.position, force)), force))


def _product(rows: Sequence[Six], values: Six) -> list[Scalar]:
    return [dot(row, values) for row in rows]


def _vector(values: Six) -> Vector:
    return values[0], values[1], values[2]


LAW = Law(CosseratBeam, add_cosserat_beam, before_joints=True)
