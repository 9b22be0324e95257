"""Survey responses between 0 and 1 in the likelihoods of counts: formulas in NumPy, and a posterior by quadrature."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.special import gammaln

from eomgen.base.arrays import Array
from eomgen.fields import (
    CellEnergy,
    FieldPosterior,
    LinearOperator,
    Mesh,
    Sampler,
    gaussian,
    negative_binomial,
    poisson,
)

MEAN, VARIANCE, BIAS, BETA, DEVIATION = 1.7, 0.6, 1.4, 2.5, 0.8
ENERGIES: dict[str, Callable[[], CellEnergy]] = {
    "poisson": lambda: poisson(MEAN, VARIANCE, BIAS, response=True),
    "negative binomial": lambda: negative_binomial(MEAN, VARIANCE, BETA, BIAS, response=True),
    "gaussian": lambda: gaussian(MEAN, VARIANCE, DEVIATION, BIAS, response=True),
}


def minus_log_likelihood(case: str, s: Array, counts: Array, response: Array) -> Array:
    """Return -ln of the probability of the counts about R mean (1 + delta)^bias/<(1 + delta)^bias>, cell by cell."""
    density = np.exp(s - VARIANCE / 2)
    moment = math.exp(BIAS * (BIAS - 1) * VARIANCE / 2)  # of a lognormal density of mean 1
    m = response * MEAN * density**BIAS / moment
    seen = response > 0
    safe = np.where(seen, m, 1.0)
    if case == "poisson":
        found = safe - counts * np.log(safe) + gammaln(counts + 1)
    elif case == "negative binomial":
        share = BETA / (BETA + safe)  # probability of a failure
        log_binomial = gammaln(counts + BETA) - gammaln(BETA) - gammaln(counts + 1)
        found = -(log_binomial + BETA * np.log(share) + counts * np.log1p(-share))
    else:
        found = (safe - counts) ** 2 / (2 * DEVIATION**2) + math.log(math.sqrt(2 * math.pi) * DEVIATION)
    return np.where(seen, found, 0.0)


def correlated(mesh: Mesh) -> LinearOperator:
    """Return a filter that gives neighbouring cells correlated values."""
    return LinearOperator("correlated", mesh, np.exp(-0.3 * mesh.wave_numbers**2))


@cache
def posterior_of(case: str, cells: tuple[int, ...]) -> FieldPosterior:
    mesh = Mesh(cells, tuple(float(n) for n in cells))
    data = {"counts": np.zeros(cells), "response": np.zeros(cells)}
    return FieldPosterior(mesh, ENERGIES[case](), {"s": correlated(mesh)}, data)


def given(case: str, cells: tuple[int, ...], counts: Array, response: Array) -> FieldPosterior:
    """Return the posterior of other data with the C that is compiled already."""
    made = posterior_of(case, cells)
    made.data["counts"][...], made.data["response"][...] = counts, response
    return made


@pytest.mark.parametrize("case", ENERGIES)
@pytest.mark.parametrize("seed", range(5))
def test_any_response_against_the_probability_of_the_counts(case: str, seed: int) -> None:
    """Differences of U against differences of -ln of the probability, its gradient and Hessian against differences."""
    stream, cells = np.random.default_rng(seed), (5, 4)
    response = np.select([stream.random(cells) < 0.2, stream.random(cells) < 0.2], [0.0, 1.0], stream.random(cells))
    counts = stream.poisson(2.0, cells).astype(float)  # in cells that are not observed, too: these drop out
    posterior = given(case, cells, counts, response)
    mesh, operator = posterior.mesh, posterior.operators["s"]

    def energy(x: Array) -> float:
        s = np.fft.irfftn(operator.symbol * np.fft.rfftn(x), cells, axes=(0, 1))
        return float(0.5 * np.sum(x**2) + np.sum(minus_log_likelihood(case, s, counts, response)))

    one, other, along = (stream.standard_normal(cells) for _ in range(3))
    x, to = mesh.spectrum(one), mesh.spectrum(along)
    difference = energy(other) - energy(one)
    assert posterior.energy(mesh.spectrum(other)) - posterior.energy(x) == pytest.approx(difference, rel=1e-11)
    h = 1e-3
    at = {k: energy(one + k * h * along) for k in (-2, -1, 0, 1, 2)}
    slope = (8 * (at[1] - at[-1]) - (at[2] - at[-2])) / (12 * h)
    assert mesh.product(posterior.gradient(x), to) == pytest.approx(slope, rel=1e-7, abs=1e-7)
    bend = (16 * (at[1] + at[-1]) - (at[2] + at[-2]) - 30 * at[0]) / (12 * h**2)
    assert mesh.product(posterior.hessian(x)(to), to) == pytest.approx(bend, rel=1e-5, abs=1e-5)


@pytest.mark.slow
@pytest.mark.long_cases("poisson")
@pytest.mark.parametrize("case", ENERGIES)
def test_samples_have_the_mean_and_deviation_of_quadrature(case: str) -> None:
    """Three correlated cells, one of them not observed and one in part: a grid of 48^3 white fields has the truth."""
    cells, response, counts = (3,), np.array([1.0, 0.0, 0.35]), np.array([7.0, 0.0, 1.0])
    posterior = given(case, cells, counts, response)
    operator = posterior.operators["s"]
    axis = np.linspace(-5.5, 5.5, 48)
    white = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    s = np.fft.irfft(operator.symbol * np.fft.rfft(white, axis=1), 3, axis=1)
    logarithm = -0.5 * np.sum(white**2, axis=1) - minus_log_likelihood(case, s, counts, response).sum(axis=1)
    weight: Any = np.exp(logarithm - logarithm.max())
    mean = weight @ s / weight.sum()
    deviation = np.sqrt(weight @ (s - mean) ** 2 / weight.sum())
    samples = Sampler(posterior, step=0.7, chains=2, start="mode", seed=3).draw(600)
    error = 4.0 * deviation * math.sqrt(max(samples.autocorrelation[0], 1.0) / 1200)
    assert np.all(np.abs(samples.mean - mean) < error)
    assert samples.deviation == pytest.approx(deviation, rel=0.1)
