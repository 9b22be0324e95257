"""Equal parts with other numbers and mirrored signs are one function: the numbers of the tape, the bits of the text
without sharing, and lengths that are exact."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import eomgen
from benchmarks.build_scenes import wishbone_car
from eomgen.codegen import convert
from eomgen.codegen.convert import to_program
from eomgen.codegen.program import Program
from eomgen.codegen.scheduling import sharing
from eomgen.codegen.targets.c.tape_code import on_tape
from eomgen.codegen.targets.c.target import generate_files
from eomgen.lie.product import Factor
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.operations import Op
from eomgen.symbolic.tape import Ref, Tape
from eomgen.system.system import Block, Function, System
from tests.codegen.hand_made import call, compile_program, make_system
from tests.codegen.test_tape_engine import _on_engine

CORNERS = 4
COORDINATES = 2 + 3 * CORNERS
POINT = {
    "p": [0.7, -0.3],
    "q": np.cos(np.arange(COORDINATES)).tolist(),
    "v": np.sin(1.0 + 2.0 * np.arange(COORDINATES)).tolist(),
}
#: Corners ahead and behind, left and right.
PLACES = tuple(itertools.product((1.45, 2.75), (1.0, -1.0)))


def corner(tape: Tape, number: int, *, ahead: float, side: float, uneven: bool) -> list[Ref]:
    """Record arms whose lateral places change sign from left to right; if ``uneven``, sums that no mirror has."""
    q = [tape.input("q", 2 + 3 * number + k) for k in range(3)]
    v = [tape.input("v", 2 + 3 * number + k) for k in range(3)]
    roll, rate = tape.input("q", 0), tape.input("v", 0)
    mass, length = tape.input("p", 0), tape.input("p", 1)
    lateral, values = tape.mul(tape.constant(0.35 * side), mass), list[Ref]()
    for turn in range(12):
        with tape.block(f"arm {turn} of corner {number}"):
            place = tape.constant(ahead + 0.1 * turn)
            high = tape.add(tape.mul(place, q[turn % 3]), tape.mul(lateral, tape.mul(roll, tape.constant(side))))
            lateral = tape.add(tape.mul(lateral, tape.constant(0.5 + 0.1 * turn)), tape.mul(tape.constant(side), high))
            turned = tape.call(Op.SIN, tape.add(lateral, tape.mul(tape.constant(0.01 * side), rate)))
            norm = tape.call(Op.SQRT, tape.add(tape.mul(turned, turned), tape.constant(1.0 + abs(ahead))))
            pushed = tape.call(Op.EXP, -tape.mul(norm, v[turn % 3]))
            least = tape.call(Op.MIN, high, -pushed)
            if uneven:
                least = tape.add(tape.mul(least, length), tape.mul(tape.constant(side), tape.mul(pushed, high)))
            chosen = tape.select(tape.call(Op.LT, high, norm), tape.div(least, norm), tape.mul(pushed, length))
            values += [high, tape.mul(turned, chosen), -tape.sub(chosen, tape.mul(lateral, lateral))]
    return values


def car(*, uneven: bool = False) -> System:
    """Return a function of four corners whose results the chassis adds, besides results of their own."""
    tape = Tape()
    corners = [
        corner(tape, number, ahead=ahead, side=side, uneven=uneven) for number, (ahead, side) in enumerate(PLACES)
    ]
    with tape.block("chassis"):
        sums = [tape.call(Op.TANH, tape.add(tape.add(a, b), tape.mul(c, d))) for a, b, c, d in zip(*corners)]  # noqa: B905  # of equal lengths
    own = tuple(-ref if number % 2 else ref for number, corner_ in enumerate(corners) for ref in corner_)
    blocks = (Block("y", (len(sums),), tuple(sums)), Block("own", (len(own),), own))
    factors = (Factor("R", "all", 0, COORDINATES, 0, COORDINATES),)
    start = (0.0,) * COORDINATES
    function = Function("all", "corners", ("p", "q", "v"), blocks)
    return make_system("car", tape, [function], factors=factors, initial_q=start, initial_v=start)


@pytest.fixture
def eager(monkeypatch: pytest.MonkeyPatch) -> None:
    """Models and functions of any length are searched."""
    monkeypatch.setattr(convert, "LONG", 50)
    monkeypatch.setattr(sharing, "SHARE_FROM", 50)


def unshared(system: System, monkeypatch: pytest.MonkeyPatch) -> Program:
    with monkeypatch.context() as patch:
        patch.setattr(convert, "LONG", 10**9)
        return to_program(system)


def apart(found: NDArray[Any], wanted: NDArray[Any]) -> float:
    """Return the largest difference over the largest number."""
    return float(np.max(np.abs(found - wanted)) / np.max(np.abs(wanted)))


def sizes(program: Program) -> tuple[int, int, int, int]:
    """Return operations of functions, then operations, calls and numbers of shared stretches."""
    return (
        sum(function.operations for function in program.functions),
        sum(text.operations for text in program.shared),
        sum(text.calls for text in program.shared),
        sum(text.numbers for text in program.shared),
    )


def numbers_of_corners(program: Program) -> set[float]:
    """Return the numbers in the tables of calls of a stretch that all corners share."""
    statements = [statement for part in program.function("all").parts for statement in part.statements]
    calls = [statement.data for statement in statements if statement.kind == "share"]
    return {number for text, *_, numbers in calls if program.shared[text].calls >= CORNERS for number in numbers}


@pytest.mark.slow
@pytest.mark.long_cases("complex-True", "lanes-False")
@pytest.mark.parametrize(
    ("real", "uneven"), [("double", True), ("float", False), ("complex", True), ("lanes", False), ("double", False)]
)
def test_corners_have_the_bits_of_text_of_their_own(
    real: str, uneven: bool, cache: Path, eager: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    system = car(uneven=uneven)
    shared, plain = to_program(system), unshared(system, monkeypatch)
    assert shared.shared
    assert not plain.shared
    assert any("_together(" in text for text in generate_files(shared, file_limit=100).values())
    found, wanted = (
        call(compile_program(program, cache, real=real, profile="reproducible", file_limit=100), "all", POINT)
        for program in (shared, plain)
    )
    for own, other in zip(found, wanted, strict=True):
        assert np.array_equal(own, other)
    refs = system.functions["all"].refs
    assert apart(np.concatenate(found), evaluate(system.tape, refs, POINT)) < (1e-14 if real != "float" else 1e-5)


def test_mirrored_corners_are_one_text_without_factors(eager: None) -> None:
    """Left and right differ by signs of constants alone, which stand in the tables of the calls."""
    program = to_program(car())
    assert sizes(program) == (92, 311, 6, 12)
    assert not {1.0, -1.0} & numbers_of_corners(program)


def test_other_signs_are_factors(eager: None) -> None:
    program = to_program(car(uneven=True))
    assert sizes(program) == (96, 358, 6, 13)
    assert {1.0, -1.0} <= numbers_of_corners(program)


def test_short_functions_keep_a_text_of_their_own() -> None:
    assert not to_program(car()).shared


def test_parts_and_files_of_any_length_have_the_same_numbers(cache: Path, eager: None) -> None:
    system = car(uneven=True)
    program = to_program(system, part_limit=20)
    assert len(program.function("all").parts) > 3
    found = call(compile_program(program, cache, file_limit=100), "all", POINT)
    assert apart(np.concatenate(found), evaluate(system.tape, system.functions["all"].refs, POINT)) < 1e-14


def test_the_engine_has_the_bits_of_the_compiled_text(cache: Path, eager: None) -> None:
    program = to_program(car(uneven=True))
    assert not on_tape(program)[0].shared
    found, wanted = (
        call(library, "all", POINT)
        for library in (_on_engine(program, cache), compile_program(program, cache, profile="reproducible"))
    )
    assert all(np.array_equal(own, other) for own, other in zip(found, wanted, strict=True))


def test_the_text_says_who_shares_it(eager: None) -> None:
    text = generate_files(to_program(car()))["car.c"]
    assert "4 calls with other places w[at[...]] and numbers k[...]: arm 0 of corner 0; arm 0 of corner 1;" in text


@pytest.mark.long
def test_a_car_on_four_corners_has_a_third_of_the_text(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Double wishbones on four corners: exact lengths, and values to rounding."""
    system = eomgen.derive(wishbone_car(), ["residual", "iteration"])
    monkeypatch.setattr(convert, "LONG", 50_000)
    shared, plain = to_program(system), unshared(system, monkeypatch)
    assert sizes(shared) == (5900, 14204, 181, 136)
    assert sizes(plain) == (53225, 0, 0, 0)
    source = np.random.default_rng(1)
    for name in ("residual", "iteration"):
        inputs = {block: source.standard_normal(shared.input_size(block)) for block in shared.function(name).inputs}
        found, wanted = (call(compile_program(program, cache), name, inputs) for program in (shared, plain))
        for own, other in zip(found, wanted, strict=True):
            assert np.array_equal(own, other)
