"""Samples of fields: the identities of energy errors, posteriors that are known, diagnostics, files."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from eomgen.base.arrays import Array
from eomgen.errors import EomgenError
from eomgen.fields import (
    FieldPosterior,
    Mesh,
    Outcome,
    Sampler,
    Samples,
    amplitude,
    autocorrelation_error,
    autocorrelation_time,
    split_r_hat,
    white,
)
from eomgen.integrators.compositions import composition_named
from eomgen.products.fields.posteriors.sampling import First
from eomgen.products.fields.sampling.result import FieldSamples
from tests.fields.density import alone, counted, optimised

__all__ = ["optimised"]


def check_identities(samples: Samples) -> None:
    """Hold energy errors of a stationary chain against what detailed balance gives, and acceptance against erfc."""
    weight, error = samples.mean_weight
    assert abs(weight - 1.0) <= 3.0 * error
    assert abs(samples.acceptance - samples.expected_acceptance) <= 0.03 + 1.5 / math.sqrt(samples.accepted.size)
    errors = samples.energy_errors
    within = 3.0 * float(errors.std()) / math.sqrt(errors.size) + 0.1 * float(errors.var())
    assert abs(samples.mean_energy_error - 0.5 * float(errors.var())) <= within


@pytest.mark.slow
def test_a_linear_posterior_is_that_of_the_wiener_filter() -> None:
    """Normal errors about the field itself: mean and variance of every wave number are known."""
    mesh = Mesh((6, 5, 8), 40.0)
    operator = amplitude(mesh, lambda k: 700.0 * np.exp(-((4.0 * k) ** 2)))
    stream = np.random.Generator(np.random.Philox(4))
    data = operator.apply(mesh.white(stream)) + 0.6 * stream.standard_normal(mesh.cells)
    posterior = FieldPosterior(mesh, "(s - d)**2/(2*0.6**2)", {"s": operator}, {"d": data})
    squares = operator.symbol**2
    exact = operator.symbol * mesh.spectrum(data) / 0.6**2 / (1.0 + squares / 0.6**2)
    mode = posterior.mode(tolerance=1e-11)
    assert mode.spectrum == pytest.approx(exact, abs=1e-9)
    sampler = Sampler(posterior, method="omf4", step=0.8, chains=2, seed=2)
    samples = sampler.draw(300)
    check_identities(samples)
    mean = operator.apply(exact)
    variance = np.sum(mesh.weights * squares / (1.0 + squares / 0.6**2)) / mesh.size
    assert samples.r_hat < 1.05
    spread = math.sqrt(variance / 600 * 2)
    assert np.sqrt(np.mean((samples.mean - mean) ** 2)) < 1.5 * spread
    assert np.mean(samples.deviation**2) == pytest.approx(variance, rel=0.03)
    # the mass of Fisher makes all frequencies 1, so that the guard is that of the oscillator
    assert sampler.frequency == pytest.approx(1.0, abs=1e-9)
    assert sampler.largest_step == pytest.approx(
        0.9 * composition_named("omf4", "drift").stability_limit / 1.2, rel=0.1
    )


@pytest.mark.parametrize(("method", "step"), [("leapfrog", 0.25), ("minimum_norm2", 0.9)])
def test_energy_errors_of_counts_have_mean_weight_one(method: str, step: float) -> None:
    posterior, truth = counted(16, 0.04)
    samples = Sampler(posterior, method=method, step=step, start=[truth], seed=3).draw(150)
    check_identities(samples)
    assert 0.3 < samples.acceptance < 0.99


def test_few_samples_have_no_autocorrelation_time() -> None:
    chains = np.random.default_rng(1).standard_normal((3, 7))
    assert all(np.isnan(autocorrelation_time(chains[:, :count])) for count in (4, 5, 6))
    assert autocorrelation_time(chains) > 0.0


@pytest.mark.slow
def test_a_warm_up_finds_the_step() -> None:
    posterior, _ = counted(16, 0.3)
    sampler = Sampler(posterior, method="leapfrog", start="zero", seed=1)
    sampler.warm_up(80)
    samples = sampler.draw(120)
    assert samples.acceptance == pytest.approx(0.651, abs=0.12)
    assert samples.steps[0] <= sampler.largest_step


def test_steps_of_a_warm_up_are_halved_and_then_changed_less_and_less(monkeypatch: pytest.MonkeyPatch) -> None:
    """By outcomes that are given; frequencies are looked at after each 20th trajectory that was accepted."""
    mesh = Mesh((4, 4), 1.0)
    sampler = Sampler(
        FieldPosterior(mesh, "s**4", {"s": white(mesh)}), step=0.5, start="zero", mass="prior", jitter=0.0
    )
    (chain,) = sampler.chains
    first, most = chain.step, sampler.largest_step
    errors = [math.inf, math.inf, 0.2, -1.0, *[3.0] * 17]
    ends = iter(Outcome(error, error < 2.0 or number == 20, 1) for number, error in enumerate(errors, 1))
    monkeypatch.setattr(sampler, "_trajectory", lambda chain, stop: next(ends, None))
    monkeypatch.setattr(type(sampler.posterior), "largest_frequency", lambda self, spectrum, mass: 7.0)
    seen: list[float] = []
    assert not sampler.warm_up(30, 0.8, seen=lambda number, outcome, potential: seen.append(chain.step))
    expected = [first / 2, first / 4]
    for tried, error in enumerate(errors[2:]):
        gain = math.exp((math.exp(-max(error, 0.0)) - 0.8) / math.sqrt(1.0 + tried))
        expected.append(min(expected[-1] * gain, most if tried < 17 else sampler.largest_step))
    assert seen == pytest.approx(expected, rel=1e-13)
    assert chain.warmed == 21 and sampler.frequency == 7.0 and sampler.largest_step < most
    kept = list(chain.tried)
    assert sampler.warm_up(21, 0.8, goes_on=True)
    assert chain.step == pytest.approx(min(math.exp(np.mean(kept[9:])), sampler.largest_step), rel=1e-13)
    assert len(kept) == 19 and chain.tried == []


def test_numbers_of_steps_and_splittings_are_drawn() -> None:
    posterior, truth = counted(8, 0.3)

    def kicks(step: float, first: First) -> list[int]:
        sampler = Sampler(posterior, method="leapfrog", step=step, duration=1.0, jitter=0.0, first=first, start=[truth])
        found: list[int] = sampler.draw(24).gradients[0].tolist()
        return found

    assert kicks(0.25, "drift") == [4] * 24
    assert kicks(0.25, "kick") == [5, *[4] * 23]  # whose first kick has the gradient of the last one before
    assert set(kicks(0.25, "random")) == {4, 5} and sum(kicks(0.25, "random")) < 24 * 4 + 10
    assert set(kicks(0.4, "drift")) == {2, 3}


def test_gradients_that_are_kept_are_those_of_the_chain() -> None:
    """A chain whose kept gradients are forgotten before each trajectory goes the same way, and evaluates more."""
    posterior, truth = counted(8, 0.3)
    kept, other = (Sampler(posterior, step=0.7, start=[truth], seed=4) for _ in range(2))
    one = kept.draw(40)
    parts = []
    for _ in range(40):
        other.chains[0].known = False
        parts.append(other.draw(1))
    for name in ("energy_errors", "potential", "cells"):
        assert np.array_equal(getattr(one, name), np.concatenate([getattr(part, name) for part in parts], axis=1))
    evaluated = sum(int(part.gradients[0, 0]) for part in parts)
    assert 0.6 < one.acceptance < 1.0 and int(one.gradients.sum()) < evaluated - 5
    slope = np.zeros_like(truth)
    energy = posterior.energy_and_gradient(truth, slope)
    assert energy == posterior.energy(truth) and np.array_equal(slope, posterior.gradient(truth))
    prior = alone(8)
    assert prior.energy_and_gradient(truth, slope) == prior.energy(truth) and np.array_equal(slope, truth)


@pytest.mark.slow
def test_the_guard_holds_steps_below_what_is_stable() -> None:
    posterior, truth = counted(16, 1.0)
    sampler = Sampler(posterior, mass="prior", method="suzuki4", step=5.0, start=[truth], seed=1)
    assert sampler.chains[0].step == sampler.largest_step
    limit = min(composition_named("suzuki4", first).stability_limit for first in ("drift", "kick"))
    assert sampler.largest_step == pytest.approx(0.9 * limit / sampler.frequency / 1.2)
    wild = Sampler(posterior, mass="prior", method="suzuki4", step=2.0, start=[truth], seed=1, guard=math.inf)
    samples = wild.draw(4)  # far beyond it, where numbers end: rejected, and no crash
    assert samples.acceptance == 0.0 and samples.energy_errors.min() > 1e3


def test_a_sampler_that_is_saved_goes_on_with_the_same_bits(tmp_path: Path) -> None:
    posterior, _ = counted(8, 0.3)

    def sampler(seed: int = 11) -> Sampler:
        return Sampler(posterior, chains=2, start="prior", step=0.7, seed=seed)

    first, second, third = sampler(), sampler(), sampler()
    first.warm_up(6)
    whole = first.draw(12)
    second.warm_up(6)
    begin = second.draw(5)
    third.restore(second_path := second.save(tmp_path / "chains.npz"))
    end = third.draw(7)
    for name in ("energy_errors", "potential", "cells", "power"):
        joined = np.concatenate([getattr(begin, name), getattr(end, name)], axis=1)
        assert np.array_equal(joined, getattr(whole, name), equal_nan=True), name
    assert np.array_equal(end.steps, whole.steps)
    assert not np.array_equal(whole.cells[0], whole.cells[1])
    other = sampler(12).draw(12)
    assert not np.array_equal(other.cells, whole.cells)
    with pytest.raises(EomgenError, match="it has 2 chains of the seed 11 with spectra of"):
        sampler(12).restore(second_path)
    with pytest.raises(EomgenError, match="cannot be read"):
        sampler().restore(tmp_path / "none.npz")
    (tmp_path / "other.npz").write_bytes(b"no archive")
    with pytest.raises(EomgenError, match="this is not a file of chains written by eomgen"):
        sampler().restore(tmp_path / "other.npz")


def autoregressive(rho: float, chains: int, count: int) -> Array:
    stream = np.random.Generator(np.random.Philox(3))
    values = np.empty((chains, count))
    state = stream.standard_normal(chains)
    for place in range(count):
        state = rho * state + math.sqrt(1.0 - rho**2) * stream.standard_normal(chains)
        values[:, place] = state
    return values


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.8, -0.4])
def test_autocorrelation_times_of_known_processes(rho: float) -> None:
    values = autoregressive(rho, 8, 5000)
    exact = (1.0 + rho) / (1.0 - rho)
    assert autocorrelation_time(values) == pytest.approx(exact, rel=0.1)
    assert autocorrelation_time(values[..., None])[0] == autocorrelation_time(values)


def test_errors_of_autocorrelation_times_are_their_scatter() -> None:
    values = autoregressive(0.5, 200, 2000)
    found = np.array([float(autocorrelation_time(chain[None])) for chain in values])
    expected = float(autocorrelation_error(3.0, 2000))
    assert expected == pytest.approx(math.sqrt(2 * 31 / 2000))
    assert found.std() / found.mean() == pytest.approx(expected, rel=0.15)


@pytest.mark.parametrize("count", [3, 4])
def test_chains_of_four_samples_have_an_r_hat(count: int) -> None:
    samples = SimpleNamespace(cells=autoregressive(0.5, 2, count)[..., np.newaxis], accepted=np.ones((2, count), bool))
    result = SimpleNamespace(samples=samples, count=count)
    assert len(FieldSamples.r_hats(cast(FieldSamples, result))) == (count == 4)


def test_split_r_hat_sees_chains_apart_and_on_their_way() -> None:
    values = autoregressive(0.5, 4, 2000)
    assert split_r_hat(values) == pytest.approx(1.0, abs=0.01)
    apart = values + np.array([0.0, 0.0, 0.0, 3.0])[:, None]
    half = 1000  # between halves of chains whose means are 0, 0, 0 and 3: variance 9 (6/8)(2/8) 8/7 above that within
    between = 9.0 * 0.75 * 0.25 * 8.0 / 7.0
    assert split_r_hat(apart) == pytest.approx(math.sqrt((half - 1) / half + between), rel=0.02)
    drifting = values + np.linspace(-2.0, 2.0, 2000)
    assert split_r_hat(drifting) > 1.3


def test_starts_and_fields_that_are_not_there() -> None:
    mesh = Mesh((4, 4), 1.0)
    with pytest.raises(EomgenError, match=r"Sampler: start: 1 spectra are not 1 of the shape \(4, 3\)"):
        Sampler(FieldPosterior(mesh, "s**4", {"s": white(mesh)}), start=[np.zeros((2, 2))])
    sampler = Sampler(FieldPosterior(mesh, "s**4", {"s": white(mesh)}), start="zero")
    with pytest.raises(EomgenError, match=r"Sampler\.draw: field: there is no field 'r'; try: s"):
        sampler.draw(4, "r")
    with pytest.raises(EomgenError, match=r"Sampler\.draw: field: there is no field to watch"):
        Sampler(FieldPosterior(mesh, "0", {}), start="zero").draw(4)


@pytest.mark.parametrize("energy", ["-3*s**2", "-s**3"])
def test_an_energy_without_a_lower_bound_is_told(energy: str) -> None:
    mesh = Mesh((4, 4), 1.0)
    posterior = FieldPosterior(mesh, energy, {"s": white(mesh)})
    sampler = Sampler(posterior, mass="prior", seed=1, start="zero")
    told = r"has come down to U = -.*: the energy of a cell has no lower bound; try: an energy that grows"
    with pytest.raises(EomgenError, match=f"Sampler: chain 0 {told}"):
        sampler.warm_up(200)
    with pytest.raises(EomgenError, match=f"mode: Newton's method {told}"):
        posterior.mode(mesh.white(np.random.Generator(np.random.Philox(1))))


def test_energies_far_below_zero_are_followed() -> None:
    mesh = Mesh((4, 4), 1.0)
    samples = Sampler(FieldPosterior(mesh, "s**2 - 1e40", {"s": white(mesh)}), seed=1).draw(3)
    assert np.all(samples.potential == -16e40)
