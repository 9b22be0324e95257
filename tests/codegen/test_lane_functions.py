"""Exponential, logarithm and square root of eight lanes: units in the last place against mpmath, special arguments."""

from __future__ import annotations

from collections.abc import Callable

import mpmath
import numpy as np
import pytest

from eomgen.codegen.targets.c.target import environment
from eomgen.symbolic.operations import Op
from eomgen.symbolic.tape import Tape
from eomgen.system.system import Block, Function
from tests.codegen.hand_made import call, compile_system, make_system

LARGEST, SMALLEST = np.finfo(float).max, 5e-324


@pytest.fixture(scope="module", params=["quick", "fast"])
def functions(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Callable[..., np.ndarray]:
    """Return exp, log and sqrt, (n, 3), of numbers (n,)."""
    tape = Tape()
    t = tape.input("t")
    block = Block("y", (3,), (tape.call(Op.EXP, t), tape.call(Op.LOG, t), tape.call(Op.SQRT, t)))
    system = make_system("three", tape, [Function("three", "", ("t",), (block,))])
    library = compile_system(system, tmp_path_factory.mktemp("three"), profile=request.param, real="lanes")
    return lambda x: call(library, "three", {"t": np.asarray(x, dtype=float).reshape(-1, 1)})[0]


def units(x: np.ndarray, found: np.ndarray, exact: Callable[[mpmath.mpf], mpmath.mpf]) -> float:
    """Return the largest error in units in the last place of what is exact."""
    with mpmath.workdps(40):
        errors = []
        for argument, value in zip(x.tolist(), found.tolist(), strict=True):
            true = exact(mpmath.mpf(argument))
            errors.append(float(abs(mpmath.mpf(value) - true) / mpmath.mpf(float(np.spacing(abs(float(true)))))))
    return max(errors)


def test_exponentials_are_within_one_unit(functions: Callable[..., np.ndarray], rng: np.random.Generator) -> None:
    multiples = np.log(2.0) * (rng.integers(-1070, 1020, 300) + 0.5)  # where the reduction leaves most
    x = np.concatenate([rng.uniform(-745, 709.7, 600), rng.normal(size=300), multiples, 10.0 ** np.arange(-20, 0)])
    assert units(x, functions(x)[:, 0], mpmath.exp) < 1.0


def test_logarithms_are_within_one_unit(functions: Callable[..., np.ndarray], rng: np.random.Generator) -> None:
    near_one = 1.0 + rng.normal(size=300) * 10.0 ** rng.uniform(-16, -1, 300)
    powers = np.sqrt(0.5) * 2.0 ** rng.integers(-1000, 1000, 100)
    x = np.concatenate([10.0 ** rng.uniform(-323, 308, 600), near_one, powers, np.nextafter(powers, 0), [0.5, 2, 4]])
    x = x[x != 1.0]
    assert units(x, functions(x)[:, 1], mpmath.log) < 1.0


def test_square_roots_are_rounded_right(functions: Callable[..., np.ndarray], rng: np.random.Generator) -> None:
    x = 10.0 ** rng.uniform(-300, 300, 400)
    np.testing.assert_array_equal(functions(x)[:, 2], np.sqrt(x))


def test_the_pieces_of_the_logarithm_of_two_are_exact_in_products() -> None:
    """A multiple of 11 bits times the first piece has 53 bits, and both make ln(2) to 80 bits."""
    header = environment().get_template("c/model/eomgen_real.h.jinja").render()
    first, second = 0.6931471803691238, 1.9082149292705877e-10
    assert header.count(f"EG_WIDE({first!r})") == header.count(f"EG_WIDE({second!r})") == 2
    mantissa, _ = np.frexp(first)
    assert (mantissa * 2.0**42).is_integer()
    with mpmath.workdps(40):
        assert abs(mpmath.mpf(first) + mpmath.mpf(second) - mpmath.log(2)) < 2.0**-80


def test_special_arguments(functions: Callable[..., np.ndarray]) -> None:
    x = np.array([0.0, -0.0, 1.0, -1.0, np.inf, -np.inf, np.nan, LARGEST, -LARGEST, SMALLEST, 709.9, -745.2])
    with np.errstate(all="ignore"):
        expected = np.stack([np.exp(x), np.log(x), np.sqrt(x)], axis=-1)
    found = functions(x)
    for column, name in enumerate(("exp", "log", "sqrt")):
        np.testing.assert_allclose(found[:, column], expected[:, column], rtol=3e-16, err_msg=name)
