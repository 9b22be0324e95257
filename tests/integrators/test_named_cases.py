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
from eomgen.lie.product import Factor
from tests.integrators.test_methods import facts
from tests.oracles.stepper import Equations, integrate


def oscillator(frequency=1.0):
    square = frequency**2 * np.eye(1)
    return Equations(
        [Factor("R", "x", 0, 1, 0, 1)],
        lambda t, q, v: -square[0] * q,
        lambda t, q, v, a: a + square[0] * q,
        lambda t, q, v, a: (square, np.zeros((1, 1)), np.eye(1)),
    )


def eigenvalues(method, phase):
    """Return those of the stepper's own amplification matrix at w step = phase, from runs of the NumPy stepper with
    step 1.

    Three steps in a row of a linear method obey one recurrence of order three; two runs from independent states
    determine it.
    """
    starts = [(np.array([1.0]), np.array([0.0])), (np.array([0.3]), np.array([1.0]))]
    paths = [integrate(oscillator(phase), method, q, v, 1.0, 5).q[:, 0] for q, v in starts]
    rows = [path[k : k + 3] for path in paths for k in range(3)]
    right = [path[k + 3] for path in paths for k in range(3)]
    scale = np.array([np.abs(row).max() for row in rows])
    c = np.linalg.lstsq(np.array(rows) / scale[:, None], np.array(right) / scale, rcond=1e-9)[0]
    return np.roots([1.0, -c[2], -c[1], -c[0]])


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

FAR = 1e3


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
    method = GeneralizedAlpha(case=case)
    assert method.rho_inf == pytest.approx(limit, abs=1e-6)
    assert np.abs(eigenvalues(method, FAR)).max() == pytest.approx(limit, abs=2e-3)


@pytest.mark.parametrize("rho", [0.2, 0.5, 0.9])
def test_spectral_radius_of_generalized_alpha_at_high_frequency(rho):
    # its roots meet at infinity: what is left of 1/FAR^2 moves a triple root by the cube root of it
    assert np.abs(eigenvalues(GeneralizedAlpha(rho), FAR)).max() == pytest.approx(rho, abs=FAR ** (-2 / 3) + 5e-3)


@pytest.mark.parametrize("phase", [0.1, 1.0, 3.0, 20.0])
def test_the_trapezoidal_rule_turns_by_twice_the_arc_tangent(phase):
    found = eigenvalues(GeneralizedAlpha(case=trapezoidal()), phase)
    main = found[np.argsort(-np.abs(found))[:2]]
    assert np.abs(main) == pytest.approx(1.0, abs=1e-9)
    assert np.abs(np.angle(main)) == pytest.approx(2.0 * np.arctan(phase / 2.0), rel=1e-7)


@pytest.mark.parametrize(("beta", "gamma"), [(0.25, 0.5), (0.3025, 0.6), (1 / 6, 0.5), (0.5, 0.7)])
@pytest.mark.parametrize("phase", [0.5, 2.0, 3.0])
def test_newmark_has_its_characteristic_polynomial(beta, gamma, phase):
    # Hughes, The Finite Element Method (1987), section 9.1: l^2 - 2 A1 l + A2, D = 1 + beta W^2
    D = 1.0 + beta * phase**2
    A1, A2 = 1.0 - 0.5 * phase**2 * (gamma + 0.5) / D, 1.0 - phase**2 * (gamma - 0.5) / D
    found = eigenvalues(GeneralizedAlpha(case=newmark(beta, gamma)), phase)
    for root in np.roots([1.0, -2.0 * A1, A2]):
        assert np.abs(found - root).min() < 1e-6


def test_linear_acceleration_is_stable_up_to_its_published_phase():
    method = GeneralizedAlpha(case=newmark(1 / 6, 0.5))
    assert method.case.largest_phase == pytest.approx(np.sqrt(12.0))
    assert np.abs(eigenvalues(method, np.sqrt(12.0) - 0.05)).max() == pytest.approx(1.0, abs=1e-6)
    assert np.abs(eigenvalues(method, np.sqrt(12.0) + 0.05)).max() > 1.1
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
