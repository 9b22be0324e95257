"""Functions of rotations and poses in a step, with first and second derivatives, as operations for C.

Updates q o exp(theta), rates of q and of increments, and momenta along increments. A change of the length of a
quaternion does not count: functions are of q/|q|.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache

from eomgen.base.data import dataclass
from eomgen.codegen.program import Statement
from eomgen.codegen.targets.c.printer import BranchingPrinter, indent_lines
from eomgen.lie.algebra import TapeAlgebra, Value
from eomgen.lie.groups import Group, group_named
from eomgen.lie.kernels import GroupKernel
from eomgen.lie.rotations import quaternion_product, rotation_matrix
from eomgen.symbolic.calculus.partials import forward_partials, gradient_along
from eomgen.symbolic.operations import InputSymbol
from eomgen.symbolic.scalar import Scalar, apply, dot
from eomgen.symbolic.tape import ONE, ZERO, Ref, Tape

Values = Sequence[Value]
Places = tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class GroupFunction:
    """A function of small vectors with the nonzeros of both derivatives, as C.

    Attributes
    ----------
    name : ``update_so3`` and the like
    meaning : the equation
    sizes : numbers of each argument, in order
    size : numbers of the result
    jacobian, hessian : (row, column) of the nonzeros; of the Hessian the lower triangle
    bodies : statements of the value, of the nonzeros of the Jacobian, and of the Hessian of weights . result
    """

    name: str
    meaning: str
    sizes: Mapping[str, int]
    size: int
    jacobian: Places
    hessian: Places
    bodies: tuple[str, str, str]


def _unit(algebra: TapeAlgebra, q: Values) -> list[Value]:
    length = algebra.sqrt(dot(q[:4], q[:4]))
    return [*(x / length for x in q[:4]), *q[4:]]


def _update(algebra: TapeAlgebra, group: Group, q: Values, theta: Values) -> list[Value]:
    return group.update(algebra, _unit(algebra, q), theta)


def _configuration_rate(algebra: TapeAlgebra, group: Group, q: Values, v: Values) -> list[Value]:
    unit = _unit(algebra, q)
    turning = quaternion_product(unit[:4], [algebra.scalar(0.0), *v[:3]])
    travel = apply(rotation_matrix(unit[:4]), v[3:]) if group.v_size == 6 else ()  # type: ignore[arg-type]
    return [*(x * 0.5 for x in turning), *travel]


def _increment_rate(_: TapeAlgebra, group: Group, theta: Values, v: Values) -> list[Value]:
    rows = group.bracket_matrix(theta)
    first = [dot(row, v) for row in rows]
    second = [dot(row, first) for row in rows]
    return [x + y * 0.5 + z / 12.0 for x, y, z in zip(v, first, second, strict=True)]


def _cotangent(algebra: TapeAlgebra, group: Group, theta: Values, x: Values) -> list[Value]:
    rows = group.tangent_inverse(algebra, theta)
    return [dot([row[k] for row in rows], x) for k in range(group.v_size)]


#: Arguments, equation and record of each function.
_FUNCTIONS: Mapping[str, tuple[tuple[str, str], str, Callable[..., list[Value]]]] = {
    "update": (("q", "theta"), "q o exp(theta)", _update),
    "configuration_rate": (("q", "v"), "q' at the velocity v", _configuration_rate),
    "increment_rate": (("theta", "v"), "v + [theta, v]/2 + [theta, [theta, v]]/12", _increment_rate),
    "cotangent": (("theta", "x"), "T(theta)^-T x", _cotangent),
}


@cache
def group_function(name: str, group_name: str) -> GroupFunction:
    """Return a function of rotations or poses with both derivatives, as statements in C; made once for each pair of
    names.

    Parameters
    ----------
    name : ``update``, ``configuration_rate``, ``increment_rate`` (up to two brackets, as explicit methods take
        T(theta)^-1 v) or ``cotangent`` (of momenta)
    group_name : ``SO3`` or ``SE3``
    """
    blocks, meaning, function = _FUNCTIONS[name]
    group = group_named(group_name)
    tape = Tape()
    algebra = TapeAlgebra(tape)
    sizes = {block: group.q_size if block == "q" else group.v_size for block in blocks}
    arguments = [[Scalar(tape, tape.input(block, k)) for k in range(size)] for block, size in sizes.items()]
    values = [algebra.scalar(value).ref for value in function(algebra, group, *arguments)]
    symbols = [InputSymbol(block, k) for block, size in sizes.items() for k in range(size)]
    seeds: dict[Ref | InputSymbol, dict[int, Ref]] = {symbol: {number: ONE} for number, symbol in enumerate(symbols)}
    first = _nonzeros(forward_partials(tape, values, seeds))
    weights = [tape.input("weights", k) for k in range(len(values))]
    gradient = gradient_along(tape, values, weights, seeds, len(symbols))
    second = {
        entry: ref for entry, ref in _nonzeros(forward_partials(tape, gradient, seeds)).items() if entry[0] >= entry[1]
    }
    inputs = (*sizes.items(), ("weights", len(values)))

    def body(refs: Sequence[Ref]) -> str:
        kernel = GroupKernel(name, meaning, inputs, tape, tuple(refs))
        statements = [Statement("let", (number, operation)) for number, operation in kernel.statements()]
        statements += [Statement("out", (0, number, value)) for number, value in enumerate(kernel.results())]
        printer = BranchingPrinter({block: f"{block}[{{}}]" for block, _ in inputs}, ["out"])
        return indent_lines(printer.lines(statements), 1)

    bodies = body(values), body(list(first.values())), body(list(second.values()))
    full = f"{name}_{group_name.lower()}"
    return GroupFunction(full, f"{meaning}, on {group_name}", sizes, len(values), tuple(first), tuple(second), bodies)


def _nonzeros(tangents: Sequence[Mapping[int, Ref]]) -> dict[tuple[int, int], Ref]:
    entries = {(row, column): ref for row, tangent in enumerate(tangents) for column, ref in sorted(tangent.items())}
    return {entry: ref for entry, ref in entries.items() if abs(ref) != ZERO}
