"""Root mean squares on a road with white noise as slope, in time: the road of exponent 2 with an unbounded band.

Slopes of intensity W lead to the variance W int g(t)^2 dt, g being the output after a unit step of the road that each
wheel meets when it gets there. Between these times g is C exp(A t) x + c, so that the integral is closed: the
observability Gramian P of Lyapunov's equation A^T P + P A + C^T C = 0, and terms of exp(A t). It neither samples nor
integrates over frequency.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg

from eomgen.base.arrays import Array
from eomgen.base.road_classes import REFERENCE_FREQUENCY
from eomgen.errors import ModelError, Problem, UsageError
from eomgen.linear.modes import Modes
from eomgen.linear.spectra import RoadExcitation
from eomgen.linear.state_space import StateSpace

_PLACE = "rms on a road of white noise"
#: A static response below this part of its terms is rounding.
_NO_STATIC_RESPONSE = 1e-9


def white_noise_road(space: StateSpace, modes: Modes, excitation: RoadExcitation, output: str) -> float:
    """Return the rms of an output.

    Raises
    ------
    UsageError
        An exponent other than 2, or a coherence between tracks that depends on frequency.
    ModelError
        A mode does not decay, or the output follows the road's elevation, which has an unbounded variance.
    """
    road = excitation.road
    if road.exponent != 2.0 or road.long_exponent not in (None, 2.0):
        fault = "the slope of a road is white noise where the exponent is 2 only"
        raise UsageError(Problem(_PLACE, fault, "rms, which integrates over frequency"))
    if excitation.coherence == "isotropic" and np.any(excitation.lateral > 0.0):
        fault = "the coherence between tracks depends on frequency"
        raise UsageError(Problem(_PLACE, fault, "rms; or coherence=0.5, a number"))
    if np.any(modes.eigenvalues.real >= -modes.uncertainty):
        k = int(np.argmax(modes.eigenvalues.real))
        fault = f"mode {k + 1} does not decay, so there is no stationary motion"
        raise ModelError(Problem(_PLACE, fault, "rms over a band, which leaves slow modes out"))
    coherence = excitation.between_tracks(np.ones(1))[0]
    tracks, of_wheel = np.unique(coherence, axis=0, return_inverse=True)
    # of each track one wheel, so that only coherences of tracks remain
    first = [int(np.flatnonzero(of_wheel == k)[0]) for k in range(len(tracks))]
    steps = _Steps(space, excitation, output, [list(np.flatnonzero(of_wheel == k)) for k in range(len(tracks))])
    if steps.unbounded:
        fault = f"{output} follows the road itself, and the variance of that has no bound without ends of the band"
        raise ModelError(Problem(_PLACE, fault, "rms, over the band of the road"))
    intensity = 2.0 * np.pi**2 * REFERENCE_FREQUENCY**2 * road.reference_roughness * excitation.speed
    variance = intensity * float(np.sum(coherence[np.ix_(first, first)] * steps.products()))
    return float(np.sqrt(max(variance, 0.0)))


class _Steps:
    """Responses of one output to unit steps of the road in each track, which its wheels meet one after another."""

    def __init__(self, space: StateSpace, excitation: RoadExcitation, output: str, tracks: list[list[int]]) -> None:
        self.A, self.C = space.A, space.output_rows([output])[0]
        self.tracks, self.delays = tracks, excitation.delays - excitation.delays.min()
        entering, direct = space.input_columns(excitation.inputs, [output])
        of_rate, at_once = np.zeros_like(entering), np.zeros(len(self.delays))
        for wheel, rate in excitation.rates.items():
            k = excitation.inputs.index(wheel)
            columns, passed = space.input_columns([rate], [output])
            of_rate[:, k], at_once[k] = columns[:, 0], passed[0, 0]
        final = -np.linalg.solve(self.A, entering)
        self.start, self.static = of_rate - final, self.C @ final + direct[0]
        size = np.sum(np.abs(self.C) @ np.abs(final) + np.abs(direct[0]))
        left = [abs(float(np.sum(self.static[wheels]))) for wheels in tracks]
        self.unbounded = max(left) > _NO_STATIC_RESPONSE * size or bool(np.any(at_once))

    def products(self) -> Array:
        """Return the integrals over time of the products of two tracks' responses, (tracks, tracks)."""
        P = scipy.linalg.solve_continuous_lyapunov(self.A.T, -np.outer(self.C, self.C))
        x, c = np.zeros((len(self.A), len(self.tracks))), np.zeros(len(self.tracks))
        total = np.zeros((len(self.tracks), len(self.tracks)))
        times = np.unique(self.delays)
        for time, later in zip(times, [*times[1:], np.inf], strict=True):
            for track, wheels in enumerate(self.tracks):
                for wheel in wheels:
                    if self.delays[wheel] == time:
                        x[:, track] += self.start[:, wheel]
                        c[track] += self.static[wheel]
            total += x.T @ P @ x
            if later < np.inf:
                moved = scipy.linalg.expm(self.A * (later - time)) @ x
                mixed = np.outer(self.C @ np.linalg.solve(self.A, moved - x), c)
                total += mixed + mixed.T - moved.T @ P @ moved + (later - time) * np.outer(c, c)
                x = moved
        return total
