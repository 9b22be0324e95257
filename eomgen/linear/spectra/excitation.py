"""Excitation: stationary random inputs by the matrix of their cross-spectra, and one input of a given spectrum."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eomgen.base.arrays import Array
from eomgen.base.text import shown
from eomgen.errors import Problem, UsageError

Complex = NDArray[np.complex128]


class Excitation(Protocol):
    """Stationary random inputs; one may have ``bends``, (n,) Hz, frequencies at which its spectra bend.

    Attributes
    ----------
    inputs : names of inputs or disturbances of the linear model
    rates : for some of them the names of inputs that carry their time derivative
    band : frequencies in Hz outside of which the spectra are zero
    name : in words, for titles
    """

    @property
    def inputs(self) -> tuple[str, ...]: ...
    @property
    def rates(self) -> dict[str, str]: ...
    @property
    def band(self) -> tuple[float, float]: ...
    @property
    def name(self) -> str: ...

    def cross_spectra(self, frequencies: Array) -> Complex:
        """Return the one-sided cross-spectra (nf, m, m) of the inputs, unit_i unit_j / Hz, at frequencies (nf,) in
        Hz: G[k, i, j] belongs to X_i conj(X_j), X being the Fourier transforms."""


def check_excitation(where: str, given: object) -> None:
    """Raise UsageError for values that are no excitation, such as the letter of a road class."""
    if not hasattr(given, "cross_spectra"):
        letter = isinstance(given, str) and len(given) == 1
        fault = f"an excitation is needed, not {shown(given) if isinstance(given, str) else type(given).__name__}"
        road = f'RoadExcitation(Road("{given if letter else "C"}"), speed=20.0, wheels={{"road": 0.0}})'
        raise UsageError(Problem(where, fault, f"{road} of eomgen.spectra, with the names of your inputs"))


@dataclass(frozen=True)
class InputSpectrum:
    """One random input of a given power spectral density: a force, an acceleration of the base, noise of a sensor.

    Parameters
    ----------
    input : str
        Name of an input or a disturbance of the linear model: ``motor``, ``base.acceleration[2]``.
    frequencies, density : (n,), (n,)
        Hz, increasing, and unit^2/Hz; straight lines in double logarithmic scales between them, zero outside.
    function : callable
        In place of ``density``: density at frequencies (n,); ``frequencies`` then is the band, a pair.

    Raises
    ------
    UsageError
        Arrays that are no spectrum.
    """

    input: str
    frequencies: ArrayLike
    density: ArrayLike | None = None
    function: Callable[[Array], Array] | None = None

    def __post_init__(self) -> None:
        f = np.asarray(self.frequencies, dtype=float)
        place = f"InputSpectrum: {self.input}"
        if (self.density is None) == (self.function is None):
            raise UsageError(Problem(place, "it needs either a density or a function", "density=[...]"))
        if f.ndim != 1 or len(f) < 2 or not np.all(np.isfinite(f)) or f[0] <= 0.0 or np.any(np.diff(f) <= 0.0):
            fault = "the frequencies have to be two or more positive numbers that increase, Hz"
            raise UsageError(Problem(place, fault, "[1.0, 20.0, 100.0]"))
        if self.density is not None:
            g = np.asarray(self.density, dtype=float)
            if g.shape != f.shape or not np.all(np.isfinite(g)) or np.any(g < 0.0):
                fault = f"the density has the shape {g.shape}, or entries that are negative or not finite"
                raise UsageError(Problem(place, fault, f"{len(f)} numbers of zero and above, unit^2/Hz"))

    @property
    def inputs(self) -> tuple[str, ...]:
        """The one input."""
        return (self.input,)

    @property
    def rates(self) -> dict[str, str]:
        """None."""
        return {}

    @property
    def band(self) -> tuple[float, float]:
        """First and last frequency, Hz."""
        f = np.asarray(self.frequencies, dtype=float)
        return float(f[0]), float(f[-1])

    @property
    def bends(self) -> Array:
        """Frequencies at which a density of points bends, Hz."""
        return np.asarray(self.frequencies if self.function is None else [], dtype=float)

    @property
    def name(self) -> str:
        """The input."""
        return f"random {self.input}"

    def cross_spectra(self, frequencies: Array) -> Complex:
        """Return the density (nf, 1, 1)."""
        low, high = self.band
        inside = (frequencies >= low) & (frequencies <= high)
        known = np.asarray(self.frequencies, dtype=float)
        if self.function is not None:
            values = np.asarray(self.function(np.clip(frequencies, low, high)), dtype=float)
        else:
            g = np.asarray(self.density, dtype=float)
            logarithms = np.log(np.where(g > 0.0, g, math.ulp(0.0)))
            values = np.exp(np.interp(np.log(np.clip(frequencies, low, high)), np.log(known), logarithms))
        result: Complex = np.where(inside, values, 0.0).astype(complex)[:, np.newaxis, np.newaxis]
        return result
