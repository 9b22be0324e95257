"""The sine and cosine of generated code: accuracy against mpmath, the origin of their constants, large and special
arguments."""

from __future__ import annotations

import re

import mpmath
import numpy as np
import pytest

from eomgen.codegen.targets.c.templates import environment
from eomgen.symbolic.operations import Op
from eomgen.symbolic.tape import Tape
from eomgen.system.system import Block, Function
from tests.codegen.hand_made import call, compile_system, make_system

HEADER = environment().get_template("c/model/eomgen_real.h.jinja").render()


@pytest.fixture(scope="module", params=["quick-double", "fast-double", "fast-lanes"])
def sincos(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory):
    profile, real = request.param.split("-")
    tape = Tape()
    t = tape.input("t")
    block = Block("y", (2,), (tape.call(Op.SIN, t), tape.call(Op.COS, t)))
    system = make_system("circle", tape, [Function("circle", "", ("t",), (block,))])
    library = compile_system(system, tmp_path_factory.mktemp("circle"), profile=profile, real=real)
    return lambda x: call(library, "circle", {"t": np.asarray(x).reshape(-1, 1)})[0]


def errors(x: np.ndarray, found: np.ndarray) -> float:
    with mpmath.workdps(40):
        pairs = ((mpmath.mpf(float(a)), y) for a, y in zip(x, found, strict=True))
        return float(max(max(abs(mpmath.sin(a) - float(y[0])), abs(mpmath.cos(a) - float(y[1]))) for a, y in pairs))


@pytest.mark.slow_except("fast-lanes-1.0")
@pytest.mark.parametrize("limit", [1e-3, 1.0, 10.0, 1e5, 1e6, 1e8, 1e10])
def test_absolute_error_stays_below_one_unit(sincos, limit: float, rng: np.random.Generator) -> None:
    quarters = np.round(rng.uniform(-limit, limit, 300) / (np.pi / 2)) * (np.pi / 2)  # where the reduction cancels most
    eighths = quarters + np.pi / 4
    x = np.concatenate([rng.uniform(-limit, limit, 600), quarters, eighths, np.nextafter(eighths, 0)])
    assert errors(x, sincos(x)) < 1e-16


@pytest.mark.slow_cases("fast-double", "quick-double")
def test_small_arguments_keep_their_relative_accuracy(sincos) -> None:
    x = np.concatenate([10.0 ** np.arange(-300, -1), -(10.0 ** np.arange(-20, -1, 0.1))])
    found = sincos(x)
    with mpmath.workdps(40):
        worst = max(
            abs(mpmath.sin(mpmath.mpf(float(a))) / mpmath.mpf(float(y)) - 1)
            for a, y in zip(x, found[:, 0], strict=True)
        )
    assert worst < 2.3e-16


@pytest.mark.slow_cases("fast-double", "quick-double")
def test_arguments_beyond_the_range_of_the_reduction_give_nan(sincos, rng: np.random.Generator) -> None:
    assert np.all(np.isfinite(sincos([1e10, -1e10])))
    exponents = rng.uniform(10.01, 308.0, 50)
    beyond = [
        np.nextafter(1e10, np.inf), -np.nextafter(1e10, np.inf), 2.0**45, 2.0**51, 1e14, -1e300, np.finfo(float).max,
    ]  # fmt: skip  # numbers
    assert np.all(np.isnan(sincos([*beyond, *(10.0**exponents), *(-(10.0**exponents)), np.nan, np.inf, -np.inf])))


def test_constants_are_minimax_polynomials_and_pieces_of_half_pi() -> None:
    with mpmath.workdps(60):
        width = (mpmath.pi / 4) ** 2 * mpmath.mpf("1.0000001")

        def sine(z):
            r = mpmath.sqrt(z)
            return (mpmath.sin(r) / r - 1) / z if z > 1e-12 else z / 120 - mpmath.mpf(1) / 6

        def cosine(z):
            return (mpmath.cos(mpmath.sqrt(z)) - 1 + z / 2) / z**2 if z > 1e-10 else mpmath.mpf(1) / 24 - z / 720

        for name, function in (("sine_tail", sine), ("cosine_tail", cosine)):
            text = re.search(rf"{name} = (.*?);", HEADER, re.DOTALL)
            written = [float(number) for number in re.findall(r"EG_WIDE\(([^)]*)\)", text.group(1))]
            assert written == [float(c) for c in mpmath.chebyfit(function, [mpmath.mpf(0), width], 6)[::-1]]
        own = HEADER[HEADER.index("eg_bits eg_sincos_sums") :]
        pieces = [float(number) for number in re.findall(r"n \* EG_WIDE\(([^)]*)\)", own[: own.index("\n}")])]
        rest = mpmath.pi / 2
        for bits, piece, sign in zip((20, 20, 53), pieces, (1, 1, -1), strict=True):  # the last one is added
            mantissa, _ = mpmath.frexp(mpmath.mpf(piece))
            assert mpmath.ldexp(mantissa, bits) == mpmath.floor(mpmath.ldexp(mantissa, bits))
            rest -= sign * mpmath.mpf(piece)
        assert abs(rest) * 2**33 < 1e-18
