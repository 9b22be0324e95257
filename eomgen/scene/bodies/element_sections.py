"""Elements of a beam whose sections vary along it: means over each element.

The load of an element is linear along it by equilibrium, so compliances add up, not stiffnesses: with C = K^-1 of the
strains that a beam has, the mean over the element of C and of its products with the distance from the middle and its
square say how an element gives way, the same means of C D C how it is damped. Masses, their moments and rotary inertia
about the beam's axis add up over each half, which is at one node.

Integrals are sums over Gauss points of the pieces between the knots of tables. Of two and four points, whose errors go
with the second and the fourth power of one number, (I4 - I2)^2/I4 estimates the error of four; pieces with the largest
error are halved. If the integral of a compliance does not exist, because the stiffness vanishes at an end of the beam,
so do the loads there, as stiffness does: the strain is constant then, and stiffnesses add up.
"""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Callable, Iterator, Sequence
from functools import reduce
from typing import cast

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, replace
from eomgen.formula.nodes import ONE, ZERO, Formula, Number
from eomgen.formula.substitution import collect, fold, mean, product, total, weighted_sum
from eomgen.scene.bodies.cosserat import BeamElement, BeamSection, Rows, SectionMoments

#: Returns the section at a place along the beam, 0 to 1; None if a fault was found there.
SectionAt = Callable[[float], BeamSection | None]
#: Returns the value of a formula at the default parameters.
ValueOf = Callable[[Formula], float]


def varying_element(
    element: BeamElement, start: float, whole: float, knots: Sequence[float], section_at: SectionAt, value_of: ValueOf
) -> BeamElement:
    """Return an element with the means of its sections; the element itself if a fault is found.

    Parameters
    ----------
    element : with the section in its middle
    start, whole : x of its first node and length of the beam, m
    knots : in order; s of the places at which sections are not smooth
    """
    length = float(element.length)
    ends = start / whole, (start + length) / whole
    middle = 0.5 * (ends[0] + ends[1])
    places = sorted({*ends, middle, *(knot for knot in knots if ends[0] < knot < ends[1])})
    if (rule := _quadrature(places, section_at, value_of)) is None:
        return element
    parts, diverging = rule
    sections = [section for part in parts for section in part.sections]
    weights = np.concatenate([part.weights for part in parts]).tolist()
    prestrain = tuple(mean(weights, [part.prestrain[s] for part in sections]) for s in range(6))
    distances = [whole * (s - middle) for part in parts for s in part.places]
    halves = [[k for k, distance in enumerate(distances) if (distance > 0.0) == bool(end)] for end in range(2)]
    resistances = [(part.stiffness, part.damping) for part in sections]
    vary = any(pair != resistances[0] for pair in resistances)
    return replace(
        element,
        section=replace(element.section, prestrain=prestrain),
        halves=tuple(
            _with_inertia(element.section, [2.0 * weights[k] for k in half], [sections[k] for k in half])
            for half in halves
        ),
        moments=_moments(weights, distances, length, sections, diverging) if vary else None,
    )


def _with_inertia(section: BeamSection, weights: Sequence[float], sections: Sequence[BeamSection]) -> BeamSection:
    """Return ``section`` with the weighted mean inertia of ``sections``, about their common centre of mass, and the
    stiffness and damping of ``section``."""
    mass = mean(weights, [part.mass_per_length for part in sections])
    center, spread = _center(weights, sections, mass)
    inertias = [(*part.rotary_inertia, *part.products) for part in sections]
    entries = [mean(weights, entry) for entry in zip(*inertias, strict=True)]
    xx, yy, zz, xy, xz, yz = (x if more == ZERO else total(x, more) for x, more in zip(entries, spread, strict=True))
    return replace(
        section, mass_per_length=mass, rotary_inertia=(xx, yy, zz), products=(xy, xz, yz), center_of_mass=center
    )


@dataclass(frozen=True)
class _ElementPart:
    """A part of an element between ``start`` and ``end``, s from 0 to 1 along the beam: places and sections at the
    Gauss points with weights, and for the 87 numbers of a section mean size and error of quadrature."""

    start: float
    end: float
    places: Sequence[float]
    sections: Sequence[BeamSection]
    weights: Array
    size: Array
    error: Array


