"""Rows of a run at given times, and the first passage of a level along it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import special

from eomgen.base.arrays import Array
from eomgen.errors import Problem, UsageError

#: Probability of samples below which they contradict a rate of crossings, and the part by which both may differ.
_CHANCE, _LIKE = 1e-3, 0.2


def rows_at(t: Array, times: Sequence[float]) -> list[int]:
    rows = [int(np.argmin(np.abs(t - time))) for time in times]
    for row, time in zip(rows, times, strict=True):
        if not abs(t[row] - time) <= 1e-6 * np.ptp(t):  # nor not a number
            fault = f"t = {time:.6g} s is no row of the run; the nearest one is at {t[row]:.9g} s"
            raise UsageError(Problem("times", fault, "whole steps within the run"))
    return rows


def first_passage(t: Array, y: Array, slopes: Array, level: float) -> float:
    """Return the probability that the output passes a level from below within the run, by its mean rate of crossings.

    To first order y and its rate are Gaussian at every time; crossings are taken as a Poisson process, so a start
    above counts as well.

    References
    ----------
    Rice: Mathematical analysis of random noise, Bell Syst. Tech. J. 24 (1945); Ditlevsen, Madsen: Structural
    Reliability Methods (1996), 14.2.
    """
    rates = np.gradient(y, t, edge_order=2)
    slope_rates = np.gradient(slopes, t, axis=0, edge_order=2)
    spread = np.sqrt(np.sum(slopes**2, axis=1))
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = (level - y) / spread
        coupling = np.sum(slopes * slope_rates, axis=1) / spread
        mean = rates + coupling * distance
        own = np.sqrt(np.maximum(np.sum(slope_rates**2, axis=1) - coupling**2, 0.0))
        ratio = mean / own
        density = np.exp(-0.5 * distance**2) / (np.sqrt(2.0 * np.pi) * spread)
        crossings = density * (own * np.exp(-0.5 * ratio**2) / np.sqrt(2.0 * np.pi) + mean * special.ndtr(ratio))
    crossings = np.where(spread > 0.0, crossings, 0.0)
    begun = float(special.ndtr(-distance[0])) if spread[0] > 0.0 else float(y[0] > level)
    integral = float(np.sum(0.5 * (crossings[1:] + crossings[:-1]) * np.diff(t)))
    return begun + (1.0 - begun) * -float(np.expm1(-integral))


def judged_passage(level: float, of_rate: float, passed: int, samples: int) -> tuple[float, str]:
    """Return the probability of a first passage to take, and a note if samples contradict the rate of crossings.

    Parameters
    ----------
    level : of the output
    of_rate : probability by the rate of crossings
    passed, samples : how many of the samples pass the level within the run
    """
    share = passed / samples
    more = float(special.bdtrc(passed - 1, samples, of_rate)) if passed else 1.0
    fewer = float(special.bdtr(passed, samples, of_rate))
    if min(more, fewer) > _CHANCE or abs(share - of_rate) <= _LIKE * max(share, of_rate):
        return of_rate, ""
    by = f"{of_rate:.3g} by the rate of crossings of a normal process and {share:.3g} by {samples} samples"
    return (
        share,
        f"the first passage of {level:.6g} has probability {by}, which is preferred: the response is not normal",
    )


def not_normal(y: Array, mean: float, deviation: float) -> str:
    """Return a note if samples y (n,) are not normal two standard deviations from the mean; else an empty text."""
    beyond, chance = int(np.count_nonzero(np.abs(y - mean) > 2.0 * deviation)), 2.0 * float(special.ndtr(-2.0))
    more = float(special.bdtrc(beyond - 1, len(y), chance)) if beyond else 1.0
    if min(more, float(special.bdtr(beyond, len(y), chance))) > _CHANCE:
        return ""
    return (
        f"it takes the response as normal, and {100.0 * beyond / len(y):.2g} % of {len(y)} samples lie more than two"
        f" standard deviations out, not {100.0 * chance:.2g} %"
    )
