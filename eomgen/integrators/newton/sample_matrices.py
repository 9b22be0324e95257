"""Sample values of a system's partials, at the initial state and at random states, for the choice of pivots.

Random states satisfy the constraints, too. If joints opened, frames would have impossible poses, and good pivots
would look bad.
"""

from __future__ import annotations

import random
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, replace
from eomgen.integrators.newton.matrix import (
    Packing,
    dense,
    pack,
    with_end_jacobian,
    with_sums,
)
from eomgen.lie import product
from eomgen.symbolic.evaluate import Evaluation, evaluate

#: Entries of B up to which B is an array: the products of some thousand entries are as fast, without SciPy.
_DENSE = 20_000


@dataclass(frozen=True)
class SampledPartials:
    """Values of the partials at n states.

    Attributes
    ----------
    packing : places of the nonzeros
    numbers : (n, size)
    v : (n, nv)
        Velocities at these states.
    scale : (nv,)
        Length of each velocity component that counts as 1: 1 rad, or the size of the machine.
    """

    packing: Packing
    numbers: Array
    v: Array
    scale: Array


def packing_of(system: Any) -> Packing:
    """Return the packing of the system's partials: of ``iteration`` if it exists, else of ``partials``; with row
    sums."""
    if "iteration" in system.functions:
        packing = pack(system.patterns)
    else:
        nonzero = {
            block.name: [divmod(k, system.nv) for k, ref in enumerate(block.refs) if system.tape.value(ref) != 0.0]
            for block in system.functions["partials"].outputs
        }
        packing = dense(nonzero, system.nv)
    return with_sums(packing, system.patterns) if "row_sums" in system.functions else packing


def at_both_ends(samples: SampledPartials) -> SampledPartials:
    """Return samples with the values of B once more after the other numbers, for B at the end of a step. The order is
    the one of ``matrix.with_end_jacobian``."""
    start, count = samples.packing.blocks.get("B", (0, 0))
    numbers = np.hstack([samples.numbers, samples.numbers[:, start : start + count]])
    return replace(samples, packing=with_end_jacobian(samples.packing), numbers=numbers)


def samples_of(system: Any) -> SampledPartials:
    """Return the partials of a system at its initial state and at a few random states, evaluated on the tape. Random
    samples that are not finite are dropped; the initial state stays, with zeros for such numbers."""
    packing = packing_of(system)
    normal = random.Random(1).gauss  # numpy.random takes a thirtieth of the time to a first step to import
    q0, v0 = np.array(system.initial_q, float), np.array(system.initial_v, float)
    # draws of the first bodies do not depend on the number of bodies
    drawn = np.reshape([normal() for _ in range(system.nv * 2 * 3)], (system.nv, 2, 3))
    scale = _scales(system)
    turns, spins = 0.7 * drawn[:, 0].T * scale, drawn[:, 1].T * scale * (1.0 + np.abs(v0 / scale).max(initial=0.0))
    with np.errstate(all="ignore"):
        inputs = _drivers(system)
        q, v = (
            np.vstack([first, others])
            for first, others in zip((q0, v0), _away(system, inputs, turns, spins, scale), strict=True)
        )
        inputs |= {
            "q": q,
            "v": v,
            "a": np.zeros((len(q), system.nv)),
            "lam": np.zeros((len(q), len(system.multipliers))),
        }
        inputs |= _consistent(system, inputs)
        evaluated = [system.functions[name] for name in (packing.function, "row_sums") if name in system.functions]
        blocks = {block.name: block.refs for function in evaluated for block in function.outputs}
        refs = [ref for name in packing.blocks for ref in blocks[name]]
        numbers = np.asarray(evaluate(system.tape, refs, inputs), float)
    good = np.all(np.isfinite(numbers), axis=1)
    good[0] = True
    return SampledPartials(packing, np.nan_to_num(numbers[good]), v[good], scale)