def _quadrature(
    places: Sequence[float], section_at: SectionAt, value_of: ValueOf
) -> tuple[list[_ElementPart], frozenset[int]] | None:
    """Return a quadrature rule for means over an element whose sections are smooth between ``places``, s in order with
    both ends, and the indices of strains whose compliance has no mean; None if a section has a fault. Parts with the
    largest error are halved up to a relative error of 1e-9."""
    tolerance, finest, most = 1e-9, 2.0**-40, 200
    whole = places[-1] - places[0]
    parts: dict[int, _ElementPart] = {}
    waiting: list[tuple[float, int]] = []
    pieces = list(itertools.pairwise(places))
    count = 0
    while pieces:
        for piece in pieces:
            part = _part(*piece, whole, section_at, value_of)
            if part is None:
                return None
            parts[count] = part
            scale = _scale(np.sum([part.size for part in parts.values()], axis=0))
            heapq.heappush(waiting, (-float(np.max(part.error / scale)), count))
            count += 1
        pieces = []
        while waiting and not pieces and count < most and -sum(error for error, _ in waiting) > tolerance:
            _, number = heapq.heappop(waiting)
            start, end = parts[number].start, parts[number].end
            if end - start > finest * whole:
                del parts[number]
                pieces = [(start, 0.5 * (start + end)), (0.5 * (start + end), end)]
    errors = np.sum([part.error for part in parts.values()], axis=0) / scale
    diverging = frozenset(strain for strain in range(6) if errors[_COMPLIANCE][7 * strain] > tolerance)
    return list(parts.values()), diverging


def _part(start: float, end: float, whole: float, section_at: SectionAt, value_of: ValueOf) -> _ElementPart | None:
    """Return a part of an element with sections at four Gauss points and an estimate of the quadrature error; None if a
    section has a fault. Weights are by ``whole``, the length of the element in s."""
    means = []
    for points in (2, 4):
        nodes, weights = np.polynomial.legendre.leggauss(points)
        share = 0.5 * (end - start) / whole * weights
        places = (0.5 * (start + end) + 0.5 * (end - start) * nodes).tolist()
        sections = []
        for s in places:
            section = section_at(s)
            if section is None:
                return None
            sections.append(section)
        numbers = np.array([_numbers(section, value_of) for section in sections])
        means.append(share @ numbers)
    size = share @ np.abs(numbers)
    error = np.abs(means[1] - means[0])
    return _ElementPart(start, end, places, sections, share, size, error * np.minimum(1.0, error / _scale(size)))


#: Numbers of a section: mass, moments of mass, rotary inertia about the axis, compliance, damping, prestrain.
_MASS, _MOMENTS, _INERTIA = slice(0, 1), slice(1, 3), slice(3, 9)
_COMPLIANCE, _DAMPING, _PRESTRAIN = slice(9, 45), slice(45, 81), slice(81, 87)


def _numbers(section: BeamSection, value_of: ValueOf) -> Array:
    mass, y, z = (value_of(entry) for entry in (section.mass_per_length, *section.center_of_mass))
    inertia = np.array([value_of(entry) for entry in (*section.rotary_inertia, *section.products)])
    inertia += mass * np.array([y * y + z * z, z * z, y * y, 0.0, 0.0, -y * z])
    stiffness, damping = (
        np.array([[value_of(entry) for entry in row] for row in rows]) for rows in (section.stiffness, section.damping)
    )
    prestrain = [value_of(entry) for entry in section.prestrain]
    has = np.ix_(*[np.flatnonzero(np.diagonal(stiffness))] * 2)
    compliance = np.zeros((6, 6))
    compliance[has] = np.linalg.inv(stiffness[has])
    return np.concatenate([[mass, mass * y, mass * z], inertia, compliance.ravel(), damping.ravel(), prestrain])


def _scale(size: Array) -> Array:
    """Return a scale above 0 for each of a section's 87 numbers, from the sizes of numbers of the same kind; 1 if all
    are 0."""
    trace = np.sum(size[_INERTIA][:3])
    result = np.empty_like(size)
    result[_MASS], result[_INERTIA] = size[_MASS], trace
    result[_MOMENTS] = np.sqrt(size[_MASS] * trace)
    for matrix in (_COMPLIANCE, _DAMPING):
        root = np.sqrt(np.diagonal(size[matrix].reshape(6, 6)))
        result[matrix] = np.outer(root, root).ravel()
    result[_PRESTRAIN] = np.repeat([np.linalg.norm(part) for part in np.split(size[_PRESTRAIN], 2)], 3)
    return np.where(result > 0.0, result, 1.0)


def _center(
    weights: Sequence[float], sections: Sequence[BeamSection], mass: Formula
) -> tuple[tuple[Formula, Formula], tuple[Formula, ...]]:
    """Return the common centre of mass (y, z) of weighted sections, m, and the additional inertia (xx, yy, zz, xy, xz,
    yz) that their distances from this centre give. ``mass`` is the mean mass per length."""
    centers = [section.center_of_mass for section in sections]
    if all(center == centers[0] for center in centers):
        return centers[0], (ZERO,) * 6
    masses = [section.mass_per_length for section in sections]
    y, z = (
        collect(
            mean(weights, [product(mass, center[axis]) for mass, center in zip(masses, centers, strict=True)]) / mass
        )
        for axis in range(2)
    )
    off = [(fold(center[0] - y), fold(center[1] - z)) for center in centers]
    along_y, along_z, across = (
        mean(weights, [product(mass, *(pair[axis] for axis in axes)) for mass, pair in zip(masses, off, strict=True)])
        for axes in ((0, 0), (1, 1), (0, 1))
    )
    return (y, z), (total(along_y, along_z), along_z, along_y, ZERO, ZERO, fold(-across))


