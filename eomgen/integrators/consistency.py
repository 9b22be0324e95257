"""Consistent positions and velocities from a sloppy guess, and the constraint rows that say nothing new.

Positions by Gauss-Newton steps of least kinetic size, q <- q exp(-M^-1 B^T (B M^-1 B^T)^+ Phi); velocities by the same
projection of B v + Phi_t. The pseudo-inverse lets redundant rows be, as long as they do not contradict each other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from eomgen.errors import ModelError, Problem
from eomgen.lie.product import FactorLike, update

Array = NDArray[np.float64]

MAX_ITERATIONS = 50
#: A row counts as met below this, relative to the largest violation met on the way (at least 1).
TOLERANCE = 1e-12
#: Stagnation above this is a contradiction, not round-off.
CONTRADICTION = 1e-8
#: Singular values below this part of the largest belong to redundant rows.
RANK = 1e-9


@dataclass(frozen=True)
class Constrained:
    """A constrained system as callables at fixed parameters.

    Attributes
    ----------
    factors : of the configuration
    names : of the rows, the ``holonomic`` first ones at position level
    constraint(q, t) -> (holonomic,), velocity(q, v, t) -> (rows,), jacobian(q, t) -> (rows, nv), mass(q) -> (nv, nv)
    """

    factors: Sequence[FactorLike]
    names: Sequence[str]
    holonomic: int
    constraint: Callable[[Array, float], Array]
    velocity: Callable[[Array, Array, float], Array]
    jacobian: Callable[[Array, float], Array]
    mass: Callable[[Array], Array]


@dataclass(frozen=True)
class Assembly:
    """A consistent state, and how far the guess was from it.

    Attributes
    ----------
    violations : mapping from row to what it was off by in the guess, where that is more than round-off
    rate_violations : the same for the rates of the rows, at the corrected position
    """

    q: Array
    v: Array
    iterations: int
    violations: dict[str, float]
    rate_violations: dict[str, float]

    def corrections(self) -> list[str]:
        """Return one sentence for each row that the guess did not meet."""
        at_position = [f"initial position corrected: {name} was off by {value:.3g}" for name, value in self.violations.items()]
        rates = self.rate_violations.items()
        return at_position + [f"initial velocity corrected: {name} changed at {value:.3g} per s" for name, value in rates]


def assemble(system: Constrained, q: Array, v: Array, t: float = 0.0) -> Assembly:
    """Return the consistent state nearest to a guess.

    Raises
    ------
    ModelError
        The constraints contradict each other, or the guess is too far away; names the rows that stay violated.
    """
    first = system.constraint(q, t)
    q, iterations = _position(system, q, t)
    rates = system.velocity(q, v, t)
    v = v - _correction(system, q, t, rates)
    left = system.velocity(q, v, t)
    scale = max(1.0, float(np.max(np.abs(rates), initial=0.0)))
    if np.max(np.abs(left), initial=0.0) > CONTRADICTION * scale:
        raise _contradiction(system.names, left, "velocities", iterations)
    return Assembly(q, v, iterations, _named(system.names, first), _named(system.names, rates))


def _position(system: Constrained, q: Array, t: float) -> tuple[Array, int]:
    best, worst = np.inf, 1.0
    for iteration in range(MAX_ITERATIONS):
        violation = system.constraint(q, t)
        size = float(np.max(np.abs(violation), initial=0.0))
        if not np.isfinite(size):
            break
        worst = max(worst, size)
        if size <= TOLERANCE * worst or (size >= 0.5 * best and best <= CONTRADICTION * worst):
            return q, iteration
        best = min(best, size)
        step = -_correction(system, q, t, violation, system.holonomic)
        largest = float(np.max(np.abs(step)))
        q = update(system.factors, q, step * min(1.0, 1.0 / largest if largest > 0 else 1.0))
    raise _contradiction(system.names, system.constraint(q, t), "positions", MAX_ITERATIONS)


def _correction(system: Constrained, q: Array, t: float, violation: Array, rows: int | None = None) -> Array:
    """Return M^-1 B^T (B M^-1 B^T)^+ violation."""
    B = system.jacobian(q, t)[:rows]
    if not len(B):
        return np.zeros(B.shape[1])
    by_mass = np.linalg.solve(system.mass(q), B.T)
    return by_mass @ np.linalg.lstsq(B @ by_mass, violation, rcond=RANK)[0]


def _named(names: Sequence[str], values: Array) -> dict[str, float]:
    return {name: float(value) for name, value in zip(names, values, strict=False) if abs(value) > 1e-10}


def _contradiction(names: Sequence[str], left: Array, what: str, iterations: int) -> ModelError:
    order = np.argsort(-np.abs(left))
    worst = [f"{names[k]} by {left[k]:.3g}" for k in order[:5] if abs(left[k]) > CONTRADICTION or not np.isfinite(left[k])]
    text = f"the {what} of the constraints cannot be met together: after {iterations} corrections still off: {'; '.join(worst)}"
    return ModelError(Problem("constraints", text, "an initial state nearer to assembly, or lengths and axes that fit"))


def redundant_rows(system: Constrained, q: Array, t: float = 0.0, samples: int = 3) -> list[int]:
    """Return the rows that follow from those before them, at the given and at nearby consistent configurations.

    Rows are taken in order: the first to say something is kept. A row that is dependent at one configuration only (a
    singular position) is no redundant row.
    """
    if np.linalg.matrix_rank(_scaled(system, q, t), tol=RANK) == len(system.names):
        return []
    generator = np.random.default_rng(1)
    bases: list[list[Array]] = []
    jacobians: list[Array] = []
    for sample in range(samples):
        here = q
        if sample:
            nudge: Array = np.multiply(0.05, generator.standard_normal(system.jacobian(q, t).shape[1]))
            try:
                here, _ = _position(system, update(system.factors, q, nudge), t)
            except ModelError:
                continue
        jacobians.append(_scaled(system, here, t))
        bases.append([])
    dependent = []
    for row in range(len(jacobians[0])):
        rests = [_rest(B[row], basis) for B, basis in zip(jacobians, bases, strict=True)]
        independent = [bool(np.linalg.norm(rest) > 10 * RANK) for rest in rests]
        if not any(independent):
            dependent.append(row)
            continue
        for rest, basis, new in zip(rests, bases, independent, strict=True):
            if new:
                basis.append(rest / np.linalg.norm(rest))
    return dependent


def _scaled(system: Constrained, q: Array, t: float) -> Array:
    """Return B L^-T with M = L L^T and rows of length one: rows compared in the metric of the kinetic energy."""
    L = np.linalg.cholesky(system.mass(q))
    rows: Array = np.linalg.solve(L, system.jacobian(q, t).T).T
    lengths = np.linalg.norm(rows, axis=1, keepdims=True)
    return rows / np.where(lengths > 0.0, lengths, 1.0)


def _rest(row: Array, basis: Sequence[Array]) -> Array:
    """Return what of a row the basis does not span (Gram-Schmidt, twice for accuracy)."""
    if not basis:
        return row
    Q = np.array(basis)
    rest = row - Q.T @ (Q @ row)
    return rest - Q.T @ (Q @ rest)
