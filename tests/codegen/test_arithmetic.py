"""Every operation of the tape, in C, for all four number types, against the evaluation of the tape in NumPy and
mpmath."""

from __future__ import annotations

import numpy as np
import pytest

from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.operations import UNARY, Op
from eomgen.symbolic.tape import Ref, Tape
from eomgen.system.system import Block, Function
from eomgen.toolchain.library import Library
from tests.codegen.hand_made import call, compile_system, make_system
from tests.oracles.fifty_digits import evaluate_mpmath

SIZE = 11
BUILDS = [("quick", "double"), ("fast", "float"), ("quick", "complex"), ("fast", "lanes")]


def every_operation(tape: Tape) -> tuple[list[Ref], list[Op]]:
    """Return every operation, on arguments of both signs inside its domain."""
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
    return refs, ops


def choices(tape: Tape) -> list[Ref]:
    x, y, one, two = tape.input("q", 0), tape.input("q", 1), tape.constant(1.0), tape.constant(2.0)
    refs = [tape.call(Op.LT, x, y), tape.call(Op.LE, y, x), tape.select(tape.call(Op.LT, x, y), one, two)]
    return [*refs, tape.select(tape.call(Op.LE, x, one), tape.call(Op.SQRT, y), two)]  # others may be anything


def bounds(tape: Tape) -> list[Ref]:
    x, y, zero = tape.input("q", 0), tape.input("q", 1), tape.constant(0.0)
    refs = [tape.call(Op.MIN, x, y), tape.call(Op.MIN, y, zero), tape.call(Op.MAX, y, x), tape.call(Op.MAX, zero, y)]
    return [*refs, tape.call(Op.MAX, tape.call(Op.MIN, y, x), zero), tape.call(Op.ABS, y), tape.call(Op.SIGN, y)]


TAPE = Tape()
EVERYTHING, OPS = every_operation(TAPE)
REFS = {"everything": EVERYTHING, "choices": choices(TAPE), "bounds": bounds(TAPE)}
REFS["power"] = [TAPE.call(Op.POW, TAPE.input("q", 0), TAPE.input("q", 1))]
REFS["circular"] = [TAPE.call(op, TAPE.input("q", 0)) for op in (Op.SIN, Op.COS)]
INPUTS = {"everything": ("t", "q", "v"), "choices": ("q",), "bounds": ("q",), "power": ("q",), "circular": ("q",)}


