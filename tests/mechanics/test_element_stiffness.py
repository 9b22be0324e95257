"""Stiffness of beam elements with linear moments against integrals of the section's flexibility along the element."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from eomgen.mechanics.forces.cosserat_beams import with_linear_moments
from eomgen.symbolic.scalar import Algebra
from eomgen.symbolic.tape import Tape
from tests.oracles.beam_elements import element_by_flexibility
from tests.oracles.evaluation import Array

LENGTH = 1.7


def element(
    section: Array, damping: Array, length: float = LENGTH, initial: Sequence[float] = (0, 0, 0, 1, 0, 0)
) -> tuple[Array, Array, Array]:
    algebra = Algebra(Tape())
    given = ([[algebra.scalar(float(x)) for x in row] for row in rows] for rows in (section, damping))
    found = with_linear_moments(algebra, *given, length, initial)
    stiffness, damped, of_section = (
        np.array([[entry.constant for entry in row] for row in rows], float)
        for rows in (found.stiffness, found.damping, found.of_section)
    )
    return stiffness, damped, of_section


def definite(rng: np.random.Generator) -> Array:
    root = rng.normal(size=(6, 6))
    matrix: Array = root @ root.T + 0.3 * np.eye(6)
    return matrix


def test_a_coupled_section_has_the_flexibility_and_damping_of_its_moments(rng: np.random.Generator) -> None:
    for _ in range(20):
        section, dampers = definite(rng), definite(rng)
        stiffness, damping, of_section = element(section, dampers)
        expected, damped = element_by_flexibility(section, dampers, LENGTH)
        within = 1e-12 * np.linalg.cond(section)
        assert np.array_equal(stiffness, stiffness.T) and np.array_equal(damping, damping.T)
        assert np.abs(stiffness - expected).max() < within * np.abs(section).max()
        assert np.abs(damping - damped).max() < within * np.abs(dampers).max()
        assert np.abs(section @ of_section - stiffness).max() < within * np.abs(section).max()


def test_a_helix_has_the_flexibility_of_its_wrenches_to_the_fourth_order(rng: np.random.Generator) -> None:
    section, dampers, curvature = definite(rng), definite(rng), np.array([0.6, -0.4, 0.8])
    errors = []
    for length in (0.02, 0.01):
        stiffness, damping, _ = element(section, dampers, length, [*curvature, 1.0, 0.0, 0.0])
        expected, damped = element_by_flexibility(section, dampers, length, curvature)
        errors.append([np.abs(stiffness - expected).max(), np.abs(damping - damped).max()])
    assert np.log2(np.divide(*errors)) == pytest.approx([4.0, 4.0], abs=0.1)


@pytest.mark.parametrize("shear", [1e-3, 1.0, 1e6, 1e12, 1e200])
def test_a_section_that_hardly_shears_loses_no_digit(shear: float) -> None:
    found, damping, _ = element(np.diag([2.0, 3.0, 5.0, 7.0, shear, 2.0 * shear]), np.zeros((6, 6)))
    assert np.count_nonzero(found) == 6 and not damping.any()
    expected = [1.0 / (1.0 / shear + LENGTH**2 / 60.0), 1.0 / (0.5 / shear + LENGTH**2 / 36.0)]
    assert np.diag(found) == pytest.approx([2.0, 3.0, 5.0, 7.0, *expected], rel=1e-15)


def test_strains_that_a_beam_does_not_have_stay_without_stiffness() -> None:
    section = np.diag([2.0, 3.0, 5.0, 0.0, 0.0, 0.0])
    found, damping, _ = element(section, 0.1 * section)
    assert np.array_equal(found, section)
    assert damping == pytest.approx(0.1 * section, rel=1e-15)
