"""Parts with few live values: complete, in order, within the limit, and with the same bits."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from itertools import chain
from pathlib import Path

import numpy as np
import pytest

from benchmarks.robots import ROBOTS, driven, scene
from eomgen.codegen.convert import to_program
from eomgen.codegen.scheduling.few_live import split_by_live_values
from eomgen.codegen.scheduling.plan import Plan
from eomgen.mechanics.derive import derive
from eomgen.symbolic.operations import Op
from eomgen.symbolic.tape import Ref, Tape
from eomgen.system.system import Block, Function, System
from tests.codegen.hand_made import call, compile_program, make_system
from tests.codegen.test_schedule import POINT, tangled

LIMIT = 175


def robot_function(words: str) -> tuple[System, str]:
    robot, name = words.split()
    described = scene(ROBOTS[robot])
    return derive(driven(described) if name.startswith("forward") else described, [name]), name


def unsplit_plan(system: System, name: str) -> Plan:
    outputs = [block.refs for block in system.functions[name].outputs]
    return Plan(system.tape, outputs, 10**9, lambda tape, live: [])


def count_live(system: System, plan: Plan, order: Sequence[int]) -> int:
    """Return the largest number of results at an operation that are made there, or made before and read later."""
    groups = [plan.group(node) for node in order]
    reads = [{abs(ref) for node in group for ref in system.tape.operands(node)} for group in groups]
    home = {node: k for k, group in enumerate(groups) for node in group}
    ends = {
        k: max((later for later in range(k, len(order)) if reads[later] & set(groups[k])), default=k)
        for k in range(len(order))
    }
    return max(
        len(groups[k]) + sum(len(groups[made]) for made in set(home.values()) if made < k < ends[made])
        for k in range(len(order))
    )


@pytest.mark.parametrize("limit", [8, 10, 1000])
def test_parts_are_complete_and_compute_operands_first(limit: int) -> None:
    system = tangled(operations=100)
    for name, function in system.functions.items():
        plan = unsplit_plan(system, name)
        known: set[int] = set()
        parts = split_by_live_values(plan, [block.refs for block in function.outputs], limit)
        for part in parts:
            assert part.given <= known
            assert len(set(part.order)) == len(part.order)
            done = set(chain.from_iterable(map(plan.group, part.given)))
            for node in part.order:
                operands = chain.from_iterable(system.tape.operands(member) for member in plan.group(node))
                assert {abs(ref) for ref in operands if abs(ref) in plan.uses} <= done
                done.update(plan.group(node))
            known.update(part.order)
            assert part.live == count_live(system, plan, part.order)
        assert known == set(plan.order)
        assert (len(parts) == 1) == (limit == 1000)


@pytest.mark.parametrize("limit", [7, 12])
def test_outputs_have_the_same_bits(limit: int, cache: Path) -> None:
    system = tangled(operations=80, functions=3)
    programs = [to_program(system, live_limit=most) for most in (0, limit)]
    assert programs[1].functions[0].workspace > 0
    plain, few = (compile_program(program, cache) for program in programs)
    for name in system.functions:
        (wanted,), (found,) = call(plain, name, POINT), call(few, name, POINT)
        np.testing.assert_array_equal(found.view(np.int64), wanted.view(np.int64))


@pytest.mark.slow
@pytest.mark.parametrize("words", ["panda partials", "panda forward_dynamics_derivatives", "talos forward_dynamics"])
def test_equations_of_robots_have_the_same_bits(words: str, cache: Path) -> None:
    system, name = robot_function(words)
    draw = np.random.default_rng(5).normal
    sizes = {"q": system.nq, "v": system.nv, "a": system.nv, "u": len(system.inputs)}
    state = {block: draw(size=(8, size)) for block, size in sizes.items()}
    plain, few = (
        call(compile_program(to_program(system, functions=[name], live_limit=limit), cache), name, state)
        for limit in (0, LIMIT)
    )
    for wanted, found in zip(plain, few, strict=True):
        np.testing.assert_array_equal(found.view(np.int64), wanted.view(np.int64))


def two_products(operations: int) -> System:
    """Return a function whose outputs are products of many values, all made of one value of a chain of operations."""
    tape = Tape()
    q = [tape.input("q", k) for k in range(2)]
    common: Ref = q[0]
    for _ in range(operations // 2):
        common = tape.add(tape.mul(common, q[1]), q[0])

    def product(first: float) -> Ref:
        values = [tape.add(common, tape.constant(first + k)) for k in range(6)]
        return reduce(tape.mul, [*values, *(tape.call(Op.SQRT, value) for value in values)])

    return make_system("two", tape, [Function("f", "", ("q",), (Block("y", (2,), (product(1.0), product(20.0))),))])


@pytest.mark.parametrize(("operations", "slots"), [(82, 0), (86, 1)])
def test_a_value_of_many_operations_is_read_from_memory(operations: int, slots: int) -> None:
    system = two_products(operations)
    once, few = (to_program(system, live_limit=limit).function("f") for limit in (0, 3))
    assert (len(few.parts), few.workspace) == (2, slots)
    assert few.operations == once.operations + (0 if slots else operations)


def test_functions_with_loops_keep_their_parts() -> None:
    tape = Tape()
    x = [tape.mul(tape.input("q", 0), tape.input("v", 0))]
    for k in range(2000):
        x.append(tape.add(tape.mul(x[-1], tape.constant(0.5 + k)), tape.input("q", 1)))
    system = make_system("chain", tape, [Function("f", "", ("q", "v"), (Block("y", (len(x),), tuple(x)),))])
    plain, few = (to_program(system, live_limit=limit).function("f") for limit in (0, 20))
    assert any(statement.kind == "repeat" for part in plain.parts for statement in part.statements)
    assert few == plain
