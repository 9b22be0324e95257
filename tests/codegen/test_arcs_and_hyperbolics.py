"""Tangent, arcs and hyperbolic functions of generated code: units in the last place against mpmath, special arguments,
lanes with the bits of double, the origin of constants; sines of float at all exponents."""

from __future__ import annotations

import re
from collections.abc import Callable

import mpmath
import numpy as np
import pytest

from eomgen.codegen.targets.c.templates import environment
from eomgen.symbolic.operations import Op
from eomgen.symbolic.tape import Tape
from eomgen.system.system import Block, Function, System
from eomgen.toolchain.library import Library
from tests.codegen.hand_made import call, compile_system, make_system

NAMES = ("tan", "asin", "acos", "atan", "sinh", "cosh", "tanh")
#: The errors in units in the last place that the texts of the functions state.
STATED = {"tan": 1.6, "asin": 1.2, "acos": 1.2, "atan": 1.0, "sinh": 1.4, "cosh": 1.4, "tanh": 1.4, "atan2": 1.0}
LARGEST, SMALLEST = np.finfo(float).max, 5e-324
BUILDS = [(profile, real) for profile in ("quick", "fast") for real in ("double", "lanes")]
HEADER = environment().get_template("c/model/eomgen_real.h.jinja").render()


def arcs_and_hyperbolics() -> System:
    """Return a system of the functions of t, and of the arc tangent of t over v."""
    tape = Tape()
    t = tape.input("t")
    values = (*(tape.call(Op[name.upper()], t) for name in NAMES), tape.call(Op.ATAN2, t, tape.input("v")))
    return make_system("eight", tape, [Function("eight", "", ("t", "v"), (Block("y", (8,), values),))])


@pytest.fixture(scope="module")
def libraries(tmp_path_factory: pytest.TempPathFactory) -> dict[tuple[str, str], Library]:
    system = arcs_and_hyperbolics()
    folder = tmp_path_factory.mktemp("eight")
    return {(profile, real): compile_system(system, folder, profile=profile, real=real) for profile, real in BUILDS}


@pytest.fixture(params=BUILDS, ids="-".join)
def functions(request: pytest.FixtureRequest, libraries: dict[tuple[str, str], Library]) -> Callable[..., np.ndarray]:
    """Return the functions of numbers (n,), and the arc tangents of these over others, by name."""
    return lambda name, x, y=1.0: values(libraries[request.param], x, y)[:, [*NAMES, "atan2"].index(name)]


def values(library: Library, x: np.ndarray, y: np.ndarray | float = 1.0) -> np.ndarray:
    x = np.asarray(x, dtype=float)
    below = np.stack([np.broadcast_to(y, x.shape), np.zeros(x.shape)], axis=-1)
    return call(library, "eight", {"t": x.reshape(-1, 1), "v": below})[0]


def units(found: np.ndarray, exact: Callable[..., mpmath.mpf], *arguments: np.ndarray) -> np.ndarray:
    """Return errors in units in the last place of the exact values."""
    with mpmath.workdps(40):
        errors = []
        for value, *numbers in zip(found.tolist(), *(x.tolist() for x in arguments), strict=True):
            true = exact(*map(mpmath.mpf, numbers))
            errors.append(float(abs(mpmath.mpf(value) - true) / mpmath.mpf(float(np.spacing(abs(float(true)))))))
    return np.array(errors)


def drawn(rng: np.random.Generator, name: str, size: int) -> np.ndarray:
    """Return numbers of all exponents in the domain of a function, and as many where its text errs most."""
    if name in ("asin", "acos"):
        parts = [rng.uniform(0.49, 0.53, size), 1.0 - 2.0 ** rng.uniform(-53, -1, size), [1.0]]
    else:
        low, high, end = {"tan": (0.7, 0.8, 1e4), "tanh": (0.1, 0.3, 22.0)}.get(name, (0.35, 0.5, 1e3))
        parts = [rng.uniform(low, high, size), rng.uniform(0.0, min(end, 710.4), size), rng.uniform(15.0, 20.0, size)]
    x = np.concatenate([2.0 ** rng.uniform(-1074, -1, size), *parts])
    return rng.choice([-1.0, 1.0], x.size) * x


