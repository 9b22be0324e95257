"""Linearised steps of generalized-alpha in C: tangents and adjoints through a part of a run; the C of sweeps is
compiled once for all models."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.files import template_folder
from eomgen.errors import NumericalError, Problem
from eomgen.lie.product import Factor
from eomgen.toolchain.builder import Builder


@functools.cache
def routine(files: Sequence[str], cdef: str, *, in_complex: bool = False) -> tuple[Any, Any]:
    """Return ``ffi`` and ``lib`` of files of ``templates/derivatives``, as one source after ``algebra.c``."""
    folder = template_folder() / "derivatives"
    texts = [(folder / name).read_text(encoding="utf-8") for name in ("algebra.c", *files)]
    source = "\n".join(["#define EG_COMPLEX"] * in_complex + texts)
    return Builder().build_routine(source, cdef)


_FILES = ("sparse_factors.c", "generalized_alpha.c")
_CDEF = """\
typedef struct eg_steps {
    long nv, nz, nl, nh;
    long np, nown;
    long steps, directions;
    long turns;
    const long *turn;
    const double *coefficients;
    const double *Jq, *Jv, *Ja;
    const double *Jz;
    const double *Jlam;
    const double *P;
    const double *A, *T;
    const double *G;
    const double *N;
    const double *Np;
    long *plan;
    double *scale;
} eg_steps;
long eomgen_plan_size(long n);
long eomgen_step_reactions(long steps, long nv, long nh, const double *B, long stride, const double *W, long w_stride,
    const double *moved, double *G, double *eta, double *reaction, double *room);
void eomgen_step_plan(const eg_steps *given, char *nonzero, long *counts, double *room);
void eomgen_step_products(long steps, long rows, long columns, long directions, const double *X, const double *D,
    double *Y);
long eomgen_step_room(long nv, long nz, long nl, long nh, long directions);
long eomgen_step_tangents(const eg_steps *given, const double *dp, double *state, double *record, double *eta,
    double *room, long *pivot);
long eomgen_step_adjoints(const eg_steps *given, const double *direct, const double *sources, double *state,
    double *gradient, double *multipliers, double *ends, double *room, long *pivot);
