"""Passes of time-discontinuous Galerkin steps in C: taken again at the steps of a part, tangents and adjoints through
them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from eomgen.base.arrays import Array
from eomgen.compiled.functions import Functions
from eomgen.errors import NumericalError, Problem
from eomgen.integrators.families.family import LinearPasses
from eomgen.lie import numeric
from eomgen.lie.groups import group_named
from eomgen.lie.product import Factor
from eomgen.products.derivatives.linear_steps import routine
from eomgen.simulation.stepping.stepper import Stepper
from eomgen.toolchain.large_stack import with_stack

_FILES = tuple(f"discontinuous_galerkin/{name}.c" for name in ("passes", "tangents", "adjoints"))
_CDEF = """\
typedef struct eg_curvature {
    void *call;
    int function;
    long inputs;
    const double **input;
    const long *of_step;
    const long *strides;
    long weights, direction;
    long weighted, moved;
    double *room;
} eg_curvature;
typedef struct eg_passes {
    long nv, nz, np;
    long nodes, passes, refined;
    long first;
    long steps, directions;
    long turns;
    const long *turn;
    double step, gain;
    const double *first_integral, *integral, *modes, *values, *derivative;
    const double *Jq0, *Jv0, *Ja0, *Jz0;
    const double *T0;
    double *S;
    double *scales;
    long *pivot;
    const double *Jq, *Jv, *Ja, *Jz, *P;
    const double *A, *T;
    const double *rate, *rate_along;
    const double *T0_along;
    const double *along;
    const double *brackets;
} eg_passes;
int eomgen_passes_run(void *run, const double *parameters, const double *settings, double *state, double *workspace,
    long steps, const double *table, long of_step, const double *kept, long size, double *memory, double *record,
    long row);
long eomgen_passes_begin(const eg_passes *g, double *room);
void eomgen_passes_refine(const eg_passes *g, double *missing, double *accelerations, double *along, double *before,
    double *room);
void eomgen_passes_correct(const eg_passes *g, long pass, const double *f, const double *rates, double *theta,
    double *w, double *y, double *along, double *before, double *room);
long eomgen_passes_tangent_room(const eg_passes *g);
long eomgen_passes_tangents(const eg_passes *g, const eg_curvature *by, const double *dp, const double *rest,
    long rest_of_step, double *state, double *ends, double *room);
long eomgen_passes_adjoint_room(const eg_passes *g);
long eomgen_passes_adjoints(const eg_passes *g, const eg_curvature *by, const double *direct, double *state,
    double *multipliers, double *rest, double *room);
