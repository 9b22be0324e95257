"""Records of chains: samples as they come, and their diagnostics, convergence and autocorrelation times."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.errors import Problem, UsageError
from eomgen.products.fields.posteriors.mesh import Complex, Mesh

#: Lags up to this many autocorrelation times count (Sokal's window).
_WINDOW = 5.0


def split_r_hat(chains: ArrayLike) -> Array:
    """Return the potential scale reduction of the halves of chains (Gelman and Rubin), 1 if the halves agree.

    Raises UsageError for fewer than two axes or four samples.

    Parameters
    ----------
    chains : array_like
        Numbers (chains, samples, ...), four samples at least; of an odd number the middle sample is left out.

    Returns
    -------
    (...) ndarray
        Near 1, also below, if the halves agree; NaN for equal numbers, infinite for numbers that change between halves
        alone, both without a meaning if means are rounded.

    Examples
    --------
    >>> from eomgen.fields import split_r_hat
    >>> chains = np.random.default_rng(1).standard_normal((4, 1000))
    >>> round(float(split_r_hat(chains)), 2)
    1.0
    """
    values = _chain_values(chains)
    half = values.shape[1] // 2
    parts = np.concatenate([values[:, :half], values[:, -half:]])
    within = parts.var(axis=1, ddof=1).mean(axis=0)
    between = parts.mean(axis=1).var(axis=0, ddof=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.sqrt((half - 1) / half + between / within))


def largest(values: Array, share: float = 1.0) -> float:
    """Return the largest of numbers, or their quantile ``share`` (0 to 1), NaN left out; NaN if all are, as of chains
    that stand still."""
    numbers = values[~np.isnan(values)]
    with np.errstate(invalid="ignore"):  # between two that are infinite
        return float(np.quantile(numbers, share)) if numbers.size else math.nan


def autocorrelation_time(chains: ArrayLike) -> Array:
    """Return the integrated autocorrelation time of samples, 1 + 2 sum of the autocorrelation.

    The sum has the smallest window of at least five lags that is five times this time (Sokal); autocovariances about
    the mean of each chain are averaged over chains first. A time is thus a fifth of the samples of a chain at most: too
    small for short chains, and 0 up to rounding for four or five samples. Raises UsageError as ``split_r_hat``.

    Parameters
    ----------
    chains : array_like
        Numbers (chains, samples, ...), four samples at least.

    Returns
    -------
    (...) ndarray
        In samples; below 1 if samples alternate; NaN if the samples of each chain are equal (a number without a meaning
        if their mean is rounded), or too few, as below 7.

    Examples
    --------
    >>> from eomgen.fields import autocorrelation_time
    >>> chains = np.random.default_rng(1).standard_normal((4, 1000))
    >>> round(float(autocorrelation_time(chains)))
    1
    """
    values = _chain_values(chains)
    count = values.shape[1]
    spectra = np.fft.rfft(values - values.mean(axis=1, keepdims=True), 2 * count, axis=1)
    covariance = np.fft.irfft(np.abs(spectra) ** 2, 2 * count, axis=1)[:, :count].mean(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        times = 2.0 * np.cumsum(covariance / covariance[0], axis=0) - 1.0
    lags = np.arange(count).reshape(-1, *[1] * (times.ndim - 1))
    enough = lags >= _WINDOW * np.maximum(times, 1.0)  # if samples alternate, more than the first lags count
    enough[-1] = False  # the sum over all lags is 0 for any samples
    at_window = np.take_along_axis(times, enough.argmax(axis=0)[None], axis=0)[0]
    return np.where(enough.any(axis=0), at_window, np.nan)


def autocorrelation_error(times: ArrayLike, samples: int) -> Array:
    """Return the relative standard errors of integrated autocorrelation times.

    sqrt(2(2 window + 1)/samples) (Madras and Sokal, J. Stat. Phys. 50 (1988) 109).

    Parameters
    ----------
    times : array_like
        Times (...) in samples, of ``autocorrelation_time``.
    samples : int
        Samples of all chains.

    Returns
    -------
    (...) ndarray
        Relative to the times.
    """
    return np.asarray(np.sqrt(2.0 * (2.0 * _WINDOW * np.maximum(times, 1.0) + 1.0) / samples))


def _chain_values(chains: ArrayLike) -> Array:
    values = np.asarray(chains, dtype=float)
    if values.ndim < 2 or values.shape[1] < 4:
        fault = f"samples of the shape {values.shape} are not chains of four samples or more [E0818]"
        raise UsageError(Problem("chains", fault, "an array (chains, samples, ...)"))
    return values


@dataclass(frozen=True)
class Samples:
    """Samples drawn by chains, first axes (chains, samples).

    Attributes
    ----------
    accepted : whether the end of a trajectory was taken
    energy_errors : dH of each trajectory; infinite if numbers ended
    potential : U of the samples
    gradients : evaluations of the gradient, of each trajectory
    cells : values of the field that is watched in the cells that are watched, (chains, samples, cells)
    power : mean |amplitude|^2 of the watched field by bins of k, (chains, samples, bins)
    wave_numbers : (bins,)
    mean, deviation : of all samples of the watched field in each cell, shape of the mesh
    steps : step size of each chain, before jitter
    """

    accepted: NDArray[np.bool_]
    energy_errors: Array
    potential: Array
    gradients: NDArray[np.int64]
    cells: Array
    power: Array
    wave_numbers: Array
    mean: Array
    deviation: Array
    steps: Array

    @property
    def acceptance(self) -> float:
        """Part of the trajectories whose ends were taken."""
        return float(np.mean(self.accepted))

    @property
    def mean_energy_error(self) -> float:
        """Mean of dH: not below 0, and for small steps half the variance of dH."""
        return float(np.mean(self.energy_errors))

    @property
    def mean_weight(self) -> tuple[float, float]:
        """Mean of exp(-dH) over all trajectories, which is 1 at stationarity for any step, and the
        standard error of this mean, as of independent trajectories; NaN for one trajectory."""
        weights = np.exp(-np.maximum(self.energy_errors, -700.0)).ravel()
        with np.errstate(over="ignore"):  # of an energy without a lower bound
            return float(weights.mean()), float(weights.std(ddof=1) / math.sqrt(weights.size))

    @property
    def expected_acceptance(self) -> float:
        """Acceptance erfc(sqrt(mean dH)/2) of normal errors with this mean."""
        return math.erfc(math.sqrt(max(self.mean_energy_error, 0.0)) / 2.0)

    @property
    def r_hat(self) -> float:
        """Largest split R-hat of the cells and bins of k that are watched."""
        return largest(np.concatenate([split_r_hat(self.cells), split_r_hat(self.power)]))

    @property
    def autocorrelation(self) -> tuple[float, float]:
        """Integrated autocorrelation times in trajectories: mean of the cells, and of the worst bin of k.

        The worst value is the largest of the estimates of all bins: with equal bins it exceeds the mean by one or two
        ``autocorrelation_error``.
        """
        return float(np.mean(autocorrelation_time(self.cells))), largest(autocorrelation_time(self.power))

    @property
    def autocorrelation_error(self) -> float:
        """Relative standard error of the autocorrelation time of the worst bin of k."""
        return float(autocorrelation_error(self.autocorrelation[1], self.accepted.size))

    @property
    def gradients_per_sample(self) -> tuple[float, float]:
        """Gradients per independent sample: mean gradients of a trajectory times the autocorrelation time, 1
        at least, for the cells (mean) and for the worst bin of k. Raises UsageError for fewer than four samples of
        each chain."""
        each = float(np.mean(self.gradients))
        of_cells, worst = self.autocorrelation
        return each * max(of_cells, 1.0), each * max(worst, 1.0)


@dataclass(frozen=True)
class Outcome:
    """End of a trajectory: ``error`` is dH, infinite for numbers that are not finite; ``accepted`` is whether the end
    became the chain's state; ``gradients`` counts evaluations of the gradient."""

    error: float
    accepted: bool
    gradients: int


