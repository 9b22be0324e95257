"""Linearised steps of generalized-alpha in C: tangents and adjoints through a part of a run; the C of sweeps is
compiled once for all models."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.files import template_folder
from eomgen.errors import NumericalError, Problem
from eomgen.lie.product import Factor
from eomgen.toolchain.builder import Builder

#: Steps side by side in C.
_LANES = 8
#: Files of ``templates/derivatives`` in an order in which each reads the earlier ones alone; the first has the
#: declarations.
_FILES = (
    "steps.h", "algebra.c", "sparse_factors.c", "generalized_alpha.c", "step_plan.c", "step_matrices.c",
    "step_factors.c", "step_reactions.c", "step_rotations.c", "step_tangents.c", "step_adjoints.c",
)  # fmt: skip  # in order


@functools.cache
def _routine() -> tuple[Any, Any]:
    """Return ``ffi`` and ``lib`` of the files, compiled once for all models."""
    texts = [(template_folder() / "derivatives" / name).read_text(encoding="utf-8") for name in _FILES]
    return Builder().build_routine("\n".join(texts), texts[0])


#: Groups of rotating factors in the order of the C.
_GROUPS = ("SO3", "R3xSO3", "SE3")
#: Matrices of a step in the order of the C.
_BLOCKS = (
    "Rq", "Fq", "Hq", "Zq", "Rv", "Fv", "Zv", "Ra", "Rz", "Fz", "L", "T", "G",
    "Rp", "Fp", "Hp", "Zp", "N", "Np", "reaction",
)  # fmt: skip  # in order


#: Matrices of linearised steps by name, (steps, rows, columns) each, as ``templates/derivatives/generalized_alpha.c``
#: says. First letters: R, residual; F, minus rates of internal states; H, constraints on positions with multipliers at
#: velocity level; Z, rates of constraints. Second letters: q, v, a (vdot), z, p (parameters). L: of the residual in
#: multipliers, transposed; A, T (steps, numbers): blocks of the rotating factors concatenated; G: B W at the starts;
#: N, Np: of W B^T eta in q and in the parameters at the starts; reaction: B^T eta, (steps, nv), or (steps, 0).
StepMatrices = Mapping[str, Array]


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
    ffi, lib = _routine()
    count, nh, nv = B.shape
    if B.strides[1:] != (8 * nv, 8) or B.strides[0] % 8:
        B = np.ascontiguousarray(B)
    G, eta, reaction = np.empty((count, nh, nv)), np.empty((count, nh)), np.empty((count, nv))
    W, moved = np.ascontiguousarray(W), np.ascontiguousarray(moved)
    from_start = ffi.cast("const double *", B.ctypes.data)
    pointers = [ffi.cast("double *", array.ctypes.data) for array in (W, moved, G, eta, reaction)]
    room = ffi.from_buffer("double[]", np.empty(_LANES * (nh * nh + 2 * nh * nv + 2 * nh + nv)))
    of_W = pointers[0], nv if W.ndim == 2 else 0
    if lib.eomgen_step_reactions(count, nv, nh, from_start, B.strides[0] // 8, *of_W, *pointers[1:], room) != count:
        fault = "the multipliers of velocities in a step are not unique: constraints repeat each other [E0585]"
        raise NumericalError(Problem("sensitivities", fault, "constraints that do not repeat"))
    return G, eta, reaction


def turning(factors: Sequence[Factor], increments: Array) -> tuple[Array, Array]:
    """Return Ad(exp(-theta)) and T(theta) of the rotating factors at increments (n, nv). Both are (n, numbers), the
    blocks of the factors one after another, row by row."""
    ffi, lib = _routine()
    turn, kinds = turning_factors(factors)
    theta, numbers = np.ascontiguousarray(increments), int(np.sum(turn[:, 1] ** 2))
    A, T = (np.empty((len(theta), numbers)) for _ in range(2))
    of_longs = (ffi.from_buffer("long[]", array) for array in (turn, kinds))
    of_doubles = (ffi.from_buffer("double[]", array) for array in (theta, A, T))
    lib.eomgen_step_turning(len(theta), theta.shape[1], len(turn), *of_longs, *of_doubles)
    return A, T


def turning_factors(factors: Sequence[Factor]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return first velocity component and size of each rotating factor, and the number of its group in C."""
    rotating, long = [factor for factor in factors if factor.group != "R"], np.dtype("l")
    turn = np.array([[factor.v_start, factor.v_size] for factor in rotating], long).reshape(-1, 2)
    return turn, np.array([_GROUPS.index(factor.group) for factor in rotating], long)


