"""Consistent positions and velocities from an approximate guess.

Positions by Gauss-Newton steps of least kinetic size, q <- q exp(-M^-1 B^T (B M^-1 B^T)^+ Phi); velocities by the same
projection of B v + Phi_t. The pseudo-inverse lets redundant rows be, as long as they do not contradict each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from eomgen.arrays import Array
from eomgen.errors import ModelError, Problem
from eomgen.lie.product import update
from eomgen.solvers.constraint_rows import (
    CONTRADICTION,
    EPSILON,
    NEARER_FRAMES,
    REPORTED,
    SINGULAR,
    Constrained,
    Rows,
    long_lever,
)

MAX_ITERATIONS = 50
#: Rounding errors of a row, in units of the last place of what the magnitudes of its summands add up to.
ROUNDING = 4.0
#: What the names of equations say by which beams do not stretch, behind that of the beam.
_NO_STRETCH = ": no stretch of element "


#: Violations of a guess are reported above this part of the extent, which positions given to seven digits reach.
FITTED = 1e-7


@dataclass(frozen=True)
class Assembly:
    """A consistent state, and how far the guess was from it.

    Attributes
    ----------
    violations : mapping from row to what it was off by in the guess, where that is more than round-off
    rate_violations : the same for the rates of the rows, at the corrected position
    deviations : a sentence for each row that the state does not meet either, by so little that it is no contradiction
    extent : m, of the largest that a row joins
    """

    q: Array
    v: Array
    iterations: int
    violations: dict[str, float]
    rate_violations: dict[str, float]
    deviations: tuple[str, ...] = ()
    extent: float = 1.0

    def corrections(self) -> list[str]:
        """Return one sentence for each row that the guess did not meet."""
        at_position = [
            f"initial position corrected: {name} was off by {value:.3g}" for name, value in self.violations.items()
        ]
        rates = self.rate_violations.items()
        return at_position + [
            f"initial velocity corrected: {name} changed at {value:.3g} per s" for name, value in rates
        ]


def assemble(system: Constrained, q: Array, v: Array, t: float = 0.0) -> Assembly:
    """Return the consistent state nearest to a guess.

    Raises
    ------
    ModelError
        The constraints contradict each other, or the guess is too far away; names the rows that stay violated.
    """
    first, start = system.constraint(q, t), Rows(system, q, t)
    q, iterations = consistent_position(system, q, t)
    rows = Rows(system, q, t)
    guess, rates = v, system.velocity(q, v, t)
    v = v - rows.correction(rates)
    left = system.velocity(q, v, t)
    limits = np.maximum(rows.rate_limits(np.maximum(np.abs(guess), np.abs(v))), CONTRADICTION * np.abs(rates))
    limits = np.maximum(limits, np.finfo(float).tiny)  # below it numbers have no digits to be met by
    if not np.all(np.abs(left) <= limits):
        raise _contradiction(rows, system.names, left, limits, "velocities", iterations)
    violations = _named(system.names, first, FITTED * start.scale)
    changed = _named(system.names, rates, REPORTED * (rows.possible @ np.abs(guess)))
    off = _named(system.names, system.constraint(q, t), REPORTED * rows.scale)
    deviations = tuple(f"{name} stays off by {by:.3g}" for name, by in off.items())
    return Assembly(q, v, iterations, violations, changed, deviations, rows.machine)


def consistent_position(system: Constrained, q: Array, t: float) -> tuple[Array, int]:
    """Return the configuration nearest to a guess on the constraints, and how many corrections led there.

    Raises
    ------
    ModelError
        The constraints contradict each other, or the guess is too far away.
    """
    best = np.full(system.holonomic, np.inf)
    for iteration in range(MAX_ITERATIONS):
        violation, rows = system.constraint(q, t), Rows(system, q, t)
        if not np.all(np.isfinite(violation)):
            break
        summands = np.maximum(rows.size[: system.holonomic], np.finfo(float).tiny)
        size = np.abs(violation) / summands / EPSILON
        met = np.abs(violation) <= rows.limits
        # row by row: summands may cancel to nothing in one of them, which rounding is any part of then
        if np.all((size <= ROUNDING) | (met & (size >= 0.5 * best))):
            return q, iteration
        best = np.minimum(best, size)
        step = -rows.correction(violation)
        largest = float(np.max(np.abs(step[system.angular]), initial=0.0))
        q = update(system.factors, q, step / max(1.0, largest))
    violation, rows = system.constraint(q, t), Rows(system, q, t)
    raise _contradiction(rows, system.names, violation, rows.limits, "positions", MAX_ITERATIONS)


def _named(names: Sequence[str], values: Array, limits: Array) -> dict[str, float]:
    return {name: float(value) for name, value, limit in zip(names, values, limits, strict=False) if abs(value) > limit}


def _contradiction(
    rows: Rows, names: Sequence[str], left: Array, limits: Array, what: str, iterations: int
) -> ModelError:
    order = np.argsort(-np.abs(left) / np.maximum(limits, np.finfo(float).tiny))
    worst = [f"{names[k]} by {left[k]:.3g}" for k in order[:5] if not abs(left[k]) <= limits[k]]
    text = (
        f"the {what} of the constraints cannot be met together: after {iterations} corrections still off:"
        f" {'; '.join(worst)}"
    )
    first, lengths = int(order[0]), _lengths(names, left, limits)
    if lengths:
        text += f"; {', '.join(what for what, _ in lengths)}"
        hint = " and ".join(dict.fromkeys(hint for _, hint in lengths))
    elif rows.lever(first) * SINGULAR > rows.extent[first]:
        text += f"; {long_lever(rows, names, first)}"
        hint = NEARER_FRAMES
    else:
        hint = "an initial state nearer to assembly, or lengths and axes that fit"
    return ModelError(Problem("constraints", text, hint))


def _lengths(names: Sequence[str], left: Array, limits: Array) -> list[tuple[str, str]]:
    """Return what beams that do not stretch would have to do to close their loops, and what to try."""
    by_beam: dict[str, float] = {}
    for name, value, limit in zip(names, left, limits, strict=False):
        beam, is_stretch, _ = name.partition(_NO_STRETCH)
        if is_stretch and not abs(value) <= limit:
            by_beam[beam] = by_beam.get(beam, 0.0) + float(value)
    longer = 'a longer beam, ends that are nearer to each other, or model = "kirchhoff", which stretches'
    shorter = "an initial shape that is bent, which says to which side the beam is to bend"
    return [
        (
            f"the beam {beam} would have to be {'longer' if by > 0.0 else 'shorter'} by more than {abs(by):.3g} m, and"
            " it does not stretch",
            longer if by > 0.0 else shorter,
        )
        for beam, by in by_beam.items()
    ]
