"""Breakpoints in time: instants at which the equations on a tape are not analytic.

Low-order methods step over the breaks of smooth splines without loss of order (see ``formula.discontinuities``), and so
do steps by accelerations and their rates; a Taylor series must end at every break.
"""

from __future__ import annotations

from collections.abc import Iterator

from eomgen.errors import ModelError, Problem
from eomgen.symbolic.operations import InputSymbol, Op
from eomgen.symbolic.tape import Ref, Tape
from eomgen.system.system import Discontinuity, System

#: Operations with kinks or jumps. A selection switches with its condition, which is among these.
_NON_SMOOTH = frozenset({Op.ABS, Op.SIGN, Op.MIN, Op.MAX, Op.LT, Op.LE})
#: Origin of breakpoints that no formula of the scene has.
_OF_BEAMS = (
    " (elements of geometrically exact beams have these: the rotation vector between two nodes is one formula next to"
    " no rotation and another next to half a turn)"
)
#: Blocks that do not change during a run.
_CONSTANT = frozenset({"p", "u", "followed"})


def has_nodes(system: System) -> bool:
    """Return whether a system has geometrically exact beams: their nodes alone have names with a dot."""
    return any("." in body for body in system.bodies)


def breakpoints_in_time(source: Tape, *, analytic: bool = True, nodes: bool = False) -> tuple[Discontinuity, ...]:
    """Return the times at which an operation of the tape is not analytic, without repetition.

    ``analytic``: whether derivatives of all orders are taken, or the first alone, which smooth curves have everywhere.
    ``nodes``: whether geometrically exact beams are among the recorded bodies.

    Raises
    ------
    ModelError
        The time of a breakpoint depends on coordinates, on tunable parameters, or nonlinearly on time.
    """
    by_time: dict[tuple[float, float], Discontinuity] = {}
    unknown: list[str] = []
    for node in range(1, len(source.op)):
        op, operands = source.op[node], source.operands(node)
        if op not in _NON_SMOOTH and op is not Op.CURVE:
            continue
        if op is Op.CURVE and not analytic and _has_rate(source, node):
            continue
        blocks = {symbol.block for symbol in source.depends_on(operands)} - _CONSTANT
        lines = [line for ref in operands if (line := _line(source, ref)) is not None]
        if len(lines) == len(operands):
            by_time |= {(item.time, item.period): item for item in _breakpoints(source, node, lines)}
        elif blocks:
            curve = source.curves[source.b[node]][0].name if op is Op.CURVE else ""
            operation = f"the pieces of curve {curve!r}" if op is Op.CURVE else f"{op.name.lower()}()"
            decider = "the motion" if blocks - {"t"} else "a tunable parameter or a formula that is not linear in time"
            unknown.append(f"{operation}, decided by {decider}")
    if unknown:
        listed = "; ".join(dict.fromkeys(unknown))
        needs = "a Taylor series needs smooth equations, or discontinuities at known times"
        if not analytic:
            needs = "its steps take the rates of accelerations, which jump at kinks, and these need known times"
        fault = f"{needs}; here are {listed}{_OF_BEAMS if nodes else ''}"
        raise ModelError(Problem("method", fault, "rk4 or generalized_alpha"))
    return tuple(by_time[key] for key in sorted(by_time))


def _has_rate(tape: Tape, node: int) -> bool:
    """Return whether the recorded derivative of a curve has a continuous rate: the next derivative has no jumps."""
    curve, derivative = tape.curves[tape.b[node]]
    return all(order > derivative + 1 for _, order in curve.kinks())


def _line(tape: Tape, ref: Ref) -> tuple[float, float] | None:
    """Return (a, b) if a reference is a t + b with constants, else None."""
    node, sign = abs(ref), 1.0 if ref > 0 else -1.0
    number = tape.number(node)
    if number is not None:
        return 0.0, sign * number
    if tape.symbol(node) == InputSymbol("t", 0):
        return sign, 0.0
    if tape.op[node] not in (Op.ADD, Op.SUB, Op.MUL):
        return None
    first, second = (_line(tape, operand) for operand in tape.operands(node))
    if first is None or second is None:
        return None
    if tape.op[node] is not Op.MUL:
        side = 1.0 if tape.op[node] is Op.ADD else -1.0
        return sign * (first[0] + side * second[0]), sign * (first[1] + side * second[1])
    if first[0] and second[0]:
        return None
    return sign * (first[0] * second[1] + second[0] * first[1]), sign * first[1] * second[1]


def _breakpoints(tape: Tape, node: int, lines: list[tuple[float, float]]) -> Iterator[Discontinuity]:
    (a, b), (c, d) = lines[0], lines[1] if len(lines) > 1 else (0.0, 0.0)
    if a == c:
        return
    if tape.op[node] is not Op.CURVE:
        yield Discontinuity((d - b) / (a - c), 0.0, 0, (abs(b) + abs(d)) / abs(a - c))
        return
    curve = tape.curves[tape.b[node]][0]
    period = float(curve.breaks[-1] - curve.breaks[0]) / abs(a) if curve.outside == "periodic" else 0.0
    for time in curve.breaks:
        yield Discontinuity((float(time) - b) / a, period, 0, (abs(float(time)) + abs(b)) / abs(a))
