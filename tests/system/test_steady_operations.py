"""How many operations of a step's functions depend on time, inputs, the base and parameters alone.

They are the same in every iteration of a step, and are evaluated in each all the same: over the examples they are too
few to be worth functions of their own. (Inputs and the base are functions of their own.)
"""

from __future__ import annotations

from pathlib import Path

import pytest

from eomgen.pipeline.documents import load
from eomgen.pipeline.methods import terms_of_step
from eomgen.pipeline.pipeline import derive
from eomgen.symbolic.operations import LEAVES, Op
from eomgen.system.system import System

pytestmark = pytest.mark.slow

#: Functions that are evaluated in each iteration, or each stage, by method.
REPEATED = {
    "generalized_alpha": {"residual", "partials", "equations", "iteration", "internal_rate"},
    "rk4": {"forward_dynamics", "internal_rate"},
}
#: Operations of these functions over all examples, and of them those of time and parameters alone. They may only fall.
BUDGETS = {"generalized_alpha": (111612, 264), "rk4": (9856, 81)}
_STEADY = ("p", "t", "u", "base")


def steady_operations(system: System, name: str) -> tuple[int, int]:
    """Return how many operations a function has, and how many of them are of time and parameters alone."""
    tape = system.tape
    steady: set[int] = set()
    live = tape.live(system.functions[name].refs)
    operations = [node for node in live if tape.op[node] not in LEAVES and tape.op[node] is not Op.MAP]
    for node in live:
        symbol = tape.symbol(node)
        known = tape.op[node] is Op.CONST or (symbol is not None and symbol.block in _STEADY)
        if known or (tape.operands(node) and all(abs(ref) in steady for ref in tape.operands(node))):
            steady.add(node)
    return len(operations), len(steady.intersection(operations))


@pytest.mark.long_except("rk4")
@pytest.mark.parametrize("method", REPEATED)
def test_few_operations_of_a_step_are_of_time_and_parameters_alone(method: str) -> None:
    every, steady = 0, 0
    for path in sorted(Path("examples").glob("*/scene.toml")):
        scene = load(path)
        constrained = bool(scene.constraints) or scene.coordinates == "absolute"
        if method == "rk4" and constrained:
            continue
        system = derive(scene, list(terms_of_step(scene, method)))
        called = REPEATED[method] & set(system.functions)
        for name in called - ({"residual", "partials"} if "equations" in called else set()):
            counts = steady_operations(system, name)
            every, steady = every + counts[0], steady + counts[1]
    assert (every, steady) == BUDGETS[method]
    assert steady < 0.01 * every