@pytest.mark.slow_except(*(f"{build}-{name}" for name in NAMES for build in ("fast-lanes", "quick-double")))
@pytest.mark.parametrize("name", NAMES)
def test_errors_are_below_the_stated_ones(
    functions: Callable[..., np.ndarray], name: str, rng: np.random.Generator
) -> None:
    x = drawn(rng, name, 80)
    assert np.all(units(functions(name, x), getattr(mpmath, name), x) < STATED[name])


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_errors_of_many_numbers_are_below_the_stated_ones(
    libraries: dict[tuple[str, str], Library], name: str, rng: np.random.Generator
) -> None:
    x = drawn(rng, name, 5000)
    found = values(libraries["quick", "double"], x)[:, NAMES.index(name)]
    assert np.all(units(found, getattr(mpmath, name), x) < STATED[name])


@pytest.mark.slow_except("fast-lanes", "quick-double")
def test_angles_of_points_are_within_a_unit(functions: Callable[..., np.ndarray], rng: np.random.Generator) -> None:
    """In all quadrants, for the smallest and largest numbers, and where the octants meet and their halves."""
    wide = 2.0 ** rng.uniform(-1074, 1024, (2, 100))
    near = rng.uniform(0.1, 1.0, (2, 100)) * np.repeat([1e-320, 1e-300, 1.0, LARGEST], 25)
    slopes = rng.uniform(0.45, 0.6, 100)
    small = np.stack([2.0 ** rng.uniform(-1074, -960, 100), 2.0 ** rng.uniform(-60, 60, 100)])
    y, x = np.concatenate([wide, near, np.stack([slopes, np.ones(100)]), small], axis=1)
    y, x = y * rng.choice([-1.0, 1.0], y.size), x * rng.choice([-1.0, 1.0], x.size)
    assert np.all(units(functions("atan2", y, x), mpmath.atan2, y, x) < STATED["atan2"])
    assert np.all(units(functions("atan2", x, y), mpmath.atan2, x, y) < STATED["atan2"])


@pytest.mark.slow_cases("quick-lanes", "fast-double")
def test_angles_at_special_numbers_are_those_of_c99(functions: Callable[..., np.ndarray]) -> None:
    special = [0.0, SMALLEST, 2 * SMALLEST, 3 * SMALLEST, 1e-310, 1e-300, 0.5, 1.0, 2.0, 1e300, 9e307, LARGEST, np.inf]
    numbers = np.array([*special, *(-x for x in special), np.nan])
    y, x = (grid.ravel() for grid in np.meshgrid(numbers, numbers))
    found, expected = functions("atan2", y, x), np.arctan2(y, x)
    np.testing.assert_allclose(found, expected, rtol=4e-16)
    known = ~np.isnan(expected)
    np.testing.assert_array_equal(np.signbit(found[known]), np.signbit(expected[known]))


@pytest.mark.slow_cases("quick-lanes", "fast-double")
def test_special_arguments(functions: Callable[..., np.ndarray]) -> None:
    """Zeros with signs, the ends of domains, the last numbers with a finite result, NaN beyond."""
    last = 710.4758600739439
    x = np.array([0.0, SMALLEST, 1e-310, 1e-8, 0.5, 1.0, np.nextafter(1, 2), 22.0, last, np.nextafter(last, 711), 1e3])
    x = np.array([*x, LARGEST, np.inf, *(-x), -LARGEST, -np.inf, np.nan])
    with np.errstate(all="ignore"):
        for name, numpy in zip(NAMES[1:], ("arcsin", "arccos", "arctan", "sinh", "cosh", "tanh"), strict=True):
            found, expected = functions(name, x), getattr(np, numpy)(x)
            np.testing.assert_allclose(found, expected, rtol=4e-16, err_msg=name)
            known = ~np.isnan(expected)
            np.testing.assert_array_equal(np.signbit(found[known]), np.signbit(expected[known]), err_msg=name)
    assert np.all(np.isnan(functions("tan", [np.nextafter(1e10, np.inf), -1e11, 1e300, np.inf, -np.inf, np.nan])))
    assert functions("tan", [0.0])[0] == 0.0


@pytest.mark.slow_cases("quick-lanes", "fast-double")
def test_tangents_of_large_angles(functions: Callable[..., np.ndarray], rng: np.random.Generator) -> None:
    """Near zeros and poles the error of the reduced angle comes to the stated one."""
    x = np.concatenate([rng.uniform(-1e10, 1e10, 300), np.round(rng.uniform(-1e10, 1e10, 100)) * (np.pi / 2)])
    x = x[np.abs(x) <= 1e10]
    with mpmath.workdps(40):
        slopes = [float(abs(mpmath.tan(mpmath.mpf(a))) + abs(mpmath.cot(mpmath.mpf(a)))) for a in x.tolist()]
    allowed = STATED["tan"] + 2e-29 * np.abs(x) * np.array(slopes) / 1.1e-16
    assert np.all(units(functions("tan", x), mpmath.tan, x) < allowed)


