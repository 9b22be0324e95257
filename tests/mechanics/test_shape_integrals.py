"""Shape functions of beams and their integrals, held against mpmath's quadrature of the textbook's formulas with 30
digits."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest

from eomgen.formula.nodes import Number
from eomgen.mechanics.shape_functions.families import QuadratureGrid
from eomgen.mechanics.shape_functions.fixed_point import ONE, round_to_doubles
from eomgen.mechanics.shape_functions.integrals import shape_integrals
from eomgen.mechanics.shape_functions.shape_integrals import ShapeIntegrals
from eomgen.scene.bodies.model import Beam, Deformation, DeformationKind, ShapeFunctions

DIGITS = 30
#: Dossier 1.10.0: upper triangles 11, 12, 13, 22, 23, 33.
TABLE = {
    "g0": (1.570878189994, -0.4223203891091, -1.072084834106, 8.647142693561, 1.890054708032, 24.95211330817),
    "g1": (1.193336374108, -0.6858552834474, -0.7923792203096, 6.478224864076, 0.1694078847615, 17.85951987986),
    "gp": (4.647778318679, -7.379875269662, 3.941515487127, 32.41739902797, -22.35244443989, 77.2988908023),
}


def deformation(kind: DeformationKind, modes: int, shapes: ShapeFunctions = "clamped_free", **more: Any) -> Deformation:
    return Deformation(kind, shapes, modes, Number(1.0), **more)


def integrals(*deformations: Deformation, start: float = 0.0, length: float = 1.0, **more: Any) -> ShapeIntegrals:
    return shape_integrals(Beam(start, length, Number(1.0), deformations, **more))


def oracle(mode: int, sign: int) -> tuple[Any, Any]:
    """Return a clamped-free (1) or free-free (-1) mode and its slope as the textbook writes them."""
    guess = (mode - mpmath.mpf(sign) / 2) * mpmath.pi
    wave = mpmath.findroot(lambda x: mpmath.cos(x) * mpmath.cosh(x) + sign, guess)
    sigma = (mpmath.cosh(wave) + sign * mpmath.cos(wave)) / (mpmath.sinh(wave) + sign * mpmath.sin(wave))

    def value(s: Any) -> Any:
        x = wave * s
        return mpmath.cosh(x) - sign * mpmath.cos(x) - sigma * (mpmath.sinh(x) - sign * mpmath.sin(x))

    def slope(s: Any) -> Any:
        x = wave * s
        return wave * (mpmath.sinh(x) + sign * mpmath.sin(x) - sigma * (mpmath.cosh(x) - sign * mpmath.cos(x)))

    return value, slope


def quadrature(function: Any) -> float:
    return float(mpmath.quad(function, mpmath.linspace(0, 1, 9)))


def upper(matrix: Any) -> list[float]:
    return [float(matrix[row, column]) for row in range(3) for column in range(row, 3)]


def test_table_of_the_clamped_free_beam() -> None:
    found = integrals(deformation("bending_y", 3))
    np.testing.assert_allclose(found.d, [0.78299175603963, 0.43393589511072, 0.25442529686611], rtol=0, atol=6e-15)
    np.testing.assert_allclose(found.e, [0.56882574370991, 0.090766786886387, 0.032416374369744], rtol=0, atol=6e-15)
    np.testing.assert_allclose(np.diag(found.k), [12.362363368326, 485.51881851337, 3806.5462663915], rtol=5e-14)
    np.testing.assert_allclose(upper(found.g0), TABLE["g0"], rtol=5e-13)
    np.testing.assert_allclose(upper(found.g1), TABLE["g1"], rtol=5e-13)
    np.testing.assert_allclose(upper(found.at(1.0).shortening), TABLE["gp"], rtol=5e-13)
    assert np.array_equal(found.m, np.diag(np.diag(found.m)))
    assert found.at(0.0).value.tolist() == found.at(0.0).slope.tolist() == [0.0, 0.0, 0.0]


@pytest.mark.slow_except("1-clamped_free-1")
@pytest.mark.parametrize(("shapes", "sign"), [("clamped_free", 1), ("free_free", -1)])
@pytest.mark.parametrize("mode", [1, 2, 7])
def test_modes_against_thirty_digits(shapes: ShapeFunctions, sign: int, mode: int) -> None:
    with mpmath.workdps(DIGITS):
        value, slope = oracle(mode, sign)
        found = integrals(deformation("bending_z", mode, shapes))
        k = mode - 1
        for x in (0.1, 0.5, 0.93, 1.0):
            station = found.at(x)
            assert abs(station.value[k] - float(value(mpmath.mpf(x)))) < 1e-14
            assert abs(station.slope[k] - float(slope(mpmath.mpf(x)))) < 3e-14 * mode
        assert abs(found.d[k] - quadrature(value)) < 3e-15
        assert abs(found.m[k, k] - 1.0) < 3e-15
        g0 = quadrature(lambda s: (1 - s) * slope(s) ** 2)
        g1 = quadrature(lambda s: (1 - s * s) / 2 * slope(s) ** 2)
        assert found.g0[k, k] == pytest.approx(g0, rel=3e-15)
        assert found.g1[k, k] == pytest.approx(g1, rel=3e-15)
        assert found.at(0.4).shortening[k, k] == pytest.approx(
            float(mpmath.quad(lambda s: slope(s) ** 2, mpmath.linspace(0, mpmath.mpf(0.4), 9))), rel=3e-15
        )


#: Rotating cantilever, dossier 1.10.0: hub radius by length, angular speed, flap 1 to 3 (or 2), lag 1 and 2.
ROTATING = [
    (0.0, 0.0, (3.51602, 22.03449, 61.69721), (3.51602, 22.03449)),
    (0.0, 4.0, (5.58500, 24.27335, 63.96676), (3.89772, 23.94150)),
    (0.0, 12.0, (13.17015, 37.60311, 79.61448), (5.42705, 35.63698)),
    (1.0, 2.0, (4.83369, 23.36604), (4.40052, 23.28029)),
    (1.0, 6.0, (10.44387, 32.02724), (8.54835, 31.46020)),
    (1.0, 12.0, (19.72154, 51.07013), (15.65053, 49.64029)),
]


@pytest.mark.slow_cases("clamped_free-20-2e-05-1.0-12.0-flap6-lag6")
@pytest.mark.parametrize(
    ("shapes", "size", "tolerance", "hub", "speed", "flap", "lag"),
    [*(("polynomial", 12, 1e-9, *row) for row in ROTATING), ("clamped_free", 20, 2e-5, *ROTATING[-1])],
)
def test_rotating_cantilever(
    shapes: ShapeFunctions, size: int, tolerance: float, hub: float, speed: float, flap: Any, lag: Any
) -> None:
    found = integrals(deformation("bending_y", size, shapes))
    stiffness = found.k + speed**2 * (found.g1 + hub * found.g0)
    root = np.linalg.inv(np.linalg.cholesky(found.m))
    for wanted, matrix in ((flap, stiffness), (lag, stiffness - speed**2 * found.m)):
        frequencies = np.sqrt(np.linalg.eigvalsh(root @ matrix @ root.T))
        np.testing.assert_allclose(frequencies[: len(wanted)], wanted, rtol=tolerance, atol=5.1e-6)


@pytest.mark.parametrize(("origin", "power"), [(Fraction(0), 23), (Fraction(1, 3), 5), (Fraction(2), 0)])
def test_running_integrals_of_powers_are_powers(origin: Fraction, power: int) -> None:
    grid = QuadratureGrid((), (Fraction(0), Fraction(1, 3), Fraction(2)))
    places = [Fraction(int(place), int(ONE)) for place in grid.positions]
    values = np.array([int(place**power * int(ONE)) for place in places], dtype=object)
    found = round_to_doubles(grid.from_origin(values, origin))
    expected = [float((place ** (power + 1) - origin ** (power + 1)) / (power + 1)) for place in places]
    np.testing.assert_allclose(found, expected, rtol=1e-14, atol=1e-14)
    up_to = grid.weights_up_to([origin]) @ round_to_doubles(values)
    np.testing.assert_allclose(up_to, float(origin ** (power + 1) / (power + 1)), rtol=1e-12, atol=1e-12)
