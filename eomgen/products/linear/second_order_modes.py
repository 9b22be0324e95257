"""Modes of M x'' + C x' + K x = 0 with many coordinates, part by part.

Coordinates that are not coupled are decomposed each by itself, equal parts once. A large part with symmetric M and K is
written in the modes that it has without damping: K becomes diagonal, and with proportional damping (Caughey and
O'Kelly, J. Appl. Mech. 32 (1965) 583) so does C. If damping couples some of these modes only, as within the modes of
one symmetry of a structure, smaller matrices remain; entries of C that are rounding of the transformation do not
couple. The change of basis is orthogonal in the metric of M, so errors are as small as in a decomposition of the whole
matrix.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from eomgen.base.arrays import Array, Complex
from eomgen.base.data import dataclass
from eomgen.products.linear.eigenvalues import (
    EPSILON,
    MARGIN,
    balance,
    eigenvectors,
    norm,
    order_of_eigenvalues,
    part_labels,
    unbalance,
    uncertainties,
)
from eomgen.products.linear.modes import Modes, modes_of

#: Coordinates from which on models are taken by parts; a part of a fifth of them and less is decomposed as a whole.
MANY = 100
Numbers = NDArray[np.intp]


@dataclass(frozen=True)
class _UncoupledModes:
    """Modes of coordinates that are not coupled to others, with imaginary parts that are not negative.

    Attributes
    ----------
    values : (n,)
    vectors : (coordinates, n) changes of the coordinates
    uncertainty : (n,) rounding errors of the values
    """

    values: Complex
    vectors: Complex
    uncertainty: Array


def second_order_modes(M: Array, C: Array, K: Array, coordinates: Sequence[str]) -> Modes:
    """Return the modes of M x'' + C x' + K x = 0, slowest first, by parts that are not coupled.

    Parameters
    ----------
    M, C, K : (n, n), M regular
    coordinates : names of the components of x
    """
    n, parts = len(M), list(_parts(M, C, K))
    values, uncertainty = (
        np.concatenate([np.tile(getattr(part, name), len(places)) for places, part in parts])
        for name in ("values", "uncertainty")
    )
    order = order_of_eigenvalues(values, uncertainty)
    columns = np.empty(len(values), np.intp)
    columns[order] = np.arange(len(values))
    states = np.zeros((2 * n, len(values)), complex)
    first = 0
    for places, part in parts:
        last = first + len(places) * len(part.values)
        of_part = columns[first:last].reshape(len(places), 1, -1)
        moves = part.vectors / part.vectors[np.argmax(np.abs(part.vectors), axis=0), np.arange(len(part.values))]
        states[places[:, :, np.newaxis], of_part] = moves
        states[n + places[:, :, np.newaxis], of_part] = moves * part.values
        first = last
    inertias = np.sqrt(np.abs(np.diagonal(M)))
    return modes_of(values[order], uncertainty[order], states[:n], states, tuple(coordinates), inertias)


def _parts(M: Array, C: Array, K: Array) -> Iterator[tuple[Numbers, _UncoupledModes]]:
    """Yield groups of equal uncoupled parts: their coordinates, (parts, size), and the modes of one such part."""
    labels = part_labels((M != 0.0) | (C != 0.0) | (K != 0.0))
    order, sizes = np.argsort(labels, kind="stable"), np.bincount(labels)
    starts = np.cumsum(sizes) - sizes
    for size in np.unique(sizes).tolist():
        places = order[starts[sizes == size][:, np.newaxis] + np.arange(size)]  # (parts, size)
        blocks = [matrix[places[:, :, np.newaxis], places[:, np.newaxis, :]] for matrix in (M, C, K)]
        equal: dict[bytes, list[int]] = {}
        for number, content in enumerate(np.concatenate(blocks, axis=1)):
            equal.setdefault(content.tobytes(), []).append(number)
        for numbers in equal.values():
            yield places[numbers], _decompose(*(block[numbers[0]] for block in blocks))


def _decompose(M: Array, C: Array, K: Array) -> _UncoupledModes:
    """Return the modes of one uncoupled part with the matrices M, C, K (n, n): by its undamped modes if it is large and
    these are few in a group, else by the eigenvectors of the balanced state matrix."""
    if len(M) > MANY // 5 and (part := _by_undamped_modes(M, C, K)) is not None:
        return part
    n = len(M)
    accelerations = np.linalg.solve(M, -np.concatenate([K, C], axis=1))
    balanced, back = balance(np.vstack([np.eye(n, 2 * n, n), accelerations]))
    values, vectors, cosines = eigenvectors(balanced)
    kept = values.imag >= 0.0
    uncertainty = uncertainties(norm(balanced), values, cosines)
    return _UncoupledModes(values[kept], unbalance(back, vectors[:, kept])[:n], uncertainty[kept])


def _by_undamped_modes(M: Array, C: Array, K: Array) -> _UncoupledModes | None:
    """Return the modes of one part by groups of undamped modes that damping couples; None if M or K is not symmetric,
    M not positive definite, or all modes are coupled."""
    diagonal = np.diagonal(M)
    rounding = 0.5 * MARGIN * EPSILON  # smaller entries do not couple modes, and a smaller skew part is none
    if not np.all(diagonal > 0.0):
        return None
    root = 1.0 / np.sqrt(diagonal)  # which makes entries of different units comparable
    inertia, stiffness = (root[:, np.newaxis] * matrix * root for matrix in (M, K))
    for matrix in (inertia, stiffness):
        if not np.linalg.norm(matrix - matrix.T) <= rounding * np.linalg.norm(matrix):
            return None
    stiffness = 0.5 * (stiffness + stiffness.T)
    try:
        point_masses = np.count_nonzero(M) == len(M)
        squares, directions = np.linalg.eigh(stiffness) if point_masses else scipy.linalg.eigh(stiffness, inertia)
    except np.linalg.LinAlgError:  # not positive definite
        return None
    directions = root[:, np.newaxis] * directions
    damping = directions.T @ C @ directions
    pace = float(np.mean(squares**2)) ** 0.25  # which makes the rows of [[0, pace], [-squares/pace, -C]] alike
    if not pace:
        return None
    size = float(np.sqrt(len(M) * pace**2 + np.sum(squares**2) / pace**2 + np.sum(damping**2)))
    groups = _coupled_groups(damping, rounding * size)
    if len(groups) == 1:
        return None
    alone = np.array([group[0] for group in groups if len(group) == 1], np.intp)
    values, numbers, cosines = _single_mode_eigenvalues(squares[alone], damping[alone, alone], pace)
    results = [(values, directions[:, alone[numbers]].astype(complex), cosines)]
    for group in groups:
        if len(group) > 1:
            values, vectors, cosines = _coupled_mode_eigenvalues(squares[group], damping[np.ix_(group, group)], pace)
            results.append((values, directions[:, group] @ vectors, cosines))
    values, vectors, cosines = (np.concatenate(items, axis=-1) for items in zip(*results, strict=True))
    return _UncoupledModes(values, vectors, uncertainties(size, values, cosines))


def _coupled_groups(damping: Array, rounding: float) -> list[Numbers]:
    """Return the numbers of the undamped modes in each group that damping couples. `damping` (n, n) is the modal
    damping matrix; the entries left out have together a norm of `rounding` at most."""
    sizes = np.abs(damping)
    np.fill_diagonal(sizes, 0.0)
    limit = rounding
    while (left := sizes[sizes <= limit]).size and np.linalg.norm(left) > rounding:
        limit *= 0.5
    labels = part_labels(sizes > limit)
    return [np.flatnonzero(labels == label) for label in range(int(labels.max()) + 1)]


def _single_mode_eigenvalues(squares: Array, damping: Array, pace: float) -> tuple[Complex, Numbers, Array]:
    """Return eigenvalues (m,) with imaginary parts that are not negative, numbers (m,) of their modes, and |y^H x|
    (m,). For modes that damping does not couple; `squares` (n,), `damping` (n,) and `pace` as of
    ``_coupled_mode_eigenvalues``."""
    A = np.zeros((len(squares), 2, 2))
    A[:, 0, 1], A[:, 1, 0], A[:, 1, 1] = pace, -squares / pace, -damping
    values, vectors = np.linalg.eig(A)
    cosines = np.abs(np.linalg.det(vectors))  # in the plane y is across the other x
    kept = values.imag >= 0.0
    numbers = np.nonzero(kept)[0]
    return values[kept].astype(complex), numbers, cosines[numbers]


def _coupled_mode_eigenvalues(squares: Array, damping: Array, pace: float) -> tuple[Complex, Complex, Array]:
    """Return eigenvalues (m,) with imaginary parts that are not negative, vectors (n, m) and |y^H x| (m,) of modes that
    damping couples.

    Parameters
    ----------
    squares : (n,) of the angular frequencies without damping, (rad/s)^2
    damping : (n, n), 1/s
    pace : ratio of the units of velocities and coordinates, 1/s
    """
    n = len(squares)
    A = np.block([[np.zeros((n, n)), pace * np.eye(n)], [-np.diag(squares) / pace, -damping]])
    values, vectors, cosines = eigenvectors(A)
    kept = values.imag >= 0.0
    return values[kept], vectors[:n, kept], cosines[kept]
