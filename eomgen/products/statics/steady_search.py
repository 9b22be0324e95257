"""The search for a steady motion: Gauss and Newton's steps in q across the symmetries and in the coefficients g of
these."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.rounding import COMPUTED
from eomgen.lie.product import update
from eomgen.products.statics.steady_conditions import Conditions, ConditionValues
from eomgen.products.statics.symmetries import Fields, constant
from eomgen.solvers.regular_inertia import regular_inertia

Mask = NDArray[np.bool_]


class PrescribedComponents(NamedTuple):
    """Which components of q are held and which of v are given, masks (nv,), the given values v (nv,), and the mask
    ``alone`` of cyclic coordinates."""

    held_q: Mask
    held_v: Mask
    v: Array
    alone: Mask


class MovingState(NamedTuple):
    """A state of a motion along fields: q, v and a, internal states z, multipliers lam, and the coefficients g of the
    fields."""

    q: Array
    v: Array
    a: Array
    z: Array
    lam: Array
    g: Array

    @property
    def motion(self) -> tuple[Array, Array, Array, Array, Array]:
        return self.q, self.v, self.a, self.z, self.lam


class SteadySearch(NamedTuple):
    """End of a search for motions along some fields, the number of steps, and whether all conditions are met."""

    fields: Fields
    state: MovingState
    steps: int
    balanced: bool


def search(
    conditions: Conditions, fields: Fields, targets: PrescribedComponents, q: Array, v: Array, z: Array
) -> SteadySearch:
    """Return the end of a search for a steady motion along symmetries, or, if that fails, with constant velocities; of
    two failures the first.

    Parameters
    ----------
    conditions, fields : Conditions, Fields
        Conditions of a steady motion, and symmetries of the model.
    targets : PrescribedComponents
        Held coordinates and prescribed velocities.
    q, v, z : (nq,), (nv,) and (nz,) ndarray
        State from which the search begins.
    """
    along = _search_around(conditions, fields, targets, q, v, z) if len(fields) else None
    if along is not None and along.balanced:
        return along
    moving = targets.alone | targets.held_v
    components = np.flatnonzero(moving | _forced(conditions, moving, q))
    single = constant(conditions.model, components.tolist(), conditions.extents)
    result = _search_around(conditions, single, targets, q, np.where(targets.alone, v, 0.0), z)
    return result if result.balanced or along is None else along


def _forced(conditions: Conditions, moving: Mask, q: Array) -> Mask:
    """Return the mask (nv,) of the components of v that constraints force to move together with the components
    ``moving`` (nv,), a mask, at q."""
    if not conditions.model.multipliers:
        return np.zeros_like(moving)
    B = conditions.jacobian(q) * conditions.extents
    if not np.all(np.isfinite(B)):
        return np.zeros_like(moving)
    answer = np.zeros((len(moving), int(np.sum(moving))))
    answer[~moving] = np.linalg.lstsq(B[:, ~moving], -B[:, moving], rcond=None)[0]
    sizes = np.max(np.abs(answer), axis=1, initial=0.0)
    result: Mask = sizes > 0.05 * np.max(sizes)
    return result


def _search_around(
    conditions: Conditions, fields: Fields, targets: PrescribedComponents, q: Array, v: Array, z: Array
) -> SteadySearch:
    """Return the end of a search from the state q, v, z, or, as long as it fails, from up to 6 random states near it;
    the first failure if all fail."""
    rng = np.random.default_rng(2)
    first = result = _search(conditions, fields, targets, _start(conditions, fields, targets, q, v, z))
    for _ in range(6):
        if result.balanced:
            return result
        eta = np.where(targets.held_q, 0.0, conditions.around(rng.normal(0.0, 0.3, conditions.model.nv)))
        try:
            moved = _start(conditions, fields, targets, update(conditions.model.factors, q, eta), v, z)
            result = _search(conditions, fields, targets, moved)
        except np.linalg.LinAlgError:
            continue
    return result if result.balanced else first


def _start(
    conditions: Conditions, fields: Fields, targets: PrescribedComponents, q: Array, v: Array, z: Array
) -> MovingState:
    """Return the motion along the fields at q whose velocities are nearest to v; given velocities have precedence."""
    X = fields.directions(q) / conditions.extents[:, np.newaxis]
    scaled_v, mask = np.where(targets.held_v, targets.v, v) / conditions.extents, targets.held_v
    g = np.linalg.lstsq(X[mask], scaled_v[mask], rcond=COMPUTED)[0]
    left = _null_space(X[mask])
    g = g + left @ np.linalg.lstsq(X[~mask] @ left, (scaled_v - X @ g)[~mask], rcond=COMPUTED)[0]
    return motion_at(conditions, fields, q, np.asarray(g), z)


def _null_space(matrix: Array) -> Array:
    """Return the null space of a matrix, as columns of norm one or less."""
    _, singular, Vt = np.linalg.svd(np.vstack([matrix, np.zeros((1, matrix.shape[1]))]))
    return np.asarray(Vt[int(np.sum(singular > COMPUTED)) :].T)


def motion_at(
    conditions: Conditions, fields: Fields, q: Array, g: Array, z: Array, lam: Array | None = None
) -> MovingState:
    """Return the motion v = X(q) g along fields, with the accelerations of a steady motion.

    Parameters
    ----------
    conditions, fields : Conditions, Fields
        Conditions of a steady motion, and n fields.
    q, z : (nq,) and (nz,) ndarray
        Configuration and internal states.
    g : (n,) ndarray
        Coefficients of the fields.
    lam : (nl,) ndarray, optional
        Multipliers; by default with the least unbalanced forces.
    """
    q = conditions.followed(q)
    v = fields.directions(q) @ g
    a = fields.along(g).W @ v
    return MovingState(q, v, a, z, conditions.multipliers(q, v, a, z) if lam is None else lam, g)


class Linear(NamedTuple):
    """Residuals of all conditions at a state divided by measures, with rounding errors and partials J in the unknowns.
    ``across`` (nv, n) are the unknown increments of q, ``by_eta`` (nv, nv) and ``by_g`` the partials of v. ``at`` are
    the conditions at the state, not divided."""

    values: Array
    rounding: Array
    J: Array
    across: Array
    by_eta: Array
    by_g: Array
    at: ConditionValues


def linear_conditions(
    conditions: Conditions, fields: Fields, targets: PrescribedComponents, state: MovingState
) -> Linear:
    """Return the conditions of a steady motion made linear about a state. Raises numpy.linalg.LinAlgError if M is not
    positive definite.

    Parameters
    ----------
    conditions, fields : Conditions, Fields
        Conditions of a steady motion, and the fields of the motion.
    targets : PrescribedComponents
        Held coordinates and prescribed velocities.
    state : MovingState
        The state.
    """
    conditions.root_of_mass(state.q)
    at = conditions.at(*state.motion)
    X, W = fields.directions(state.q), fields.along(state.g).W
    D = fields.slope(state.q, state.g)
    turns = (fields.stacked.W @ state.v).T
    M = regular_inertia(at.M, at.B, conditions.extents)
    across = _across(M, X if fields.symmetric else np.eye(len(X))[:, targets.alone], targets.held_q)
    dv = np.hstack([D @ across, X])
    da = np.hstack([W @ D @ across, W @ X + turns])
    dq = np.hstack([across, np.zeros_like(X)])
    rows, nz = len(at.velocity), len(at.rates)
    holonomic = len(at.position)
    moved = [
        at.K @ dq + at.C @ dv + at.M @ da,
        at.B[:holonomic] @ dq,
        at.Z @ dq + at.B @ dv,
        at.Aq @ dq + at.Av @ dv + at.B @ da,
        at.Fq @ dq + at.Fv @ dv,
    ]
    by_z = [at.Rz, np.zeros((holonomic, nz)), np.zeros((2 * rows, nz)), at.Fz]
    by_lam = [at.B.T, np.zeros((holonomic + 2 * rows + nz, rows))]
    raw = np.hstack([np.concatenate(moved), np.concatenate(by_z), np.concatenate(by_lam)])
    values, rounding = conditions.measured(at, at.values)
    J, _ = conditions.measured(at, raw)
    of_given = np.flatnonzero(targets.held_v)
    speed = conditions.pace * conditions.extents[of_given]
    short = (state.v - targets.v)[of_given] / speed
    by_given = np.hstack([dv[of_given] / speed[:, np.newaxis], np.zeros((len(of_given), nz + rows))])
    values, rounding = np.concatenate([values, short]), np.concatenate([rounding, 0.0 * short])
    return Linear(values, rounding, np.concatenate([J, by_given]), across, D, X, at)


def _across(M: Array, X: Array, held: Mask) -> Array:
    """Return increments of q, (nv, n), that change no held component and are orthogonal, by the inertia matrix M, to
    the fields X (nv, fields)."""
    free = (np.eye(len(M)) / np.sqrt(np.diag(M)))[:, ~held]  # of unit kinetic energy each
    sizes = np.sqrt(np.einsum("ij,ik,kj->j", X, M, X))
    X = X[:, sizes > 0.0] / sizes[sizes > 0.0]
    along = X @ _null_space(np.sqrt(np.diag(M))[held, np.newaxis] * X[held])  # columns that change no held component
    return np.asarray(free @ _null_space((free.T @ M @ along).T))


def _search(conditions: Conditions, fields: Fields, targets: PrescribedComponents, state: MovingState) -> SteadySearch:
    """Return the end of a damped Gauss-Newton iteration from a state, with steps of least size, halved until the
    residual falls."""
    steps, balanced, most = 0, False, 100
    for steps in range(most + 1):
        linear = linear_conditions(conditions, fields, targets, state)
        value, J = linear.values, linear.J
        balanced = bool(np.all(np.isfinite(value) & (np.abs(value) <= 1e-11 + linear.rounding)))
        if not (np.all(np.isfinite(J)) and np.all(np.isfinite(value))) or steps == most:
            break
        scale = _weights(linear)
        change = -np.linalg.lstsq(J / scale, value, rcond=1e-11)[0] / scale
        increment = linear.across @ change[: linear.across.shape[1]]
        share = 0.5 / float(np.max(np.abs(increment[conditions.turning]), initial=0.5))
        for _ in range(1 if balanced else 30):
            ends = np.cumsum([linear.across.shape[1], len(fields), len(state.z)])
            by_q, dg, dz, _ = np.split(share * change, ends)
            q = update(conditions.model.factors, state.q, linear.across @ by_q)
            moved = motion_at(conditions, fields, q, state.g + dg, state.z + dz)
            next_value = _values(conditions, targets, linear.at, moved)
            enough = 0.5 if balanced else 1.0 - 0.1 * share
            if np.all(np.isfinite(next_value)) and np.linalg.norm(next_value) < enough * np.linalg.norm(value):
                break
            share *= 0.5
        else:
            break
        state = moved
    return SteadySearch(fields, state, steps, balanced)


def _values(conditions: Conditions, targets: PrescribedComponents, at: ConditionValues, state: MovingState) -> Array:
    """Return the conditions at a state, with the given velocities, divided by the scales at another state, ``at``."""
    values, _ = conditions.measured(at, conditions.values(*state.motion))
    of_given = np.flatnonzero(targets.held_v)
    return np.concatenate([values, (state.v - targets.v)[of_given] / (conditions.pace * conditions.extents[of_given])])


def _weights(linear: Linear) -> Array:
    """Return weights (n,) that make the unknowns comparable: kinetic energies for coordinates and velocities, norms of
    columns of J for other unknowns."""
    M, moving = linear.at.M, linear.across.shape[1] + linear.by_g.shape[1]
    energies = [np.einsum("ij,ik,kj->j", part, M, part) for part in (linear.across, linear.by_g)]
    rest = np.linalg.norm(linear.J[:, moving:], axis=0)
    weights = np.concatenate([np.sqrt(np.concatenate(energies)), rest])
    return np.where(weights > 0.0, weights, 1.0)