class LinearSteps:
    """The compiled linearised steps of a run: tangents and adjoints through steps in C.

    Parameters
    ----------
    sizes, factors : of the model
    coefficients : h, alpha_m, alpha_f, beta, gamma, and alpha_m and gamma of equations of first order
    eta : rows of constraints with multipliers at velocity level
    """

    def __init__(
        self, sizes: Mapping[str, int], factors: Sequence[Factor], coefficients: Sequence[float], eta: int
    ) -> None:
        self._ffi, self._lib = _routine()
        self._nv, self._nz, self._nl, self._nh = sizes["v"], sizes["z"], sizes["lam"], eta
        self._turn, _ = turning_factors(factors)
        self._coefficients = np.array(coefficients, dtype=float)
        #: Sums over the nonzeros of the steps so far, and the order of pivots; the first number says whether.
        self._plan = np.zeros(2**13, np.intc)
        self._scale = np.zeros(self.rows)
        self._seen = np.zeros(0, np.uint8)
        self._unseen = np.zeros(0, np.longlong)
        self._memory = np.empty(0)

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
        steps, directions = len(matrices["Rq"]), state.shape[1]
        record, eta = (np.empty((steps, size, directions)) for size in (self.record_size, self._nh))
        arguments = self._arguments(matrices, dp.shape[0], steps, directions)
        room, pivot = self._room(arguments[0])
        arrays = list(map(self._doubles, (np.ascontiguousarray(dp), state, record, eta)))
        while (done := self._lib.eomgen_step_tangents(arguments[0], *arrays, room, pivot)) < 0:
            arguments[0].first = -1 - done
            self._plan_steps(arguments[0])
            room, pivot = self._room(arguments[0])
        self._check(done, steps, times)
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
        steps, directions = len(matrices["Rq"]), state.shape[1]
        multipliers, ends = (np.empty((steps, size, directions)) for size in (self.rows, 2 * self._nv))
        arguments = self._arguments(matrices, gradient.shape[0], steps, directions)
        room, pivot = self._room(arguments[0])
        added = self._ffi.NULL if sources is None else self._doubles(np.ascontiguousarray(sources))
        of_rows, *arrays = map(self._doubles, (np.ascontiguousarray(direct), state, gradient, multipliers, ends))
        while (done := self._lib.eomgen_step_adjoints(arguments[0], of_rows, added, *arrays, room, pivot)) < 0:
            self._plan_steps(arguments[0])
            arguments[0].steps = -done
            room, pivot = self._room(arguments[0])
        self._check(done, int(arguments[0].steps), times)
        return multipliers, ends

    def _arguments(self, matrices: StepMatrices, parameters: int, steps: int, directions: int) -> tuple[Any, ...]:
        """Return the structure for C with a plan for its steps, and the arrays to which it points, which have to be
        kept alive. `parameters`, `steps` and `directions` are numbers."""
        ffi = self._ffi
        arguments = ffi.new("eg_steps *")
        arguments.nv, arguments.nz, arguments.nl, arguments.nh = self._nv, self._nz, self._nl, self._nh
        arguments.np, arguments.nown, arguments.nshared = parameters, matrices["Rp"].shape[2], matrices["Np"].shape[2]
        arguments.steps, arguments.directions, arguments.turns = steps, directions, len(self._turn)
        A, T = np.ascontiguousarray(matrices["A"]), np.ascontiguousarray(matrices["T"])
        turn, coefficients = ffi.from_buffer("long[]", self._turn), self._doubles(self._coefficients)
        arguments.turn, arguments.coefficients = turn, coefficients
        arguments.A, arguments.T = self._doubles(A), self._doubles(T)
        arguments.scale = self._doubles(self._scale)
        for block, name in zip(arguments.block, _BLOCKS, strict=True):
            array = T if name == "T" else matrices[name]
            block.x = ffi.cast("const double *", array.__array_interface__["data"][0])
            strides = [stride // 8 for stride in array.strides]
            if array.ndim == 2:  # a row, or a column
                strides = [strides[0], 0, strides[1]] if name == "T" else [*strides, 0]
            block.step, block.row, block.column = strides
        places = self._lib.eomgen_plan_places(arguments)
        if len(self._seen) != places:
            self._seen, self._unseen = np.zeros(places, np.uint8), np.empty(places, np.longlong)
            self._plan[0] = 0
            self._plan_steps(arguments)
        arguments.plan, arguments.capacity = ffi.from_buffer("int[]", self._plan), len(self._plan)
        arguments.unseen = ffi.from_buffer("long long[]", self._unseen)
        return arguments, matrices, A, T

    def _plan_steps(self, arguments: Any) -> None:
        """Plan the sums over nonzeros and the elimination of steps in C, for the nonzeros of these and all earlier
        steps. The plan's memory grows until it suffices."""
        ffi, lib, rows = self._ffi, self._lib, self.rows
        bits, numbers = np.empty(len(self._seen), np.longlong), np.empty(lib.eomgen_plan_numbers(arguments), np.intc)
        while True:
            arguments.plan, arguments.capacity = ffi.from_buffer("int[]", self._plan), len(self._plan)
            seen, counted = ffi.from_buffer("unsigned char[]", self._seen), ffi.from_buffer("int[]", numbers)
            done = lib.eomgen_step_plan(arguments, seen, ffi.from_buffer("long long[]", bits), counted)
            if done == 1:
                nonzero = ffi.from_buffer("char[]", np.empty(rows * rows, np.uint8))
                room = self._doubles(np.empty(lib.eomgen_plan_room(arguments)))
                done = lib.eomgen_step_order(arguments, counted, nonzero, room)
            if done >= 0:
                self._unseen[:] = np.where(self._seen, 0, -1)
                return
            self._plan = np.zeros(4 * len(self._plan), np.intc)

    def _room(self, arguments: Any) -> tuple[Any, Any]:
        size = self._lib.eomgen_step_room(arguments)
        if len(self._memory) < size:
            self._memory = np.empty(size)
        return self._doubles(self._memory), self._ffi.new("long[]", self.rows)

    def _doubles(self, array: Array) -> Any:
        return self._ffi.from_buffer("double[]", array)

    def _check(self, done: int, steps: int, times: Array) -> None:
        if done != steps:
            fault = f"the equations of the step to t = {times[done]:.9g} s, made linear, have no solution [E0586]"
            raise NumericalError(Problem("sensitivities", fault, "a smaller step, or constraints that do not repeat"))
