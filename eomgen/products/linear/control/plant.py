"""A linear plant in second-order form, M q'' + C q' + K q = B u, its scaling, and its uncontrollable modes and modes
without cost (Popov, Belevitch and Hautus).

A mode with eigenvalue s is uncontrollable if [s^2 M + s C + K, B] loses rank (A. J. Laub and W. F. Arnold,
Controllability and observability criteria for multivariable linear second-order models, IEEE Transactions on Automatic
Control 29, 1984).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import block_diag, cholesky, solve_triangular

from eomgen.base.arrays import Array, Complex
from eomgen.base.data import dataclass
from eomgen.errors import ModelError, UsageError


def real_matrix(name: str, value: ArrayLike, rows: int, columns: int) -> Array:
    """Return a matrix as finite floats.

    Parameters
    ----------
    name : str
        Name in messages.
    value : array_like
        The matrix.
    rows, columns : int
        Shape that is needed.

    Raises
    ------
    UsageError
        Another shape, or an entry that is not a finite number.
    """
    try:
        matrix = np.array(value, dtype=float)
    except (TypeError, ValueError):
        fault = f"{name} is not a matrix of real numbers [E0392]"
        raise UsageError(fault, f"an array of shape ({rows}, {columns})") from None
    if matrix.shape != (rows, columns):
        raise UsageError(f"{name} has the shape {matrix.shape} [E0393]", f"({rows}, {columns})")
    if not np.all(np.isfinite(matrix)):
        row, column = np.argwhere(~np.isfinite(matrix))[0]
        raise UsageError(f"{name} has an entry [{row}, {column}] that is not finite [E0395]", "finite numbers")
    return matrix


@dataclass(frozen=True)
class Scales:
    """Units in which the motion of a plant has numbers near one.

    Attributes
    ----------
    L : (n, n) lower triangular, M = L L^T; coordinates L^T q have the unit mass matrix.
    rate : float, 1/s. Unit of time is 1/rate, so that stiffness and damping are of the order of one.
    """

    L: Array
    rate: float

    @property
    def state(self) -> Array:
        """(2n, 2n) matrix T, x^ = T [q, v]: x^ = (rate L^T q, L^T v)."""
        return np.asarray(block_diag(self.rate * self.L.T, self.L.T))

    @property
    def state_back(self) -> Array:
        """(2n, 2n) matrix, the inverse of ``state``."""
        inverse = solve_triangular(self.L, np.eye(len(self.L)), lower=True).T
        return np.asarray(block_diag(inverse / self.rate, inverse))


class Plant:
    """A linear second-order model M q'' + C q' + K q = B u with n coordinates and m actuators.

    Parameters
    ----------
    M : (n, n) symmetric, positive definite.
    C, K : (n, n), symmetric or not.
    B : (n, m)
    names : sequence of str, optional
        Of the coordinates, for messages.

    Raises
    ------
    UsageError
        A matrix of another shape, with entries that are not finite, or a mass matrix that no mechanism has.
    """

    def __init__(self, M: ArrayLike, C: ArrayLike, K: ArrayLike, B: ArrayLike, names: Sequence[str] = ()) -> None:
        n = len(np.atleast_1d(np.asarray(M)))
        self.M, self.C, self.K = (real_matrix(name, value, n, n) for name, value in (("M", M), ("C", C), ("K", K)))
        shape = np.shape(B)
        self.B = real_matrix("B", B, n, shape[1] if len(shape) == 2 else 1)
        self.names = tuple(names) or tuple(f"coordinate {k + 1}" for k in range(n))
        if not n or not np.allclose(self.M, self.M.T, rtol=0.0, atol=1e-9 * np.abs(self.M).max()):
            raise UsageError("the mass matrix M is not symmetric [E0396]", "the inertia matrix of a mechanism")
        try:
            self._factor: Array = cholesky((self.M + self.M.T) / 2.0, lower=True)
        except np.linalg.LinAlgError:
            fault = "the mass matrix M is not positive definite [E0397]"
            raise UsageError(fault, "the inertia matrix of a mechanism") from None

    @property
    def n(self) -> int:
        """Number of coordinates."""
        return len(self.M)

    @property
    def m(self) -> int:
        """Number of actuators."""
        return int(self.B.shape[1])

    @cached_property
    def scales(self) -> Scales:
        """Scales that bring the numbers of the plant near one."""
        stiffness, damping = (float(np.linalg.norm(self._congruent(matrix), 2)) for matrix in (self.K, self.C))
        rate = max(stiffness**0.5, damping)
        return Scales(self._factor, rate if rate > 0.0 else 1.0)

    @cached_property
    def scaled_matrices(self) -> tuple[Array, Array, Array]:
        """Stiffness k, damping c (n, n), actuation b (n, m) of q^'' + c q^' + k q^ = b u in the units of ``scales``."""
        rate = self.scales.rate
        b = solve_triangular(self._factor, self.B, lower=True) / rate
        return self._congruent(self.K).T / rate**2, self._congruent(self.C).T / rate, np.asarray(b)

    def _congruent(self, matrix: Array) -> Array:
        """Return the transpose of L^-1 matrix L^-T, M = L L^T."""
        half = solve_triangular(self._factor, matrix, lower=True)
        return np.asarray(solve_triangular(self._factor, half.T, lower=True))

    def state_space(self, G_p: ArrayLike | None = None, G_v: ArrayLike | None = None) -> tuple[Array, Array]:
        """Return A (2n, 2n), B (2n, m) of x' = A x + B u, x = [q, v], closed by u = -G_p q - G_v v if given."""
        n, m = self.n, self.m
        K = self.K if G_p is None else self.K + self.B @ real_matrix("G_p", G_p, m, n)
        C = self.C if G_v is None else self.C + self.B @ real_matrix("G_v", G_v, m, n)
        k, c, b = np.split(np.linalg.solve(self.M, np.hstack([K, C, self.B])), [n, 2 * n], axis=1)
        return first_order(k, c), np.vstack([np.zeros((n, m)), b])

    def eigenvalues(self, G_p: ArrayLike | None = None, G_v: ArrayLike | None = None) -> Complex:
        """Return the 2n eigenvalues, 1/s, slow ones first; with gains, of the closed loop under u = -G_p q - G_v v."""
        k, c, b = self.scaled_matrices
        back = self.scales.state_back
        n, m = self.n, self.m
        if G_p is not None:
            k = k + b @ (real_matrix("G_p", G_p, m, n) @ back[:n, :n])
        if G_v is not None:
            c = c + b @ (real_matrix("G_v", G_v, m, n) @ back[n:, n:])
        values = self.scales.rate * np.linalg.eigvals(first_order(k, c))
        order = np.lexsort((values.imag, values.real, np.round(np.abs(values), 12)))
        return np.asarray(values[order], dtype=complex)


