"""The quarter car of the examples against linear theory: eigenvalues, steady motion on harmonics, root mean squares."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen import Model

SCENE = Path(__file__).parents[2] / "examples" / "quarter_car" / "scene.toml"
SPRUNG, UNSPRUNG, SPRING, DAMPER, TYRE = 240.0, 36.0, 16000.0, 980.0, 160000.0


@pytest.fixture(scope="module")
def model() -> Model:
    return eomgen.build(SCENE)


def _matrices(damper: float = DAMPER, skyhook: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return M, C, K of (wheel, body), written down by hand."""
    mass = np.diag([UNSPRUNG, SPRUNG])
    damping = np.array([[damper, -damper - skyhook], [-damper, damper + skyhook]])
    return mass, damping, np.array([[SPRING + TYRE, -SPRING], [-SPRING, SPRING]])


def _eigenvalues(model: Model, **parameters: float) -> np.ndarray:
    q, v = model.initial_q, model.initial_v
    K, C, M = model.partials(q, v, np.zeros(2), parameters=parameters)
    companion = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    return np.linalg.eigvals(companion)


def test_undamped_frequencies(model: Model) -> None:
    frequencies = np.unique(np.round(np.abs(_eigenvalues(model, damper=0.0).imag) / (2 * math.pi), 9))
    np.testing.assert_allclose(frequencies, [1.2382426677, 11.1351894335], atol=1e-9)


def test_damped_eigenvalues(model: Model) -> None:
    found = sorted((value for value in _eigenvalues(model) if value.imag > 0), key=abs)
    np.testing.assert_allclose(found, [-1.7116733175 + 7.6694018453j, -13.9411044603 + 67.8527902572j], atol=1e-9)


@pytest.mark.parametrize("skyhook", [0.0, 2000.0])
def test_partials_are_the_textbook_matrices(model: Model, skyhook: float) -> None:
    K, C, M = model.partials(model.initial_q, model.initial_v, np.zeros(2), parameters={"skyhook": skyhook})
    for found, expected in zip((M, C, K), _matrices(skyhook=skyhook), strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-9)


def test_rests_on_a_flat_road(model: Model) -> None:
    assert np.abs(model.forward_dynamics(model.initial_q, model.initial_v, 5.0, {"road": 0.0})).max() < 1e-12
