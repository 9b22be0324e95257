"""What follows from the shapes of sections, against integrals, published tables and Cowper's general formula."""

# ruff: noqa: E501 (a row of the table is a message, quoted whole)

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
import pytest

from eomgen.errors import DescriptionError
from eomgen.formula.evaluate import evaluate
from eomgen.formula.nodes import Formula, Number
from eomgen.scene.bodies.cross_sections import SHAPES, ShapeValues
from eomgen.scene.load import from_data
from tests.anchors import anchor
from tests.oracles.evaluation import Array

RATIO = 0.3


def value(formula: Formula) -> float:
    return evaluate(formula, lambda symbol: math.nan)


def values_of(shape: str, sizes: list[float], ratio: float = RATIO) -> ShapeValues:
    return SHAPES[shape].law([Number(size) for size in sizes], Number(ratio), value)


#: Of each shape: sizes, and the boundary by an angle, whose integrals are those of the section; the hole's after it.
BOUNDARIES: dict[str, tuple[list[float], list[Callable[[Array], tuple[Array, Array]]]]] = {
    "circle": ([0.8], [lambda u: (0.4 * np.cos(u), 0.4 * np.sin(u))]),
    "ellipse": ([0.6, 1.4], [lambda u: (0.3 * np.cos(u), 0.7 * np.sin(u))]),
    "tube": (
        [0.8, 0.15],
        [lambda u: (0.4 * np.cos(u), 0.4 * np.sin(u)), lambda u: (0.25 * np.cos(-u), 0.25 * np.sin(-u))],
    ),
}


def by_boundary(shape: str, function: Callable[[Array, Array], Array]) -> float:
    """Return an integral over a section of df/dx by Green's theorem, for f = ``function``."""
    u = np.linspace(0.0, 2.0 * np.pi, 401)[:-1]
    total = 0.0
    for boundary in BOUNDARIES[shape][1]:
        x, y = boundary(u)
        dy = np.real(np.fft.ifft(1j * np.fft.fftfreq(len(u), 1 / len(u)) * np.fft.fft(y)))
        total += float(np.mean(function(x, y) * dy) * 2.0 * np.pi)
    return total


@pytest.mark.parametrize("shape", BOUNDARIES)
def test_areas_and_second_moments_are_integrals(shape: str) -> None:
    found = values_of(shape, BOUNDARIES[shape][0])
    assert value(found.area) == pytest.approx(by_boundary(shape, lambda x, y: x), rel=1e-12)
    expected = [by_boundary(shape, lambda x, y: x**3 / 3.0), by_boundary(shape, lambda x, y: x * y**2)]
    np.testing.assert_allclose([value(item) for item in found.second_moments], expected, rtol=1e-12)


def test_a_rectangle_has_the_area_and_the_moments_of_one() -> None:
    found = values_of("rectangle", [0.2, 0.5])
    np.testing.assert_allclose(
        [value(item) for item in (found.area, *found.second_moments)], [0.1, 0.5 * 0.2**3 / 12, 0.2 * 0.5**3 / 12]
    )


def torsion_factor(ratio: float) -> float:
    return value(values_of("rectangle", [1.0, ratio]).torsion_constant) / ratio


def test_torsion_of_rectangles_is_that_of_the_table() -> None:
    """Timoshenko and Goodier, Theory of Elasticity, 1970, table of section 109."""
    anchor("torsion_of_rectangles").check([torsion_factor(ratio) for ratio in (1.0, 1.5, 2.0, 3.0, 5.0, 10.0)])
    for ratio, factor in ((1.2, 0.166), (2.5, 0.249), (4.0, 0.281)):
        assert torsion_factor(ratio) == pytest.approx(factor, abs=6e-4)


@pytest.mark.parametrize("ratio", [1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 10.0])
def test_torsion_of_rectangles_is_their_series(ratio: float) -> None:
    for sizes in ([1.0, ratio], [ratio, 1.0]):
        found = value(values_of("rectangle", sizes).torsion_constant)
        series = mpmath.nsum(
            lambda k: mpmath.tanh((2 * k + 1) * mpmath.pi * ratio / 2) / (2 * k + 1) ** 5, [0, mpmath.inf]
        )
        assert found == pytest.approx(
            float(ratio * (mpmath.mpf(1) / 3 - 64 * series / (mpmath.pi**5 * ratio))), rel=1e-13
        )