def _moments(
    weights: Sequence[float],
    distances: Sequence[float],
    length: float,
    sections: Sequence[BeamSection],
    diverging: frozenset[int],
) -> SectionMoments:
    """Return the moments of compliance and damping over an element as formulas, for groups of strains that are coupled
    in some section. ``distances`` are from the middle, m; in groups with ``diverging`` strains, stiffnesses are added
    up instead."""
    rows = [(section.stiffness, section.damping) for section in sections]
    by_power = (np.array(weights) * np.power.outer(np.array(distances), range(3)).T).tolist()
    results = [[[ZERO] * 6 for _ in range(6)] for _ in range(6)]
    for group in _groups([matrix for pair in rows for matrix in pair]):
        blocks = [[[[matrix[row][column] for column in group] for row in group] for matrix in pair] for pair in rows]
        if not diverging.isdisjoint(group):
            blocks = [[_sums(weights, [pair[which] for pair in blocks]) for which in range(2)]]
        if any(matrix[k][k] != ZERO for matrix, _ in rows for k in group):  # else strains that the beam does not have
            for result, block in zip(results, _block_moments(by_power, length, blocks), strict=True):
                for (i, row), (j, column) in itertools.product(enumerate(group), repeat=2):
                    result[row][column] = block[i][j]
    moments = [tuple(map(tuple, matrix)) for matrix in results]
    return SectionMoments((moments[0], moments[1], moments[2]), (moments[3], moments[4], moments[5]))


_Matrix = list[list[Formula]]


def _block_moments(
    weights: Sequence[Sequence[float]], length: float, blocks: Sequence[Sequence[_Matrix]]
) -> Iterator[_Matrix]:
    """Yield the three moments along the element, by powers 0 to 2 of the distance from the middle, of the compliance S
    = K^-1, then of S D S. ``blocks`` are pairs of stiffness K and damping D at the places, ``weights`` has a row for
    each power."""
    if all(pair == blocks[0] for pair in blocks):
        blocks, weights = blocks[:1], [[1.0], [0.0], [length**2 / 12.0]]
    compliances = [_inverse(pair[0]) for pair in blocks]
    rates = [_times(_times(S, pair[1]), S) for S, pair in zip(compliances, blocks, strict=True)]
    for matrices in (compliances, rates):
        yield from (_sums(each, matrices) for each in weights)


def _groups(matrices: Sequence[Rows]) -> list[list[int]]:
    """Return the six strains in groups of indices, so that all matrices are zero between two groups."""
    group_of = list(range(6))
    for matrix in matrices:
        for row in range(6):
            for column in range(6):
                if matrix[row][column] != ZERO and group_of[row] != group_of[column]:
                    group_of = [group_of[row] if group == group_of[column] else group for group in group_of]
    return [[strain for strain in range(6) if group_of[strain] == group] for group in dict.fromkeys(group_of)]


def _sums(weights: Sequence[float], matrices: Sequence[_Matrix]) -> _Matrix:
    return [[weighted_sum(weights, entry) for entry in zip(*rows, strict=True)] for rows in zip(*matrices, strict=True)]


def _times(first: _Matrix, second: _Matrix) -> _Matrix:
    columns = list(zip(*second, strict=True))
    return [[_dot(row, column) for column in columns] for row in first]


def _dot(row: Sequence[Formula], column: Sequence[Formula]) -> Formula:
    pairs = [(a, b) for a, b in zip(row, column, strict=True) if ZERO not in (a, b)]
    return reduce(total, [collect(product(*pair)) for pair in pairs]) if pairs else ZERO


def _inverse(matrix: _Matrix) -> _Matrix:
    """Return the inverse of a positive definite matrix, symmetric to the last digit."""
    size = len(matrix)
    if all(isinstance(entry, Number) for row in matrix for entry in row):
        inverse = np.linalg.inv([[cast("Number", entry).value for entry in row] for row in matrix])
        return [[Number(float(0.5 * (inverse[i, j] + inverse[j, i]))) for j in range(size)] for i in range(size)]
    return _inverse_of_formulas(matrix)


def _inverse_of_formulas(matrix: _Matrix) -> _Matrix:
    size = len(matrix)
    rows = [[*row, *(ONE if i == j else ZERO for j in range(size))] for i, row in enumerate(matrix)]
    for pivot in range(size):
        rows[pivot] = [collect(entry / rows[pivot][pivot]) if entry != ZERO else ZERO for entry in rows[pivot]]
        for k in range(size):
            if k != pivot and (factor := rows[k][pivot]) != ZERO:
                rows[k] = [
                    x if two == ZERO else total(x, product(Number(-1.0), factor, two))
                    for x, two in zip(rows[k], rows[pivot], strict=True)
                ]
    inverse_rows = [row[size:] for row in rows]
    return [[inverse_rows[min(i, j)][max(i, j)] for j in range(size)] for i in range(size)]
