"""Distributions against SciPy's own, and what is said of texts that are none."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from eomgen.errors import UsageError
from eomgen.products.ensembles import DISTRIBUTIONS, from_normal, read_distribution

P = np.array([1e-9, 0.01, 0.3, 0.5, 0.8, 0.999])
VARIANCE = np.log1p(0.25**2)
ORACLES = {
    "normal(2, 0.5)": stats.norm(2, 0.5),
    "truncated_normal(2, 0.5, 1.5, 4)": stats.truncnorm(-1, 4, 2, 0.5),
    "lognormal(2, 0.5)": stats.lognorm(np.sqrt(VARIANCE), scale=2 * np.exp(-VARIANCE / 2)),
    "uniform(-1, 3)": stats.uniform(-1, 4),
    "loguniform(0.1, 10)": stats.loguniform(0.1, 10),
    "triangular(-1, 0, 3)": stats.triang(0.25, -1, 4),
    "exponential(2)": stats.expon(scale=2),
    "weibull(2, 1.5)": stats.weibull_min(1.5, scale=2),
    "gumbel(1, 2)": stats.gumbel_r(1, 2),
    "integers(-3, 3)": stats.randint(-3, 4),
}


@pytest.mark.parametrize("text", ORACLES)
def test_quantiles_are_those_of_scipy(text: str) -> None:
    np.testing.assert_allclose(read_distribution("vary x", text).quantiles(P), ORACLES[text].ppf(P), rtol=1e-9)


@pytest.mark.parametrize("text", ORACLES)
def test_values_of_normal_variables_have_their_probabilities(text: str) -> None:
    """Out to where a probability less than 1 is rounding, for distributions without an end there."""
    distribution, law = read_distribution("vary x", text), ORACLES[text]
    z = np.array([-9.0, -6.0, -0.5, 0.0, 0.7, 6.0, *([9.0] if distribution.upper else [])])
    expected = np.where(z < 0.0, law.ppf(stats.norm.cdf(z)), law.isf(stats.norm.sf(z)))
    np.testing.assert_allclose(from_normal(distribution, z), expected, rtol=1e-7, atol=1e-9)


def test_every_distribution_has_an_oracle_and_mean_and_deviation_are_those_of_the_number() -> None:
    assert {text.partition("(")[0] for text in ORACLES} == set(DISTRIBUTIONS)
    assert ORACLES["lognormal(2, 0.5)"].mean() == pytest.approx(2.0)
    assert ORACLES["lognormal(2, 0.5)"].std() == pytest.approx(0.5)


def test_units_and_percentages() -> None:
    found = read_distribution("vary stiffness", "normal(80 kN/m, 5 %)", "N/m")
    np.testing.assert_allclose(found.quantiles(P), stats.norm(80e3, 4e3).ppf(P))
    assert read_distribution("vary x", "linspace(-90 deg, 90 deg, 3)", "rad").levels == pytest.approx(
        (-np.pi / 2, 0.0, np.pi / 2)
    )
    assert read_distribution("vary x", "logspace(1, 100, 3)").levels == pytest.approx((1.0, 10.0, 100.0))
    listed = read_distribution("vary x", "values(1, 4)")
    assert listed.quantiles(np.array([0.0, 0.49, 0.51, 1.0])).tolist() == [1.0, 1.0, 4.0, 4.0]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("1.5", "usage error: vary mass: '1.5' is not a distribution; try: mass=normal(1, 0.1)"),
        ("normals(1, 2)", "usage error: vary mass: there is no distribution 'normals'; try: normal"),
        ("normal(1)", "usage error: vary mass: normal takes 2 numbers, not 1; try: normal(mean, deviation)"),
        ("normal(a, 1)", "usage error: vary mass: mean: 'a' is not a number; try: normal(mean, deviation)"),
        ("normal(1, nan)", "usage error: vary mass: deviation: 'nan' is not finite; try: normal(mean, deviation)"),
        (
            "normal(1, -1)",
            "usage error: vary mass: normal(mean, deviation) needs deviation > 0; here mean = 1, deviation = -1; try: "
            "mass=normal(1, 0.1)",
        ),
        ("linspace(0, 1, 2.5)", "count must be a whole number from 2 to 100000, not 2.5"),
        ("logspace(0, 1, 3)", "usage error: vary mass: logspace needs ends above 0; here 0 and 1; try: linspace"),
    ],
)
def test_texts_that_are_none(text: str, said: str) -> None:
    with pytest.raises(UsageError) as caught:
        read_distribution("vary mass", text)
    assert said in str(caught.value)


@pytest.mark.parametrize(
    "text",
    [
        *("normal(1, 0)", "lognormal(1, 0)", "lognormal(0, 1)", "uniform(1, 1)", "loguniform(0, 1)"),
        *("triangular(1, 1, 1)", "triangular(0, -1, 1)", "triangular(0, 2, 1)", "exponential(0)", "gumbel(1, 0)"),
        *("weibull(0, 1)", "weibull(1, 0)", "integers(1, 1)", "integers(0.5, 2)", "integers(0, 2.5)"),
        *(f"integers(0, {2**52})", f"integers({-(2**52)}, 0)", "truncated_normal(0, 0, 0, 1)"),
        *("truncated_normal(0, 1, 1, 1)", "truncated_normal(0, 1, 8, 9)"),
    ],
)
def test_arguments_at_the_border_of_a_demand_are_refused(text: str) -> None:
    name = text.partition("(")[0]
    with pytest.raises(UsageError, match=f"{name}.* needs {DISTRIBUTIONS[name].demand}"):
        read_distribution("vary x", text)


@pytest.mark.parametrize(
    "text", ["triangular(0, 0, 1)", "triangular(0, 1, 1)", f"integers(0, {2**52 - 1})", "truncated_normal(0, 1, 6, 9)"]
)
def test_arguments_within_the_border_of_a_demand_are_taken(text: str) -> None:
    low, high = read_distribution("vary x", text).quantiles(np.array([1e-12, 1.0 - 1e-12]))
    assert low < high
