"""Joints between absolute bodies, many alike as one loop: equations, scales, and forces.

In absolute coordinates an equation of a joint depends on the poses of the two joined bodies alone. Joints of one type
with frames that are alike but for numbers are one ``Map``: the numbers are columns, and derivatives of the equations
are loops, too. Forces B^T lam are recorded as forces on the bodies for all joints together, so that their partials are
a loop over the joints in place of products of all entries of B.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from itertools import chain

from eomgen.base.data import dataclass
from eomgen.formula.nodes import Formula
from eomgen.mechanics.constraints.rows import ConstraintRow, rows_of_pair
from eomgen.mechanics.forces.cosserat_beams import POSE, LoopInputs
from eomgen.mechanics.forces.frame_pairs import FramePair, FramePose, lengths
from eomgen.mechanics.forces.loads import add_wrench
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.mechanics.kinematics.fields import Wrench
from eomgen.mechanics.kinematics.points import LinkKinematics
from eomgen.mechanics.tree.links import Tree
from eomgen.scene.joints.model import Constraint, Frame
from eomgen.symbolic.calculus.loops import Tangent
from eomgen.symbolic.calculus.partials import forward_partials
from eomgen.symbolic.map import add_map
from eomgen.symbolic.operations import InputSymbol
from eomgen.symbolic.scalar import Algebra, Matrix, Scalar, Vector, apply, minus, multiply, plus, skew, transpose
from eomgen.symbolic.tape import ONE, Ref, Tape

#: Least number of joints of a kind for a loop: code of fewer joints is shorter without it.
FEWEST = 16
#: Returns the generalized forces, (nv,), of a wrench for each link, None for links without one; takes a label, too.
Generalized = Callable[[Sequence[Wrench | None], str], list[Scalar]]


@dataclass(frozen=True)
class _JointEnd:
    """A frame of a joint: number of the link (negative for base and world), frame axes, (3, 3), and origin, m, in link
    axes."""

    link: int
    axes: Matrix
    origin: Vector

    @classmethod
    def of(cls, quantities: Quantities, frame: Frame) -> _JointEnd:
        mount = quantities.mount(frame)
        axes = multiply(mount.orientation, quantities.algebra.matrix(frame.orientation))
        point = plus(mount.position, apply(mount.orientation, quantities.vector(frame.position)))
        return cls(mount.link, axes, point)

    @property
    def numbers(self) -> list[Scalar]:
        return [*chain.from_iterable(self.axes), *self.origin]


@dataclass(frozen=True)
class _Member:
    """A joint of a kind: position in the list of constraints, constraint, its two frames, and value of its length or
    pitch."""

    position: int
    item: Constraint
    ends: tuple[_JointEnd, _JointEnd]
    number: Scalar


class _KernelSymbols(Quantities):
    """Symbols in the kernel of a loop over joints, in which every formula is the joint's length or pitch,
    ``number``."""

    def __init__(self, algebra: Algebra, number: Scalar) -> None:
        self.algebra, self.number = algebra, number

    def formula(self, formula: Formula) -> Scalar:
        return self.number


def rows_of_loops(
    quantities: Quantities, constraints: Sequence[Constraint], generalized: Generalized
) -> dict[int, list[ConstraintRow]]:
    """Return equations of constraints that are recorded as loops, by position in the list of constraints.

    Constraints between two frames, without drive, formula or rolling, are sorted into kinds that differ in numbers
    alone; each kind of at least ``FEWEST`` joints is one loop. Other constraints are absent from the result.
    ``generalized`` maps a wrench for each link, and a label, to generalized forces, (nv,).
    """
    kinds: dict[Hashable, list[_Member]] = {}
    for position, item in enumerate(constraints):
        if item.framed and item.equation is None and item.drive is None and not item.kind.rows[1]:
            ends = _JointEnd.of(quantities, item.first), _JointEnd.of(quantities, item.second)
            number = quantities.formula(item.length if item.type == "distance" else item.pitch)
            member = _Member(position, item, ends, number)
            if ends[0].link != ends[1].link:
                kinds.setdefault(_kind(quantities, member), []).append(member)
    result: dict[int, list[ConstraintRow]] = {}
    for members in kinds.values():
        if len(members) >= FEWEST:
            result |= _JointKind(quantities, members, generalized).rows()
    return result


def _kind(quantities: Quantities, member: _Member) -> Hashable:
    """Return a key that is equal for joints that one loop may contain. The key has the type of the joint, the kinds of
    the two links, and those numbers of the frames that are 0, 1 or -1, since the tape simplifies these."""
    links = [quantities.tree.links[end.link].kind if end.link >= 0 else end.link for end in member.ends]
    numbers = [number.constant for end in member.ends for number in end.numbers]
    return (member.item.type, *links, *(number if number in (0.0, 1.0, -1.0) else None for number in numbers))


class _JointKind:
    """Joints that differ in numbers alone: their equations, and their constraint forces, each recorded as one loop.

    Attributes
    ----------
    count : number of equations of all joints together
    """

    def __init__(self, quantities: Quantities, members: Sequence[_Member], generalized: Generalized) -> None:
        self.quantities, self.members, self.generalized = quantities, members, generalized
        kinematics = quantities.kinematics
        columns: list[list[Scalar]] = []
        for member in members:
            poses = [kinematics.pose(end.link) for end in member.ends]
            of_links = [number for R, x in poses for number in (*chain.from_iterable(R), *x)]
            columns.append([*of_links, *member.ends[0].numbers, *member.ends[1].numbers, member.number])
        self.numbers = columns
        self.count = len(members) * len(self._record_kernel([])[1])

    def _record_kernel(self, more: Sequence[Sequence[Scalar]]) -> tuple[LoopInputs, list[ConstraintRow], _LoopKernel]:
        """Record the equations of one joint on a new tape, the kernel of a loop over all joints. ``more`` has further
        numbers for each joint, such as multipliers, or is empty. Returns the inputs of the kernel with their values for
        each joint, the holonomic equations, and the kernel with poses and further numbers as inputs."""
        algebra = Algebra(Tape())
        inputs = LoopInputs(algebra, [])
        further = more or [()] * len(self.members)
        entries = zip(*[[*row, *others] for row, others in zip(self.numbers, further, strict=True)], strict=True)
        numbers = [inputs.number(column) for column in entries]
        first, second = (_pose(numbers[start : start + POSE]) for start in (0, POSE))
        start = 2 * POSE
        frames = [_pose(numbers[start + k * POSE : start + (k + 1) * POSE]) for k in (0, 1)]
        still = [member.link < 0 for member in self.members[0].ends]
        pair = _pair(algebra, (first, second), frames, still)
        end = start + 2 * POSE
        rows = rows_of_pair(_KernelSymbols(algebra, numbers[end]), self.members[0].item, pair).holonomic
        return inputs, rows, _LoopKernel(algebra, (first, second), still, numbers[end + 1 :])

    def rows(self) -> dict[int, list[ConstraintRow]]:
        """Return the holonomic equations of each joint, by position in the list of constraints; values come from one
        loop."""
        inputs, rows, _ = self._record_kernel([])
        scales = [value for row in rows for value in (row.size, row.extent, row.path_length)]
        values = self._loop_values("equations", inputs, [row.value for row in rows])
        sizes = self._loop_values("scales of the equations", inputs, scales)
        result: dict[int, list[ConstraintRow]] = {}
        for position, (member, value, size) in enumerate(zip(self.members, values, sizes, strict=True)):
            prefix = f"{self.members[0].item.name}: "
            for number, row in enumerate(rows):
                name = f"{member.item.name}: {row.name.removeprefix(prefix)}"
                scale, extent, path = size[3 * number : 3 * number + 3]
                index = position * len(rows) + number
                made = ConstraintRow(name, value[number], row.unit, scale, extent, path, group=self, in_group=index)
                result.setdefault(member.position, []).append(made)
        return result

    def forces(self, multipliers: Sequence[Scalar]) -> list[Scalar]:
        """Return the joints' part of B^T lam, (nv,), by a loop over the joints. ``multipliers`` has one number for each
        equation, (count,), joint by joint, in the order of ``in_group``."""
        each = self.count // len(self.members)
        groups = [multipliers[start : start + each] for start in range(0, self.count, each)]
        inputs, rows, kernel = self._record_kernel(groups)
        zero = kernel.algebra.zero
        work = sum((value * row.value for value, row in zip(kernel.more, rows, strict=True)), zero)
        wrenches: list[Wrench | None] = [None] * len(self.quantities.tree.links)
        for member, row in zip(self.members, self._loop_values("forces", inputs, kernel.wrenches(work)), strict=True):
            moving = [end.link for end in member.ends if end.link >= 0]
            for link, (a, b, c, x, y, z) in zip(moving, (row[:6], row[6:]), strict=False):
                add_wrench(wrenches, link, ((a, b, c), (x, y, z)))
        return self.generalized(wrenches, self._label("forces"))

    def _label(self, meaning: str) -> str:
        first, last = self.members[0].item.name, self.members[-1].item.name
        return f"{meaning} of {len(self.members)} joints, {first} to {last}"

    def _loop_values(self, meaning: str, inputs: LoopInputs, values: Sequence[Scalar]) -> list[list[Scalar]]:
        """Return for each joint the numbers that ``values`` of the kernel have, recorded as one loop on the outer tape.
        Constant values are copied as constants. ``meaning`` begins the label of the loop."""
        kernel, outer = inputs.algebra.tape, self.quantities.algebra
        varying = list(dict.fromkeys(abs(value.ref) for value in values if value.constant is None))
        loop = inputs.loop(len(self.members), self._label(meaning), stacked=[Scalar(kernel, ref) for ref in varying])
        rows = add_map(outer.tape, loop).rows if varying else [()] * len(self.members)
        fixed = {value.ref: outer.scalar(value.constant) for value in values if value.constant is not None}

        def joint_values(row: Sequence[Ref]) -> list[Scalar]:
            known = fixed | {ref: Scalar(outer.tape, result) for ref, result in zip(varying, row, strict=True)}
            return [known[value.ref] if value.ref in known else -known[-value.ref] for value in values]

        return [joint_values(row) for row in rows]


@dataclass(frozen=True)
class _LoopKernel:
    """Inputs of the kernel of a loop over joints: two poses of links, and ``more`` further numbers for each joint.
    ``still`` states for each link whether this is the base or the world."""

    algebra: Algebra
    poses: tuple[tuple[Matrix, Vector], tuple[Matrix, Vector]]
    still: Sequence[bool]
    more: Sequence[Scalar]

    def wrenches(self, work: Scalar) -> list[Scalar]:
        """Return the wrenches of a virtual work on the links that are neither base nor world, six numbers each. Moment
        first, about the origin of the link, in link axes. ``work`` is a value of the kernel, differentiated by the pose
        of each link."""
        tape = self.algebra.tape
        seeds: dict[Ref | InputSymbol, Tangent] = {}
        for end, ((R, origin), still) in enumerate(zip(self.poses, self.still, strict=True)):
            if still:
                continue
            turned = [multiply(R, skew(axis)) for axis in self.algebra.identity]
            for i in range(3):
                for j in range(3):
                    seeds[R[i][j].ref] = {6 * end + k: turned[k][i][j].ref for k in range(3) if k != j}
                seeds[origin[i].ref] = {6 * end + 3 + i: ONE}
        (tangent,) = forward_partials(tape, [work.ref], seeds)
        result: list[Scalar] = []
        for end, ((R, _), still) in enumerate(zip(self.poses, self.still, strict=True)):
            if not still:
                a, b, c, x, y, z = (
                    Scalar(tape, tangent[k]) if k in tangent else self.algebra.zero for k in range(6 * end, 6 * end + 6)
                )
                result += [a, b, c, *apply(transpose(R), (x, y, z))]
        return result


def _pose(numbers: Sequence[Scalar]) -> tuple[Matrix, Vector]:
    """Return axes, (3, 3), and origin, (3,), of twelve numbers."""
    x, y, z, origin = ((numbers[k], numbers[k + 1], numbers[k + 2]) for k in range(0, 12, 3))
    return (x, y, z), origin


def _pair(
    algebra: Algebra,
    links: Sequence[tuple[Matrix, Vector]],
    frames: Sequence[tuple[Matrix, Vector]],
    still: Sequence[bool],
) -> FramePair:
    """Return the poses of two frames on two free bodies, with the scales of their equations, as ``frame_pair`` does.

    Positions are relative to an origin near both frames, which keeps rounding errors small.

    Parameters
    ----------
    links, frames : pose of each link, and of its frame in the axes of the link
    still : whether the link is the base or the world
    """
    zero = algebra.zero_vector
    starts = [plus(x, apply(R, s)) if fixed else x for (R, x), (_, s), fixed in zip(links, frames, still, strict=True)]
    apart = minus(starts[1], starts[0])
    origins = [zero, apart]
    if still[1] and not still[0]:
        apart = minus(starts[0], starts[1])
        origins = [apart, zero]
    steps = [s for (_, s), fixed in zip(frames, still, strict=True) if not fixed]
    poses: dict[int, tuple[Matrix, Vector]] = {}
    ends: list[FramePose] = []
    for number, ((R, _), (axes, s), fixed, origin) in enumerate(zip(links, frames, still, origins, strict=True)):
        point = origin if fixed else plus(origin, apply(R, s))
        poses[number] = (R, minus(origin, apply(R, s)) if fixed else origin)
        ends.append(FramePose(number, multiply(R, axes), point))
    kinematics = LinkKinematics(Tree(algebra, (), {}, {}, (), {}), poses, {})
    size = lengths((*starts, *steps))
    return FramePair(kinematics, ends[0], ends[1], size, lengths(steps), lengths((apart, *steps)))