class Record:
    """Samples of chains, which come one by one.

    Parameters
    ----------
    mesh : Mesh
        The mesh of the field.
    chains : int
        Number of chains.
    samples : int
        Samples of each chain in a full record.
    watched : ndarray of int
        Cells whose values are kept, as numbers of the flattened mesh.
    bins : int
        Number of bins of wave numbers.
    """

    def __init__(self, mesh: Mesh, chains: int, samples: int, watched: NDArray[np.int64], bins: int) -> None:
        self.mesh, self.watched, self.bins = mesh, watched, bins
        #: Samples of each chain so far.
        self.counts = np.zeros(chains, np.int64)
        self._arrays: dict[str, Array] = {}
        self._mean, self._squares = np.zeros(mesh.cells), np.zeros(mesh.cells)
        self._wave_numbers = np.empty(bins)
        self._chains = chains
        self.resize(samples)

    @property
    def size(self) -> int:
        """Samples of each chain that there is place for."""
        return len(self._arrays["energy_errors"][0])

    def resize(self, samples: int) -> None:
        """Make place for more samples of each chain; recorded samples stay.

        Parameters
        ----------
        samples : int
            Samples of each chain that there shall be place for in all; from ``size``, the present room, on: ValueError
            for fewer, even if the recorded samples would fit.
        """
        shapes, present = {"cells": (len(self.watched),), "power": (self.bins,)}, self.size if self._arrays else 0
        for name in ("energy_errors", "accepted", "gradients", "potential", "cells", "power"):
            made = np.full((self._chains, samples, *shapes.get(name, ())), np.nan)
            if present:
                made[:, :present] = self._arrays[name]
            self._arrays[name] = made

    def add(
        self, chain: int, outcome: Outcome, potential: float, values: Array, amplitudes: Complex | None = None
    ) -> None:
        """Add the next sample of a chain, and take its field into mean and deviation of all chains.

        Parameters
        ----------
        chain : int
            Number of the chain, from 0; IndexError if the record has no place for another sample of the chain.
        outcome : Outcome
            End of the trajectory.
        potential : float
            U of the sample.
        values : ndarray
            The watched field, shape of the mesh.
        amplitudes : complex ndarray, optional
            The half spectrum of ``values``, for the power; by default it is computed.
        """
        at = (chain, int(self.counts[chain]))
        arrays = self._arrays
        arrays["energy_errors"][at], arrays["potential"][at] = outcome.error, potential
        arrays["accepted"][at], arrays["gradients"][at] = outcome.accepted, outcome.gradients
        arrays["cells"][at] = values.ravel()[self.watched]
        amplitudes = self.mesh.spectrum(values) if amplitudes is None else amplitudes
        self._wave_numbers, arrays["power"][at] = self.mesh.power(amplitudes, self.bins)
        self.counts[chain] += 1
        change = values - self._mean
        self._mean += change / float(self.counts.sum())
        change *= values - self._mean
        self._squares += change

    def samples(self, steps: Array) -> Samples:
        """Return the samples that all chains have, and mean and deviation of samples that any has.

        Parameters
        ----------
        steps : ndarray
            Step size of each chain, which the result keeps.

        Returns
        -------
        Samples
            With first axes (chains, samples): samples is the smallest number of a chain and may be 0. The deviation has
            the divisor n - 1; before the first sample of any chain mean and deviation are 0, and wave numbers
            undefined. Energy errors, potential, cells and power are views of the record, which ``take`` overwrites
            unless ``resize`` was called since; the rest are copies, and ``steps`` itself.
        """
        done = int(self.counts.min())
        cut: dict[str, Any] = {name: array[:, :done] for name, array in self._arrays.items()}
        cut |= {"accepted": cut["accepted"] > 0.0, "gradients": cut["gradients"].astype(np.int64)}
        deviation = np.sqrt(self._squares / max(int(self.counts.sum()) - 1, 1))
        more = {"wave_numbers": self._wave_numbers.copy(), "mean": self._mean.copy(), "deviation": deviation}
        return Samples(**cut, **more, steps=steps)

    def arrays(self) -> dict[str, Array]:
        """Return all that there is, for a file.

        Returns
        -------
        dict
            Arrays of doubles by name: ``energy_errors``, ``accepted``, ``gradients``, ``potential``, ``cells`` and
            ``power`` with first axes (chains, samples), NaN for the missing samples of a shorter chain; ``mean`` and
            ``squares`` (sum of squares about the mean), shape of the mesh; ``wave_numbers`` and ``counts`` (samples of
            each chain). Not copied, except ``counts``.
        """
        return {**self._views(int(self.counts.max())), "counts": self.counts.astype(float)}

    def _views(self, count: int) -> dict[str, NDArray[Any]]:
        """Return all arrays by name, of the first ``count`` samples of each chain."""
        whole = {"counts": self.counts, "mean": self._mean, "squares": self._squares}
        whole["wave_numbers"] = self._wave_numbers
        return {name: array[:, :count] for name, array in self._arrays.items()} | whole

    def take(self, arrays: Mapping[str, Array]) -> None:
        """Replace the samples of this record by ``arrays`` of a record with the same chains, watched cells and bins.

        Parameters
        ----------
        arrays : mapping
            Arrays by name, of ``arrays``, of at most ``size`` samples of each chain, else ValueError; KeyError for a
            missing name. The record is unchanged after either error. Other names are ignored.
        """
        places = self._views(int(arrays["counts"].max()))
        if wrong := [name for name, array in places.items() if arrays[name].shape != array.shape]:
            raise ValueError(f"the shapes of {', '.join(wrong)} are of another record, or of more samples")
        for name, array in places.items():
            array[...] = arrays[name]