def test_a_foil_has_the_torsion_of_a_thin_strip() -> None:
    found = value(values_of("rectangle", [1e4, 1.0]).torsion_constant)
    edges = 192.0 / np.pi**5 * float(31 * mpmath.zeta(5) / 32) * 1e-4
    assert found == pytest.approx(1e4 / 3.0 * (1.0 - edges), rel=1e-14)


def by_prandtl(shape: str) -> float:
    """Return 2 times the integral of Prandtl's function, which these sections have in closed form."""
    if shape == "ellipse":
        a, b = 0.3, 0.7
        size = a * a * b * b / (a * a + b * b)
        return 2.0 * by_boundary(shape, lambda x, y: size * (x - x**3 / (3 * a * a) - x * y**2 / (b * b)))
    return by_boundary(shape, lambda x, y: x**3 / 3.0 + x * y**2)


@pytest.mark.parametrize("shape", BOUNDARIES)
def test_torsion_constants_are_integrals_of_prandtls_function(shape: str) -> None:
    found = value(values_of(shape, BOUNDARIES[shape][0]).torsion_constant)
    assert found == pytest.approx(by_prandtl(shape), rel=1e-12)


def flexure_function(points: Array, normals: Array, ratio: float, holed: bool) -> Callable[[Array, Array], Array]:
    """Return Love's flexure function chi of a section loaded along x, by least squares on its boundary.

    d chi/dn = -n_x (nu x^2/2 + (1 - nu/2) y^2) - n_y (2 + nu) x y, with harmonic polynomials odd in x and even in y,
    and around a hole their mirror images too (Love, Mathematical Theory of Elasticity, 1927, section 229).
    """
    powers = [*range(1, 22, 2), *(range(-9, 0, 2) if holed else ())]
    z, n = points[:, 0] + 1j * points[:, 1], normals[:, 0] + 1j * normals[:, 1]
    matrix = np.column_stack([np.real(power * z ** (power - 1) * n) for power in powers])
    x, y = points.T
    right = -normals[:, 0] * (ratio * x**2 / 2 + (1 - ratio / 2) * y**2) - normals[:, 1] * (2 + ratio) * x * y
    weights = np.linalg.lstsq(matrix, right, rcond=None)[0]
    assert np.abs(matrix @ weights - right).max() < 1e-3 * np.abs(right).max()
    return lambda x, y: np.real(
        sum(weight * (x + 1j * y) ** power for weight, power in zip(weights, powers, strict=True))
    )


@pytest.mark.parametrize("shape", BOUNDARIES)
def test_shear_factors_are_those_of_cowpers_general_formula(shape: str) -> None:
    """Equation (16) of J. Appl. Mech. 33 (1966) 335: its integrals are sums over cells in polar coordinates."""
    sizes, boundaries = BOUNDARIES[shape]
    u, h, hole = np.linspace(0.0, 2.0 * np.pi, 241)[:-1], 1e-5, 0.625 if shape == "tube" else 0.0
    r, v = np.meshgrid(np.linspace(hole, 1.0, 801)[1::2], u)
    outer = boundaries[0](v.ravel())
    inside = np.column_stack([r.ravel() * outer[0], r.ravel() * outer[1]])
    found = values_of(shape, sizes)
    weight = r.ravel() / np.sum(r) * value(found.area)
    points = np.vstack([np.column_stack(boundary(u)) for boundary in boundaries])
    slopes = np.vstack([np.column_stack(boundary(u + h)) - np.column_stack(boundary(u - h)) for boundary in boundaries])
    normals = np.column_stack([slopes[:, 1], -slopes[:, 0]]) / np.linalg.norm(slopes, axis=1)[:, np.newaxis]
    for axis, factor in enumerate(found.shear_factors):
        order = [axis, 1 - axis]
        chi = flexure_function(points[:, order], normals[:, order], RATIO, shape == "tube")
        x, y = inside[:, order].T
        along, across = np.sum(weight * x * x), np.sum(weight * y * y)
        integral = np.sum(weight * x * (chi(x, y) + x * y * y))
        below = RATIO / 2 * (across - along) - np.sum(weight) / along * integral
        assert value(factor) == pytest.approx(2 * (1 + RATIO) * along / below, rel=2e-4), axis


