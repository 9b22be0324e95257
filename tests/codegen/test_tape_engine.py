"""Functions on the tape engine: the values of Python for each operation, the bits of C without fused products."""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import eomgen
from eomgen.codegen.convert import to_program
from eomgen.codegen.metadata import interface_layout
from eomgen.codegen.program import Program
from eomgen.codegen.targets.c.interface import INTERFACE_CDEF, fingerprint
from eomgen.codegen.targets.c.tape_code import OPERATIONS, before_scheduling, functions_of_data, on_tape
from eomgen.codegen.targets.c.target import written_on_tape
from eomgen.formula.curves import Curve
from eomgen.pipeline.model import Model
from eomgen.symbolic.operations import LEAVES, UNARY, Op
from eomgen.symbolic.tape import Tape
from eomgen.system.system import Block, Function
from eomgen.toolchain import library
from eomgen.toolchain.builder import Builder
from eomgen.toolchain.cache import Cache
from eomgen.toolchain.library import Library
from eomgen.toolchain.tables import packed_tables
from tests.codegen.hand_made import call, compile_program, make_system
from tests.codegen.test_schedule import POINT, tangled

EXAMPLES = Path(__file__).parents[2] / "examples"
#: One for each kind of statement between runs of the engine: loops, tables, samples, events, several methods.
KINDS = ("bouncing_ball", "four_bar", "hanging_chain", "half_car_on_measured_road", "pi_servo", "active_vehicle")


def _on_engine(program: Program, folder: Path, real: str = "double") -> Library:
    coded, tape = on_tape(program)
    files = written_on_tape(coded, folder / "templates")
    heads = tape.placed_heads(len(coded.functions))
    data = packed_tables(fingerprint(files).encode(), {"tape": tape.numbers}, heads, tape.code)
    builder = Builder("instant", real, None, Cache(folder))
    return builder.build(data, files, INTERFACE_CDEF, interface_layout(coded), tables=lambda: data)


_TWO = (Op.ADD, Op.SUB, Op.MUL, Op.DIV, Op.ATAN2, Op.POW, Op.MIN, Op.MAX, Op.LT, Op.LE)
_ONE = tuple(sorted(UNARY))
#: Functions of C and Python of which the last bits are not given by IEEE 754.
_ROUNDED = {*UNARY, Op.ATAN2, Op.POW} - {Op.SQRT, Op.ABS, Op.SIGN}


def _python(op: Op, *x: float) -> float:
    plain: dict[Op, Callable[..., float]] = {
        Op.ADD: lambda a, b: a + b,
        Op.SUB: lambda a, b: a - b,
        Op.MUL: lambda a, b: a * b,
        Op.DIV: lambda a, b: a / b,
        Op.MIN: lambda a, b: b if b < a else a,
        Op.MAX: lambda a, b: b if a < b else a,
        Op.LT: lambda a, b: float(a < b),
        Op.LE: lambda a, b: float(a <= b),
        Op.ABS: abs,
        Op.SIGN: lambda a: float((a > 0) - (a < 0)),
    }
    return plain[op](*x) if op in plain else float(getattr(math, op.name.lower())(*x))


@pytest.fixture(scope="module")
def each_operation(cache: Path) -> Library:
    """Return a function with each operation on q[0] and q[1], and on their negatives."""
    tape = Tape()
    x, y = tape.input("q", 0), tape.input("q", 1)
    refs = [tape.call(op, x) for op in _ONE] + [tape.call(op, x, y) for op in _TWO]
    refs += [tape.call(op, -x, y) for op in _TWO[:4]] + [tape.call(op, x, -y) for op in _TWO[:4]]
    refs += [tape.select(tape.call(Op.LT, x, y), -x, y)]
    block = Block("y", (len(refs),), tuple(refs))
    return _on_engine(to_program(make_system("operations", tape, [Function("f", "", ("q",), (block,))])), cache)


@pytest.mark.slow
@settings(max_examples=200, deadline=None)
@given(st.floats(0.01, 0.99), st.floats(0.01, 0.99) | st.just(0.5))
def test_each_operation_has_the_value_of_python(each_operation: Library, x: float, y: float) -> None:
    (made,) = call(each_operation, "f", {"q": [x, y]})
    wanted = [(op, _python(op, x)) for op in _ONE] + [(op, _python(op, x, y)) for op in _TWO]
    wanted += [(op, _python(op, -x, y)) for op in _TWO[:4]] + [(op, _python(op, x, -y)) for op in _TWO[:4]]
    wanted += [(Op.SELECT, -x if x < y else y)]
    for value, (op, expected) in zip(made, wanted, strict=True):
        if op in _ROUNDED:
            assert value == pytest.approx(expected, rel=4e-16, abs=4e-16), op.name
        else:
            assert value == expected, op.name


def test_the_engine_has_every_operation_of_the_tape() -> None:
    assert {op.name for op in Op} - {op.name for op in LEAVES} - {"MAP", "CURVE"} <= set(OPERATIONS)