@pytest.fixture(scope="module", params=BUILDS, ids="-".join)
def library(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Library:
    """Return all functions, once of each number type."""
    functions = [
        Function(name, "", INPUTS[name], (Block("y", (len(refs),), tuple(refs)),)) for name, refs in REFS.items()
    ]
    profile, real = request.param
    folder = tmp_path_factory.mktemp("arithmetic")
    return compile_system(make_system("everything", TAPE, functions), folder, profile=profile, real=real)


def samples() -> dict[str, np.ndarray]:
    rng = np.random.default_rng(20)
    return {"t": rng.uniform(-2, 2, (SIZE, 1)), "q": rng.uniform(-2, 2, (SIZE, 2)), "v": rng.uniform(-2, 2, (SIZE, 2))}


def expected(inputs: dict[str, np.ndarray]) -> np.ndarray:
    return np.array([evaluate(TAPE, EVERYTHING, {name: rows[k] for name, rows in inputs.items()}) for k in range(SIZE)])


def worse(errors: np.ndarray, tolerance: float) -> set[str]:
    """Return the names of the operations with an error above a tolerance."""
    return {op.name for op, error in zip(OPS, errors, strict=True) if not error <= tolerance}


def test_every_operation_agrees_with_the_tape(library: Library) -> None:
    inputs = samples()
    (found,) = call(library, "everything", inputs)
    wanted = expected(inputs)
    worst = np.max(np.abs(found - wanted) / np.maximum(1.0, np.abs(wanted)), axis=0)
    assert worse(worst, 4e-6 if library.real == "float" else 4e-15) == set()


@pytest.mark.parametrize("library", [("quick", "double")], indirect=True, ids="-".join)
def test_double_agrees_with_fifty_digits(library: Library) -> None:
    inputs = samples()
    (found,) = call(library, "everything", inputs)
    exact = evaluate_mpmath(TAPE, EVERYTHING, {name: [float(x) for x in rows[3]] for name, rows in inputs.items()})
    errors = [
        abs(float(value - float(y))) / max(1.0, abs(float(value))) for value, y in zip(exact, found[3], strict=True)
    ]
    assert worse(np.array(errors), 1e-15) == set()


@pytest.mark.slow
@pytest.mark.parametrize("library", [("fast", "float")], indirect=True, ids="-".join)
def test_sines_in_float_are_within_a_rounding_of_one(library: Library) -> None:
    exponents = np.random.default_rng(3).uniform(-10.0, np.log(1e5), 20_000)
    angles = np.concatenate([np.exp(exponents), -np.exp(exponents), np.arange(60_000) * (np.pi / 2)])
    q = np.repeat(angles.astype(np.float32).astype(float)[:, None], 2, axis=1)
    (found,) = call(library, "circular", {"q": q})
    exact = np.column_stack([np.sin(q[:, 0]), np.cos(q[:, 0])])
    assert 5e-8 < np.max(np.abs(found - exact)) < 1e-7
    (found,) = call(library, "circular", {"q": np.array([[np.inf, 0.0], [np.nan, 0.0]])})
    assert np.isnan(found).all()


@pytest.mark.parametrize("library", [("quick", "complex")], indirect=True, ids="-".join)
def test_complex_step_on_the_compiled_code_gives_derivatives(library: Library) -> None:
    """d/dq0 by a step of 1e-200 i in C, against central differences of the NumPy evaluation; of powers of negative
    bases in closed form."""
    inputs = samples()
    shifted = {name: rows.astype(complex) for name, rows in inputs.items()}
    shifted["q"] = shifted["q"] + np.array([1e-200j, 0.0])
    (found,) = call(library, "everything", shifted)
    step = 1e-6
    ahead, behind = (expected({**inputs, "q": inputs["q"] + [off, 0.0]}) for off in (step, -step))
    error = np.max(np.abs(found.imag * 1e200 - (ahead - behind) / (2 * step)), axis=0)
    assert worse(error, 1e-8) == set()
    assert np.max(np.abs(found.imag)) * 1e200 > 0.5
    (found,) = call(library, "power", {"q": np.array([-1.5 + 1e-200j, 3.0])})
    assert found[0].real == pytest.approx(-3.375, rel=1e-15)
    assert found[0].imag * 1e200 == pytest.approx(3 * 1.5**2, rel=1e-14)


def all_values(library: Library, name: str, q: np.ndarray) -> list[np.ndarray]:
    """Return the values of a function in C, in NumPy and in mpmath."""
    (found,) = call(library, name, {"q": q})
    rows = [[complex(value) for value in evaluate_mpmath(TAPE, REFS[name], {"q": list(map(float, row))})] for row in q]
    return [found, evaluate(TAPE, REFS[name], {"q": q}), np.array(rows)]


def test_not_a_number_passes_through_comparisons_and_choices(library: Library) -> None:
    q = np.array([[2.0, np.nan], [np.nan, 2.0], [2.0, -np.inf], [-np.inf, 4.0], [2.0, 2.0]])
    nan = np.nan
    wanted = [[nan, nan, nan, 2], [nan, nan, nan, nan], [0, 1, 2, 2], [1, 0, 1, 2], [0, 1, 2, 2]]
    for values in all_values(library, "choices", q):
        assert np.array_equal(values.real, wanted, equal_nan=True)


def test_not_a_number_passes_through_min_max_abs_and_sign(library: Library) -> None:
    q = np.array(
        [[0.0, np.nan], [1.0, np.nan], [np.inf, np.nan], [np.nan, np.nan], [np.inf, -np.inf], [-2.0, 3.0], [3.0, -2.0]]
    )
    for values in all_values(library, "bounds", q):
        assert np.all(np.isnan(values[:4]))
        assert values[4:].real.tolist() == [
            [-np.inf, -np.inf, np.inf, 0, 0, np.inf, -1],
            [-2, 0, 3, 3, 0, 3, 1],
            [-2, -2, 3, 0, 0, 2, -1],
        ]
    (swapped,) = call(library, "bounds", {"q": np.array([[np.nan, 0.0], [np.nan, 1.0]])})
    assert np.all(np.isnan(swapped[:, [0, 2, 4]])) and not np.any(np.isnan(swapped[:, [1, 3, 5, 6]]))
