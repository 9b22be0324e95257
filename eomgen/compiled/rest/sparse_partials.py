"""Partials of the residual and the constraints as sparse matrices, with the softest modes of a stiffness in this form;
analyses that refuse scenes with sampled states.

Scenes with many velocity components have the term ``iteration``, which gives nonzeros alone; of long trees it keeps
unknowns s of the recursion, rows g(q, v, a, s) - s = 0, which are eliminated here (Schur complement). Scenes without
that term are small, and have whole matrices.

The softest modes come from the sparse equations of rest by inverse iteration; strains show whether anything opposes a
direction at all, since energies of strains are sums of squares, which do not cancel.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import block_array, csc_array
from scipy.sparse.linalg import splu

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.rounding import SUMMED
from eomgen.compiled.model import CompiledModel
from eomgen.errors import ModelError, Problem
from eomgen.solvers.bordered_newton import LoadedState, LoadedStatics, Matrix, sparse, whole
from eomgen.solvers.tangent_stiffness import ROUNDING
from eomgen.system.sparsity import Places, unpacked_places


def check_continuous(model: CompiledModel, analysis: str) -> None:
    """Raise ModelError if the model has sampled states: they are constant between samples, so they have no equilibrium.

    Parameters
    ----------
    analysis : name of the analysis
    """
    layout = model.library.layout
    if layout["sampled"]:
        names = ", ".join(layout["states"][int(item["state"])]["name"] for item in layout["sampled"])
        problem = (
            f"the states {names} are sampled: between samples they stay as they are, so they have no"
            f" equilibrium [E0088]"
        )
        hint = 'a run of simulate; linearize(at="initial"); or the scene with inputs in place of sampled states'
        raise ModelError(Problem(analysis, problem, hint))


#: Terms of which one gives all partials of the residual.
OF_RESIDUAL = ("iteration", "partials")
#: Partials in velocities, which rest does not need.
_OF_VELOCITIES = ("C", "Z", "Fv")
#: Matrices whose rows of forces are followed by rows of the recursion, and the recursion's unknowns.
_OF_FORCES = ("K", "C", "M", "Rz", "X")
_WHOLE = ("partials", "constraint_jacobian", "velocity_partials", "internal_partials")


@dataclass(frozen=True)
class SparsePartials:
    """Partial derivatives of the equations at one state as sparse matrices, with the names of ``linear.partials``.

    For long trees, K, C, M and Rz are dense arrays, since the unknowns of the recursion were eliminated.

    Attributes
    ----------
    K, C, M : (nv, nv) of the residual in q (left-trivialised), v and a, multipliers held
    B, Z : (rows, nv) constraint Jacobian, and partials of the rows' rates in q
    Rz : (nv, nz) of the residual in internal states
    Fq, Fv, Fz : (nz, nv), (nz, nv), (nz, nz) of the rates of internal states
    """

    K: Matrix
    C: Matrix
    M: Matrix
    B: Matrix
    Z: Matrix
    Rz: Matrix
    Fq: Matrix
    Fv: Matrix
    Fz: Matrix


def sparse_partials(
    model: CompiledModel,
    q: Array,
    v: Array,
    a: Array,
    z: Array,
    multipliers: Array,
    arguments: Mapping[str, Any],
    *,
    of_velocities: bool = True,
) -> SparsePartials:
    """Return all partials at one state q, v, a, z with multipliers; matrices that the model lacks are empty.

    Parameters
    ----------
    model : with one of the terms ``OF_RESIDUAL``
    arguments : t, parameters, base and u, as of ``model.evaluate``
    of_velocities : whether C, Z and Fv are needed; False may leave them empty
    """
    state: dict[str, Any] = {"q": q, "v": v, "a": a, "z": z, "multipliers": multipliers, **arguments}
    nv, nz, rows = model.nv, model.nz, len(model.multipliers)
    shapes = {
        **dict.fromkeys("KCM", (nv, nv)),
        **dict.fromkeys("BZ", (rows, nv)),
        "Rz": (nv, nz),
        "Fq": (nz, nv),
        "Fv": (nz, nv),
        "Fz": (nz, nz),
    }
    if "iteration" in model.functions:
        entries = model.evaluate("iteration", **state)
        if not of_velocities:
            entries = {name: block for name, block in entries.items() if name not in _OF_VELOCITIES}
        result = _iteration_matrices(model, entries, shapes)
    else:
        result = {name: csc_array(block) for name, block in _whole(model, state, _WHOLE).items()}
    return SparsePartials(
        **{name: result[name] if name in result else _empty(*shape) for name, shape in shapes.items()}
    )


@lru_cache(maxsize=64)
def _empty(rows: int, columns: int) -> csc_array:
    return csc_array((rows, columns))


def whole_partials(model: CompiledModel, at: Callable[[str], tuple[Array, ...]]) -> dict[str, Array]:
    """Return the partials that rest needs, K, B, Rz, Fq and Fz of ``SparsePartials``, as whole arrays by name.

    Parameters
    ----------
    at : returns the outputs of a term, by its name, at the state
    """
    nv, nz, rows = model.nv, model.nz, len(model.multipliers)
    shapes = {"K": (nv, nv), "B": (rows, nv), "Rz": (nv, nz), "Fq": (nz, nv), "Fz": (nz, nz)}

    def named_outputs(term: str) -> dict[str, Array]:
        return dict(zip(model.functions.output_names(term), at(term), strict=True))

    blocks: dict[str, Array] = {}
    if "iteration" not in model.functions:
        for term in ("partials", "constraint_jacobian", "internal_partials"):
            blocks |= named_outputs(term) if term in model.functions else {}
    elif (places := _places(model)).get("X", np.zeros(0)).size:
        sizes = {**shapes, **dict.fromkeys("CM", (nv, nv)), "Z": (rows, nv), "Fv": (nz, nv)}
        eliminated = _iteration_matrices(model, named_outputs("iteration"), sizes)
        blocks = {name: whole(matrix) for name, matrix in eliminated.items()}
    else:
        entries = named_outputs("iteration")
        blocks = {name: np.zeros(shapes[name]) for name in shapes.keys() & entries.keys()}
        for name, block in blocks.items():
            np.add.at(block, tuple(places[name]), entries[name])
    return {name: blocks[name] if name in blocks else np.zeros(shape) for name, shape in shapes.items()}


def _places(model: CompiledModel) -> dict[str, Places]:
    """Return rows and columns of the entries of the term ``iteration``, (2, count) by matrix."""
    return {name: _unpacked(text) for name, text in model.library.layout["patterns"].items()}


_unpacked = lru_cache(maxsize=64)(unpacked_places)


def _whole(model: CompiledModel, state: Mapping[str, Any], terms: Sequence[str]) -> dict[str, Array]:
    """Return the whole matrices of terms, without the terms that the model lacks."""
    blocks: dict[str, Array] = {}
    for term in terms:
        if term in model.functions:
            blocks |= model.evaluate(term, **state)
    return blocks


def _iteration_matrices(
    model: CompiledModel, values: Mapping[str, Array], shapes: Mapping[str, tuple[int, int]]
) -> dict[str, Matrix]:
    """Return the matrices of the term ``iteration`` by name, with the unknowns of the recursion eliminated. ``values``
    are the nonzeros of each matrix, ``shapes`` the shapes of the results. With a recursion, K, C, M, Rz and the
    partials Fq, Fv, Fz that it changes are dense."""
    nv, nz = model.nv, model.nz
    places = _places(model)
    inner = int(places["X"][1].max()) + 1 if "X" in places and places["X"].size else 0
    entire: dict[str, csc_array] = {}
    for name, entries in values.items():
        rows, columns = shapes.get(name, (nz if name == "Fx" else nv, inner))
        with_recursion = (rows + inner if name in _OF_FORCES else rows, columns)
        entire[name] = _by_columns(model.library.layout["patterns"][name], with_recursion, entries)
    if not inner:
        return dict(entire)
    X, Fx = entire.pop("X"), entire.pop("Fx", _empty(nz, inner))
    result: dict[str, Matrix] = dict(entire)
    # forces and rates by the recursion's rows: one solution for all matrices, with as many right sides as forces
    by_recursion: Array = np.concatenate([whole(X[:nv]), whole(Fx)])
    solution = np.ascontiguousarray(splu(csc_array(X[nv:].T)).solve(by_recursion.T))
    for name, of_rates in (("K", "Fq"), ("C", "Fv"), ("M", ""), ("Rz", "Fz")):
        if name not in entire:
            continue
        change = np.asarray(entire[name][nv:].T @ solution).T
        result[name] = np.asarray(entire[name][:nv].toarray() - change[:nv])
        if nz and of_rates:
            before = entire[of_rates].toarray() if of_rates in entire else 0.0
            result[of_rates] = np.asarray(before - change[nv:])
    return result


@lru_cache(maxsize=64)
def _structure(text: str, rows: int, columns: int) -> tuple[NDArray[np.intp], NDArray[np.int32], NDArray[np.int32]]:
    """Return the structure by compressed columns of a (rows, columns) matrix with the packed pattern ``text``. It
    consists of the index into the data for each entry of the pattern, row indices, and ends of columns."""
    row, column = _unpacked(text)
    kept, places = np.unique(column * rows + row, return_inverse=True)
    ends = np.searchsorted(kept, rows * np.arange(columns + 1))
    return places, (kept % max(rows, 1)).astype(np.int32), ends.astype(np.int32)


def _by_columns(text: str, shape: tuple[int, int], entries: Array) -> csc_array:
    """Return the matrix of a pattern's entries, entries at one place summed."""
    places, indices, ends = _structure(text, *shape)
    return csc_array((np.bincount(places, entries, len(indices)), indices, ends), shape=shape)


