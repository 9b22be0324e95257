"""Named cases of generalized-alpha: published coefficients and spectra, orders on every group, refusals with the
reason."""

from __future__ import annotations

from fractions import Fraction as F

import numpy as np
import pytest

from eomgen.errors import ModelError, UsageError
from eomgen.integrators.families.generalized_alpha import GeneralizedAlpha
from eomgen.integrators.families.generalized_alpha_cases import hht, newmark, trapezoidal, wbz
from eomgen.integrators.families.register import check_needs, method_named, method_parameters
from tests.integrators.test_methods import facts

# -- coefficients ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("case", "alpha_m", "alpha_f", "beta", "gamma", "order"),
    [
        (hht(alpha=0.05), F(0), F(1, 20), F(441, 1600), F(11, 20), 2),
        (hht(alpha=0.3), F(0), F(3, 10), F(169, 400), F(4, 5), 2),
        (hht(rho_inf=0.5), F(0), F(1, 3), F(4, 9), F(5, 6), 2),
        (wbz(alpha=0.1), F(-1, 10), F(0), F(121, 400), F(3, 5), 2),
        (wbz(rho_inf=0.0), F(-1), F(0), F(1), F(3, 2), 2),
        (newmark(), F(0), F(0), F(1, 4), F(1, 2), 2),
        (newmark(0.3025, 0.6), F(0), F(0), F(121, 400), F(3, 5), 1),
        (newmark(alpha=0.1), F(0), F(0), F(121, 400), F(3, 5), 1),
        (trapezoidal(), F(0), F(0), F(1, 4), F(1, 2), 2),
    ],
)
def test_coefficients_are_the_published_fractions(case, alpha_m, alpha_f, beta, gamma, order):
    assert (case.alpha_m, case.alpha_f, case.beta, case.gamma, case.order) == (alpha_m, alpha_f, beta, gamma, order)
    assert case.unconditionally_stable


# -- spectra -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("case", "limit"),
    [
        (hht(alpha=0.05), 0.95 / 1.05),
        (hht(alpha=0.3), 0.7 / 1.3),
        (wbz(alpha=0.1), 0.9 / 1.1),
        (wbz(rho_inf=0.3), 0.3),
        (newmark(alpha=0.2), 0.8 / 1.2),
        (newmark(0.5, 0.6), np.sqrt(1.0 - 0.1 / 0.5)),
        (trapezoidal(), 1.0),
    ],
)
def test_spectral_radius_at_high_frequency_is_the_published_one(case, limit):
    assert GeneralizedAlpha(case=case).rho_inf == pytest.approx(limit, abs=1e-6)


def test_linear_acceleration_is_stable_up_to_its_published_phase():
    method = GeneralizedAlpha(case=newmark(1 / 6, 0.5))
    assert method.case.largest_phase == pytest.approx(np.sqrt(12.0))
    assert method.warnings(False) == (
        "newmark with 2 beta < gamma is stable only while step times the highest angular frequency stays below 3.464",
    )


# -- refusals ----------------------------------------------------------------------------------------------------------


RHO = {"rho_inf": 0.5}


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: hht(alpha=-0.05), r"alpha of hht must lie in 0\.\.1/3, not -0\.05: .* the opposite sign; try: 0\.05"),
        (lambda: hht(alpha=0.4), r"must lie in 0\.\.1/3, not 0\.4: at high frequencies it damps less again"),
        (lambda: hht(rho_inf=0.3), r"infinite frequency of 1/2 to 1, not 0\.3; try: generalized_alpha"),
        (lambda: wbz(alpha=1.1), r"alpha of wbz must lie in 0\.\.1, not 1\.1"),
        (lambda: wbz(rho_inf=1.1), r"wbz has spectral radii at infinite frequency of 0 to 1, not 1\.1; try: 0\.9"),
        (lambda: newmark(beta=0.0), r"method\.beta: beta must be positive, not 0\.0: with zero the step is explicit"),
        (lambda: newmark(gamma=0.4), r"gamma must be at least 1/2, not 0\.4: below it every oscillation grows"),
        (lambda: newmark(0.25, alpha=0.1), "newmark takes alpha, or beta and gamma, not both"),
        (lambda: newmark(beta=float("nan")), r"method\.beta: a finite number is needed, not nan"),
        (lambda: method_named("trapezoidal_index3"), "has a spectral radius of 1 here, and index 3 is weakly unstable"),
        (lambda: method_named("newmark_index3"), r"spectral radius of 1 here.*try: newmark without _index3"),
        (lambda: method_parameters("trapezoidal", RHO, {}), "rho_inf: trapezoidal takes no rho_inf; try: leave"),
        (lambda: method_parameters("newmark", RHO, {}), "newmark takes no rho_inf; try: only alpha, beta, gamma"),
        (lambda: method_parameters("hht", {**RHO, "alpha": 0.3}, {}), "alpha and rho_inf say the same"),
        (lambda: method_parameters("generalized_alpha", {"alpha": 0.3}, {}), "takes no alpha; try: only rho"),
        (lambda: method_parameters("rk4", {"beta": 0.3}, {}), "rk4 takes no beta"),
    ],
)
def test_what_cannot_be_is_refused_with_the_reason(make, text):
    with pytest.raises(UsageError, match=text):
        make()


def test_a_conditionally_stable_newmark_takes_no_constraints():
    method = GeneralizedAlpha(case=newmark(1 / 6, 0.5))
    check_needs(method, facts())
    with pytest.raises(ModelError, match=r"without constraints: with 2 beta < gamma .*try: beta of at least gamma/2"):
        check_needs(method, facts(constraints=True))


def test_parameters_of_a_call_go_before_those_of_a_scene():
    assert method_parameters("hht", {}, {"rho_inf": 0.8, "alpha": None}) == {"rho_inf": 0.8}
    assert method_parameters("hht", {"rho_inf": 0.9}, {"rho_inf": 0.8, "alpha": 0.1}) == {"rho_inf": 0.9}
    assert method_named("hht", 0.8, alpha=0.1).case == hht(alpha=0.1)
