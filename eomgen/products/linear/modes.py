"""Modes of a state-space matrix: frequency, damping ratio and complex shape, with bounds of their rounding errors, in
balanced units.

An eigenvalue is known to machine precision times the norm of the balanced matrix times its condition 1 / |y^H x|
(Wilkinson 1965). For the double zero of a rigid-body motion it is the square root of the precision.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from eomgen.base.arrays import Array, Complex
from eomgen.base.calls import checked_calls, unknown_attribute
from eomgen.base.data import dataclass
from eomgen.errors import Problem, UsageError
from eomgen.products.linear.freedom import times
from eomgen.products.linear.notebook import modes_html
from eomgen.products.linear.plots import plot_modes


def balance(A: Array, *, permute: bool = True) -> tuple[Array, Array]:
    """Return B = T^-1 A T and T, (n, n) both; T is diagonal, and permuted if ``permute`` is true.

    SciPy converts the scales to whole numbers, too, to find permutations among the scales. Scales above 2^63 are not a
    permutation and are not used, so the warning of SciPy is suppressed.
    """
    with np.errstate(invalid="ignore"):
        balanced, T = scipy.linalg.matrix_balance(A, permute=permute, separate=False)
    return np.asarray(balanced), np.asarray(T)


def restored(T: Array, vectors: Complex) -> Complex:
    """Return T times vectors for the T of ``balance``, which has one number in each row: (n, any)."""
    place = np.argmax(np.abs(T), axis=1)
    result: Complex = vectors[place]
    result *= T[np.arange(len(T)), place][:, np.newaxis]
    return result


#: Rounding errors are this many times the bound's unit.
_MARGIN = 16.0
EPSILON = float(np.finfo(float).eps)


@checked_calls()
@dataclass(frozen=True)
class Modes:
    """One mode for each real eigenvalue and for each conjugate pair, slowest first.

    Attributes
    ----------
    eigenvalues : (n,) complex, 1/s, imaginary parts not negative
    angular_frequency : (n,) |eigenvalue|, rad/s, undamped: of an oscillation that without damping
    frequency : (n,) undamped, |eigenvalue| / 2 pi, Hz; ``damped_frequency`` is of the oscillation as it is seen
    damping_ratio : (n,) -Re / |eigenvalue|: 1 for decay without oscillation, -1 for growth without oscillation, 0 for a
        zero eigenvalue
    uncertainty : (n,) of the eigenvalues by rounding; smaller eigenvalues are zero
    shapes : (nv, n) complex changes of all coordinates, left-trivialised; the largest is 1
    state_shapes : (ns, n) complex, with velocities and internal states, in the same scale
    coordinates : names of the rows of ``shapes``
    weights : (nv,) roots of inertias, which make coordinates of different units comparable
    """

    eigenvalues: Complex
    angular_frequency: Array
    frequency: Array
    damping_ratio: Array
    uncertainty: Array
    shapes: Complex
    state_shapes: Complex
    coordinates: tuple[str, ...]
    weights: Array

    if not TYPE_CHECKING:  # type checkers know the attributes

        def __getattr__(self, name: str) -> object:
            raise unknown_attribute(self, name)

    def __len__(self) -> int:
        return len(self.eigenvalues)

    def __repr__(self) -> str:
        oscillating = [f"{value:.4g}" for value in self.frequency[self.oscillating][:6]]
        more = ", ..." if int(np.sum(self.oscillating)) > len(oscillating) else ""
        heard = f": {', '.join(oscillating)}{more} Hz undamped" if oscillating else ""
        return f"<Modes: {len(self)}, {self.stability}{heard}>"

    def _repr_html_(self) -> str:
        return modes_html(self)

    def plot(self, axes: object = None) -> list[Any]:
        """Draw the shape of each mode (at most 12) and return matplotlib's axes, one for each.

        Parameters
        ----------
        axes : sequence of matplotlib Axes, optional
            One for each mode; a new figure of pyplot if none are given.

        Returns
        -------
        list of matplotlib Axes
            One for each mode.

        Raises
        ------
        UsageError
            Another number of axes than of modes.

        Examples
        --------
        >>> modes = eomgen.build("examples/quarter_car/scene.toml").linearize(t=30.0).modes()
        >>> len(modes.plot())
        2
        """
        return plot_modes(self, axes)

    @property
    def undamped_frequency(self) -> Array:
        """(n,) Undamped frequencies |eigenvalue| / 2 pi, Hz: ``frequency`` by its full name."""
        return self.frequency

    @property
    def damped_frequency(self) -> Array:
        """(n,) Damped frequencies |Im eigenvalue| / 2 pi, Hz: of the oscillation in time; 0 without oscillation."""
        return np.asarray(np.abs(self.eigenvalues.imag) / (2.0 * np.pi))

    @property
    def oscillating(self) -> NDArray[np.bool_]:
        """(n,) Whether a mode oscillates."""
        result: NDArray[np.bool_] = np.abs(self.eigenvalues.imag) > self.uncertainty
        return result

    @property
    def stability(self) -> str:
        """``stable`` if all modes decay, ``unstable`` if one grows, else ``marginal``."""
        growth = self.eigenvalues.real
        if np.any(growth > self.uncertainty):
            return "unstable"
        return "stable" if np.all(growth < -self.uncertainty) else "marginal"

    @property
    def band(self) -> tuple[float, float]:
        """From a tenth of the lowest frequency of a mode that is not zero to ten times the highest, Hz."""
        frequencies = self.frequency[np.abs(self.eigenvalues) > self.uncertainty]
        if not len(frequencies):
            return 0.01, 100.0
        return 0.1 * float(np.min(frequencies)), 10.0 * float(np.max(frequencies))

    def dominant(self, mode: int, count: int = 3) -> list[tuple[str, complex]]:
        """Return the coordinates that take the largest part in a mode.

        Parts are compared by the roots of the kinetic energies of coordinates.

        Parameters
        ----------
        mode : int
            Number of the mode, from 0.
        count : int, optional
            Largest number of coordinates.

        Returns
        -------
        list of tuple of str and complex
            Name and part of each coordinate, the largest first; left-trivialised, 1 for the largest.

        Raises
        ------
        UsageError
            A number of no mode.

        Examples
        --------
        >>> modes = eomgen.build("examples/quarter_car/scene.toml").linearize(t=30.0).modes()
        >>> [name for name, part in modes.dominant(1)]
        ['wheel', 'body']
        """
        if mode not in range(len(self)):
            numbers = f"numbers from 0 to {len(self) - 1}"
            raise UsageError(Problem("mode", f"there is no mode {mode!r} [E0373]", numbers))
        sizes = self.weights * np.abs(self.shapes[:, mode])
        order = np.argsort(-sizes, kind="stable")[:count]
        largest = np.max(sizes, initial=0.0)
        return [(self.coordinates[k], complex(self.shapes[k, mode])) for k in order if sizes[k] > 0.05 * largest]


#: States up to which a matrix is not searched for parts that are not coupled.
_FEW = 40


def _decomposed(A: Array) -> tuple[Complex, Complex, Array]:
    """Return the eigenvalues (n,) of A, the right eigenvectors (n, n), and |y^H x| of the eigenvectors (n,).

    Parts of A that are not coupled are decomposed each, and equal ones once: bending in two planes, bodies that turn
    freely. The work grows with the cube of the number of states.
    """
    parts = _uncoupled(A)
    values, vectors, cosines = np.zeros(len(A), complex), np.zeros(A.shape, complex), np.zeros(len(A))
    known: dict[bytes, tuple[Complex, Complex, Array]] = {}
    for part in parts:
        block = np.ascontiguousarray(A[np.ix_(part, part)]) if len(parts) > 1 else A
        content = block.tobytes() if len(parts) > 1 else b""
        if content not in known:
            known[content] = eigenvectors(block)
        values[part], vectors[np.ix_(part, part)], cosines[part] = known[content]
    return values, vectors, cosines


def eigenvectors(A: Array) -> tuple[Complex, Complex, Array]:
    """Return the eigenvalues (n,) of A, the right eigenvectors (n, n), and |y^H x| of the eigenvectors (n,)."""
    solution: Any = scipy.linalg.eig(A, left=True, right=True)  # the stubs know of one kind of vectors only
    values, left, right = solution
    return values, right, np.abs(np.sum(left.conj() * right, axis=0))


def _uncoupled(A: Array) -> list[NDArray[np.intp]]:
    """Return the numbers of the states of each part of A that is not coupled to others, in their order."""
    if len(A) > _FEW:
        coupled = A != 0.0
        reached = coupled[np.argmax(coupled.sum(axis=1))]
        for _ in range(2):
            reached = reached | coupled[reached].any(axis=0)
        if reached.all():
            return [np.arange(len(A))]
        from scipy.sparse import csr_array  # noqa: PLC0415  # of long models only
        from scipy.sparse.csgraph import connected_components  # noqa: PLC0415

        count, labels = connected_components(csr_array(coupled), directed=False)
        if count > 1:
            return np.split(np.argsort(labels, kind="stable"), np.cumsum(np.bincount(labels))[:-1])
    return [np.arange(len(A))]


def modes(A: Array, of_coordinates: Array, coordinates: Sequence[str], inertias: Array) -> Modes:
    """Return the modes of sdot = A s.

    Parameters
    ----------
    of_coordinates : (nv, ns), dq = of_coordinates s
    coordinates : names of the components of dq
    inertias : (nv,) diagonal of the inertia matrix
    """
    if not len(A):
        empty = np.zeros((len(coordinates), 0), complex)
        weights = np.sqrt(np.abs(inertias))
        return modes_of(
            np.zeros(0, complex), np.zeros(0), empty, np.zeros((0, 0), complex), tuple(coordinates), weights
        )
    balanced, back = balance(A)
    values, right, cosines = _decomposed(balanced)
    uncertainty = uncertainties(float(np.linalg.norm(balanced)), cosines)
    kept = ordered(values, uncertainty)
    kept = kept[values[kept].imag >= 0.0]
    original = restored(back, right[:, kept])
    shapes = times(of_coordinates, original)
    largest = np.argmax(np.abs(shapes), axis=0)
    of_largest = shapes[largest, np.arange(len(kept))]
    states = original[np.argmax(np.abs(original), axis=0), np.arange(len(kept))]
    # modes of internal states do not move bodies
    unit = np.where(np.abs(of_largest) > 1e-9 * np.abs(states), of_largest, states)
    weights = np.sqrt(np.abs(inertias))
    return modes_of(values[kept], uncertainty[kept], shapes / unit, original / unit, tuple(coordinates), weights)


def modes_of(
    values: Complex,
    uncertainty: Array,
    shapes: Complex,
    state_shapes: Complex,
    coordinates: tuple[str, ...],
    weights: Array,
) -> Modes:
    """Return modes with the frequencies and damping ratios of their eigenvalues."""
    size = np.abs(values)
    zero = size <= uncertainty
    ratio = np.where(zero, 0.0, -values.real / np.where(zero, 1.0, size))
    frequency = size / (2.0 * np.pi)
    return Modes(values, size, frequency, ratio, uncertainty, shapes, state_shapes, coordinates, weights)


def uncertainties(norm: float, cosines: Array) -> Array:
    """Return the rounding errors of the eigenvalues of a matrix of a norm, by |y^H x| of the eigenvectors, (n,)."""
    with np.errstate(divide="ignore", over="ignore"):
        condition = np.minimum(1.0 / cosines, 1.0 / np.sqrt(EPSILON))
    return np.asarray(_MARGIN * EPSILON * norm * condition)


def ordered(values: Complex, uncertainty: Array) -> NDArray[np.intp]:
    """Return the order of eigenvalues: zeros first, then by size, equal ones by decay."""
    first = np.argsort(np.abs(values), kind="stable")
    sizes = np.abs(values[first])
    sizes = np.where(sizes <= uncertainty[first], 0.0, [round(size, 12) for size in sizes.tolist()])
    return np.asarray(first[np.lexsort((values[first].real, sizes))])