def soft_modes(
    statics: LoadedStatics, rest: LoadedState, inertia: Matrix, shapes: Array, largest: float
) -> tuple[Array, Array]:
    """Return squared frequencies, (modes,), rad²/s², and their directions, (nv, modes), orthonormal in the metric of
    the mass; the squared frequency of a direction that is not opposed by any force is exactly 0.

    The squared frequencies are not sorted. Without geometrically exact beams, and if the equations of rest are
    singular, all are 0 and the directions are ``shapes`` as given. If the solution overflows, the values so far are
    returned.

    Parameters
    ----------
    statics, rest : equations of rest, and the state that they are linear about
    inertia : (nv, nv), positive definite
    shapes : (nv, modes) directions that span the soft directions, as far as known
    largest : squared frequency of the stiffest direction, rad²/s²
    """
    strains = statics.strains(rest.s)
    if strains is None or not shapes.shape[1]:
        return np.zeros(shapes.shape[1]), shapes
    tangents, rows, mass = statics.tangents(rest), len(rest.multipliers), whole(inertia)
    try:
        K, B = sparse(tangents.K), sparse(tangents.B)
        factors = splu(block_array([[K, B.T], [B, None]], format="csc"))
    except RuntimeError:
        return np.zeros(shapes.shape[1]), shapes
    values = np.zeros(shapes.shape[1])
    for _ in range(4):
        right = np.concatenate([mass @ shapes, np.zeros((rows, shapes.shape[1]))])
        solution = factors.solve(right)[: len(mass)]
        if not np.all(np.isfinite(solution)):
            return values, shapes
        inverse, turn = np.linalg.eigh(0.5 * (shapes.T @ mass @ solution + solution.T @ mass @ shapes))
        values = np.divide(1.0, inverse, out=np.zeros_like(inverse), where=inverse != 0.0)
        shapes = np.linalg.qr(np.linalg.cholesky(mass).T @ solution @ turn)[0]
        shapes = np.linalg.solve(np.linalg.cholesky(mass).T, shapes)
    d = strains.values(rest.q)
    change = (strains.derivative(rest.q, d) @ shapes).reshape(*d.shape, -1)
    energy = np.einsum("eik,eij,ejk->k", change, strains.stiffness, change)
    every = np.abs(shapes)
    rounding = ROUNDING * np.einsum("ij,ij->j", every, abs(K) @ every)
    return np.where((energy > SUMMED**2 * largest) & (np.abs(values) > rounding), values, 0.0), shapes
