"""Symmetries of a model's equations: fields of displacements and velocities under which the forces are invariant.

Looked for among the fields X(q) of rigid motions and spins: constant increments e (ignorable coordinates; the spin of a
symmetric body about its own axis), increments Ad(q^-1) xi of each rotation or pose (motions of the frame that it is
seen from), and turns of pairs of travels, A q. Velocities and accelerations go along with W = -ad(e) and A, forces with
-W^T. All conditions are linear in the unknowns: a null space of partials at arbitrary states. A motion along a
symmetry, v = X(q) with vdot = W v, that is balanced at one instant is so forever (Marsden 1992, chapter 4).
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import expm

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.rounding import COMPUTED
from eomgen.lie import numeric
from eomgen.lie.groups import group_named
from eomgen.lie.product import bracket_matrix, moved_frames

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel
    from eomgen.products.statics.steady_conditions import Conditions

#: Singular values below this part of the largest are zero.
_NOTHING = 1e-8


@dataclass(frozen=True)
class SymmetryField:
    """One field X(q) = e + A q + Ad(q^-1) xi.

    Attributes
    ----------
    e : (nv,)
    A : (nv, nv), of the components of v; turns travels among one another
    xi : (nv,), zero but for rotations and poses
    W : (nv, nv), how velocities change along the field
    """

    e: Array
    A: Array
    xi: Array
    W: Array


@dataclass(frozen=True)
class Fields:
    """Fields of a model, for motions v = X(q) g along combinations of them; ``symmetric`` is whether they are
    symmetries."""

    model: CompiledModel
    every: Sequence[SymmetryField]
    symmetric: bool = True

    def __len__(self) -> int:
        return len(self.every)

    @cached_property
    def stacked(self) -> SymmetryField:
        """All fields as one with a leading axis: e and xi (n, nv), A and W (n, nv, nv)."""
        nv, every = self.model.nv, self.every
        e, xi = (np.array([getattr(field, name) for field in every]).reshape(-1, nv) for name in ("e", "xi"))
        A, W = (np.array([getattr(field, name) for field in every]).reshape(-1, nv, nv) for name in ("A", "W"))
        return SymmetryField(e, A, xi, W)

    def directions(self, q: Array) -> Array:
        """Return X(q), (nv, number of fields)."""
        if not self.every:
            return np.zeros((self.model.nv, 0))
        coordinates, frames, of = _single_coordinates(self.model, q), moved_frames(self.model.factors, q), self.stacked
        return np.asarray((of.e + of.A @ coordinates + of.xi @ frames.T).T)

    def along(self, g: Array) -> SymmetryField:
        """Return a combination as one field."""
        of = self.stacked
        return SymmetryField(*(np.tensordot(g, part, 1) for part in (of.e, of.A, of.xi, of.W)))

    def slope(self, q: Array, g: Array) -> Array:
        """Return the left-trivialised derivative of X(q) g in q, (nv, nv)."""
        field = self.along(g)
        factors = self.model.factors
        turned = bracket_matrix(factors, moved_frames(factors, q) @ field.xi)
        return np.asarray(field.A + turned, dtype=float)  # derivative of Ad(q^-1) xi along eta: -ad(eta) Ad(q^-1) xi

    def after(self, q: Array, g: Array, seconds: float) -> Array:
        """Return the configuration (nq,) that the motion along the combination g (n,) reaches from q after some
        seconds."""
        field, nv = self.along(g), self.model.nv
        coordinates = _single_coordinates(self.model, q)
        if np.any(field.A):
            affine = np.zeros((nv + 1, nv + 1))
            affine[:nv, :nv], affine[:nv, nv] = field.A, field.e
            coordinates = (expm(seconds * affine) @ np.append(coordinates, 1.0))[:nv]
        else:
            coordinates = coordinates + seconds * field.e
        result = q.copy()
        for factor in self.model.factors:
            if factor.group == "R":
                result[factor.q] = coordinates[factor.v]
                continue
            group = group_named(factor.group, factor.v_size)
            carried = numeric.compose(group, numeric.exp(group, seconds * field.xi[factor.v]), q[factor.q])
            result[factor.q] = numeric.update(group, carried, seconds * field.e[factor.v])
        return result


def constant(model: CompiledModel, components: Sequence[int], extents: Array) -> Fields:
    """Return the fields along which single components of v are constant, each of the size of the component's
    measure."""
    nv = model.nv
    none = np.zeros((nv, nv))
    single = [SymmetryField(np.eye(nv)[k] * extents[k], none, np.zeros(nv), none) for k in components]
    return Fields(model, single, symmetric=False)


def symmetries(conditions: Conditions, q: Array, z: Array) -> Fields:
    """Return the symmetries of a model, identified at random states around q that satisfy the constraints; none without
    such states."""
    model = conditions.model
    basis = _candidates(model, conditions.extents)
    rng = np.random.default_rng(1)
    count = 2 + 3 * len(basis) // model.nv
    samples = filter(None, (conditions.sample(q, rng) for _ in range(count)))
    parts = [_equations(conditions, basis, *sample, z) for sample in samples]
    if not parts:
        return Fields(model, [])
    matrix = np.concatenate(parts)
    matrix = matrix[np.all(np.isfinite(matrix), axis=1)]
    if len(matrix) < len(basis):
        matrix = np.vstack([matrix, np.zeros((len(basis) - len(matrix), len(basis)))])
    _, singular, Vt = np.linalg.svd(matrix, full_matrices=False)
    null_space = Vt[int(np.sum(singular > _NOTHING * singular[:1])) :]
    # a candidate that is in all symmetries only by rounding has a velocity of exactly zero
    null_space = np.where(np.linalg.norm(null_space, axis=0) > _NOTHING, null_space, 0.0)
    fields = []
    for field in (Fields(model, basis).along(coefficients) for coefficients in null_space):
        size = float(np.linalg.norm(Fields(model, [field]).directions(q)[:, 0] / conditions.extents)) or 1.0
        fields.append(SymmetryField(field.e / size, field.A / size, field.xi / size, field.W / size))
    return Fields(model, fields)


class KnownSymmetries:
    """Memory of the symmetries of a model, for several steady motions at the same parameters, time and inputs. The
    symmetries are independent of the requested velocities. Forces may be different expressions in different regions of
    q, so symmetries are checked at a state near each q in use, and determined again if the check fails."""

    def __init__(self) -> None:
        self.fields: Fields | None = None

    def near(self, conditions: Conditions, q: Array, z: Array) -> Fields:
        """Return the symmetries, without a new search if the known symmetries hold near q."""
        if self.fields is None or not _hold(self.fields, conditions, q, z):
            self.fields = symmetries(conditions, q, z)
        return self.fields

    def forget(self) -> None:
        """Discard the symmetries, so that the next use determines them anew."""
        self.fields = None


def _hold(fields: Fields, conditions: Conditions, q: Array, z: Array) -> bool:
    """Return whether fields are symmetries at an arbitrary state near q. False if the conditions have no such state."""
    sample = conditions.sample(q, np.random.default_rng(3))
    if sample is None:
        return False
    if not len(fields):
        return True
    rows = _equations(conditions, fields.every, *sample, z)
    return bool(np.all(np.abs(rows) <= _NOTHING))


def _candidates(model: CompiledModel, extents: Array) -> list[SymmetryField]:
    """Return all candidate fields, each with one number other than zero in e, A or xi, of the size of the scale of its
    component."""
    nv = model.nv
    none, rest = np.zeros((nv, nv)), np.zeros(nv)
    unit, places = np.diag(extents), range(nv)
    fields = []
    for factor in model.factors:
        for k in places[factor.v]:
            W = none if factor.group == "R" else -np.asarray(bracket_matrix(model.factors, unit[k]), dtype=float)
            fields.append(SymmetryField(unit[k], none, rest, W))
            if factor.group != "R":
                fields.append(SymmetryField(rest, none, unit[k], none))
    single = [k for factor in model.factors if factor.group == "R" for k in places[factor.v]]
    travels = [k for k in single if model.v_units[k] == "m/s"]
    for i, j in itertools.combinations(travels, 2) if len(travels) <= 12 else ():
        A = np.zeros((nv, nv))
        A[i, j], A[j, i] = -1.0, 1.0
        fields.append(SymmetryField(rest, A, rest, A))
    return fields


def _equations(
    conditions: Conditions, basis: Sequence[SymmetryField], q: Array, v: Array, a: Array, lam: Array, z: Array
) -> Array:
    """Return the conditions of a symmetry at a state, a matrix with a column for each candidate in ``basis``, each row
    divided by the magnitudes of its terms; a symmetry is in its null space.

    Rows of constraints may turn into one another, together with the multipliers: so rows only have to remain satisfied,
    and forces have to follow the symmetry except for constraint forces.
    """
    at = conditions.at(q, v, a, z, lam)
    holonomic = len(at.position)
    model = conditions.model
    extents, speed = conditions.extents, np.abs(v)
    free = np.eye(len(v))
    if len(at.B) and np.all(np.isfinite(at.B)):
        _, singular, Vt = np.linalg.svd(at.B * extents)
        free = extents[:, np.newaxis] * Vt[int(np.sum(singular > COMPUTED * singular[:1])) :].T
    fields = Fields(model, basis)
    W = fields.stacked.W
    eta, by_v, by_a = fields.directions(q), (W @ v).T, (W @ a).T
    forces = at.K @ eta + at.C @ by_v + at.M @ by_a + (at.residual @ W).T
    terms = np.abs(at.K) @ extents + np.abs(at.C) @ speed + np.abs(at.M) @ np.abs(a)
    rows = (
        (free.T @ forces, np.abs(free.T) @ terms),
        (at.B[:holonomic] @ eta, np.abs(at.B[:holonomic]) @ extents),
        (at.Z @ eta + at.B @ by_v, np.abs(at.Z) @ extents + np.abs(at.B) @ speed),
        (at.Fq @ eta + at.Fv @ by_v, np.abs(at.Fq) @ extents + np.abs(at.Fv) @ speed),
    )
    columns, size = (np.concatenate(parts) for parts in zip(*rows, strict=True))
    return np.asarray(columns / np.where(size > 0.0, size, 1.0)[:, np.newaxis])


def _single_coordinates(model: CompiledModel, q: Array) -> Array:
    """Return the plain coordinates at the indices of the velocities, (nv,); 0 for rotations and poses."""
    result = np.zeros(model.nv)
    for factor in model.factors:
        if factor.group == "R":
            result[factor.v] = q[factor.q]
    return result
