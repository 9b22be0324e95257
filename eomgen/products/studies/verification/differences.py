"""Derivatives by a ladder of central differences, each entry with its own error bar, and by complex steps.

The bar of an entry is the change of the difference between neighbouring steps, plus round-off divided by the step.
Round-off is measured by the scatter at the smallest steps, and is the last place of the function's largest number at
least. So cancellation inside the functions widens the bars by itself, and so does truncation at too large steps
(Ridders 1982 estimates in this way, too). One-sided differences that do not meet as steps shrink tell a kink.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from eomgen.products.studies.verification.claims.claim import Claim
from eomgen.products.studies.verification.engines import COMPLEX_STEP, Array, Blocks, Engine, moved, spread

#: Steps, largest first, in the units of the directions.
LADDER = 10.0 ** (-0.5 * np.arange(23))
#: From here on steps are so small that differences scatter by round-off only.
_SCATTER = int(np.flatnonzero(LADDER < 5e-8)[0])
#: One-sided differences are compared at steps this many rungs apart: a hundred times.
_APART = 4
#: Numbers that are held at once.
_HELD = 2**23


@dataclass(frozen=True)
class Differences:
    """Finite differences of one closed form at states (S), entry by entry (R, C).

    Attributes
    ----------
    ladder : (K, S, R, C), by step; NaN if a state leaves the function's domain
    best : (S, R, C) the difference at the step of the smallest bar
    bar : (S, R, C) its error bar; infinite if no step gives a number
    step : (S, R, C) that step
    kink : (S, R, C) whether one-sided differences do not meet
    kink_step : (S, R, C) the step at which that was found
    """

    ladder: Array
    best: Array
    bar: Array
    step: Array
    kink: Array
    kink_step: Array


def differences(claim: Claim, engine: Engine, state: Blocks) -> Differences:
    """Return finite differences of the source of a claim on an engine."""
    parts = [_of_states(claim, engine, part) for part in _in_parts(claim, engine, state)]
    central, sided = (np.concatenate(found, axis=1) for found in zip(*parts, strict=True))
    floor = _last_place(claim, engine, state)
    with np.errstate(all="ignore"):
        change = np.abs(np.diff(central, axis=0))
        scatter = np.nan_to_num(np.max(change[_SCATTER:] * _by_step(LADDER[_SCATTER + 1 :], change), axis=0), nan=0.0)
        between = np.maximum(change[:-1], change[1:])
        bars = between + (scatter + floor) / _by_step(LADDER[1:-1], between)
    # a step below rounding
    unnoticed = (central == 0.0) & np.maximum.accumulate(np.nan_to_num(np.abs(central)) > 0.0, axis=0)
    known = np.isfinite(bars) & np.isfinite(central[1:-1]) & ~unnoticed[1:-1]
    bars = np.where(known, bars, np.inf)
    chosen = np.argmin(bars, axis=0)[np.newaxis]
    bar = np.take_along_axis(bars, chosen, axis=0)[0]
    best = np.take_along_axis(central, chosen + 1, axis=0)[0]
    kink, kink_step = _kinks(sided, scatter, np.max(np.abs(np.where(np.isfinite(best), best, 0.0)), initial=0.0))
    return Differences(central, best, bar, LADDER[1:-1][chosen[0]], kink, kink_step)


def _last_place(claim: Claim, engine: Engine, state: Blocks) -> Array:
    """Return the unit in the last place of a state's largest number, (S, 1, 1): smaller changes go unnoticed."""
    assert claim.source is not None  # for mypy: only claims that are compared with differences come here
    with np.errstate(all="ignore"):
        largest = np.max(np.abs(np.nan_to_num(claim.source(engine, state))), axis=-1, initial=0.0)
    return np.asarray(2.0 * np.finfo(float).eps * largest[..., np.newaxis, np.newaxis])


def _by_step(steps: Array, like: Array) -> Array:
    return steps.reshape(-1, *(1,) * (like.ndim - 1))


def _kinks(sided: Array, scatter: Array, size: float) -> tuple[Array, Array]:
    """Return the mask of one-sided differences (2, K, S, R, C) that do not meet, and the smallest step, which tells."""
    gap = np.abs(sided[1] - sided[0])
    noise = 40.0 * scatter / _by_step(LADDER, gap)
    telling = np.where(noise <= 1e-4 * max(size, 1e-300), np.arange(len(LADDER)).reshape(-1, *(1,) * scatter.ndim), -1)
    at = np.max(telling, axis=0)[np.newaxis]
    near, far = (np.take_along_axis(gap, np.maximum(at - apart, 0), axis=0)[0] for apart in (0, _APART))
    kink = (at[0] >= _APART) & (near > 1e-3 * size) & (near > 0.3 * far)
    return kink, LADDER[np.maximum(at[0], 0)]


def _in_parts(claim: Claim, engine: Engine, state: Blocks) -> Iterator[dict[str, Array]]:
    """Yield the states in parts that memory can hold."""
    first = {name: array[:1] for name, array in state.items()}
    count = max(rate.shape[-2] for rate in claim.directions(first).values()) if claim.directions is not None else 1
    size = claim.source(engine, first).shape[-1] if claim.source is not None else 1
    part = max(1, _HELD // max(1, count * max(size, 8) * 8))
    for start in range(0, len(state["q"]), part):
        yield {name: array[start : start + part] for name, array in state.items()}


def _of_states(claim: Claim, engine: Engine, state: Blocks) -> tuple[Array, Array]:
    """Return central differences (K, S, R, C), and one-sided ones (2, K, S, R, C)."""
    assert claim.source is not None and claim.directions is not None  # as above
    rates, around = claim.directions(state), spread(state)
    here = claim.source(engine, state)[..., np.newaxis, :]
    central, backward, forward = [], [], []
    with np.errstate(all="ignore"):
        for step in LADDER.tolist():
            above = claim.source(engine, moved(engine, around, rates, step))
            below = claim.source(engine, moved(engine, around, rates, -step))
            central.append(combined(claim, engine, state, (above - below) / (2.0 * step)))
            backward.append(combined(claim, engine, state, (here - below) / step))
            forward.append(combined(claim, engine, state, (above - here) / step))
    return np.stack(central), np.stack([np.stack(backward), np.stack(forward)])


def combined(claim: Claim, engine: Engine, state: Blocks, by_direction: Array) -> Array:
    """Return derivatives (..., count, n) as the claim means them, (..., R, C)."""
    derivatives = np.swapaxes(by_direction, -1, -2)
    return derivatives if claim.combine is None else claim.combine(engine, state, derivatives)


def complex_steps(claim: Claim, engine: Engine, tape: Engine, state: Blocks) -> Array:
    """Return the derivatives of a claim's source by complex steps on the tape, (S, R, C)."""
    assert claim.source is not None and claim.directions is not None  # as above
    rates, around = claim.directions(state), spread(state)
    with np.errstate(all="ignore"):
        values = claim.source(tape, moved(tape, around, rates, 1j * COMPLEX_STEP))
        return combined(claim, engine, state, values.imag / COMPLEX_STEP)
