"""Response of a linear model to stationary random inputs: spectra, and rms by integration over frequency; rms on a road
with white noise as slope, in time.

G_y(f) = H(f) G(f) H(f)^H with the one-sided cross-spectra G of the inputs; rms^2 = int G_y df.

Slopes of intensity W lead to the variance W int g(t)^2 dt, g being the output after a unit step of the road that each
wheel meets when it gets there. Between these times g is C exp(A t) x + c, so that the integral is closed: the
observability Gramian P of Lyapunov's equation A^T P + P A + C^T C = 0, and terms of exp(A t). It neither samples nor
integrates over frequency.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from eomgen.base.arrays import Array, Complex
from eomgen.base.rounding import COMPUTED
from eomgen.errors import ModelError, NumericalError, Problem, UsageError
from eomgen.products.linear.modes import Modes
from eomgen.products.linear.spectra import Excitation, RoadExcitation, weighting_response
from eomgen.products.linear.state_space import StateSpace

#: Initial points of integration intervals about a resonance, in half bandwidths from the resonance.
_AROUND = (-30.0, -6.0, -1.5, 0.0, 1.5, 6.0, 30.0)


def responses(space: StateSpace, frequencies: Array, excitation: Excitation, outputs: Sequence[str]) -> Complex:
    """Return the frequency responses H (nf, outputs, inputs) to the inputs of an excitation; inputs for the rate of a
    wheel's road count as i omega times that wheel.

    Parameters
    ----------
    space : StateSpace
        The linear model.
    frequencies : (nf,) ndarray
        Hz.
    excitation : Excitation
        Random inputs with the names of their rates.
    outputs : sequence of str
        Names of outputs or states.

    Raises
    ------
    UsageError
        An unknown input or output.
    NumericalError
        A frequency equal to an undamped mode's, to machine precision.
    """
    omega = 2.0 * np.pi * frequencies
    H = space.frequency_responses(omega, excitation.inputs, outputs)
    for wheel, rate in excitation.rates.items():
        of_rate = space.frequency_responses(omega, [rate], outputs)
        H[:, :, excitation.inputs.index(wheel)] += 1j * omega[:, np.newaxis] * of_rate[:, :, 0]
    return H


def densities(
    space: StateSpace, modes: Modes, excitation: Excitation, outputs: Sequence[str], frequencies: Array
) -> Array:
    """Return the one-sided power spectral densities (outputs, nf) of a stationary motion, in squared units per Hz.

    Parameters
    ----------
    space, modes : StateSpace, Modes
        The linear model and the modes.
    excitation : Excitation
        Random inputs.
    outputs : sequence of str
        Names of outputs or states.
    frequencies : (nf,) ndarray
        Hz.

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
    """Return the root mean squares (outputs,) by adaptive integration over frequency (Gauss and Kronrod), to 1e-8.

    Parameters
    ----------
    space, modes : StateSpace, Modes
        The linear model and the modes.
    excitation : random inputs with a band and cross-spectra
    outputs : names of outputs or states
    weightings : (outputs,) names of frequency weightings, or None
    band : Hz; by default the band of the excitation, to which it is cut

    Raises
    ------
    UsageError
        Unknown names, or a band outside the excitation's.
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
            fault = f"the band {band[0]:.6g} to {band[1]:.6g} Hz is outside the excitation's [E0449]"
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
        epsrel=1e-8,
        norm="max",
        points=_places(modes, np.asarray(getattr(excitation, "bends", ())), ends),
        limit=20_000,
        full_output=True,
    )
    if not info.success:
        fault = f"the integral over {low:.4g} to {high:.4g} Hz does not converge [E0448]"
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
        fault = f"mode {k + 1} ({along}) grows with {growth[k]:.4g} 1/s, so there is no stationary motion [E0450]"
        raise ModelError(Problem("random response", fault, "another state to be linear about, or other gains"))


def _check_damped(modes: Modes, low: float, high: float) -> None:
    undamped = modes.oscillating & (np.abs(modes.eigenvalues.real) <= modes.uncertainty)
    inside = undamped & (modes.frequency >= low) & (modes.frequency <= high)
    if np.any(inside):
        k = int(np.flatnonzero(inside)[0])
        fault = f"mode {k + 1} at {modes.frequency[k]:.6g} Hz has no damping, so the rms has no bound [E0451]"
        raise ModelError(Problem("random response", fault, "a damper, or a band without it"))


_PLACE = "rms on a road of white noise"


def white_noise_road(space: StateSpace, modes: Modes, excitation: RoadExcitation, output: str) -> float:
    """Return the rms of an output over all frequencies on a road whose slope is white noise, by a Lyapunov equation.

    Parameters
    ----------
    space, modes : StateSpace, Modes
        The linear model and the modes.
    excitation : RoadExcitation
        A road of exponent 2 under the wheels.
    output : str
        Name of an output or a state.

    Raises
    ------
    UsageError
        An exponent other than 2, or a coherence between tracks that depends on frequency.
    ModelError
        A mode does not decay, or the output follows the road's elevation, which has an unbounded variance.
    """
    road = excitation.road
    if road.exponent != 2.0 or road.long_exponent not in (None, 2.0):
        fault = "the slope of a road is white noise where the exponent is 2 only [E0452]"
        raise UsageError(Problem(_PLACE, fault, "rms, which integrates over frequency"))
    if excitation.coherence == "isotropic" and np.any(excitation.lateral > 0.0):
        fault = "the coherence between tracks depends on frequency [E0453]"
        raise UsageError(Problem(_PLACE, fault, "rms; or coherence=0.5, a number"))
    if np.any(modes.eigenvalues.real >= -modes.uncertainty):
        k = int(np.argmax(modes.eigenvalues.real))
        fault = f"mode {k + 1} does not decay, so there is no stationary motion [E0454]"
        raise ModelError(Problem(_PLACE, fault, "rms over a band, which leaves slow modes out"))
    coherence = excitation.between_tracks(np.ones(1))[0]
    _, first, of_wheel = np.unique(coherence, axis=0, return_index=True, return_inverse=True)
    entering, direct = space.input_columns(excitation.inputs, [output])
    of_rate, at_once = np.zeros_like(entering), np.zeros(len(of_wheel))
    for wheel, rate in excitation.rates.items():
        k = excitation.inputs.index(wheel)
        columns, passed = space.input_columns([rate], [output])
        of_rate[:, k], at_once[k] = columns[:, 0], passed[0, 0]
    # a unit step of each wheel's elevation, and the output long after
    final = -np.linalg.solve(space.A, entering)
    C = space.output_rows([output])[0]
    start, static = of_rate - final, C @ final + direct[0]
    size = np.sum(np.abs(C) @ np.abs(final) + np.abs(direct[0]))
    left = np.abs(np.bincount(of_wheel, static))  # of each track
    if np.max(left) > COMPUTED * size or np.any(at_once):
        fault = f"{output} follows the road itself, whose variance has no bound without ends of the band [E0455]"
        raise ModelError(Problem(_PLACE, fault, "rms, over the band of the road"))
    products = _products_of_steps(space.A, C, start, static, excitation.delays, of_wheel)
    # of each track one wheel, so that only coherences of tracks remain
    variance = road.velocity_intensity(excitation.speed) * float(np.sum(coherence[np.ix_(first, first)] * products))
    return float(np.sqrt(max(variance, 0.0)))


def _products_of_steps(
    A: Array, C: Array, start: Array, static: Array, delays: Array, of_wheel: NDArray[np.intp]
) -> Array:
    """Return for each two tracks the integral over time of the product of their responses, (tracks, tracks), to a unit
    step in each track, which the wheels meet in turn.

    Parameters
    ----------
    A, C : (ns, ns) and (ns,) of the model and of the output
    start, static : (ns, wheels) and (wheels,) the state after a step under each wheel, less the state long after, and
        the output long after
    delays, of_wheel : (wheels,) s, and numbers of the tracks
    """
    P = scipy.linalg.solve_continuous_lyapunov(A.T, -np.outer(C, C))
    tracks = int(of_wheel.max()) + 1
    x, c, total = np.zeros((len(A), tracks)), np.zeros(tracks), np.zeros((tracks, tracks))
    times = np.unique(delays)
    for time, later in zip(times, [*times[1:], np.inf], strict=True):
        for wheel in np.flatnonzero(delays == time):
            x[:, of_wheel[wheel]] += start[:, wheel]
            c[of_wheel[wheel]] += static[wheel]
        total += x.T @ P @ x
        if later < np.inf:
            moved = scipy.linalg.expm(A * (later - time)) @ x
            mixed = np.outer(C @ np.linalg.solve(A, moved - x), c)
            total += mixed + mixed.T - moved.T @ P @ moved + (later - time) * np.outer(c, c)
            x = moved
    return total