@pytest.mark.parametrize("profile", ["quick", "fast"])
def test_lanes_have_the_bits_of_double(
    profile: str, libraries: dict[tuple[str, str], Library], rng: np.random.Generator
) -> None:
    x = rng.normal(size=4000) * 10.0 ** rng.uniform(-3, 3, 4000)
    x = np.concatenate([x, rng.uniform(-1.1, 1.1, 4000), 10.0 ** rng.uniform(-323, 308, 4000), [np.nan, np.inf, -0.0]])
    y = rng.normal(size=x.size) * 10.0 ** rng.uniform(-3, 3, x.size)
    one, other = (values(libraries[profile, real], x, y) for real in ("double", "lanes"))
    np.testing.assert_array_equal(one, other)


def test_double_and_lanes_take_three_exact_functions_of_the_c_library() -> None:
    parts = (environment().get_template(f"c/model/real_{part}.h.jinja").render() for part in ("functions", "arcs"))
    text = re.sub(r"/\*.*?\*/", "", "".join(parts), flags=re.DOTALL)
    called = set(re.findall(r"\b([a-z0-9]+)\(", text))
    assert called - {"defined", "sizeof", "for"} == {"sqrt", "fabs", "memcpy"}
    assert all(f"#define EG_{name.upper()}(x) eg_{name}(x)" in text for name in NAMES)


@pytest.mark.parametrize(
    ("name", "function", "first", "count"),
    [("arctangent", mpmath.atan, -1 / mpmath.mpf(3), 13), ("arcsine", mpmath.asin, 1 / mpmath.mpf(6), 13)],
)
def test_series_of_arcs_are_minimax_polynomials(
    name: str, function: Callable[..., mpmath.mpf], first: mpmath.mpf, count: int
) -> None:
    """Of (f(r)/r - 1)/z, with z = r^2 up to 1/4."""

    def tail(z: mpmath.mpf) -> mpmath.mpf:
        r = mpmath.sqrt(z)
        return (function(r) / r - 1) / z if z > 1e-12 else first

    text = re.search(rf"eg_wide {name} = (.*?);", HEADER, re.DOTALL)
    assert text is not None
    written = [float(number) for number in re.findall(r"EG_WIDE\(([^)]*)\)", text[1])]
    with mpmath.workdps(60):
        exact = mpmath.chebyfit(tail, [mpmath.mpf(0), mpmath.mpf("0.25") * mpmath.mpf("1.0000001")], count)[::-1]
        assert written == [float(c) for c in exact]


def test_a_quarter_of_pi_is_50_bits_and_the_rest() -> None:
    first, second = 0.7853981633974483, 3.061616997868383e-17
    assert HEADER.count(f"EG_WIDE({first!r})") == HEADER.count(f"EG_WIDE({second!r})") == 1
    assert (first * 2.0**50).is_integer()
    with mpmath.workdps(40):
        assert abs(mpmath.mpf(first) + mpmath.mpf(second) - mpmath.pi / 4) < 2.0**-106


@pytest.mark.parametrize("profile", ["quick", pytest.param("fast", marks=pytest.mark.slow)])
def test_sines_of_float_at_all_exponents(
    profile: str, tmp_path_factory: pytest.TempPathFactory, rng: np.random.Generator
) -> None:
    tape = Tape()
    t = tape.input("t")
    block = Block("y", (2,), (tape.call(Op.SIN, t), tape.call(Op.COS, t)))
    system = make_system("circle", tape, [Function("circle", "", ("t",), (block,))])
    library = compile_system(system, tmp_path_factory.mktemp("float"), profile=profile, real="float")
    exponents = 2.0 ** rng.uniform(-126, 128, 8000)
    quarters = np.round(10.0 ** rng.uniform(0, 12, 2000)) * (np.pi / 2)
    x = np.concatenate([exponents, -exponents, quarters, rng.uniform(-1.2e5, 1.2e5, 4000), [0.0, np.finfo("f4").max]])
    x = x.astype(np.float32).astype(float)
    found = call(library, "circle", {"t": x.reshape(-1, 1)})[0]
    assert np.max(np.abs(found - np.stack([np.sin(x), np.cos(x)], axis=-1))) < 1.3e-7
    assert np.all(np.isnan(call(library, "circle", {"t": np.array([[np.inf], [-np.inf], [np.nan]])})[0]))
