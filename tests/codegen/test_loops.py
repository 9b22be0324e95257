"""Maps: a loop in C gives the bits of its unrolled form, and its code does not grow with the number of elements."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from eomgen.codegen.convert import to_program
from eomgen.codegen.scheduling.rerolling import runs
from eomgen.codegen.targets.c.target import generate_files
from eomgen.lie.product import Factor
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.map import Map, MapResults, add_map, unroll
from eomgen.symbolic.operations import Op
from eomgen.symbolic.tape import Ref, Tape
from eomgen.system.system import Block, Function, System
from tests.codegen.hand_made import call, compile_program, make_system


def chain(tape: Tape, count: int, kind: str) -> MapResults:
    """Return a chain of springs between neighbours: energy (sum), accumulated angle (carry), force and stretch
    (rows)."""
    kernel = Tape()
    left, right, angle = kernel.input("gather", 0), kernel.input("gather", 1), kernel.input("carry", 0)
    stiffness, scale = kernel.input("element", 0), kernel.input("shared", 0)
    stretch = kernel.sub(right, left)
    force = kernel.mul(kernel.mul(stiffness, scale), kernel.call(Op.SIN, stretch))
    turned = kernel.add(angle, kernel.call(Op.COS, stretch))
    q = [tape.input("q", k) for k in range(count + 1)]
    loop = Map(
        kernel=kernel,
        count=count,
        elements=(tuple(1.0 + 0.1 * k for k in range(count)),),
        shared=(tape.input("p", 0),),
        gather=(tuple(q[:-1]), tuple(q[1:])),
        initial=(-tape.mul(q[0], q[1]),),
        sums=(kernel.mul(force, stretch),),
        last=(turned,),
        stacked=(force, -kernel.mul(turned, stretch)),
        label="springs of the chain",
    )
    return add_map(tape, loop) if kind == "loop" else unroll(tape, loop)


def chain_system(count: int, kind: str) -> System:
    tape = Tape()
    results = chain(tape, count, kind)
    rows: list[Ref] = [ref for row in results.rows for ref in row]
    mixed = tape.mul(results.rows[1][0], results.sums[0])
    blocks = (
        Block("rows", (count, 2), tuple(rows)),
        Block("force", (count,), tuple(-row[0] for row in results.rows)),
        Block("rest", (3,), (results.sums[0], -results.last[0], mixed)),
    )
    functions = [
        Function("chain", "a chain", ("p", "q"), blocks),
        Function("again", "the same", ("p", "q"), blocks[2:]),
    ]
    return make_system("chain", tape, functions, initial_q=(0.0,) * (count + 1), factors=tuple(factors(count + 1)))


def factors(count: int) -> list[Factor]:
    return [Factor("R", f"q{k}", k, 1, k, 1) for k in range(count)]


@pytest.mark.slow
@pytest.mark.parametrize("real", ["double", "lanes", "complex", "float"])
def test_loop_equals_unrolled_and_the_tape(real: str, cache: Path, rng: np.random.Generator) -> None:
    count = 9
    looped = compile_program(to_program(chain_system(count, "loop")), cache, real=real, profile="reproducible")
    unrolled = compile_program(to_program(chain_system(count, "unrolled")), cache, real=real, profile="reproducible")
    point = {"p": [1.3, 0.0], "q": rng.uniform(-1, 1, (3, count + 1))}
    for name in ("chain", "again"):
        here, there = call(looped, name, point), call(unrolled, name, point)
        assert all(np.array_equal(a, b) for a, b in zip(here, there, strict=True))  # zeros of either sign are equal
    system = chain_system(count, "loop")
    wanted = evaluate(system.tape, system.functions["chain"].refs, {"p": point["p"], "q": point["q"][1]})
    found = np.concatenate([array[1] for array in call(looped, "chain", point)])
    assert np.max(np.abs(found - wanted)) < (2e-5 if real == "float" else 2e-14)


def waves_system(count: int) -> System:
    """Return two sums over the same frequencies, and their sum."""
    tape = Tape()
    sums = []
    for op, phase in ((Op.COS, 0.2), (Op.SIN, 1.3)):
        kernel = Tape()
        angle = kernel.mul(kernel.input("element", 0), kernel.input("shared", 0))
        wave = kernel.mul(kernel.input("element", 1), kernel.call(op, angle))
        columns = (tuple(0.3 * k + 0.1 for k in range(count)), tuple(phase / (1 + k) for k in range(count)))
        sums += add_map(tape, Map(kernel, count, columns, shared=(tape.input("q"),), sums=(wave,), label="waves")).sums
    block = Block("y", (3,), (*sums, tape.add(*sums)))
    return make_system(
        "waves",
        tape,
        [Function("waves", "two sums", ("q",), (block,))],
        initial_q=(0.0, 0.0),
        factors=tuple(factors(2)),
    )


@pytest.mark.parametrize(
    ("count", "lanes", "real"), [(5, 1, "complex"), (6, 2, "float"), (12, 4, "double"), (40, 8, "lanes")]
)
def test_loops_that_share_run_as_one_side_by_side(real: str, count: int, lanes: int, cache: Path) -> None:
    system = waves_system(count)
    program = to_program(system)
    [loop] = program.loops
    assert (loop.sums, loop.lanes, len(loop.constants)) == (2, lanes, 3)
    assert generate_files(program)["waves.c"].count("EG_SINCOS") == 1
    compiled = compile_program(program, cache, real=real, profile="reproducible")
    points = np.linspace(-3.0, 40.0, 11)
    [found] = call(compiled, "waves", {"q": np.stack([points, points], axis=1)})
    wanted = np.array([evaluate(system.tape, system.functions["waves"].refs, {"q": [x]}) for x in points])
    assert np.max(np.abs(found - wanted)) < (3e-6 if real == "float" else 4e-15)


def test_code_does_not_grow_with_the_elements(cache: Path) -> None:
    def statements(count: int) -> int:
        text = generate_files(to_program(chain_system(count, "loop")))["chain.c"]
        return sum(line.rstrip().endswith(";") for line in text.splitlines() if "q[" not in line or "K(" not in line)

    assert statements(500) == statements(100) <= statements(20) + 2  # one value in many places is written by a loop
    text = generate_files(to_program(chain_system(100, "loop")))["chain.c"]
    assert text.count("chain_loop1(const real") == 1
    assert "/* springs of the chain: 100 elements. */" in text


def test_runs_cover_every_place_once() -> None:
    places = [(0, 5), (1, 6), (2, 7), (3, 8), (9, 1), (4, 0), (6, 0), (8, 0), (10, 0), (11, 3)]
    found = list(runs(places))
    assert found[0] == (0, 5, 1, 1, 4)
    assert (4, 0, 2, 0, 4) in found
    spread = [(to + k * to_step, start + k * step) for to, start, to_step, step, length in found for k in range(length)]
    assert spread == places