"""


@dataclass(frozen=True)
class StepMatrices:
    """Matrices of linearised steps, (steps, ...) each, as ``templates/derivatives/generalized_alpha.c`` says.

    ``rows`` of Jq to P: residual, minus rates of internal states, holonomic constraints, rates of all constraints. P
    may lack the columns of the last parameters, which no equation has.
    Blocks of the rotating factors in A and T are concatenated.
    """

    Jq: Array
    Jv: Array
    Ja: Array
    Jz: Array
    Jlam: Array
    P: Array
    A: Array
    T: Array
    G: Array
    N: Array
    Np: Array


def reactions(B: Array, W: Array, moved: Array) -> tuple[Array, Array, Array]:
    """Return G = B W, (n, nh, nv), eta with (B W B^T) eta = B moved, (n, nh), and B^T eta, (n, nv).

    Parameters
    ----------
    B : (n, nh, nv), each of them contiguous
    W : (nv,) or (n, nv)
    moved : (n, nv)

    Raises
    ------
    NumericalError
        Constraints repeat each other.
    """
    ffi, lib = routine(_FILES, _CDEF)
    count, nh, nv = B.shape
    if B.strides[1:] != (8 * nv, 8) or B.strides[0] % 8:
        B = np.ascontiguousarray(B)
    G, eta, reaction = np.empty((count, nh, nv)), np.empty((count, nh)), np.empty((count, nv))
    W, moved = np.ascontiguousarray(W), np.ascontiguousarray(moved)
    from_start = ffi.cast("const double *", B.ctypes.data)
    pointers = [ffi.cast("double *", array.ctypes.data) for array in (W, moved, G, eta, reaction)]
    room = ffi.new("double[]", nh * nh + nh * nv)
    own = nv if W.ndim == 2 else 0
    done = lib.eomgen_step_reactions(
        count, nv, nh, from_start, B.strides[0] // 8, pointers[0], own, *pointers[1:], room
    )
    if done != count:
        fault = "the multipliers of velocities in a step are not unique: constraints repeat each other"
        raise NumericalError(Problem("sensitivities", fault, "constraints that do not repeat"))
    return G, eta, reaction


class LinearSteps:
    """The compiled linearised steps of a run.

    Parameters
    ----------
    coefficients : h, alpha_m, alpha_f, beta, gamma, and alpha_m and gamma of equations of first order
    eta : rows of constraints with multipliers at velocity level
    """

    def __init__(
        self, sizes: Mapping[str, int], factors: Sequence[Factor], coefficients: Sequence[float], eta: int
    ) -> None:
        self._ffi, self._lib = routine(_FILES, _CDEF)
        self._nv, self._nz, self._nl, self._nh = sizes["v"], sizes["z"], sizes["lam"], eta
        turning = [factor for factor in factors if factor.group != "R"]
        self._turn = np.array([[factor.v_start, factor.v_size] for factor in turning], dtype=np.dtype("l")).reshape(
            -1, 2
        )
        self._coefficients = np.array(coefficients, dtype=float)
        #: Order of pivots by the nonzeros of some steps, chosen at the first sweep; the first number says whether.
        self._plan = self._ffi.new("long[]", self._lib.eomgen_plan_size(self.rows))
        self._scale = self._ffi.new("double[]", self.rows)

    @property
    def rows(self) -> int:
        """Equations of a step."""
        return self._nv + self._nz + self._nh + self._nl

    @property
    def state_size(self) -> int:
        """Rows of a state: dq, dv, dvdot, da, dz, dzdot, dr."""
        return 4 * self._nv + 3 * self._nz

    @property
    def record_size(self) -> int:
        """Rows of the record of a step: dq, dv, dvdot, dz, dlam."""
        return 3 * self._nv + self._nz + self._nl

    def tangents(self, matrices: StepMatrices, dp: Array, state: Array, times: Array) -> tuple[Array, Array]:
        """Take tangents through steps: ``state`` (state_size, directions) becomes the tangent at the end of the steps.

        Parameters
        ----------
        dp : (parameters, directions)
        times : (steps,) of the ends of the steps, for messages

        Returns
        -------
        record : (steps, record_size, directions)
        eta : (steps, holonomic rows, directions)
        """
        steps, directions = len(matrices.Jq), state.shape[1]
        record, eta = (np.empty((steps, size, directions)) for size in (self.record_size, self._nh))
        given = self._given(matrices, dp.shape[0], steps, directions)
        room, pivot = self._room(directions)
        arrays = map(self._doubles, (np.ascontiguousarray(dp), state, record, eta))
        self._check(self._lib.eomgen_step_tangents(given[0], *arrays, room, pivot), steps, times)
        return record, eta

    def adjoints(
        self,
        matrices: StepMatrices,
        direct: Array,
        state: Array,
        gradient: Array,
        times: Array,
        sources: Array | None = None,
    ) -> tuple[Array, Array]:
        """Take adjoints back through steps: ``state`` becomes the adjoint at the start of the steps, and the gradient
        of the steps is added to ``gradient`` (parameters, directions).

        Parameters
        ----------
        direct : (steps, record_size, directions), derivatives of functionals by each row
        sources : (steps, 2 nv + holonomic rows, directions), added to the derivatives in q at the start of each step,
            in the increment h D and in eta

        Returns
        -------
        multipliers : (steps, rows, directions)
            Of the equations of each step.
        ends : (steps, 2 nv, directions)
            Derivatives in q at the end of each step, and in D.
        """
        steps, directions = len(matrices.Jq), state.shape[1]
        multipliers, ends = (np.empty((steps, size, directions)) for size in (self.rows, 2 * self._nv))
        given = self._given(matrices, gradient.shape[0], steps, directions)
        room, pivot = self._room(directions)
        added = self._ffi.NULL if sources is None else self._doubles(np.ascontiguousarray(sources))
        of_rows, *arrays = map(self._doubles, (np.ascontiguousarray(direct), state, gradient, multipliers, ends))
        done = self._lib.eomgen_step_adjoints(given[0], of_rows, added, *arrays, room, pivot)
        self._check(done, steps, times)
        return multipliers, ends

    def products(self, matrices: Array, columns: Array) -> Array:
        """Return products of (n, rows, size) and (n, size, directions)."""
        count, rows, size = matrices.shape
        result = np.empty((count, rows, columns.shape[2]))
        kept = np.ascontiguousarray(matrices), np.ascontiguousarray(columns), result
        self._lib.eomgen_step_products(count, rows, size, columns.shape[2], *map(self._doubles, kept))
        return result

    def _given(self, matrices: StepMatrices, parameters: int, steps: int, directions: int) -> tuple[Any, ...]:
        """Return the structure for C, and the arrays to which it points."""
        kept = {name: np.ascontiguousarray(array) for name, array in vars(matrices).items()}
        pointers = {name: self._doubles(array) for name, array in kept.items()}
        turn = self._ffi.from_buffer("long[]", self._turn)
        sizes = {"nv": self._nv, "nz": self._nz, "nl": self._nl, "nh": self._nh, "np": parameters}
        sizes["nown"] = matrices.P.shape[2]
        numbers = {"steps": steps, "directions": directions, "turns": len(self._turn), "turn": turn}
        coefficients = self._doubles(self._coefficients)
        pointers |= {"coefficients": coefficients, "plan": self._plan, "scale": self._scale}
        given = self._ffi.new("eg_steps *", {**sizes, **numbers, **pointers})
        if not self._plan[0] and steps:
            rows = self.rows
            room = self._ffi.new("char[]", rows * rows), self._ffi.new("long[]", 3 * rows), self._room(1)[0]
            self._lib.eomgen_step_plan(given, *room)
        return given, kept, pointers, turn, coefficients

    def _room(self, directions: int) -> tuple[Any, Any]:
        size = self._lib.eomgen_step_room(self._nv, self._nz, self._nl, self._nh, directions)
        return self._ffi.new("double[]", size), self._ffi.new("long[]", self.rows)

    def _doubles(self, array: Array) -> Any:
        return self._ffi.from_buffer("double[]", array)

    def _check(self, done: int, steps: int, times: Array) -> None:
        if done != steps:
            fault = f"the equations of the step to t = {times[done]:.9g} s, made linear, have no solution"
            raise NumericalError(Problem("sensitivities", fault, "a smaller step, or constraints that do not repeat"))