def _scales(system: Any) -> Array:
    """Return the characteristic scale of each velocity component, (nv,): 1 rad, or the size of the machine, m.

    Sizes are powers of 1000, so that pivots depend little on the numbers of a scene.
    """
    size = 1.0
    if system.extent:
        parameters = [parameter.value for parameter in system.parameters]
        size = float(evaluate(system.tape, system.extent[:1], {"p": parameters})[0])
    travels = 1e3 ** round(np.log10(size) / 3.0) if 0.0 < size < np.inf else 1.0
    return np.where(np.array(system.angular or (True,) * system.nv), 1.0, travels)


def _away(system: Any, inputs: dict[str, Any], turns: Array, spins: Array, scale: Array) -> tuple[Array, Array]:
    """Return q (n, nq) and v (n, nv) of states off the initial one, on the constraints.

    States that cannot be brought onto the constraints are dropped.

    Parameters
    ----------
    inputs : parameters, time, inputs and base for the tape
    turns, spins : (n, nv)
        Increments of q and of v before their correction by the constraints.
    scale : (nv,)
        Length of each velocity component that counts as 1, so that corrections depend on no unit of length.
    """
    q = np.broadcast_to(np.array(system.initial_q, float), (len(turns), system.nq)).copy()
    v = np.array(system.initial_v, float) + spins
    sources = [name for name in ("equations", "constraint", "iteration") if name in system.functions]
    refs = {block.name: block.refs for name in sources for block in system.functions[name].outputs}
    if "iteration" not in sources or len(sources) < 2 or not len(system.multipliers):
        return product.update(system.factors, q, turns), v
    known = dict(inputs) | {"v": np.zeros((len(q), system.nv))}

    B_of, Phi_of = Evaluation(system.tape, refs["B"]), Evaluation(system.tape, refs.get("Phi", ()))

    def jacobians(rows: int) -> list[_ScaledRows]:
        return [_ScaledRows(_rows_of(system, values)[:rows], scale) for values in B_of.on_arrays(known | {"q": q})]

    size, near = np.full(len(q), np.inf), 1e-3  # of rows, relative to the scales of velocity
    moves = 6  # each is corrected onto the constraints, and as many further corrections follow
    for move in range(2 * moves):
        Phi = Phi_of.on_arrays(known | {"q": q})
        holonomic = jacobians(system.holonomic)
        size = np.array([np.abs(B.rows * value).max(initial=0.0) for B, value in zip(holonomic, Phi, strict=True)])
        if move >= moves and np.all(size <= near):
            break
        steps = turns / moves if move < moves else np.zeros_like(turns)
        for number, B in enumerate(holonomic):
            steps[number] = steps[number] - B.shortest(B.of(steps[number]) + Phi[number])
        q = product.update(system.factors, q, steps)
    for number, B in enumerate(jacobians(len(system.multipliers))):
        v[number] = v[number] - B.shortest(B.of(v[number]))
    return q[size <= near], v[size <= near]


class _ScaledRows:
    """Constraint rows B of one sample, a dense or sparse array, scaled for least-norm solutions.

    Attributes
    ----------
    B : (rows, nv), as given
    scale : (nv,), by which columns are multiplied
    rows : (rows,), by which rows are multiplied then, so that their largest entry is 1
    matrix : the scaled B
    """

    def __init__(self, B: Any, scale: Array) -> None:
        self.scale, self.B, self.dense = scale, B, isinstance(B, np.ndarray)
        scaled = B * scale if self.dense else B.multiply(scale[np.newaxis, :]).tocsr()
        if self.dense:
            largest = np.max(np.abs(scaled), axis=1, initial=0.0)
        else:
            largest = np.asarray(abs(scaled).max(axis=1).todense()).ravel() if B.shape[0] else np.zeros(0)
        self.rows = 1.0 / np.where(largest > 0.0, largest, 1.0)
        factors = self.rows[:, np.newaxis]
        self.matrix = scaled * factors if self.dense else scaled.multiply(factors).tocsr()

    def of(self, x: Array) -> Array:
        return np.asarray(self.B @ x, float)

    def shortest(self, w: Array) -> Array:
        """Return approximately the x of least norm, in units of ``scale``, with B x = w; a small diagonal regularises
        a rank-deficient B. NaN if B is not finite: the state lies beyond the domain of a constraint."""
        if not np.all(np.isfinite(self.matrix if self.dense else self.matrix.data)):
            return np.full(len(self.scale), np.nan)
        product_of_rows = self.matrix @ self.matrix.T
        diagonal = product_of_rows.diagonal() * (1.0 + 1e-9) + 1e-12
        if self.dense:
            np.fill_diagonal(product_of_rows, diagonal)
            multipliers = np.linalg.solve(product_of_rows, self.rows * w)
        else:
            from scipy.sparse.linalg import splu  # noqa: PLC0415  # of many rows alone, since SciPy is slow to import

            product_of_rows = product_of_rows.tocsc()
            product_of_rows.setdiag(diagonal)
            multipliers = splu(product_of_rows).solve(self.rows * w)
        return np.asarray(self.scale * (self.matrix.T @ multipliers), float)


