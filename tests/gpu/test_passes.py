"""Passes of functions of few live values, and predictions against counts of the machine code by NVRTC."""

from __future__ import annotations

import pytest

from eomgen.base.data import replace
from eomgen.codegen.convert import to_program
from eomgen.codegen.program import FunctionPart, OutputArray, Program, ProgramFunction, Statement
from eomgen.products.gpu.passes import BANDWIDTH, LIVE_LIMIT, RATE, Pass, passes
from eomgen.symbolic.tape import Tape
from eomgen.system.system import Block, Function
from tests.codegen.hand_made import make_system
from tests.codegen.test_few_live import robot_function

#: Function of a robot -> instructions in double of the kernel with and without fused products, and bytes of the stack
#: of a thread with fused ones, by NVRTC 13.5 for sm_90; numbers of inputs and outputs.
COUNTS = {
    "panda partials": (3200, 4699, 408, 168),
    "panda forward_dynamics_derivatives": (9183, 13801, 592, 161),
    "anymal_b partials": (6558, 9610, 584, 1027),
    "talos inverse_dynamics": (3444, 5196, 112, 153),
    "talos forward_dynamics": (11027, 15819, 672, 153),
}


@pytest.mark.slow_cases(*tuple(COUNTS)[1:])
@pytest.mark.parametrize("words", COUNTS)
def test_predictions_are_near_the_counts_of_the_machine_code(words: str) -> None:
    system, name = robot_function(words)
    program = to_program(system, functions=[name], live_limit=LIVE_LIMIT)
    fused, separate, stack, numbers = COUNTS[words]
    for instructions, found in ((fused, passes(program, name)), (separate, passes(program, name, fused=False))):
        least = max(8 * numbers / BANDWIDTH, instructions / RATE)
        assert least * 0.97 < sum(item.seconds for item in found) < least * 1.3  # passes load the inputs again
        assert stack <= max(item.stack for item in found) <= stack + 240


def two_chains(parts: tuple[FunctionPart, ...], workspace: int) -> Program:
    """Return a Program of one function with outputs of 3 and 40 numbers, and given parts."""
    outputs = (OutputArray("y", "y", (3,), 3, ""), OutputArray("m", "m", (40,), 40, ""))
    function = ProgramFunction("f", "", ("q",), outputs, parts, workspace, 9, {})
    tape = Tape()
    refs = tape.mul(tape.input("q", 0), tape.input("q", 1))
    program = to_program(make_system("hand", tape, [Function("f", "", ("q",), (Block("y", (1,), (refs,)),))]))
    return replace(program, functions=(function,))


def part(
    *statements: tuple[str, tuple[object, ...]], outputs: tuple[int, ...], workspace: bool = False
) -> FunctionPart:
    return FunctionPart(tuple(Statement(*item) for item in statements), ("q",), outputs, workspace, 2)


X: tuple[object, ...] = ("in", "q", 0)


def test_parts_that_pass_values_are_one_pass_and_others_stand_alone() -> None:
    first = part(("save", (0, X)), ("out", (0, 0, X)), ("out", (0, 2, X)), outputs=(0,), workspace=True)
    second = part(("out", (1, 5, X)), ("out", (1, 6, X)), outputs=(1,))
    third = part(("out", (0, 1, ("w", 0))), outputs=(0,), workspace=True)
    found = passes(two_chains((first, second, third), 1), "f")
    time = 8 * 5 / BANDWIDTH, 8 * 4 / BANDWIDTH
    assert found == (Pass((0, 2), (("y", 0, 3),), 0, 8, time[0]), Pass((1,), (("m", 5, 7),), 0, 0, time[1]))


def test_outputs_that_loops_store_count_as_whole() -> None:
    zeros = part(("fill", (1, 40)), ("out", (1, 3, X)), ("out", (0, 1, X)), outputs=(0, 1))
    copies = part(("repeat", (12, (), (X,), (("row", 1, 0, 2),))), ("out", (1, 1, X)), outputs=(1,))
    found = passes(two_chains((zeros, copies), 0), "f")
    assert [item.outputs for item in found] == [(("y", 1, 2), ("m", 0, 40)), (("m", 0, 40),)]
    assert found[0].seconds == pytest.approx(8 * (2 + 41) / BANDWIDTH, rel=1e-15)
