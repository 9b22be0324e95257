"""Stiffness and damping of a beam element with linear section loads along it, from its section's matrices.

An element has one strain, and would have one wrench. By equilibrium the wrench is W + s ad^T W at the distance s from
its middle, ad being the adjoint of the initial shape's twist by length. It adds to the flexibility of the section,
S^-1, the matrix (l^2/12) ad S^-1 ad^T up to (l kappa)^4: the residual bending flexibility of MacNeal, Comput. Struct.
8 (1978) 175, for curved and twisted beams. (The quadratic part of the wrench cancels with the logarithm's.) With it
small deflections of straight beams by loads on nodes are exact for any number of elements, and large ones far closer;
and however much a section resists shear, its elements bend.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from eomgen.lie.numeric import skew
from eomgen.symbolic.scalar import Algebra, Scalar, dot

Rows = Sequence[Sequence[Scalar]]
_SIX = range(6)


@dataclass(frozen=True)
class ElementStiffness:
    """Stiffness and damping of an element against its strains.

    Attributes
    ----------
    stiffness, damping : (6, 6) each, symmetric, rotations first
    of_section : (6, 6), maps the strain of the element to the strain of the section in its middle
    """

    stiffness: list[list[Scalar]]
    damping: list[list[Scalar]]
    of_section: list[list[Scalar]]


def with_linear_moments(
    algebra: Algebra, stiffness: Rows, damping: Rows, length: float, initial: Sequence[float] = (0, 0, 0, 1, 0, 0)
) -> ElementStiffness:
    """Return stiffness and damping of an element.

    Parameters
    ----------
    stiffness, damping : of sections, (6, 6) each, symmetric, by strains of twist, bending about y and z, stretch, shear
        along y and z; rows of zeros for strains that the beam does not have
    length : m, of the element
    initial : (6,), twist by length of the element in the initial shape of the beam, rotations (1/m) first
    """
    free = [i for i in _SIX if not all(entry.is_zero for entry in stiffness[i])]
    section = _inverse(algebra, stiffness, free)
    along = [[algebra.scalar(entry) for entry in row] for row in _adjoint(initial)]
    share = length**2 / 12.0
    residual = _congruent(section, along)
    flexibility = [[section[i][j] + share * residual[i][j] for j in _SIX] for i in _SIX]
    result = _inverse(algebra, flexibility, free)
    for i in free:
        # 1/(1/x) need not be x.
        if residual[i][i].is_zero and all(stiffness[i][j].is_zero for j in free if j != i):
            result[i][i] = stiffness[i][i]
    of_section = _product(section, result)
    for i in _SIX:
        if i not in free or result[i][i].ref == stiffness[i][i].ref:
            of_section[i][i] = algebra.one
    if all(entry.is_zero for row in damping for entry in row):
        return ElementStiffness(result, [list(row) for row in damping], of_section)
    # Rates of strain in the middle, and s times the rates of its change along the element.
    varying = _product(section, _product(list(zip(*along, strict=True)), result))
    middle, change = _congruent(damping, _transposed(of_section)), _congruent(damping, _transposed(varying))
    damped = [[x + share * y for x, y in zip(*rows, strict=True)] for rows in zip(middle, change, strict=True)]
    return ElementStiffness(result, damped, of_section)


def _adjoint(twist: Sequence[float]) -> np.ndarray:
    """Return ad of a twist, rotations first."""
    turned, shifted = (skew(np.array(part)) for part in (twist[:3], twist[3:]))
    return np.block([[turned, np.zeros((3, 3))], [shifted, turned]])


def _inverse(algebra: Algebra, matrix: Rows, rows: Sequence[int]) -> list[list[Scalar]]:
    """Return the inverse of the given rows and columns of a symmetric positive definite matrix, zero in the others."""
    left = {(i, j): matrix[i][j] for i in rows for j in rows}
    right = {(i, j): algebra.one if i == j else algebra.zero for i in rows for j in rows}
    for pivot in rows:
        over = algebra.one / left[pivot, pivot]
        for i in rows:
            if i == pivot or left[i, pivot].is_zero:
                continue
            factor = left[i, pivot] * over
            for j in rows:
                left[i, j] = left[i, j] - factor * left[pivot, j] if j != pivot else algebra.zero
                right[i, j] = right[i, j] - factor * right[pivot, j]
        for j in rows:
            left[pivot, j], right[pivot, j] = left[pivot, j] * over, right[pivot, j] * over
    return _symmetric([[right.get((i, j), algebra.zero) for j in _SIX] for i in _SIX])


def _product(rows: Rows, others: Rows) -> list[list[Scalar]]:
    return [[dot(row, column) for column in zip(*others, strict=True)] for row in rows]


def _transposed(rows: Rows) -> list[list[Scalar]]:
    return [list(column) for column in zip(*rows, strict=True)]


def _congruent(matrix: Rows, others: Rows) -> list[list[Scalar]]:
    """Return A S A^T of a symmetric S (``matrix``) and A (``others``)."""
    return _symmetric(_product(others, _product(matrix, _transposed(others))))


def _symmetric(rows: Rows) -> list[list[Scalar]]:
    """Return the entries above the diagonal on both sides of it."""
    return [[rows[min(i, j)][max(i, j)] for j in _SIX] for i in _SIX]
