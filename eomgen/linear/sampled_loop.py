"""The loop of a linear model and its sampled states, from one common period to the next.

Between samples s' = A s + B z_s, and the sampled states z_s stay; at a sample the states that are due take new values,
level by level. The product of these matrices over a common period is the monodromy matrix (Floquet; Francis and
Georgiou, Stability theory for linear time-invariant plants with periodic digital controllers, IEEE Transactions on
Automatic Control 33 (1988) 820).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
from scipy.linalg import expm

from eomgen.base.arrays import Array
from eomgen.errors import ModelError, Problem
from eomgen.linear.partials import Partials

#: Ratios of periods are fractions of numbers up to this one, and so many samples a common period has at most.
_MOST = 10_000
#: Part of a period by which times may differ and be the same.
_SAME = 1e-9


@dataclass(frozen=True)
class SampledPart:
    """Sampled states of a system, and the partials of their new values.

    Attributes
    ----------
    names : (n,)
    places : (n,) their indices among all internal states
    periods, offsets : (n,), s
    levels : (n,) in which order they are set at the same time
    by_q, by_v : (n, nv), by_z : (n, nz) of all internal states
    """

    names: tuple[str, ...]
    places: tuple[int, ...]
    periods: tuple[float, ...]
    offsets: tuple[float, ...]
    levels: tuple[int, ...]
    by_q: Array
    by_v: Array
    by_z: Array

    @property
    def others(self) -> list[int]:
        """Places of the internal states that are not sampled."""
        return [k for k in range(self.by_z.shape[1]) if k not in self.places]

    @property
    def common_period(self) -> float:
        """The least time that is a multiple of all periods, s. Raises ModelError if there is none that is short."""
        first = self.periods[0]
        ratios = [Fraction(period / first).limit_denominator(_MOST) for period in self.periods]
        exact = all(
            abs(period - first * ratio) <= _SAME * period for period, ratio in zip(self.periods, ratios, strict=True)
        )
        whole = Fraction(math.lcm(*(of.numerator for of in ratios)), math.gcd(*(of.denominator for of in ratios)))
        if not exact or whole * sum(1 / of for of in ratios) > _MOST:
            listed = ", ".join(f"{period:.9g} s" for period in dict.fromkeys(self.periods))
            fault = f"the periods {listed} have no common multiple within {_MOST} samples"
            raise ModelError(Problem("sampled loop", fault, "periods that are multiples of one another"))
        return first * float(whole)

    def samples(self) -> list[tuple[float, list[int]]]:
        """Return the times of samples within the common period from t = 0 on, and which states are due."""
        end = self.common_period
        due: dict[int, list[int]] = {}
        for k, (period, offset) in enumerate(zip(self.periods, self.offsets, strict=True)):
            for number in range(round(end / period)):
                place = ((offset + number * period) / end) % 1.0
                due.setdefault(round(place / _SAME) % round(1.0 / _SAME), []).append(k)
        return [(place * _SAME * end, due[place]) for place in sorted(due)]


def held_as_inputs(partials: Partials, part: SampledPart) -> Partials:
    """Return partials in which sampled states are inputs behind the others."""
    p, held, kept = partials, list(part.places), part.others
    return replace(
        p,
        B=np.hstack([p.B, -p.Rz[:, held]]),
        Rz=p.Rz[:, kept],
        Fq=p.Fq[kept],
        Fv=p.Fv[kept],
        Fz=p.Fz[np.ix_(kept, kept)],
        Fu=np.hstack([p.Fu[kept], p.Fz[np.ix_(kept, held)]]),
        Fw=p.Fw[kept],
        Yz=p.Yz[:, kept],
        Yu=np.hstack([p.Yu, p.Yz[:, held]]),
    )


def over_a_period(part: SampledPart, A: Array, B: Array, of_q: Array, of_v: Array) -> Array:
    """Return the matrix of (s, z_s) over a common period, from just before the samples at its start.

    Parameters
    ----------
    A : (ns, ns), B : (ns, n) of the continuous part with z_s as inputs; its internal states are the last of s
    of_q, of_v : (nv, ns) dq and dv by s
    """
    ns, n = B.shape
    rates = np.block([[A, B], [np.zeros((n, ns + n))]])
    z = np.zeros((part.by_z.shape[1], ns + n))
    first = ns - len(part.others)
    for row, place in enumerate(part.others):
        z[place, first + row] = 1.0
    for row, place in enumerate(part.places):
        z[place, ns + row] = 1.0
    values = part.by_z @ z
    values[:, :ns] += part.by_q @ of_q + part.by_v @ of_v
    whole, now, end = np.eye(ns + n), 0.0, part.common_period
    for time, due in part.samples():
        whole = expm(rates * (time - now)) @ whole
        whole, now = _at_sample(part, values, due, ns) @ whole, time
    return np.asarray(expm(rates * (end - now)) @ whole)


def _at_sample(part: SampledPart, values: Array, due: Sequence[int], ns: int) -> Array:
    """Return the matrix of (s, z_s) over a sample of the states that are due."""
    whole = np.eye(values.shape[1])
    for level in sorted({part.levels[k] for k in due}):
        step = np.eye(values.shape[1])
        for k in due:
            if part.levels[k] == level:
                step[ns + k] = values[k]
        whole = step @ whole
    return whole
