"""The two functions of a motion's Taylor coefficients as parts of a Program, and which scenes have them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from eomgen.codegen.program import OutputArray, ProgramFunction
from eomgen.codegen.recurrence import NEXT, Recurrence
from eomgen.codegen.schedule import NEST_LIMIT, PART_LIMIT, schedule
from eomgen.errors import ModelError, Problem
from eomgen.symbolic.series import KEPT, LEFT, ORDER, RIGHT, SUMS
from eomgen.symbolic.tape import InputSymbol, Op, Ref, Tape
from eomgen.system import System

#: Input blocks of both functions, in the order of their arguments.
START_BLOCKS = ("p", "t", "q", "v", "z", "u", "followed")
NEXT_BLOCKS = (*NEXT.values(), SUMS, LEFT, RIGHT, KEPT, ORDER)
#: What has corners. A selection goes on after its condition, which is among these.
_ROUGH = frozenset({Op.ABS, Op.SIGN, Op.MIN, Op.MAX, Op.LT, Op.LE})
#: Blocks that do not change during a run.
_HELD = frozenset({"p", "u", "followed"})
#: Numbers in a vector; rows of products are filled up to whole ones.
LANES = 8


def check_smooth(source: Tape) -> None:
    """Raise ModelError where a motion has no Taylor series: corners at times that are not known, so that no step can end there.

    Known are those of comparisons and curves with arguments linear in time (see ``scene.corners``).
    """
    found: list[str] = []
    for node in range(1, len(source.op)):
        op, operands = source.op[node], source.operands(node)
        if (op not in _ROUGH and op is not Op.CURVE) or all(_linear_in_time(source, ref) for ref in operands):
            continue
        blocks = {symbol.block for symbol in source.depends_on(operands)} - _HELD
        if not blocks:
            continue
        curve = source.curves[source.b[node]][0].name if op is Op.CURVE else ""
        what = f"the pieces of curve {curve!r}" if op is Op.CURVE else f"{op.name.lower()}()"
        decider = "the motion" if blocks - {"t"} else "a tunable parameter or a formula that is not linear in time"
        found.append(f"{what}, decided by {decider}")
    if found:
        corners = "; ".join(dict.fromkeys(found))
        what = f"a Taylor series needs smooth equations, or corners at times that are known; here are {corners}"
        raise ModelError(Problem("method", what, "rk4 or generalized_alpha"))


def _linear_in_time(tape: Tape, ref: Ref) -> bool:
    node = abs(ref)
    if tape.op[node] is Op.INPUT:
        return tape.symbol(node) == InputSymbol("t", 0)
    if tape.op[node] is Op.CONST:
        return True
    operands = tape.operands(node)
    if tape.op[node] is Op.MUL and not any(tape.value(operand) is not None for operand in operands):
        return False
    return tape.op[node] in (Op.ADD, Op.SUB, Op.MUL) and all(_linear_in_time(tape, operand) for operand in operands)


def series_functions(system: System, curve_numbers: dict[int, int]) -> tuple[tuple[ProgramFunction, ...], dict[str, Any]]:
    """Return ``series_start`` and ``series_next``, and the sizes that a driver needs: ``products``, ``kept``, ``room`` of a row.

    Raises ModelError where the motion has no Taylor series.
    """
    recurrence = Recurrence(system, by_inverse={"mass", "residual"} <= set(system.functions))
    check_smooth(recurrence.source)
    series, tape = recurrence.series, recurrence.series.tape
    per_next = tape.input(ORDER, 2)
    start: list[tuple[str, Sequence[Ref], str]] = [
        ("left_0", [term.value for term in series.left], "left factors of the products"),
        ("right_0", [term.value for term in series.right], "right factors"),
        ("kept_0", series.kept, "what coefficients of all orders need"),
    ]
    later: list[tuple[str, Sequence[Ref], str]] = [
        ("left_k", [term.next for term in series.left], "coefficient k of the left factors, or k times it"),
        ("right_k", [term.next for term in series.right], "coefficient k of the right factors"),
    ]
    for block, terms in sorted(recurrence.rates.items()):
        start.append((f"{block}_1", [term.value for term in terms], f"rate of {block}"))
        coefficients = [tape.mul(per_next, term.next) for term in terms]
        later.append((f"{block}_next", coefficients, f"coefficient k + 1 of {block}"))
    functions = (
        _function(tape, "series_start", "values at order 0, and coefficient 1", START_BLOCKS, start, curve_numbers),
        _function(tape, "series_next", "coefficient k + 1 from those before it", NEXT_BLOCKS, later, curve_numbers),
    )
    room = -(-len(series.left) // LANES) * LANES
    return functions, {"products": len(series.left), "kept": len(series.kept), "room": room, "lanes": LANES}


def _function(
    tape: Tape, name: str, description: str, blocks: Sequence[str], outputs: Sequence[tuple[str, Sequence[Ref], str]],
    curve_numbers: dict[int, int],
) -> ProgramFunction:  # fmt: skip
    present = [output for output in outputs if output[1]]
    made = schedule(
        tape, [refs for _, refs, _ in present], blocks, PART_LIMIT, NEST_LIMIT, {}, curve_numbers, fill=False, roll=False
    )
    used = {block for part in made.parts for block in part.inputs}
    return ProgramFunction(
        name=name, description=description, inputs=tuple(block for block in blocks if block in used),
        outputs=tuple(OutputArray(label, label, (len(refs),), len(refs), text) for label, refs, text in present),
        parts=made.parts, workspace=made.workspace, operations=made.operations,
        counts={},
    )  # fmt: skip
