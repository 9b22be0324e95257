"""Exponential, logarithm, powers and square root of generated code: units in the last place against mpmath, special
arguments, and lanes with the bits of double."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import mpmath
import numpy as np
import pytest

from eomgen.codegen.targets.c.templates import environment
from eomgen.symbolic.operations import Op
from eomgen.symbolic.tape import Tape
from eomgen.system.system import Block, Function, System
from eomgen.toolchain.library import Library
from tests.codegen.hand_made import call, compile_system, make_system

LARGEST, SMALLEST = np.finfo(float).max, 5e-324


BUILDS = [(profile, real) for profile in ("quick", "fast") for real in ("double", "lanes")]


def powers_and_roots() -> System:
    """Return a system of exp, log, sqrt of t, and of t to the power of v."""
    tape = Tape()
    t = tape.input("t")
    power = tape.call(Op.POW, t, tape.input("v"))
    block = Block("y", (4,), (tape.call(Op.EXP, t), tape.call(Op.LOG, t), tape.call(Op.SQRT, t), power))
    return make_system("four", tape, [Function("four", "", ("t", "v"), (block,))])


@pytest.fixture(scope="module")
def libraries(tmp_path_factory: pytest.TempPathFactory) -> dict[tuple[str, str], Library]:
    system = powers_and_roots()
    folder = tmp_path_factory.mktemp("four")
    return {(profile, real): compile_system(system, folder, profile=profile, real=real) for profile, real in BUILDS}


@pytest.fixture(params=BUILDS, ids="-".join)
def functions(request: pytest.FixtureRequest, libraries: dict[tuple[str, str], Library]) -> Callable[..., np.ndarray]:
    """Return exp, log, sqrt and powers, (n, 4), of numbers (n,) and exponents (n,)."""
    return partial(values, libraries[request.param])


def values(library: Library, x: np.ndarray, y: np.ndarray | float = 1.0) -> np.ndarray:
    x = np.asarray(x, dtype=float)
    exponents = np.stack([np.broadcast_to(y, x.shape), np.zeros(x.shape)], axis=-1)
    return call(library, "four", {"t": x.reshape(-1, 1), "v": exponents})[0]


def units(x: np.ndarray, found: np.ndarray, exact: Callable[[mpmath.mpf], mpmath.mpf]) -> float:
    """Return the largest error in units in the last place of what is exact."""
    with mpmath.workdps(40):
        errors = []
        for argument, value in zip(x.tolist(), found.tolist(), strict=True):
            true = exact(mpmath.mpf(argument))
            errors.append(float(abs(mpmath.mpf(value) - true) / mpmath.mpf(float(np.spacing(abs(float(true)))))))
    return max(errors)


@pytest.mark.slow_cases("fast-double")
@pytest.mark.slow_cases("quick-double", "quick-lanes")
def test_exponentials_are_within_one_unit(functions: Callable[..., np.ndarray], rng: np.random.Generator) -> None:
    multiples = np.log(2.0) * (rng.integers(-1070, 1020, 200) + 0.5)  # where the reduction leaves most
    x = np.concatenate([rng.uniform(-745, 709.7, 300), rng.normal(size=200), multiples, 10.0 ** np.arange(-20, 0)])
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


def test_powers_are_within_seven_tenths_of_a_unit(
    functions: Callable[..., np.ndarray], rng: np.random.Generator
) -> None:
    """Over all numbers, and where a base near one has a large exponent, to results from the smallest to the largest."""
    wide = 10.0 ** rng.uniform(-323, 308, 400)
    close = 1.0 + rng.normal(size=400) * 10.0 ** rng.uniform(-15, -0.5, 400)
    plain = 10.0 ** rng.uniform(-3, 3, 400)
    x = np.concatenate([wide, np.abs(close), plain])
    logarithms = np.concatenate([rng.uniform(-744, 709.7, 1000), rng.normal(size=200)])
    y = logarithms / np.where(x == 1.0, 1.0, np.log(x))
    y[::7] = np.round(y[::7])
    y = np.where(np.abs(y * np.log(x)) < 709.7, y, 0.5)
    found = functions(x, y)[:, 3]
    with mpmath.workdps(40):
        errors = [
            abs(mpmath.mpf(float(value)) - mpmath.mpf(float(base)) ** mpmath.mpf(float(exponent)))
            / mpmath.mpf(float(np.spacing(value)))
            for base, exponent, value in zip(x, y, found, strict=True)
        ]
    assert max(errors) < 0.7


def test_powers_at_special_numbers_are_those_of_c99(functions: Callable[..., np.ndarray]) -> None:
    large = 2.0**53
    special = [0.0, 1.0, 2.0, 0.5, 3.0, np.inf, 1e300, LARGEST, SMALLEST, 1e-310, 2.5]
    special += [large, large + 2, large / 2 - 0.5]
    numbers = np.array([*special, *(-x for x in special), np.nan, large / 2 + 1, -large / 2 - 1])
    x, y = (grid.ravel() for grid in np.meshgrid(numbers, numbers))
    with np.errstate(all="ignore"):
        expected = np.power(x, y)
    found = functions(x, y)[:, 3]
    np.testing.assert_allclose(found, expected, rtol=3e-16)
    np.testing.assert_array_equal(np.signbit(found[~np.isnan(found)]), np.signbit(expected[~np.isnan(found)]))


@pytest.mark.parametrize("profile", ["quick", "fast"])
def test_lanes_have_the_bits_of_double(
    profile: str, libraries: dict[tuple[str, str], Library], rng: np.random.Generator
) -> None:
    scale = 10.0 ** rng.uniform(-3, 3, 4000)
    x = np.concatenate([scale * rng.normal(size=4000), 10.0 ** rng.uniform(-323, 308, 4000), [np.nan, np.inf, -np.inf]])
    y = rng.normal(size=x.size) * 10.0 ** rng.uniform(-3, 3, x.size)
    one, other = (values(libraries[profile, real], x, y) for real in ("double", "lanes"))
    np.testing.assert_array_equal(one, other)


def test_the_pieces_of_the_logarithm_of_two_are_exact_in_products() -> None:
    """A multiple of 11 bits times the first piece has 53 bits, and both make ln(2) to 80 bits."""
    header = environment().get_template("c/model/eomgen_real.h.jinja").render()
    first, second = 0.6931471803691238, 1.9082149292705877e-10
    assert header.count(f"EG_WIDE({first!r})") == header.count(f"EG_WIDE({second!r})") == 3
    mantissa, _ = np.frexp(first)
    assert (mantissa * 2.0**42).is_integer()
    with mpmath.workdps(40):
        assert abs(mpmath.mpf(first) + mpmath.mpf(second) - mpmath.log(2)) < 2.0**-80


def test_special_arguments(functions: Callable[..., np.ndarray]) -> None:
    x = np.array([0.0, -0.0, 1.0, -1.0, np.inf, -np.inf, np.nan, LARGEST, -LARGEST, SMALLEST, 709.9, -745.2])
    with np.errstate(all="ignore"):
        expected = np.stack([np.exp(x), np.log(x), np.sqrt(x), x], axis=-1)
    found = functions(x)
    for column, name in enumerate(("exp", "log", "sqrt", "first power")):
        np.testing.assert_allclose(found[:, column], expected[:, column], rtol=3e-16, err_msg=name)
