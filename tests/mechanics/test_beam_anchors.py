"""Published digits of geometrically exact beams: bend of 45 degrees, composite beam, twisted beam.

The digits are those of Kynema-FMB's verification chapter, of 15 nodes of one spectral element, which BeamDyn meets
(github.com/kynema/kynema-fmb, docs/sphinx/testing). Its bend of 45 degrees is no arc: the axis goes through the arc's
first, middle and last point, rounded to six digits, as a parabola, which begins 3.15 degrees off the arc.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from eomgen.mechanics.derive import derive
from eomgen.scene.load import from_data
from tests.anchors import anchor
from tests.models.cosserat import beam_scene, pose_of_last, rest
from tests.oracles.evaluation import Array
from tests.oracles.rods import tip_of_rod

TERMS = ("residual", "partials", "poses")
#: Of Wang, Sprague, Jonkman, Johnson and Jonkman, Wind Energy 20 (2017) 1439, rotations first; lb, in.
COMPOSITE = np.diag([16.96e3, 59.12e3, 141.47e3, 1368.17e3, 88.56e3, 38.78e3])
COMPOSITE[0, 1] = COMPOSITE[1, 0] = 17.61e3
COMPOSITE[0, 2] = COMPOSITE[2, 0] = -0.351e3
COMPOSITE[1, 2] = COMPOSITE[2, 1] = -0.37e3
#: Of the same paper: a section of 0.5 m by 0.25 m that turns by 90 degrees over 10 m; N, m.
TWISTED = np.diag([1.41872656e8, 5.20833e8, 1.30208333e8, 2.5e10, 8.2604167e9, 8.2604167e9])
BENT = np.diag([8.333e5, 8.333e5, 8.333e5, 1e7, 41.6667e5, 41.6667e5])
#: Stiffness, dead force across z at the tip, curvature at rest; 10 long. Displacements of the tip are anchor cases.
PUBLISHED: dict[str, tuple[Array, float, list[float]]] = {
    "composite_beam": (COMPOSITE, 150.0, [0.0, 0.0, 0.0]),
    "twisted_beam": (TWISTED, -4e6, [np.pi / 20.0, 0.0, 0.0]),
}


def tips_of(elements: tuple[int, ...], force: float, beam: dict[str, Any]) -> list[Array]:
    """Return where the tip rests under a dead force along z, for each number of elements."""
    tips = []
    for count in elements:
        system = derive(from_data(beam_scene(count, {"force": [0.0, 0.0, f"{force!r} * load"]}, beam)), TERMS)
        tips.append(pose_of_last(system, rest(system, 2))[4:])
    return tips


def extrapolated(tips: list[Array]) -> Array:
    """Return the limit of a result whose error is a series in squares of the spacing, halved from one to the next."""
    order = 2
    while len(tips) > 1:
        tips = [(2**order * fine - coarse) / (2**order - 1) for coarse, fine in pairwise(tips)]
        order += 2
    return tips[0]


@pytest.mark.slow_cases("twisted_beam")
@pytest.mark.parametrize("name", PUBLISHED)
def test_the_differential_equations_have_the_published_digits(name: str) -> None:
    stiffness, force, curvature = PUBLISHED[name]
    expected = anchor(name).reference
    found = tip_of_rod(10.0, stiffness, np.array([0.0, 0.0, force]), lambda _: np.array(curvature)) - [10.0, 0.0, 0.0]
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-9 * np.linalg.norm(expected))


@pytest.mark.slow
@pytest.mark.parametrize("name", PUBLISHED)
def test_elements_reach_the_published_digits_at_order_2(name: str) -> None:
    stiffness, force, curvature = PUBLISHED[name]
    displacement, start = anchor(name).reference, np.array([10.0, 0.0, 0.0])
    expected = displacement + start
    beam = {"stiffness": None, "stiffness_matrix": stiffness.tolist(), "curvature": curvature}
    tips = tips_of((2, 4, 8, 16), force, beam)
    errors = [float(np.linalg.norm(tip - expected)) for tip in tips]
    assert np.log2(errors[2] / errors[3]) == pytest.approx(2.0, abs=0.05)
    assert errors[3] < 1e-3 * np.linalg.norm(displacement)
    anchor(name).check(extrapolated(tips) - start)


def parabola() -> tuple[Array, Array]:
    """Return the three points of Kynema's bend, and the coefficients of y over x, constant first."""
    points = np.array([[0.0, 0.0], [38.2683, -7.61205], [70.7107, -29.2893]])
    return points, np.polynomial.polynomial.polyfit(points[:, 0], points[:, 1], 2)


@pytest.mark.slow
def test_the_arc_itself_bends_otherwise() -> None:
    """Digits of the arc; Bathe and Bolourchi 1979 give 23.5, 13.4 and 53.4 in size."""
    ends = 100.0 * np.array([np.sin(np.pi / 4.0), np.cos(np.pi / 4.0) - 1.0, 0.0])
    tip = tip_of_rod(25.0 * np.pi, BENT, np.array([0.0, 0.0, 600.0]), lambda _: np.array([0.0, 0.0, -0.01]))
    np.testing.assert_allclose(tip - ends, [-23.5612968, 13.6050230, 53.4761081], atol=1e-6)