def test_parts_and_workspace_have_the_bits_of_c(cache: Path) -> None:
    program = to_program(tangled(operations=150, functions=2), part_limit=41, nest_limit=3)
    assert any(len(function.parts) > 1 and function.workspace for function in program.functions)
    engine, compiled = _on_engine(program, cache), compile_program(program, cache)
    for function in program.functions:
        assert call(engine, function.name, POINT)[0].tobytes() == call(compiled, function.name, POINT)[0].tobytes()


def test_curves_have_the_values_of_the_curve(cache: Path) -> None:
    """Curves stay C between runs of the engine: values and slopes, of arguments that the engine computes."""
    tape, x = Tape(), np.linspace(-2.0, 2.0, 9)
    curve = Curve("hill", x, 3.0 / (1.0 + x**2))
    q = [tape.input("q", k) for k in range(2)]
    argument = tape.sub(tape.mul(q[0], q[1]), q[0])
    refs = [tape.call(Op.SIN, tape.curve(curve, 0, argument)), tape.mul(tape.curve(curve, 1, -q[1]), q[0])]
    many = q[0]
    for _ in range(50):  # functions of fewer operations stay C
        many = tape.call(Op.SIN, many)
    block = Block("y", (3,), (*refs, many))
    program = to_program(make_system("curves", tape, [Function("f", "", ("q",), (block,))]))
    engine = _on_engine(program, cache)
    for here in ([0.3, 1.4], [-0.7, 0.2]):
        (found,) = call(engine, "f", {"q": here})
        along, nested = here[0] * here[1] - here[0], here[0]
        for _ in range(50):
            nested = math.sin(nested)
        values = [math.sin(curve(np.array(along))), here[0] * curve(np.array(-here[1]), 1), nested]
        np.testing.assert_allclose(found, values, rtol=1e-14)


def test_threads_share_no_registers(cache: Path) -> None:
    program = to_program(tangled(operations=150, functions=1))
    engine = _on_engine(program, cache)
    points = [{**POINT, "q": [0.1 * k, 1.0]} for k in range(8)]
    alone = [call(engine, "tangle0", point)[0].tobytes() for point in points]

    def often(k: int) -> set[bytes]:
        return {call(engine, "tangle0", points[k])[0].tobytes() for _ in range(200)}

    with ThreadPoolExecutor(8) as pool:
        assert list(pool.map(often, range(8))) == [{bits} for bits in alone]


@pytest.mark.slow_cases("complex")
@pytest.mark.parametrize("real", ["float", "complex"])
def test_other_number_types_agree_with_c(real: str, cache: Path) -> None:
    program = to_program(tangled(operations=100, functions=1))
    engine, compiled = _on_engine(program, cache, real), compile_program(program, cache, real=real)
    one, other = call(engine, "tangle0", POINT)[0], call(compiled, "tangle0", POINT)[0]
    assert one == pytest.approx(other, rel=1e-12)


@pytest.mark.parametrize("example", ["four_bar", "robot_arm"])
def test_texts_are_known_before_functions_are_scheduled(example: str, tmp_path: Path) -> None:
    system = eomgen.derive(EXAMPLES / example / "scene.toml")
    early = before_scheduling(to_program(system, scheduled=False))
    assert early is not None
    coded, _ = on_tape(to_program(system))
    assert functions_of_data(coded) == set(system.functions)
    assert written_on_tape(early, tmp_path) == written_on_tape(coded, tmp_path)


def test_long_programs_and_moving_bases_are_scheduled_first() -> None:
    shaken = eomgen.derive(EXAMPLES / "double_pendulum_on_shaking_base" / "scene.toml")
    assert before_scheduling(to_program(shaken, scheduled=False)) is None
    assert before_scheduling(to_program(tangled(operations=20_000, functions=1), scheduled=False)) is None


def _bits(model: Model) -> dict[str, bytes]:
    """Return the bytes of all functions at random arguments, and of the states after some steps."""
    random = np.random.default_rng(7)
    bits = {}
    for function in model.library.layout["functions"]:
        own = {"p": model.parameter_array(), "q": model.initial_q}
        sizes = zip(function["inputs"], function["input_sizes"], strict=True)
        inputs = [own[name] + 0.0 if name in own else 0.3 * random.standard_normal(size) for name, size in sizes]
        outputs = [np.full(output["size"], 7.0) for output in function["outputs"]]
        model.library.call(function["name"], inputs, outputs)
        bits[function["name"]] = b"".join(output.tobytes() for output in outputs)
    solution = model.simulate(20 * model.description.simulation.step, error_estimate=False)
    return bits | {"steps": solution.q.tobytes() + solution.v.tobytes() + solution.z.tobytes()}


@pytest.mark.slow
@pytest.mark.long_except("bouncing_ball", "pi_servo")
@pytest.mark.parametrize("example", KINDS)
def test_examples_have_the_bits_of_c_without_fused_products(
    example: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Forward dynamics, partials, all other functions, and steps; ``quick`` compiles without fused products, too."""
    monkeypatch.setenv("EOMGEN_CACHE", str(tmp_path))
    scene = eomgen.load(EXAMPLES / example / "scene.toml")
    monkeypatch.setattr(library, "_DELAY", 1e6)  # the compiler in the background never begins
    engine = eomgen.build(scene, profile="instant")
    assert engine.library.profile == "instant"
    assert _bits(engine) == _bits(eomgen.build(scene, profile="quick"))
