"""Every operation of the tape, in C, for all four number types, against the evaluation of the tape in NumPy and
mpmath."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.operations import UNARY, Op
from eomgen.symbolic.tape import Ref, Tape
from eomgen.system.system import Block, Function, System
from tests.codegen.hand_made import call, compile_system, make_system
from tests.oracles.fifty_digits import evaluate_mpmath

SIZE = 11
BUILDS = [("quick", "double"), ("fast", "float"), ("quick", "complex"), ("fast", "lanes")]


def every_operation() -> tuple[System, list[Ref], list[Op]]:
    """Return a System whose one output has every operation, on arguments of both signs inside its domain."""
    tape = Tape()
    x = [tape.input("q", k) for k in range(2)] + [tape.input("v", k) for k in range(2)] + [tape.input("t")]
    refs: list[Ref] = []
    ops: list[Op] = []
    for op in Op:
        if op in (Op.CONST, Op.INPUT, Op.MAP, Op.CURVE):  # curves have tests of their own
            continue
        for first, second in ((x[0], x[1]), (x[2], -x[3]), (-x[4], x[0])):
            unit = tape.mul(tape.constant(0.3), first)
            above = tape.add(tape.constant(1.75), tape.mul(tape.constant(0.25), first))
            if op in (Op.ADD, Op.SUB, Op.MUL):
                ref = {Op.ADD: tape.add, Op.SUB: tape.sub, Op.MUL: tape.mul}[op](first, second)
            elif op is Op.DIV:
                ref = tape.div(second, above)
            elif op in (Op.SQRT, Op.LOG):
                ref = tape.call(op, above)
            elif op is Op.POW:
                ref = tape.call(op, above, second)
            elif op in UNARY:
                ref = tape.call(op, unit if op in (Op.ASIN, Op.ACOS, Op.TAN) else first)
            elif op is Op.SELECT:
                ref = tape.select(tape.call(Op.LT, first, second), tape.mul(first, second), -above)
            else:
                ref = tape.call(op, first, second)
            refs += [ref, -ref]
            ops += [op, op]
    function = Function("everything", "every operation", ("t", "q", "v"), (Block("y", (len(refs),), tuple(refs)),))
    return make_system("everything", tape, [function]), refs, ops


def samples() -> dict[str, np.ndarray]:
    rng = np.random.default_rng(20)
    return {"t": rng.uniform(-2, 2, (SIZE, 1)), "q": rng.uniform(-2, 2, (SIZE, 2)), "v": rng.uniform(-2, 2, (SIZE, 2))}


def expected(system: System, refs: list[Ref], inputs: dict[str, np.ndarray]) -> np.ndarray:
    rows = [evaluate(system.tape, refs, {name: rows[k] for name, rows in inputs.items()}) for k in range(SIZE)]
    return np.array(rows)


@pytest.mark.parametrize(
    ("real", "tolerance"), [("double", 4e-15), ("float", 4e-6), ("lanes", 4e-15), ("complex", 4e-15)]
)
def test_every_operation_agrees_with_the_tape(real: str, tolerance: float, tmp_path: Path) -> None:
    system, refs, ops = every_operation()
    inputs = samples()
    (found,) = call(compile_system(system, tmp_path, real=real), "everything", inputs)
    wanted = expected(system, refs, inputs)
    scale = np.maximum(1.0, np.abs(wanted))
    worst = np.max(np.abs(found - wanted) / scale, axis=0)
    assert {op.name for op, error in zip(ops, worst, strict=True) if not error <= tolerance} == set()


def test_double_agrees_with_fifty_digits(tmp_path: Path) -> None:
    system, refs, ops = every_operation()
    inputs = samples()
    (found,) = call(compile_system(system, tmp_path), "everything", inputs)
    exact = evaluate_mpmath(system.tape, refs, {name: [float(x) for x in rows[3]] for name, rows in inputs.items()})
    errors = [
        abs(float(value - float(y))) / max(1.0, abs(float(value))) for value, y in zip(exact, found[3], strict=True)
    ]
    assert {op.name for op, error in zip(ops, errors, strict=True) if not error <= 1e-15} == set()


def test_complex_step_on_the_compiled_code_gives_derivatives(tmp_path: Path) -> None:
    """d/dq0 by a step of 1e-200 i in C, against central differences of the NumPy evaluation."""
    system, refs, ops = every_operation()
    inputs = samples()
    shifted = {name: rows.astype(complex) for name, rows in inputs.items()}
    shifted["q"] = shifted["q"] + np.array([1e-200j, 0.0])
    (found,) = call(compile_system(system, tmp_path, real="complex"), "everything", shifted)
    step = 1e-6
    ahead = expected(system, refs, {**inputs, "q": inputs["q"] + [step, 0.0]})
    behind = expected(system, refs, {**inputs, "q": inputs["q"] - [step, 0.0]})
    error = np.max(np.abs(found.imag * 1e200 - (ahead - behind) / (2 * step)), axis=0)
    assert {op.name for op, worst in zip(ops, error, strict=True) if not worst < 1e-8} == set()
    assert np.max(np.abs(found.imag)) * 1e200 > 0.5


def test_negative_bases_of_powers_keep_their_derivative(tmp_path: Path) -> None:
    tape = Tape()
    power = tape.call(Op.POW, tape.input("q", 0), tape.input("q", 1))
    system = make_system("power", tape, [Function("power", "", ("q",), (Block("y", (1,), (power,)),))])
    (found,) = call(compile_system(system, tmp_path, real="complex"), "power", {"q": np.array([-1.5 + 1e-200j, 3.0])})
    assert found[0].real == pytest.approx(-3.375, rel=1e-15)
    assert found[0].imag * 1e200 == pytest.approx(3 * 1.5**2, rel=1e-14)


@pytest.mark.parametrize(("profile", "real"), BUILDS)
def test_not_a_number_passes_through_comparisons_and_choices(real: str, profile: str, tmp_path: Path) -> None:
    tape = Tape()
    x, y, one, two = tape.input("q", 0), tape.input("q", 1), tape.constant(1.0), tape.constant(2.0)
    refs = [tape.call(Op.LT, x, y), tape.call(Op.LE, y, x), tape.select(tape.call(Op.LT, x, y), one, two)]
    refs += [tape.select(tape.call(Op.LE, x, one), tape.call(Op.SQRT, y), two)]  # what is not chosen may be anything
    system = make_system("choices", tape, [Function("choices", "", ("q",), (Block("y", (len(refs),), tuple(refs)),))])
    library = compile_system(system, tmp_path, profile=profile, real=real)
    q = np.array([[2.0, np.nan], [np.nan, 2.0], [2.0, -np.inf], [-np.inf, 4.0], [2.0, 2.0]])
    (found,) = call(library, "choices", {"q": q})
    in_numpy = evaluate(tape, refs, {"q": q})
    in_mpmath = [[complex(value) for value in evaluate_mpmath(tape, refs, {"q": list(map(float, row))})] for row in q]
    nan = np.nan
    wanted = [[nan, nan, nan, 2], [nan, nan, nan, nan], [0, 1, 2, 2], [1, 0, 1, 2], [0, 1, 2, 2]]
    for values in (found, in_numpy, np.array(in_mpmath)):
        assert np.array_equal(values.real, wanted, equal_nan=True)


@pytest.mark.parametrize(("profile", "real"), BUILDS)
def test_not_a_number_passes_through_min_max_abs_and_sign(real: str, profile: str, tmp_path: Path) -> None:
    tape = Tape()
    x, y, zero = tape.input("q", 0), tape.input("q", 1), tape.constant(0.0)
    refs = [tape.call(Op.MIN, x, y), tape.call(Op.MIN, y, zero), tape.call(Op.MAX, y, x), tape.call(Op.MAX, zero, y)]
    refs += [tape.call(Op.MAX, tape.call(Op.MIN, y, x), zero), tape.call(Op.ABS, y), tape.call(Op.SIGN, y)]
    system = make_system("bounds", tape, [Function("bounds", "", ("q",), (Block("y", (len(refs),), tuple(refs)),))])
    library = compile_system(system, tmp_path, profile=profile, real=real)
    q = np.array(
        [[0.0, np.nan], [1.0, np.nan], [np.inf, np.nan], [np.nan, np.nan], [np.inf, -np.inf], [-2.0, 3.0], [3.0, -2.0]]
    )
    (found,) = call(library, "bounds", {"q": q})
    in_numpy = evaluate(tape, refs, {"q": q})
    in_mpmath = [[complex(value) for value in evaluate_mpmath(tape, refs, {"q": list(map(float, row))})] for row in q]
    for values in (found, in_numpy, np.array(in_mpmath)):
        assert np.all(np.isnan(values[:4]))
        assert values[4:].real.tolist() == [
            [-np.inf, -np.inf, np.inf, 0, 0, np.inf, -1],
            [-2, 0, 3, 3, 0, 3, 1],
            [-2, -2, 3, 0, 0, 2, -1],
        ]
    (swapped,) = call(library, "bounds", {"q": np.array([[np.nan, 0.0], [np.nan, 1.0]])})
    assert np.all(np.isnan(swapped[:, [0, 2, 4]])) and not np.any(np.isnan(swapped[:, [1, 3, 5, 6]]))
