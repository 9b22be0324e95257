"""Tolerances of a check: bounds of the rounding errors of the compared numbers.

Exact comparisons (complex steps, second derivations) may differ by 1e-11 of the largest entry of its row or
column, if that is smaller, by 1e-13 of the largest entry of its state and of the differentiated function, which may
cancel along a direction, and by 100 times the effect of rounding of the
arguments on the closed form: that is measured, and is the condition. Comparisons with differences may differ
by 1e-7 and 1e-9 besides, and by 10 error bars.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from eomgen.products.studies.verification.claims.claim import Claim
from eomgen.products.studies.verification.engines import Array, Blocks, Engine, moved

EXACT, EXACT_OF_LARGEST, CONDITION = 1e-11, 1e-13, 100.0
BY_DIFFERENCES, BY_DIFFERENCES_OF_LARGEST, BARS = 1e-7, 1e-9, 10.0
#: Samples by which the condition is measured, and how much they round, in units of the last place.
_SAMPLES, _ROUNDING = 4, 2.0 * float(np.finfo(float).eps)
#: Sizes below this part of the largest over all states count as that.
_SMALL = 1e-3
#: Rounding that changes more than this part of a state's size takes another branch at a kink, which is no rounding.
_BRANCH = 1e-7


@dataclass(frozen=True)
class Sizes:
    """Sizes of entries by row and column (1 or S, R, C), of states (S, 1, 1), of the differentiated function (S, 1, 1),
    and the effect of rounding of arguments (S, R, C)."""

    entry: Array
    state: Array
    source: Array
    condition: Array

    @property
    def exact(self) -> Array:
        known = EXACT_OF_LARGEST * np.maximum(self.state, self.source)
        return np.asarray(EXACT * self.entry + known + CONDITION * self.condition)

    @property
    def differences(self) -> Array:
        return np.asarray(BY_DIFFERENCES * self.entry + BY_DIFFERENCES_OF_LARGEST * self.state + self.exact)


def sizes_of(claim: Claim, engine: Engine, state: Blocks, value: Array, rng: np.random.Generator) -> Sizes:
    largest = np.max(np.abs(value), axis=(-2, -1), initial=0.0)
    if claim.size is not None:
        largest = np.maximum(largest, claim.size(engine, state))
    largest = np.maximum(np.where(np.isfinite(largest), largest, 0.0), _SMALL * np.max(largest, initial=0.0))
    whole = np.where(largest > 0.0, largest, 1.0)[:, np.newaxis, np.newaxis]
    if value.shape[-1] > 1:
        rows, columns = np.max(np.abs(value), axis=(0, 2)), np.max(np.abs(value), axis=(0, 1))
        entry = np.minimum(rows[:, np.newaxis], columns)[np.newaxis]
    else:
        entry = whole
    condition = np.zeros(value.shape)
    for _ in range(_SAMPLES):
        with np.errstate(all="ignore"):
            change = np.abs(claim.value(engine, _rounded(engine, state, rng)) - value)
        condition = np.maximum(condition, np.where(np.isfinite(change), change, 0.0))
    return Sizes(entry, whole, _of_source(claim, engine, state), np.where(condition < _BRANCH * whole, condition, 0.0))


def _of_source(claim: Claim, engine: Engine, state: Blocks) -> Array:
    """Return the size of the differentiated function in each state, (S, 1, 1)."""
    if claim.source is None or claim.combine is not None:
        return np.zeros(1)
    found = np.abs(claim.source(engine, state))
    largest: Array = np.max(np.where(np.isfinite(found), found, 0.0), axis=-1, initial=0.0)
    return largest[:, np.newaxis, np.newaxis]


def _rounded(engine: Engine, state: Blocks, rng: np.random.Generator) -> dict[str, Array]:
    """Return the state with all its numbers changed as rounding may change them."""
    relative = {
        name: array * (1.0 + _ROUNDING * rng.uniform(-1.0, 1.0, array.shape))
        for name, array in state.items()
        if name != "q"
    }
    reach = np.ones(state["v"].shape)
    for factor in engine.factors:
        if factor.group == "R":
            here = np.abs(state["q"][..., factor.q])
            reach[..., factor.v] = np.maximum(here, 1.0)
    turned = moved(engine, state, {"q": reach * rng.uniform(-1.0, 1.0, reach.shape)}, _ROUNDING)
    return {**turned, **relative}
