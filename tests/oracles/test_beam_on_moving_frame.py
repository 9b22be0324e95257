"""Geometric stiffening against Lagrange's equations for every motion of the frame: the difference is exactly zero."""

import pytest
import sympy as sp

from tests.oracles.beam_on_moving_frame import (
    AXIAL,
    CHI,
    EI_Y,
    ETA,
    LENGTH,
    MASS,
    OMEGA,
    PHI,
    by_lagrange,
    by_stiffening,
    x,
)

pytestmark = pytest.mark.slow


@pytest.mark.long
def test_stiffening_is_what_lagrange_says() -> None:
    lagrange, stiffened = by_lagrange(), by_stiffening()
    assert (lagrange - stiffened).expand() == sp.zeros(2, 1)
    missing = (lagrange - by_stiffening(axial_acceleration=False)).expand()
    assert missing[0].has(ETA) and missing[0] != 0 != missing[1]


@pytest.mark.long
def test_other_polynomials_obey_the_same_identity() -> None:
    shapes = PHI + x**3 * (LENGTH - x) / LENGTH**4, CHI - x**2 / LENGTH**2
    assert (by_lagrange(*shapes) - by_stiffening(*shapes)).expand() == sp.zeros(2, 1)


@pytest.mark.long
def test_equation_holds_bending_centrifugal_and_axial_stiffness_of_the_tip_load_shape() -> None:
    """For phi = (3 s^2 - s^3)/2: int phi''^2 = 3/L^3, int phi'^2 = 6/(5 L), int phi^2 = 33 L/140, G1 = 81 L/280."""
    eta_row = by_lagrange()[0]
    assert eta_row.coeff(EI_Y) == 3 * ETA / LENGTH**3
    assert eta_row.coeff(AXIAL) == sp.Rational(6, 5) * ETA / LENGTH
    per_mass = eta_row.coeff(MASS).coeff(ETA)
    assert per_mass.coeff(OMEGA[2] ** 2) == LENGTH * (sp.Rational(81, 280) - sp.Rational(33, 140))