def first_order(k: Array, c: Array) -> Array:
    """Return the state matrix (2n, 2n) of q'' + c q' + k q = 0."""
    return np.block([[np.zeros_like(k), np.eye(len(k))], [-k, -c]])


#: Distance from the imaginary axis, as a share of the plant's rate, up to which an eigenvalue counts as on the axis: a
#: double eigenvalue at zero is accurate to half of the digits only.
_ON_AXIS = 1e-7
#: A singular value below this share of the largest is none.
_RANK = 1e-9


def check_stabilisable(plant: Plant) -> None:
    """Raise ModelError if actuators do not reach a mode that does not decay; the message names the fastest growing
    one."""
    lost = [(value, shape) for value, shape, reach in _modes_with_reach(plant) if reach < _RANK]
    lost = [(value, shape) for value, shape in lost if value.real > -_ON_AXIS * plant.scales.rate]
    if lost:
        value, shape = max(lost, key=lambda mode: mode[0].real)
        fault = f"{describe_mode(plant, value, shape)} cannot be stabilised: no actuator moves it [E0378]"
        raise ModelError(fault, "an actuator that works on it, or a spring and a damper that hold it")


def check_controllable(plant: Plant) -> None:
    """Raise ModelError if a mode is out of the actuators' reach, decaying or not."""
    for value, shape, reach in _modes_with_reach(plant):
        if reach < _RANK:
            fault = f"{describe_mode(plant, value, shape)} cannot be placed: no actuator moves it [E0379]"
            raise ModelError(fault, "an actuator that works on it, or a method that leaves it as it is (lqr)")


