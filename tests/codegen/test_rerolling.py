"""What repeats becomes loops: the same numbers, the same bits, and a text that does not grow with the number of
bodies."""

from __future__ import annotations

import functools
import random
from pathlib import Path

import numpy as np
import pytest

from eomgen.codegen.convert import to_program
from eomgen.codegen.scheduling import scheduler as scheduling
from eomgen.codegen.scheduling.rerolling import find_loops
from eomgen.formula.curves import Curve
from eomgen.lie.product import Factor
from eomgen.mechanics.derive import derive
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.map import Map, add_map
from eomgen.symbolic.operations import LEAVES, Op
from eomgen.symbolic.tape import Ref, Tape
from eomgen.system.system import BASE_LAYOUT, INPUT_BLOCKS, Block, Function, Quantity, System
from tests.codegen.hand_made import call, compile_program, make_system
from tests.oracles.robots import planar_chain

BODIES = 90


def repetitive(bodies: int = BODIES, seed: int = 1) -> System:
    """Return a function with all that loops have to get right: recursions to and fro, branches, tables, odd ones
    out."""
    source = random.Random(seed)
    tape = Tape()
    q = [tape.input("q", k) for k in range(2)]
    p = [tape.input("p", k) for k in range(2)]
    first = [tape.mul(tape.constant(source.random()), q[k % 2]) for k in range(bodies)]
    states: list[Ref] = []
    for k in range(bodies):
        with tape.block(f"body {k}"):
            above = states[source.randrange(len(states))] if states and k % 7 == 3 else (states[-1] if states else q[0])
            angle = tape.add(above, first[source.randrange(bodies)])
            s, c = tape.call(Op.SIN, angle), tape.call(Op.COS, angle)
            turned = tape.sub(tape.mul(s, p[0]), tape.mul(tape.constant(0.1 + 0.01 * k), c))
            states.append(tape.mul(tape.add(turned, p[1]), tape.constant(0.5)) if k != bodies // 2 else -turned)
    back: list[Ref] = [tape.mul(p[0], p[1])]
    for state in reversed(states):
        pair = tape.mul(state, tape.add(back[-1], tape.input("v", len(back) % 2)))
        back.append(tape.div(pair, tape.add(tape.mul(state, state), tape.constant(2.0))))
    circular = [tape.call(Op.COS, q[0]), tape.call(Op.SIN, q[1])]
    refs = (*states, *(-ref for ref in back), states[3], -states[3], *circular, back[5], p[0], *first[:3])
    return make_system(
        "repetitive", tape, [Function("all", "repeats", ("p", "q", "v"), (Block("y", (len(refs),), refs),))]
    )


def signed(bodies: int = BODIES) -> System:
    """Return a function whose bodies are rolled, and read values of other bodies, inputs and constants with a minus.

    Products and sums pass a minus on; exponentials and maxima keep it where it is read.
    """
    tape = Tape()
    p = [tape.input("p", k) for k in range(2)]
    states = [p[0], p[1], tape.mul(p[0], p[1])]
    for k in range(bodies):
        with tape.block(f"body {k}"):
            falling = tape.call(Op.EXP, -states[-3])  # of a turn before, from the workspace
            pushed = tape.call(Op.EXP, -tape.input("v", k))  # an input of its own in each turn
            held = tape.call(Op.MAX, -states[-2], tape.constant(-0.3 - 0.001 * k))
            mixed = tape.add(
                tape.mul(falling, tape.constant(0.2 + 0.001 * k)), tape.mul(pushed, tape.constant(0.3 - 0.001 * k))
            )
            states.append(tape.sub(tape.mul(mixed, tape.sub(held, states[-1])), tape.mul(held, p[1])))
    refs = tuple(states)
    factors = (Factor("R", "all", 0, bodies, 0, bodies),)
    function = Function("all", "signs", ("p", "v"), (Block("y", (len(refs),), refs),))
    return make_system(
        "signed", tape, [function], factors=factors, initial_q=(0.0,) * bodies, initial_v=(0.0,) * bodies
    )


POINT = {"p": [0.7, -0.3], "q": [0.4, 1.9], "v": [-1.1, 0.2]}


@pytest.fixture
def eager(monkeypatch: pytest.MonkeyPatch) -> None:
    """Functions of any length are searched."""
    monkeypatch.setattr(scheduling, "REROLL_FROM", 100)
    monkeypatch.setattr(scheduling, "REROLLED_PART", 1.0)


def loops_of(system: System, name: str = "all") -> list[int]:
    function = to_program(system).function(name)
    return [statement.data[0] for part in function.parts for statement in part.statements if statement.kind == "repeat"]


@pytest.mark.parametrize(("seed", "part_limit"), [(1, 1500), (2, 60)])
def test_loops_give_the_numbers_of_the_tape(seed: int, part_limit: int, cache: Path, eager: None) -> None:
    system = repetitive(seed=seed)
    assert len(loops_of(system)) >= 2
    (found,) = call(compile_program(to_program(system, part_limit=part_limit), cache), "all", POINT)
    wanted = evaluate(system.tape, system.functions["all"].refs, POINT)
    assert np.max(np.abs(found - wanted)) < 1e-13


def test_loops_read_values_of_other_turns_and_inputs_with_their_sign(cache: Path, eager: None) -> None:
    system = signed()
    point = {"p": [0.7, -0.3], "v": (0.4 * np.sin(np.arange(BODIES))).tolist()}
    program = to_program(system)
    (loop,) = [s for part in program.function("all").parts for s in part.statements if s.kind == "repeat"]
    assert loop.data[0] >= BODIES // 2 - 2  # of two bodies each, whose signs alternate
    blocks = {expression[1][1] for expression in loop.data[2] if expression[0] == "neg"}
    assert blocks == {"w", "v"}
    (found,) = call(compile_program(program, cache), "all", point)
    wanted = evaluate(system.tape, system.functions["all"].refs, point)
    assert np.max(np.abs(found - wanted)) < 1e-13 and np.ptp(wanted[3:]) > 0.1


def test_short_functions_stay_as_they_are() -> None:
    assert not loops_of(repetitive())


def test_what_does_not_repeat_stays_as_it_is() -> None:
    source = random.Random(4)
    tape = Tape()
    nodes: list[Ref] = [tape.input("q", 0), tape.input("q", 1)]
    for _ in range(3000):
        x, y = source.choice(nodes[-50:]), source.choice(nodes[-50:])
        nodes.append(source.choice([tape.add, tape.sub, tape.mul])(x, y))
    live = [node for node in tape.live(nodes[-5:]) if tape.op[node] not in LEAVES]
    assert not find_loops(tape, live)


BASE_SIZE = sum(size for _, size, _ in BASE_LAYOUT)
SIZES = {"p": 3, "t": 1, "q": 2, "v": 2, "a": 2, "z": 2, "lam": 2, "u": 2, "base": 3}
#: Operations with a statement or a macro of their own in C.
OPERATIONS = (Op.SIN, Op.COS, Op.TAN, Op.ATAN2, Op.ABS, Op.SELECT, Op.CURVE, Op.MAX)


def of_inputs(block: str, *, with_map: bool) -> System:
    """Return a function with a chain that becomes a loop, whose bodies and outputs use every operation of a block."""
    tape = Tape()
    found = [tape.input(block, k) for k in range(SIZES[block])]
    angles = [tape.input("q", k) for k in range(2)]
    table = Curve("table", np.linspace(-9, 9, 7), np.cos(np.arange(7.0)), outside="hold")
    second = [found[(k + 1) % len(found)] for k in range(len(found))]

    def of(op: Op, x: Ref, y: Ref) -> Ref:
        if op is Op.CURVE:
            return tape.curve(table, 0, x)
        if op is Op.SELECT:
            return tape.select(tape.call(Op.LT, x, y), x, tape.constant(0.25))
        return tape.call(op, x, y) if op in (Op.ATAN2, Op.MAX) else tape.call(op, x)

    values = [of(op, x, y) for op in OPERATIONS for x, y in zip(found, second, strict=True)]
    values += [-value for value in values]
    state = tape.mul(angles[0], angles[1])
    states: list[Ref] = []
    for k in range(40):
        s, c = tape.call(Op.SIN, state), tape.call(Op.COS, state)
        turned = tape.add(tape.mul(s, values[0]), tape.mul(tape.constant(0.1 + 0.01 * k), c))
        turned = tape.add(turned, tape.mul(values[len(found)], found[-1]))
        state = tape.mul(tape.add(turned, of(Op.MAX, found[0], angles[1])), tape.constant(0.5))
        states.append(state)
    if with_map:
        kernel = Tape()
        pair = kernel.mul(kernel.call(Op.SIN, kernel.input("gather", 0)), kernel.input("shared", 0))
        gathered = tuple([*found, *(-ref for ref in found), *states][:12])
        loop = Map(kernel, len(gathered), shared=(found[0],), gather=(gathered,), sums=(pair,), stacked=(pair,))
        results = add_map(tape, loop)
        states += [results.sums[0], *(ref for row in results.rows for ref in row)]
    refs = (*values, *states, *found, *(-ref for ref in found), *(found[0] for _ in range(70)))
    quantities = {key: tuple(Quantity(f"{key}{k}") for k in range(SIZES[key])) for key in ("p", "u", "z")}
    names = tuple(name for name in INPUT_BLOCKS if name in {block, "q"})
    function = Function("all", "operations of a block", names, (Block("y", (len(refs),), refs),))
    return make_system(
        "special",
        tape,
        [function],
        parameters=quantities["p"],
        inputs=quantities["u"],
        states=quantities["z"],
        multipliers=("first", "second"),
        row_units=("m", "m"),
    )


@pytest.mark.slow_cases("v", "a", "z", "u")
@pytest.mark.parametrize("block", SIZES)
def test_special_operations_of_every_block_compile_beside_loops(block: str, cache: Path, eager: None) -> None:
    system = of_inputs(block, with_map=block not in ("q", "lam"))
    assert loops_of(system)
    size = BASE_SIZE if block == "base" else SIZES[block]
    point = {"q": [0.4, 1.9], block: (0.3 * np.cos(np.arange(size))).tolist()}
    (found,) = call(compile_program(to_program(system), cache), "all", point)
    wanted = evaluate(system.tape, system.functions["all"].refs, point)
    assert np.max(np.abs(found - wanted)) < 1e-13 * max(1.0, np.max(np.abs(wanted)))


@functools.cache
def chain_of(links: int) -> System:
    return derive(planar_chain(links))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["forward_dynamics", "iteration"])
def test_the_text_of_a_chain_does_not_grow_with_its_links(name: str) -> None:
    def statements(links: int) -> int:
        program = to_program(chain_of(links), functions=[name])
        return sum(
            len(part.statements) + sum(len(s.data[1]) for s in part.statements if s.kind == "repeat")
            for part in program.function(name).parts
        )

    short, long = statements(150), statements(210)
    assert long <= short + 3 * 60  # some outputs are still stored one by one
    assert long <= 1500
