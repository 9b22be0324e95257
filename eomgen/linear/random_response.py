"""Response of a linear model to stationary random inputs: spectra, and rms by integration over frequency.

G_y(f) = H(f) G(f) H(f)^H with the one-sided cross-spectra G of the inputs; rms^2 = int G_y df.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.errors import ModelError, NumericalError, Problem, UsageError
from eomgen.linear.modes import Modes
from eomgen.linear.spectra import Excitation, weighting_response
from eomgen.linear.state_space import StateSpace

Complex = NDArray[np.complex128]
#: Relative error of integrals over frequency.
_TOLERANCE = 1e-8
#: Points per resonance that intervals of integration begin with, in half bandwidths from its centre.
_AROUND = (-30.0, -6.0, -1.5, 0.0, 1.5, 6.0, 30.0)


def responses(space: StateSpace, frequencies: Array, excitation: Excitation, outputs: Sequence[str]) -> Complex:
    """Return H (nf, outputs, inputs) from the excitation's inputs at frequencies (nf,) in Hz, with their rates."""
    omega = 2.0 * np.pi * frequencies
    H = space.frequency_responses(omega, excitation.inputs, outputs)
    for wheel, rate in excitation.rates.items():
        of_rate = space.frequency_responses(omega, [rate], outputs)
        H[:, :, excitation.inputs.index(wheel)] += 1j * omega[:, np.newaxis] * of_rate[:, :, 0]
    return H


def densities(
    space: StateSpace, modes: Modes, excitation: Excitation, outputs: Sequence[str], frequencies: Array
) -> Array:
    """Return the one-sided power spectral densities (outputs, nf).

    Raises
    ------
    ModelError
        A mode grows, so that there is no stationary motion.
    """
    _check_stable(modes)
    return _densities(space, excitation, outputs, frequencies)


def _densities(space: StateSpace, excitation: Excitation, outputs: Sequence[str], frequencies: Array) -> Array:
    H = responses(space, frequencies, excitation, outputs)
    G = excitation.cross_spectra(frequencies)
    return np.asarray(np.maximum(np.einsum("foi,fij,foj->of", H, G, H.conj()).real, 0.0))


def root_mean_squares(
    space: StateSpace,
    modes: Modes,
    excitation: Excitation,
    outputs: Sequence[str],
    weightings: Sequence[str | None],
    band: tuple[float, float] | None = None,
) -> Array:
    """Return the rms (outputs,) by adaptive integration over frequency (Gauss and Kronrod), to 1e-8.

    Parameters
    ----------
    weightings : (outputs,) names of frequency weightings, or None
    band : Hz; the excitation's if none is given, else a part of it

    Raises
    ------
    ModelError
        A mode grows, or one within the band has no damping.
    NumericalError
        The integral does not converge.
    """
    space.input_columns((*excitation.inputs, *excitation.rates.values()), outputs)  # names before values
    low, high = excitation.band
    if band is not None:
        low, high = max(low, band[0]), min(high, band[1])
        if not low < high:
            fault = f"the band {band[0]:.6g} to {band[1]:.6g} Hz is outside the excitation's"
            hint = f"a part of {excitation.band[0]:.6g} to {excitation.band[1]:.6g} Hz"
            raise UsageError(Problem("rms: band", fault, hint))
    _check_stable(modes)
    _check_damped(modes, low, high)

    def integrand(logarithm: Array) -> Array:
        f = np.atleast_1d(np.exp(logarithm))
        values = _densities(space, excitation, outputs, f) * f
        for row, name in enumerate(weightings):
            if name:
                values[row] *= np.abs(weighting_response(name, f)) ** 2
        return np.asarray(values)

    ends = np.log([low, high])
    coarse = np.linspace(ends[0], ends[1], 2000)
    scale = np.atleast_1d(np.trapezoid(integrand(coarse), coarse, axis=1))
    scale[scale <= 0.0] = 1.0
    from scipy.integrate import quad_vec  # noqa: PLC0415  # a third of the import time of the first linear model

    integrate: Any = quad_vec  # the stubs do not know of integrands of arrays
    integral, _, info = integrate(
        lambda x: integrand(x)[:, 0] / scale,
        *ends,
        epsabs=0.0,
        epsrel=_TOLERANCE,
        norm="max",
        points=_places(modes, np.asarray(getattr(excitation, "bends", ())), ends),
        limit=20_000,
        full_output=True,
    )
    if not info.success:
        fault = f"the integral over {low:.4g} to {high:.4g} Hz does not converge"
        raise NumericalError(Problem("rms", fault, "a narrower band, or more damping"))
    return np.asarray(np.sqrt(np.maximum(integral * scale, 0.0)))


def _places(modes: Modes, bends: Array, ends: Array) -> list[float]:
    """Return logarithms of frequencies about each resonance and at bends (n,) Hz within the ends, increasing."""
    points = [float(np.log(f)) for f in bends if f > 0.0]
    for value in modes.eigenvalues[modes.oscillating]:
        centre, half_width = abs(value.imag) / (2.0 * np.pi), abs(value.real) / (2.0 * np.pi)
        points += [np.log(f) for part in _AROUND if (f := centre + part * half_width) > 0.0]
    return sorted(point for point in set(points) if ends[0] < point < ends[1])


def _check_stable(modes: Modes) -> None:
    growth = modes.eigenvalues.real
    if np.any(growth > modes.uncertainty):
        k = int(np.argmax(growth))
        along = ", ".join(name for name, _ in modes.dominant(k)) or "internal states"
        fault = f"mode {k + 1} ({along}) grows with {growth[k]:.4g} 1/s, so there is no stationary motion"
        raise ModelError(Problem("random response", fault, "another state to be linear about, or other gains"))


def _check_damped(modes: Modes, low: float, high: float) -> None:
    undamped = modes.oscillating & (np.abs(modes.eigenvalues.real) <= modes.uncertainty)
    inside = undamped & (modes.frequency >= low) & (modes.frequency <= high)
    if np.any(inside):
        k = int(np.flatnonzero(inside)[0])
        fault = f"mode {k + 1} at {modes.frequency[k]:.6g} Hz has no damping, so the rms has no bound"
        raise ModelError(Problem("random response", fault, "a damper, or a band without it"))