def _rows_of(system: Any, values: Any) -> Any:
    """Return B (rows, nv) of a system from the values of its nonzeros; a sparse array if B is large."""
    rows, columns = np.array(system.patterns["B"]).T
    shape, numbers = (len(system.multipliers), system.nv), np.asarray(values, float)
    if shape[0] * shape[1] > _DENSE:
        from scipy.sparse import csr_array  # noqa: PLC0415  # as above

        return csr_array((numbers, (rows, columns)), shape=shape)
    B = np.zeros(shape)
    B[rows, columns] = numbers
    return B


def _drivers(system: Any) -> dict[str, Any]:
    """Return parameters, time 0, inputs, internal states and base motion at the start, by block name, for the tape."""
    known: dict[str, Any] = {"p": np.array([parameter.value for parameter in system.parameters]), "t": np.zeros(1)}
    known["u"], known["z"] = np.zeros(system.nu), np.array(system.initial_z, float)
    for name, block in (("inputs", "u"), ("base", "base")):
        if name in system.functions:
            known[block] = evaluate(system.tape, system.functions[name].refs, known)
    return known


def _consistent(system: Any, inputs: dict[str, Any]) -> dict[str, Any]:
    """Return accelerations a (n, nv) and multipliers lam (n, rows) that are consistent with the initial state. The same
    values are repeated for all n samples. Empty without constraints, for large systems, and without the functions that
    are needed. `inputs` has all blocks of the samples."""
    nl, nv = len(system.multipliers), system.nv
    forces = "equations" if "equations" in system.functions else "residual"
    # of more unknowns, a dense solve costs more than multipliers improve samples
    if not nl or nv + nl > 1000 or not {forces, "constraint_bias", "iteration"} <= set(system.functions):
        return {}
    at_start = {name: value[0] if name in ("q", "v", "a", "lam") else value for name, value in inputs.items()}

    def values(name: str, block: str) -> Array:
        refs = next((item.refs for item in system.functions[name].outputs if item.name == block), ())
        return np.asarray(evaluate(system.tape, refs, at_start), float)

    A = np.zeros((nv + nl, nv + nl))
    for (row, column), value in zip(system.patterns["M"], values("iteration", "M"), strict=True):
        A[row, column] = value
    for (row, column), value in zip(system.patterns["B"], values("iteration", "B"), strict=True):
        A[nv + row, column] = A[column, nv + row] = value
    right = np.concatenate([values(forces, "r"), values("constraint_bias", "g")])
    scale = _equilibrating(A, nv)
    solution = scale * np.linalg.lstsq(A * np.outer(scale, scale), -scale * right, rcond=None)[0]
    parts = {"a": solution[:nv], "lam": solution[nv:]}
    return {name: np.broadcast_to(part, (len(inputs["q"]), len(part))).copy() for name, part in parts.items()}


def _equilibrating(A: Array, nv: int) -> Array:
    """Return factors of rows and columns of [[M, B^T], [B, 0]] without units: M_ii is 1, rows of B about 1."""
    scale = np.ones(len(A))
    inertia = np.abs(np.diagonal(A)[:nv])
    scale[:nv] = 1.0 / np.sqrt(np.where(inertia > 0.0, inertia, 1.0))
    rows = np.max(np.abs(A[nv:, :nv] * scale[:nv]), axis=1, initial=0.0)
    scale[nv:] = 1.0 / np.where(rows > 0.0, rows, 1.0)
    return scale
