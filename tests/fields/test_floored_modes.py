"""Lognormal fields that cannot have a power spectrum say by how much theirs is another."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable

import numpy as np
import pytest

from eomgen.base.arrays import Array
from eomgen.fields import Mesh, lognormal_amplitude, mask, smoothing
from eomgen.sampling import sample
from tests.fields.density import density
from tests.sampling.files import changed

MESH = Mesh((16, 16, 16), 80.0)
NOTE = re.compile(
    r"no lognormal field has this power spectrum: ([\d.]+)% of the modes .* the variance is ([\d.]+)% larger, and the"
    r" power of the density off by more than a tenth in modes from k = ([\d.]+) on, with ([\d.]+)% of it"
)


def by_numpy(mesh: Mesh, power: Callable[[Array], Array]) -> tuple[float, float, float, float]:
    """Return shares of floored modes and of added variance in per cent, the first wave number whose power of the
    density is off by a tenth, and the share of its power, by whole complex transforms."""
    axes = [2 * np.pi * np.fft.fftfreq(n, length / n) for n, length in zip(mesh.cells, mesh.lengths, strict=True)]
    k = np.sqrt(sum(part**2 for part in np.meshgrid(*axes, indexing="ij")))
    wanted = power(k) * mesh.size / np.prod(mesh.lengths)
    gaussian = np.fft.fftn(np.log1p(np.fft.ifftn(wanted).real)).real
    floored = np.maximum(gaussian, 1e-12 * gaussian.max())
    made = np.fft.fftn(np.expm1(np.fft.ifftn(floored).real)).real
    off = (np.abs(made - wanted) > 0.1 * wanted) & (k > 0)
    added = (floored - gaussian).sum() / gaussian.sum()
    return 100 * np.mean(gaussian < floored), 100 * added, k[off].min(), 100 * wanted[off].sum() / wanted.sum()


@pytest.mark.parametrize("sharpness", [1.0, 2.0, 6.0])
def test_shares_of_modes_and_of_power_are_told(sharpness: float) -> None:
    def power(k: Array) -> Array:
        return np.asarray(3000.0 * k / (0.02 + k) ** 2 * np.exp(-((sharpness * k) ** 2)))

    with pytest.warns(RuntimeWarning) as caught:
        made = lognormal_amplitude(MESH, power)
    found = NOTE.search(str(caught[0].message))
    assert found is not None
    expected = by_numpy(MESH, power)
    assert [float(text) for text in found.groups()] == pytest.approx(expected, rel=2e-3, abs=6e-3)
    assert (smoothing(MESH, 1.0) @ made).note == made.note == (mask(MESH, np.ones(MESH.cells)) @ made).note


@pytest.mark.parametrize("power", [lambda k: 60.0 * k / (0.02 + k) ** 2.5, lambda k: 200.0 / (0.05 + k) ** 1.5])
def test_spectra_of_lognormal_fields_are_not_noted(power: Callable[[Array], Array]) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert lognormal_amplitude(MESH, power).note == ""
        assert density.__wrapped__(32).note == ""  # of the example


@pytest.mark.slow
def test_a_run_of_a_file_says_it() -> None:
    power = "3000*k/(0.02 + k)**2*exp(-(radius*k)**2)"
    floored = changed(operators={"s": {"lognormal_power": power}}, mesh__cells=[8, 8, 8])
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        found = sample(floored)
    assert found.problem.notes and found.problem.notes[0].startswith("s: no lognormal field has this power spectrum: ")
    assert found.message.endswith(f"; {found.problem.notes[0]}")
    assert sample(changed()).problem.notes == []


def test_empty_bins_of_scales_are_left_out() -> None:
    """A box with unequal sides has no wave number in the first of many bins: scales have a verdict all the same."""
    found = sample(changed(mesh={"cells": [12, 6], "length": [24.0, 30.0]}, sampling__bins=12), samples=50)
    assert np.isnan(found.samples.wave_numbers).any()
    assert len(found.scales()) == np.isfinite(found.samples.wave_numbers).sum() < 12
    assert all(np.isfinite([scale.k, scale.mean, scale.r_hat]).all() for scale in found.scales())
    worst = max(scale.r_hat for scale in found.scales())
    assert found.summary()["r_hat_of_scales"] == pytest.approx(worst) and worst < 2.0


def test_scales_that_do_not_agree_are_told() -> None:
    """Chains of a start far apart and steps next to nothing stay there; R-hat of scales is in the verdict too."""
    found = sample(
        changed(sampling__step=1e-3, sampling__duration=2e-3, sampling__start="prior"), samples=50, warm_up=0
    )
    assert "chains do not agree yet: split R-hat is " in found.message
    assert re.search(r"[\d.]+ in a cell and [\d.]+ in a bin of scales; try: more samples", found.message)