def test_the_shear_factor_of_a_rectangle_is_that_of_cowpers_table() -> None:
    shapes = ("rectangle", [0.2, 0.5]), ("circle", [0.2])
    anchor("shear_factors").check([value(values_of(*shape).shear_factors[0]) for shape in shapes])


def scene(section: dict[str, Any], **parameters: Any) -> dict[str, Any]:
    material = {"elastic_modulus": 2e11, "density": 7850.0, "poisson_ratio": 0.3}
    return {
        "format": 1,
        "name": "shape",
        "parameters": {name: {"value": number, "tunable": True} for name, number in parameters.items()},
        "beams": {"rod": {"model": "cosserat", "length": 1.0, "elements": 2, "section": {**material, **section}}},
        "joints": {"clamp": {"type": "fixed", "parent": "base", "child": "rod"}},
    }


def test_a_shear_modulus_stands_for_poissons_ratio() -> None:
    rows = []
    for given in ({"poisson_ratio": 0.25}, {"shear_modulus": 8e10}):
        data = scene({"shape": "rectangle", "width": 0.1, "height": 0.2})
        del data["beams"]["rod"]["section"]["poisson_ratio"]
        data["beams"]["rod"]["section"] |= given
        (element,) = from_data(data).elements
        rows.append([[value(entry) for entry in row] for row in element.beam.parts[0].section.stiffness])
    np.testing.assert_allclose(rows[0], rows[1], rtol=1e-14)


REFUSED: list[tuple[dict[str, Any], str]] = [
    ({"shape": "circle"}, "(beams.rod.section): a circle needs its diameter; try: diameter = 0.02"),
    ({"shape": "circle", "width": 0.1, "diameter": 0.1}, "(beams.rod.section.width): a circle has no width; try: diameter"),
    ({"shape": "circle", "diameter": 0.1, "area": 0.1}, "(beams.rod.section.area): area is given, and follows"),
    ({"diameter": 0.1}, "(beams.rod.section.diameter): diameter belongs to a shape, and the section has no shape"),
    ({"shape": "tube", "diameter": 0.1, "thickness": 0.06},
        "(beams.rod.section.thickness): the wall of 0.06 m is thicker than half of the diameter 0.1 m; try: a "
        "thinner wall, or a circle"),
    ({"shape": "circle", "diameter": 0.1, "shear_modulus": 8e10},
        "(beams.rod.section.poisson_ratio): shear_modulus and poisson_ratio are both given; try: one of them: "
        "shear modulus = E/(2 (1 + ratio))"),
    ({"shape": "circle", "diameter": 0.1, "poisson_ratio": 0.6}, "(beams.rod.section.poisson_ratio): Poisson's ratio"),
    ({"shape": "circle", "diameter": "0.1 - 0.2 * s"}, "(beams.rod.section.diameter): at s = 0.75, the diameter"),
]  # fmt: skip  # a table


@pytest.mark.parametrize(("section", "message"), REFUSED)
def test_what_no_section_can_be_is_refused_with_one_message(section: dict[str, Any], message: str) -> None:
    with pytest.raises(DescriptionError, match=re.escape(message)) as caught:
        from_data(scene(section))
    assert len(caught.value.problems) == 1, str(caught.value)


def test_sizes_may_be_tunable_and_are_held_to_their_bounds() -> None:
    found = from_data(scene({"shape": "tube", "diameter": "wide", "thickness": "wide / 10"}, wide=0.1))
    assert any(
        item.rule is not None and item.rule.broken([-0.1]) for item in found.requirements if len(item.formulas) == 1
    )
