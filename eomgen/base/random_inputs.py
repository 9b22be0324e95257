"""Inputs by seed: random road profiles as sums of harmonics, so that a road is the same smooth formula of time in
Python and C, the road classes of ISO 8608:2016, and standard normal variables.

ISO 8608:2016: one-sided displacement spectrum G(n) = G(n0) (n / n0)^-2 over the spatial frequency n, n0 = 0.1 cycle/m,
with the geometric mean of G(n0) for each class.
"""

from __future__ import annotations

import math
import random

import numpy as np

from eomgen.base.arrays import Array

#: Reference spatial frequency n0, cycle/m.
REFERENCE_FREQUENCY = 0.1
#: G_d(n0) by class, m^3; each class has four times the roughness of the class before.
ROUGHNESS = {name: 16e-6 * 4.0**power for power, name in enumerate("ABCDEFGH")}
#: Spatial frequencies that the standard describes, cycle/m.
FREQUENCY_RANGE = (0.011, 2.83)


FASTEST = 10_000.0  # m/s
FARTHEST = 1e6  # m; the phase of the shortest wave is then 2e7 rad, known to 4e-9

Harmonic = tuple[float, float, float]


def road_harmonics(
    road_class: str, speed: float, *, seed: int = 0, offset: float = 0.0, harmonics: int = 200
) -> tuple[Harmonic, ...]:
    """Return the road under a wheel as harmonics (amplitude, angular frequency, phase) in time.

    The elevation at time t is the sum of amplitude cos(angular frequency t + phase), in m. Spatial frequencies are the
    geometric centres of logarithmic bands, so the profile does not repeat within any run of practical length; each
    harmonic carries the variance of its band exactly.

    Parameters
    ----------
    road_class : one of ``A`` .. ``H``
    speed : in m/s
    seed : of the phases; the same seed gives the same road
    offset : distance in m by which this wheel follows the wheel with offset 0 in the same track
    harmonics : number of bands
    """
    generator = random.Random(seed)
    low, high = FREQUENCY_RANGE
    ratio = (high / low) ** (1.0 / harmonics)
    result = []
    for band in range(harmonics):
        start, end = low * ratio**band, low * ratio ** (band + 1)
        scale = ROUGHNESS[road_class] * REFERENCE_FREQUENCY**2
        amplitude = math.sqrt(2.0 * scale * (1.0 / start - 1.0 / end))
        wavenumber = 2.0 * math.pi * math.sqrt(start * end)
        phase = generator.uniform(0.0, 2.0 * math.pi) - wavenumber * offset
        result.append((amplitude, wavenumber * speed, math.remainder(phase, 2.0 * math.pi)))
    return tuple(result)


#: Name of the stream from which waves have random numbers.
WAVES = "waves"


def standard_normals(seed: int, count: int, name: str = "") -> Array:
    """Return independent standard normal variables, (count,), by a seed from 0 on and a process's name; processes with
    equal seeds are independent."""
    from statistics import NormalDist  # noqa: PLC0415  # few scenes have random inputs

    generator, normal = random.Random(f"{seed} {name}"), NormalDist()
    # quantiles of the middles of 2^52 equal cells, so that neither 0 nor 1 is among them
    return np.array([normal.inv_cdf((generator.getrandbits(52) + 0.5) * 2.0**-52) for _ in range(count)])
