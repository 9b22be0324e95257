"""All partials of a constrained mechanical system with internal states at one state, and its independent coordinates x
and velocities y of small motions about a moving state.

M da + C dv + K dq + Rz dz + J^T dlam = B du + E dw            dzdot = Fq dq + Fv dv + Fz dz + Fu du + Fw dw
J dv + Z dq = 0,  J da + Av dv + Aq dq = 0                      dy = Yq dq + Yv dv + Ya da + Yz dz + Ylam dlam + Yu
du + Yw dw

    dq = R x,   dv = S y + T x,   da = S ydot + U y + V x,   xdot = N y + W x

x and y are changes of coordinates and velocities that motions are measured by: components of dq and dv themselves, or
velocities w(q, v) of joints between absolute bodies, which have changes P dv + Z dq. Independent ones are
chosen by pivots among the columns of the constraint Jacobian (Wehage and Haug 1982). Neighbouring motions meet the
constraints at all levels, which gives T, U and V without differentiating R in time; with W = 0 they are R', 2 R' and
R''. On groups measured coordinates change with dw - ad(w) x. Constraints at velocity level leave fewer y than x.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from eomgen.base.arrays import Array, Complex
from eomgen.base.data import dataclass
from eomgen.base.rounding import COMPUTED
from eomgen.errors import ModelError, Problem
from eomgen.lie.product import Factor, bracket_matrix

Numbers = TypeVar("Numbers", Array, Complex)


@dataclass(frozen=True)
class Partials:
    """Partials at one state; dq is left-trivialised, dv and da are changes of components.

    Attributes
    ----------
    M, C, K : (nv, nv) of the residual in a, v and q, multipliers held
    B, E : (nv, nu) and (nv, nw): forces by inputs u and by disturbances w
    Rz : (nv, nz) of the residual in internal states
    Fq, Fv, Fz, Fu, Fw : (nz, ...) of the rates of internal states
    Yq, Yv, Ya, Yz, Ylam, Yu, Yw : (ny, ...) of outputs
    J : (rows, nv) constraint Jacobian, the first ``holonomic`` rows at position level, the following rows at velocity
        level
    Z : (rows, nv) partials of the rows' rates in q
    Aq, Av : (rows, nv) partials of the rows' accelerations in q and v
    """

    M: Array
    C: Array
    K: Array
    B: Array
    E: Array
    Rz: Array
    Fq: Array
    Fv: Array
    Fz: Array
    Fu: Array
    Fw: Array
    Yq: Array
    Yv: Array
    Ya: Array
    Yz: Array
    Ylam: Array
    Yu: Array
    Yw: Array
    J: Array
    Z: Array
    Aq: Array
    Av: Array
    holonomic: int = 0

    @staticmethod
    def of(
        blocks: Mapping[str, Array], inputs: int, disturbances: int, outputs: int = 0, holonomic: int = 0
    ) -> Partials:
        """Return partials from named matrices; missing matrices are zero.

        Parameters
        ----------
        blocks : mapping
            Matrices by name; M, C and K (nv, nv) are required.
        inputs, disturbances, outputs : int
            Numbers of their components.
        holonomic : int, optional
            Number of rows of J that are constraints on positions; these come first.
        """
        nv = len(blocks["M"])
        rows = len(blocks["J"]) if "J" in blocks else 0
        nz = blocks["Rz"].shape[1] if "Rz" in blocks else 0
        columns = {"q": nv, "v": nv, "a": nv, "z": nz, "u": inputs, "w": disturbances, "lam": rows}
        shapes = dict.fromkeys("MCK", (nv, nv)) | {"B": (nv, inputs), "E": (nv, disturbances), "Rz": (nv, nz)}
        shapes |= {f"F{letter}": (nz, columns[letter]) for letter in "qvzuw"}
        shapes |= {f"Y{letter}": (outputs, size) for letter, size in columns.items()}
        shapes |= dict.fromkeys(("J", "Z", "Aq", "Av"), (rows, nv))
        partials = {
            name: np.asarray(blocks[name], dtype=float).reshape(shape) if name in blocks else np.zeros(shape)
            for name, shape in shapes.items()
        }
        return Partials(**partials, holonomic=holonomic)


@dataclass(frozen=True)
class Freedom:
    """Matrices of the independent coordinates x and velocities y about a state, as of the equations of this module.

    dq = R x, dv = S y + T x, da = S ydot + U y + V x, xdot = N y + W x.

    Attributes
    ----------
    coordinates, velocities : numbers of the measured components that are independent, increasing
    R : (nv, nx); S : (nv, ny); T : (nv, nx); U : (nv, ny); V : (nv, nx); N : (nx, ny); W : (nx, nx)
    W_rate : (nx, nx), time derivative of W along the reference; only meaningful if nx = ny
    """

    coordinates: tuple[int, ...]
    velocities: tuple[int, ...]
    R: Array
    S: Array
    T: Array
    U: Array
    V: Array
    N: Array
    W: Array
    W_rate: Array

    @property
    def holonomic(self) -> bool:
        """Whether there are as many independent velocities as coordinates."""
        return len(self.coordinates) == len(self.velocities)

    @property
    def unconstrained(self) -> bool:
        """Whether x are changes of all coordinates, and y their rates."""
        still = not any(matrix.any() for matrix in (self.T, self.U, self.V, self.W, self.W_rate))
        return still and all(_is_identity(matrix) for matrix in (self.R, self.S, self.N))


@dataclass(frozen=True)
class Measures:
    """Velocities w(q, v), the measures of motions, at one state; n components.

    Attributes
    ----------
    factors : the groups of the configuration with velocities w
    v, a : (n,) w and the time derivative of w
    P, Z : (n, nv) partials of w in v and in q; w and the first nv - n constraint rows determine v
    Av, Aq : (n, nv) partials of the time derivative in v and in q
    """

    factors: Sequence[Factor]
    v: Array
    a: Array
    P: Array
    Z: Array
    Av: Array
    Aq: Array

    @property
    def are_velocities(self) -> bool:
        """Whether w has the changes of v."""
        return _is_identity(self.P) and not any(matrix.any() for matrix in (self.Z, self.Av, self.Aq))

    @staticmethod
    def components(factors: Sequence[Factor], v: Array, a: Array) -> Measures:
        """Return the components of v as measures."""
        nothing = np.zeros((len(v), len(v)))
        return Measures(factors, v, a, np.eye(len(v)), nothing, nothing, nothing)


def freedom(measures: Measures, partials: Partials, preferred: Sequence[int] = ()) -> Freedom:
    """Return the independent coordinates and velocities about a state, chosen by pivots of the constraint Jacobian.

    Parameters
    ----------
    measures : quantities whose changes are x and y; constraint rows satisfied by the measures come first
    partials : derivatives of the equations, with the rows of the constraints
    preferred : indices of measures that are to be independent, as far as the constraints allow

    Raises
    ------
    ModelError
        Constraint rows depend on each other in this state.
    """
    J, nv = partials.J, len(partials.M)
    if not len(J) and measures.are_velocities:
        every, zero = np.eye(nv), np.zeros((nv, nv))
        names = tuple(range(nv))
        W, W_rate = (-bracket_matrix(measures.factors, w) if w.any() else zero for w in (measures.v, measures.a))
        return Freedom(names, names, every, every, zero, zero, zero, every, W, W_rate)
    count = len(measures.P)
    met = nv - count
    basis = _solve(np.concatenate([J[:met], measures.P]), np.eye(nv)[:, met:])
    rows, holonomic = times(J[met:], basis), partials.holonomic - met
    weight = np.sqrt(np.abs(np.diag(times(basis.T, times(partials.M, basis)))))
    weight[weight == 0.0] = 1.0
    scale = 1.0 / weight  # columns of unit kinetic energy, so that metres and radians compare
    favour = np.ones(count)
    favour[list(preferred)] = 1e-3
    dependent = _pivots(rows[:holonomic] * scale, favour)
    x = _others(range(count), dependent)
    of_x = _null_basis(rows[:holonomic], x)
    at_velocity = rows[holonomic:] @ of_x
    y = _others(x, [x[k] for k in _pivots(at_velocity * scale[x], favour[x])])
    R, S = times(basis, of_x), times(basis, _null_basis(rows, y))
    held = np.concatenate([J, measures.P[y]])

    def solve_rows(of_rows: Array, of_measures: Array) -> Array:
        """Return the X with J X + of_rows = 0 and P X + of_measures = 0, the latter in the rows of y."""
        return _solve(held, -np.concatenate([of_rows, of_measures[y]]))

    T = solve_rows(times(partials.Z, R), times(measures.Z, R))
    U = solve_rows(times(partials.Av, S), times(measures.Av, S))
    V = solve_rows(times(partials.Av, T) + times(partials.Aq, R), times(measures.Av, T) + times(measures.Aq, R))
    turning = bracket_matrix(measures.factors, measures.v)
    measured = times(measures.P, T) + times(measures.Z, R)
    of_R = times(turning, of_x)
    N, W = times(measures.P, S)[x], measured[x] - of_R[x]
    W_rate = np.zeros_like(W)
    if len(x) == len(y):
        R_rate = measured - of_R - times(of_x, W)
        W_rate = -(times(bracket_matrix(measures.factors, measures.a), of_x) + times(turning, R_rate))[x]
    return Freedom(tuple(x), tuple(y), R, S, T, U, V, N, W, W_rate)


def times(left: Array, right: Numbers) -> Numbers:
    """Return the matrix product ``left @ right``, bit for bit, without arithmetic if a factor is simple. Rows or
    columns are moved if each row of a factor has a single 1, as bases of trees have, and the result is zero if a finite
    factor is zero. Products were most of the linear model of a net of cables."""
    if (rows := _ones(left)) is not None:
        return right[rows]
    result: Any = np.zeros((len(left), right.shape[1]), np.result_type(left, right))
    columns = _ones(right)
    if columns is not None and len(np.unique(columns)) == len(columns):
        result[:, columns] = left
    elif (np.any(left) and np.any(right)) or not (np.all(np.isfinite(left)) and np.all(np.isfinite(right))):
        np.matmul(left, right, out=result)
    made: Numbers = result
    return made


def _ones(matrix: Array | Complex) -> NDArray[np.intp] | None:
    """Return the column of the 1 in each row, (rows,), if each row has a single nonzero and it is 1; else None."""
    if not matrix.size or np.count_nonzero(matrix) != len(matrix):
        return None
    columns = np.argmax(matrix == 1.0, axis=1)
    return columns if np.all(matrix[np.arange(len(matrix)), columns] == 1.0) else None


def _is_identity(matrix: Array) -> bool:
    n = len(matrix)
    return matrix.shape == (n, n) and np.count_nonzero(matrix) == n and bool(np.all(np.diagonal(matrix) == 1.0))


def _solve(matrix: Array, right: Array) -> Array:
    """Return matrix^-1 right. Raises ModelError if the matrix has no inverse."""
    if _is_identity(matrix):  # trees, whose measures are their velocities
        return right
    try:
        return np.asarray(np.linalg.solve(matrix, right), dtype=float)
    except np.linalg.LinAlgError:
        raise singular_mechanism() from None


def singular_mechanism() -> ModelError:
    """Return the error for constraint rows that lose rank."""
    fault = "constraints depend on each other in this state, so the independent coordinates are not determined [E0436]"
    return ModelError(Problem("linearization", fault, "a state near by in which the mechanism is not singular"))


def _pivots(matrix: Array, favour: Array) -> list[int]:
    """Return the numbers of the dependent columns, as many as there are rows, by QR decomposition with column pivoting.
    Columns are multiplied by `favour` for the choice: small factors keep columns independent. Raises ModelError if rows
    depend on each other."""
    rows = len(matrix)
    if not rows:
        return []
    sizes = np.linalg.norm(matrix, axis=1, keepdims=True)
    scaled = matrix / np.where(sizes > 0.0, sizes, 1.0)
    if rows > matrix.shape[1] or np.linalg.svd(scaled, compute_uv=False)[-1] <= COMPUTED:
        raise singular_mechanism()
    order = scipy.linalg.qr(scaled * favour, mode="r", pivoting=True)[1]
    return [int(k) for k in order[:rows]]


def _others(every: Sequence[int] | range, without: Sequence[int]) -> list[int]:
    left_out = set(without)
    return [k for k in every if k not in left_out]


def _null_basis(J: Array, free: Sequence[int]) -> Array:
    """Return the basis (n, free) of the null space of J (rows, n) in which the free components are the coordinates."""
    held = _others(range(J.shape[1]), free)
    basis = np.zeros((J.shape[1], len(free)))
    basis[list(free), range(len(free))] = 1.0
    if held:
        basis[held] = -np.linalg.solve(J[:, held], J[:, list(free)])
    return basis