def check_detectable(plant: Plant, A: Array, root: Array) -> None:
    """Raise ModelError if a mode on the imaginary axis has no cost: optimal control would leave the mode there.

    Parameters
    ----------
    A : (2n, 2n) state matrix in the units of ``plant.scales``, cross terms of the cost taken off.
    root : (r, 2n) with root^T root the weight of the state in these units.
    """
    n = plant.n
    norm = float(np.linalg.norm(root, 2)) if root.size else 0.0
    unit = root / norm if norm > 0.0 else np.zeros((1, 2 * n))
    for value in distinct(np.linalg.eigvals(A)):
        if abs(value.real) > _ON_AXIS:
            continue
        at = 1j * value.imag
        stacked = np.vstack([at * np.eye(2 * n) - A, unit])
        _, singular, right = np.linalg.svd(stacked)
        if singular[-1] < math.sqrt(_RANK):
            shape = right[-1].conj()[:n]
            shape = shape if np.linalg.norm(shape) > _RANK else right[-1].conj()[n:]
            physical = plant.scales.state_back[:n, :n] @ shape
            mode = describe_mode(plant, plant.scales.rate * at, physical)
            fault = f"{mode} has zero weight, so optimal control would leave it as it is [E0399]"
            raise ModelError(fault, "a weight on a coordinate or a velocity that it moves")


def _modes_with_reach(plant: Plant) -> Iterator[tuple[complex, Complex, float]]:
    """Yield each distinct eigenvalue in 1/s, the left mode shape (n,), and the reach of actuators. The reach is the
    least singular value of the test matrix of Popov, Belevitch and Hautus in scaled units: 0 for an uncontrollable
    mode."""
    k, c, b = plant.scaled_matrices
    norm = float(np.linalg.norm(b, 2)) if b.size else 0.0
    unit = b / norm if norm > 0.0 else np.zeros((plant.n, 1))
    back = plant.scales.state_back[: plant.n, : plant.n]
    for value in distinct(np.linalg.eigvals(first_order(k, c))):
        dynamic = value**2 * np.eye(plant.n) + value * c + k
        reach = float(np.linalg.svd(np.hstack([dynamic, unit]), compute_uv=False)[-1])
        left = np.linalg.svd(np.hstack([dynamic, unit]))[0][:, -1]
        yield plant.scales.rate * value, back @ left.conj(), reach / max(1.0, abs(value) ** 2)


def distinct(values: ArrayLike) -> list[complex]:
    """Return eigenvalues without repetitions, by increasing magnitude. Kept are one of each conjugate pair, with a
    positive imaginary part, and one of each group of equal eigenvalues."""
    distinct: list[complex] = []
    for value in sorted(map(complex, np.asarray(values)), key=lambda value: (round(abs(value), 9), -value.imag)):
        near = math.sqrt(np.finfo(float).eps) * max(1.0, abs(value))
        if value.imag >= -near and all(abs(value - known) > near for known in distinct):
            distinct.append(value)
    return distinct


def describe_mode(plant: Plant, value: complex, shape: Complex) -> str:
    """Return a mode in words: frequency, growth, and the coordinates of largest motion."""
    size = np.abs(shape) * np.sqrt(np.diag(plant.M))
    order = np.argsort(-size)[:2]
    movers = [plant.names[k] for k in order if size[k] > 0.3 * size[order[0]]] if size.max() > 0.0 else []
    return in_words(value, movers, _ON_AXIS * plant.scales.rate)


def in_words(value: complex, movers: Sequence[str], axis: float) -> str:
    """Return a description of a mode by its eigenvalue, 1/s, and the names of the moving coordinates (empty if
    unknown). Real and imaginary parts below ``axis``, 1/s, count as zero."""
    where = f" of {' and '.join(movers)}" if movers else ""
    if abs(value) <= axis:
        return f"the mode{where} at 0 Hz, which nothing holds,"
    if abs(value.imag) <= axis:
        trend = "grows" if value.real > 0.0 else "decays"
        return f"the mode{where} that {trend} at {abs(value.real):.4g} 1/s without oscillating"
    frequency = abs(value.imag) / (2.0 * math.pi)
    if value.real > axis:
        return f"the mode{where} at {frequency:.4g} Hz, which grows at {value.real:.4g} 1/s,"
    damping = f"decays at {-value.real:.4g} 1/s" if value.real < -axis else "is not damped"
    return f"the mode{where} at {frequency:.4g} Hz, which {damping},"
