"""Methods as data: the coefficients, and the refusals."""

from __future__ import annotations

from fractions import Fraction as F

import numpy as np
import pytest

from eomgen.errors import UsageError
from eomgen.integrators.families.generalized_alpha import GeneralizedAlpha
from eomgen.integrators.families.runge_kutta import RUNGE_KUTTA_MUNTHE_KAAS_4
from eomgen.system.system import Facts
from tests.oracles.orders import order_of_tableau


@pytest.mark.parametrize(
    ("rho", "alpha_m", "alpha_f", "beta", "gamma"),
    [
        (1.0, F(1, 2), F(1, 2), F(1, 4), F(1, 2)),
        (0.9, F(8, 19), F(9, 19), F(100, 361), F(21, 38)),
        (0.8, F(1, 3), F(4, 9), F(25, 81), F(11, 18)),
        (0.6, F(1, 8), F(3, 8), F(25, 64), F(3, 4)),
        (0.0, F(-1), F(0), F(1), F(3, 2)),
    ],
)
def test_coefficients_are_the_published_fractions(rho, alpha_m, alpha_f, beta, gamma):
    method = GeneralizedAlpha(rho)
    assert (method.alpha_m, method.alpha_f, method.beta, method.gamma) == (alpha_m, alpha_f, beta, gamma)


@pytest.mark.parametrize("rho", [-0.1, 1.01, float("nan"), float("inf"), "0.9"])
def test_a_spectral_radius_outside_its_range_is_refused(rho):
    with pytest.raises(
        UsageError, match=r"method\.rho_inf: the spectral radius .* must lie in 0\.\.1, not .*try: 0\.9"
    ):
        GeneralizedAlpha(rho)


def test_the_tableau_has_its_order():
    method = RUNGE_KUTTA_MUNTHE_KAAS_4
    assert order_of_tableau(method.A, method.b, method.c) == method.order == 4
    assert method.commutators >= method.order - 2
    heun = ((F(0), F(0), F(0)), (F(1, 3), F(0), F(0)), (F(0), F(2, 3), F(0)))
    assert order_of_tableau(heun, (F(1, 4), F(0), F(3, 4)), (F(0), F(1, 3), F(2, 3))) == 3


def facts(**changes):
    return Facts(**{"constant_mass": False, "velocity_forces": True, "smooth": True, "moving_base": True} | changes)


@pytest.mark.parametrize("rho_inf", [0.0, 0.3, 0.5, 0.8, 1.0])
def test_equations_of_first_order_have_the_same_radius_at_infinity(rho_inf):
    method = GeneralizedAlpha(rho_inf)
    alpha_m, alpha_f, gamma = (float(x) for x in (method.rate_alpha_m, method.alpha_f, method.rate_gamma))
    radii = []
    for stiffness in (1e-3, 1.0, 1e3, 1e9):  # zdot = -stiffness z in steps of 1: (z, rate) -> (z', rate')
        # (1 - am) rate' + am rate = -stiffness ((1 - af) z' + af z),  z' = z + (1 - g) rate + g rate'
        left = np.array([[1.0, -gamma], [stiffness * (1.0 - alpha_f), 1.0 - alpha_m]])
        right = np.array([[1.0, 1.0 - gamma], [-stiffness * alpha_f, -alpha_m]])
        radii.append(np.abs(np.linalg.eigvals(np.linalg.solve(left, right))).max())
    assert max(radii) <= 1.0 + 1e-12
    assert radii[-1] == pytest.approx(rho_inf, abs=1e-4)