"""


class Curvature(NamedTuple):
    """Evaluates second derivatives of the equations at the starts of steps.

    Attributes
    ----------
    functions : which have ``second_partials``
    values : input blocks at the starts, but weights and direction
    """

    functions: Functions
    values: dict[str, Array]


class GalerkinSweeps:
    """The compiled passes of a number of steps.

    Parameters
    ----------
    sizes : nv, nz, and the number of parameters
    first : points of the first pass
    dtype : of all arrays, float64 or complex128
    """

    def __init__(
        self,
        method: LinearPasses,
        factors: Sequence[Factor],
        sizes: tuple[int, int, int],
        steps: int,
        step: float,
        first: int,
        dtype: Any,
    ) -> None:
        self._in_complex = np.dtype(dtype).kind == "c"
        self.dtype, self._steps, self._method = dtype, steps, method
        self._ffi, self._lib = routine(_FILES, _CDEF, in_complex=self._in_complex)
        self._nv, self._nz, parameters = sizes
        self.rows, self.width, nodes = self._nv + self._nz, 3 * self._nv + self._nz, len(method.nodes)
        turning = [factor for factor in factors if factor.group != "R"]
        later = method.passes - 1
        #: Number of pairs, first pair of each pass, and number of points.
        self.of_pass = (3 if method.refined else 1) * nodes
        self.pairs = nodes + later * self.of_pass
        self.points = first + later * (2 if method.refined else 1) * nodes
        self._kept: dict[str, Any] = {}
        self._given = self._ffi.new(
            "eg_passes *",
            {
                **{"nv": self._nv, "nz": self._nz, "np": parameters, "steps": steps, "turns": len(turning)},
                **{"nodes": nodes, "passes": method.passes, "refined": int(method.refined), "first": first},
                **{"step": step, "gain": method.gamma * step},
            },
        )
        turn = np.array([[factor.v_start, factor.v_size] for factor in turning], dtype=np.dtype("l")).reshape(-1, 2)
        names = {"first_integral": "first", "integral": "later", "modes": "modes", "values": "values"}
        tables = {name: np.array(getattr(method, of), float) for name, of in names.items()}
        tables["derivative"] = np.array(method.derivative, float)
        tables["brackets"] = np.concatenate([np.zeros(0), *map(_brackets, turning)])
        for name, table in tables.items():
            self._point(name, table, own=np.float64)
        self._kept["turn"] = turn
        self._given.turn = self._ffi.from_buffer("long[]", turn)
        self._pivot = np.zeros((steps, self.rows), dtype=np.dtype("l"))
        self._given.pivot = self._ffi.from_buffer("long[]", self._pivot)
        self._point("S", np.empty((steps, self.rows, self.rows), dtype))
        self._point("scales", np.empty((steps, 2, self.rows), dtype))
        self.along = np.zeros((self.pairs, steps, self.width), dtype)
        self._point("along", self.along)

    def begin(self, times: Array, **starts: Array) -> None:
        """Factor the matrices of the steps, which begin at ``times``.

        Parameters
        ----------
        starts : Jq0, Jv0, Ja0, Jz0 and T0

        Raises
        ------
        NumericalError
            A matrix is singular.
        """
        for name, array in starts.items():
            self._point(name, array)
        done = self._lib.eomgen_passes_begin(self._given, self._room((self.rows + 1) * self._nv))
        if done < self._steps:
            fault = f"the equations of the step from t = {times[done]:.9g} s, made linear, have no solution [E0578]"
            raise NumericalError(Problem("sensitivities", fault, "a smaller step"))

    def refine(self, number: int, missing: Array, accelerations: Array, before: Array) -> None:
        """Correct accelerations of nodes (nodes, steps, nv) by the factors of the steps; ``missing``, the residuals at
        the nodes, become the forces of inertia of the corrections.

        Parameters
        ----------
        before : (pairs, steps, nv), whose entries of the pass are filled
        """
        first = self._first_pair(number)
        arrays = map(self._doubles, (missing, accelerations, self.along[first:], before[first:]))
        self._lib.eomgen_passes_refine(self._given, *arrays, self._room(self.rows + self._nv))

    def correct(self, number: int, f: Array, rates: Array, changes: tuple[Array, Array, Array], before: Array) -> None:
        """Take the corrections of a pass, by which ``changes`` of theta, v and z at the nodes are moved."""
        first = self._first_pair(number) + (self.of_pass - len(changes[0]) if number else 0)
        arrays = map(self._doubles, (f, rates, *changes, self.along[first:], before[first:]))
        self._lib.eomgen_passes_correct(self._given, number, *arrays, self._room(4 * self.rows + 2 * self._nv))

    def linear(self, **matrices: Array) -> None:
        """Hand over matrices of the steps by name in C."""
        for name, array in matrices.items():
            self._point(name, array)

    def tangents(self, dp: Array, rest: Array, state: Array, curvature: Curvature) -> Array:
        """Take tangents through the steps: ``state`` (size, directions) becomes the tangent at the end of the steps.

        Parameters
        ----------
        rest : (1 or steps, size, directions)
            Motions after z of second derivatives at the starts: multipliers of constraints, parameters, inputs.

        Returns
        -------
        (steps, size, directions)
        """
        self._given.directions = state.shape[1]
        by, kept, stack = self._curvature(curvature, self.pairs * self.rows)
        ends = np.empty((self._steps, *state.shape), self.dtype)
        room = self._room(self._lib.eomgen_passes_tangent_room(self._given))
        of_parameters, of_rest = (np.ascontiguousarray(array, self.dtype) for array in (dp, rest))
        of_step = of_rest[0].size if len(of_rest) > 1 else 0
        given = self._given, by, self._doubles(of_parameters), self._doubles(of_rest), of_step
        self._call("eomgen_passes_tangents", stack, *given, self._doubles(state), self._doubles(ends), room)
        del kept  # arrays that C had pointers to
        return ends

    def adjoints(self, direct: Array, state: Array, curvature: Curvature) -> tuple[Array, Array]:
        """Take adjoints back through the steps: ``state`` (size, functionals) becomes the adjoint at the start of the
        steps.

        Parameters
        ----------
        direct : (steps, size, functionals), derivatives of functionals by the ends of steps

        Returns
        -------
        multipliers : (points, steps, rows, functionals)
        rest : (steps, size, functionals)
            Parts of multipliers of constraints, parameters and inputs in second derivatives at the starts.
        """
        count = state.shape[1]
        self._given.directions = count
        by, kept, stack = self._curvature(curvature, count * min(self.pairs, self.rows))
        multipliers = np.zeros((self.points, self._steps, self.rows, count), self.dtype)
        rest = np.empty((self._steps, int(by.moved) - self.width, count), self.dtype)
        room = self._room(self._lib.eomgen_passes_adjoint_room(self._given))
        direct = np.ascontiguousarray(direct, self.dtype)
        arrays = map(self._doubles, (direct, state, multipliers, rest))
        self._call("eomgen_passes_adjoints", stack, self._given, by, *arrays, room)
        del kept  # arrays that C had pointers to
        return multipliers, rest

    def _call(self, name: str, stack: int, *arguments: Any) -> None:
        if getattr(with_stack(self._lib, stack), name)(*arguments) != self._steps:
            raise MemoryError("the compiled model could not allocate memory for its arguments")

    def _curvature(self, curvature: Curvature, of_step: int) -> tuple[Any, Any, int]:
        """Return the C structure, the arrays of the pointers, and the stack size of the function.

        Parameters
        ----------
        of_step : samples
        """
        functions, ffi, width = curvature.functions, self._ffi, 2 if self._in_complex else 1
        names = functions.inputs("second_partials")
        arrays = {
            name: np.ascontiguousarray(array, self.dtype) for name, array in curvature.values.items() if name in names
        }
        weighted, moved = functions.sizes["weights"], functions.sizes["direction"]
        samples = {"weights": weighted, "direction": moved}
        some = {"weights": np.ones((self._steps, weighted)), "direction": np.ones((self._steps, moved))}
        library = functions.fastest("second_partials", {**arrays, **some}, of_step * self._steps)
        pointers = [self._doubles(arrays[name]) if name in arrays else ffi.NULL for name in names]
        moves = [width * arrays[name].size // self._steps if name in arrays and name != "p" else 0 for name in names]
        kept = (
            *(arrays, ffi.new("double *[]", pointers), ffi.new("long[]", moves)),
            ffi.new("long[]", [width * samples.get(name, 0) for name in names]),
            self._room(max(of_step, self.rows) * (weighted + 2 * moved) + self.rows),
        )
        given = {
            **{"call": ffi.cast("void *", library.address("eomgen_call")), "inputs": len(names)},
            **{"function": library.index["second_partials"], "input": kept[1], "of_step": kept[2], "strides": kept[3]},
            **{"weights": names.index("weights"), "direction": names.index("direction"), "room": kept[4]},
            **{"weighted": weighted, "moved": moved},
        }
        return ffi.new("eg_curvature *", given), kept, int(library.layout.get("stack", 0))

    def _first_pair(self, number: int) -> int:
        return len(self._method.nodes) + (number - 1) * self.of_pass if number else 0

    def _point(self, name: str, array: Array, own: Any = None) -> None:
        self._kept[name] = array = np.ascontiguousarray(array, own or self.dtype)
        setattr(self._given, name, self._doubles(array))

    def _room(self, size: int) -> Any:
        return self._doubles(np.empty(size, self.dtype))

    def _doubles(self, array: Array) -> Any:
        return self._ffi.from_buffer("double[]", array)


def steps_with_memory(stepper: Stepper, steps: int, table: Array | None, kept: str, record: Array) -> tuple[int, Array]:
    """Take steps one by one, fill the rows, and return the last status and the state at the start of each step, (steps,
    size)."""
    ffi, lib = routine(_FILES, _CDEF)
    begun = stepper.state[stepper.places[kept]]
    memory = np.empty((steps, len(begun)))
    doubles = [
        ffi.from_buffer("double[]", array)
        for array in (stepper.parameters, stepper.settings, stepper.state, stepper.workspace)
    ]
    given, of_step = ffi.NULL, 0
    if table is not None:
        table = np.ascontiguousarray(table)
        given, of_step = ffi.from_buffer("double[]", table), (len(stepper.input_times) - 1) * table.shape[1]
    run = ffi.cast("void *", stepper.library.address("eomgen_run"))
    places = (ffi.from_buffer("double[]", array) for array in (begun, memory, record))
    began, kept_memory, rows = places
    called = with_stack(lib, int(stepper.layout.get("stack", 0))).eomgen_passes_run
    status = called(run, *doubles, steps, given, of_step, began, len(begun), kept_memory, rows, stepper.sizes["row"])
    return int(status), memory


def _brackets(factor: Factor) -> Array:
    """Return ad of the unit velocities of a factor, (size^3,)."""
    group = group_named(factor.group, factor.v_size)
    return numeric.bracket_matrix(group, np.eye(factor.v_size)).ravel()
