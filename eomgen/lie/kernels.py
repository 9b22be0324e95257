"""Lie group functions called in a time step (update, tangent, cotangent, bracket, transport, rate), as tapes and as
printable statements."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from typing import Any

from numpy.typing import NDArray

from eomgen.base.data import dataclass
from eomgen.lie.algebra import TapeAlgebra, Value
from eomgen.lie.groups import Group
from eomgen.symbolic.calculus.partials import jacobian_vector
from eomgen.symbolic.evaluate import Evaluation
from eomgen.symbolic.operations import LEAVES, InputSymbol
from eomgen.symbolic.scalar import Scalar, dot
from eomgen.symbolic.tape import Ref, Tape

Array = NDArray[Any]


@dataclass(frozen=True)
class GroupKernel:
    """A function of small vectors on one group, recorded on a tape and printable as statements.

    Attributes
    ----------
    name : str
        ``update_se3`` and the like.
    description : str
        The equation.
    inputs : tuple of (name, size)
    tape, refs
        Recorded operations, and the components of the result.
    """

    name: str
    description: str
    inputs: tuple[tuple[str, int], ...]
    tape: Tape
    refs: tuple[Ref, ...]

    def statements(self) -> list[list[Any]]:
        """Return the statements in order: the number of each, and its expression as in ``codegen.program``, lists for
        tuples."""
        numbers = self._numbers()
        return [[number, self._operation(node, numbers)] for node, number in numbers.items()]

    def results(self) -> list[Any]:
        """Return the expressions of the components."""
        numbers = self._numbers()
        return [self._operand(ref, numbers) for ref in self.refs]

    def _numbers(self) -> dict[int, int]:
        """Return numbers from 1 by node, in order, for the nodes that become statements. These are nodes of results,
        nodes that are used more than once, and nodes whose expression has ten operations or more."""
        tape = self.tape
        nodes = [node for node in tape.live(self.refs) if tape.op[node] not in LEAVES]
        uses = Counter(abs(ref) for node in nodes for ref in tape.operands(node))
        results = {abs(ref) for ref in self.refs}
        sizes: dict[int, int] = {}
        numbers: dict[int, int] = {}
        for node in nodes:
            size = 1 + sum(sizes.get(abs(ref), 0) for ref in tape.operands(node))
            if uses[node] > 1 or size >= 10 or node in results:
                numbers[node] = len(numbers) + 1
            else:
                sizes[node] = size
        return numbers

    def _operation(self, node: int, numbers: dict[int, int]) -> list[Any]:
        return [self.tape.op[node].name, *(self._operand(ref, numbers) for ref in self.tape.operands(node))]

    def _operand(self, ref: Ref, numbers: dict[int, int]) -> Any:
        constant, symbol, node = self.tape.value(ref), self.tape.symbol(ref), abs(ref)
        if constant is not None:
            return ["K", constant]
        if node in numbers:
            return numbers[node] if ref > 0 else -numbers[node]
        plain = ["in", symbol.block, symbol.index] if symbol is not None else self._operation(node, numbers)
        return plain if ref > 0 else ["neg", plain]


def _product(rows: Iterable[Sequence[Value]], x: Sequence[Value]) -> list[Value]:
    return [dot(row, x) for row in rows]


def _tangent_blocks(group: Group, algebra: TapeAlgebra, theta: Sequence[Value]) -> list[Value]:
    """Return the distinct 3 x 3 blocks of T(theta): (0, 0), and on SE(3) also (3, 0)."""
    T = group.tangent(algebra, theta)
    offsets = (0, 3) if group.name == "SE3" else (0,)
    return [T[offset + i][j] for offset in offsets for i in range(3) for j in range(3)]


#: By name: the equation, the inputs (q and g are elements of the group, others increments), and the function.
_KERNELS: Mapping[str, tuple[str, tuple[str, ...], Callable[..., list[Value]]]] = {
    "update": (
        "out = q o exp(theta), the quaternion at unit length",
        ("q", "theta"),
        lambda group, algebra, q, theta: group.update(algebra, q, theta),
    ),
    "tangent": (
        "out = blocks of T(theta): exp(theta)^-1 d exp(theta) = (T(theta) d theta)~",
        ("theta",),
        _tangent_blocks,
    ),
    "cotangent": (  # maps a momentum at an end of exp(theta) to its mean velocity
        "out = T(theta)^-T x",
        ("theta", "x"),
        lambda group, algebra, theta, x: _product(zip(*group.tangent_inverse(algebra, theta), strict=True), x),
    ),
    "bracket": ("out = [x, y]", ("x", "y"), lambda group, _, x, y: _product(group.bracket_matrix(x), y)),
    "transport": (  # the twist x of the source frame of g in the target frame
        "out = Ad(g)^-1 x",
        ("g", "x"),
        lambda group, _, g, x: _product(group.adjoint(group.inverse(g)), x),
    ),
    "rate": (  # of canonical coordinates theta that move with velocity v
        "out = T(theta)^-1 v, for rotation angles below 2 pi",
        ("theta", "v"),
        lambda group, algebra, theta, v: _product(group.tangent_inverse(algebra, theta), v),
    ),
}


def group_kernel(name: str, group: Group) -> GroupKernel:
    """Return a kernel on a group by name: ``update``, ``tangent``, ``cotangent``, ``bracket``, ``transport`` or
    ``rate``, with the operations on a tape of its own."""
    equation, names, function = _KERNELS[name]
    tape = Tape()
    algebra = TapeAlgebra(tape)
    inputs = tuple((block, group.q_size if block in "qg" else group.v_size) for block in names)
    arguments = [[Scalar(tape, tape.input(block, k)) for k in range(size)] for block, size in inputs]
    refs = tuple(algebra.scalar(value).ref for value in function(group, algebra, *arguments))
    return GroupKernel(f"{name}_{group.name.lower()}", f"{equation}, on {group.name}", inputs, tape, refs)


def tangent_along(group: Group, theta: Array, direction: Array, *, inverse: bool = False) -> Array:
    """Return the derivative of T(theta), or with ``inverse`` of T(theta)^-1, along a direction of theta.

    The result has the shape (..., v_size, v_size).

    Parameters
    ----------
    theta, direction : (..., v_size), of shapes that broadcast; real or complex
    """
    entries = _tangent_slopes(group, inverse).on_arrays({"theta": theta, "direction": direction})
    return entries.reshape(*entries.shape[:-1], group.v_size, group.v_size)


@cache
def _tangent_slopes(group: Group, inverse: bool) -> Evaluation:
    """Return the change of the entries of T(theta), or T(theta)^-1, along a direction, recorded on a tape."""
    tape = Tape()
    algebra = TapeAlgebra(tape)
    symbols = [InputSymbol("theta", k) for k in range(group.v_size)]
    theta = [Scalar(tape, tape.input(symbol.block, symbol.index)) for symbol in symbols]
    rows = (group.tangent_inverse if inverse else group.tangent)(algebra, theta)
    refs = [algebra.scalar(entry).ref for row in rows for entry in row]
    moved: dict[Ref | InputSymbol, Ref] = {symbol: tape.input("direction", symbol.index) for symbol in symbols}
    return Evaluation(tape, jacobian_vector(tape, refs, moved))
