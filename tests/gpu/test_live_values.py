"""Live values of parts: exact figures of robots, and the rule by which they are counted."""

from __future__ import annotations

import pytest

from eomgen.codegen.convert import to_program
from eomgen.codegen.program import FunctionPart, Statement
from eomgen.products.gpu.target import LIVE_LIMIT
from tests.codegen.test_few_live import robot_function
from tests.gpu.live_values import live_values

#: Function of a robot -> live values of each part, operations, and values in the workspace.
FIGURES = {
    "panda partials": ([163, 147], 4073, 0),
    "panda forward_dynamics_derivatives": ([170, 168, 165, 173, 155], 12189, 0),
    "anymal_b partials": ([161, 153], 8175, 0),
    "talos inverse_dynamics": ([128], 3664, 0),
    "talos forward_dynamics": ([171, 173], 12562, 20),
}


@pytest.mark.slow_cases(*tuple(FIGURES)[1:])
@pytest.mark.parametrize("words", FIGURES)
def test_live_values_operations_and_workspace_of_robots(words: str) -> None:
    system, name = robot_function(words)
    function = to_program(system, functions=[name], live_limit=LIVE_LIMIT).function(name)
    found = [live_values(part) for part in function.parts], function.operations, function.workspace
    assert found == FIGURES[words]


def test_live_values_are_counted_from_statement_to_statement() -> None:
    angles, weights = ("in", "q", 0), ("in", "q", 1)
    statements = (
        Statement("label", ("a paragraph",)),
        Statement("sincos", (1, 2, angles)),
        Statement("let", (3, ("MUL", 1, weights))),
        Statement("out", (0, 0, ("neg", ("ADD", -1, ("K", 7.0))))),
        Statement("let", (4, ("CURVE", 3, 2, 1))),
        Statement("save", (5, ("ADD", ("MUL", 2, 4), ("w", 4)))),
    )
    part = FunctionPart(statements, ("q",), (0,), True, 6)
    assert live_values(part) == 3
    assert live_values(FunctionPart(statements[:2], ("q",), (), False, 1)) == 2
