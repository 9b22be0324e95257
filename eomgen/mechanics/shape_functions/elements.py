"""Finite elements of a beam in mpmath numbers with symmetric banded matrices; coordinates are modes of the mesh or
nodal displacements.

Bending has two nodes an element, deflection and slope at each, and cubic Hermite polynomials between; stretch and
torsion have three nodes and quadratic ones. Both are conforming, so squared frequencies come down to the exact ones
with the fourth power of the element's length (G. Strang and G. J. Fix, An Analysis of the Finite Element Method, 1973,
section 6.3).

Rayleigh's quotient iteration starts from SciPy's eigenvectors and triples the digits in every step (B. N.
Parlett, The Symmetric Eigenvalue Problem, 1980, section 4.6). So the result does not depend on the library or the
processor.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import scipy.linalg

from eomgen.base.data import dataclass, replace
from eomgen.mechanics.shape_functions.families import ShapeFunctions, Values
from eomgen.mechanics.shape_functions.fixed_point import BITS, ONE, WORKING, Fixed, array, from_fixed, polynomial, times
from eomgen.mechanics.shape_functions.uniform_beams import Coefficients, differentiate, integrate, on_piece, product
from eomgen.scene.bodies.model import Beam, Deformation


class BandedMatrix:
    """A symmetric matrix of numbers of mpmath; ``rows[i][j]`` is the entry (i, i - j), j up to ``width``."""

    def __init__(self, size: int, width: int) -> None:
        self.rows = [[mpmath.mpf(0)] * (width + 1) for _ in range(size)]
        self.width = width

    def add(self, row: int, column: int, value: Any) -> None:
        """Add a number of mpmath to the entry (row, column), which is on or below the diagonal and within the band:
        0 <= row - column <= width. The entry (column, row) is the same number."""
        self.rows[row][row - column] += value

    def submatrix(self, kept: Sequence[int]) -> BandedMatrix:
        """Return the matrix of the rows and columns ``kept``, in order, with the same width."""
        result = BandedMatrix(len(kept), self.width)
        for new, row in enumerate(kept):
            for column in range(max(0, new - self.width), new + 1):
                if row - kept[column] <= self.width:
                    result.rows[new][new - column] = self.rows[row][row - kept[column]]
        return result

    def apply(self, vector: Sequence[Any]) -> list[Any]:
        """Return the product of the matrix and a vector, a list of mpmath numbers."""
        result = [row[0] * value for row, value in zip(self.rows, vector, strict=True)]
        for k, row in enumerate(self.rows):
            for below in range(1, min(self.width, k) + 1):
                result[k] += row[below] * vector[k - below]
                result[k - below] += row[below] * vector[k]
        return result

    def product(self, left: Sequence[Any], right: Sequence[Any]) -> Any:
        """Return left^T matrix right."""
        return mpmath.fdot(left, self.apply(right))

    def less(self, factor: Any, other: BandedMatrix) -> BandedMatrix:
        """Return the matrix minus ``factor`` times another matrix of the same size and width."""
        result = BandedMatrix(len(self.rows), self.width)
        for k, (mine, theirs) in enumerate(zip(self.rows, other.rows, strict=True)):
            result.rows[k] = [entry - factor * part for entry, part in zip(mine, theirs, strict=True)]
        return result

    def solve(self, right: Sequence[Any]) -> list[Any]:
        """Return the solution x of matrix x = right, by L D L^T without pivoting, in the present precision of mpmath. A
        pivot of 0 is replaced by the unit roundoff."""
        rows, x, size = [list(row) for row in self.rows], list(right), len(self.rows)
        for pivot in range(size):
            below = range(pivot + 1, min(pivot + self.width, size - 1) + 1)
            column = [rows[row][row - pivot] for row in below]
            rows[pivot][0] = rows[pivot][0] or mpmath.eps  # the shift of a mode that has converged to the last digit
            for row, entry in zip(below, column, strict=True):
                factor = entry / rows[pivot][0]
                for k in range(pivot + 1, row + 1):
                    rows[row][row - k] -= factor * column[k - pivot - 1]
                rows[row][row - pivot] = factor
                x[row] -= factor * x[pivot]
        for pivot in reversed(range(size)):
            x[pivot] /= rows[pivot][0]
            for row in range(pivot + 1, min(pivot + self.width, size - 1) + 1):
                x[pivot] -= rows[row][row - pivot] * x[row]
        return x

    def doubles(self) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
        """Return the dense matrix in double precision."""
        result = np.zeros((len(self.rows),) * 2)
        for k, row in enumerate(self.rows):
            for below in range(min(self.width, k) + 1):
                result[k, k - below] = result[k - below, k] = float(row[below])
        return result


def modes(stiffness: BandedMatrix, mass: BandedMatrix, first: int, count: int) -> list[list[Any]]:
    """Return ``count`` eigenvectors of K x = w^2 M x by frequency, from number ``first`` (0 for the lowest), of x^T M x
    = 1. Each is a list of mpmath numbers."""
    wanted = (first, first + count - 1)
    squares, guesses = scipy.linalg.eigh(stiffness.doubles(), mass.doubles(), subset_by_index=wanted)
    shapes = []
    for square, guess in zip(squares, guesses.T, strict=True):
        mode, shift = [mpmath.mpf(float(entry)) for entry in guess], mpmath.mpf(float(square))
        for _ in range(4):
            mode = stiffness.less(shift, mass).solve(mass.apply(mode))
            length = mpmath.sqrt(mass.product(mode, mode))
            mode = [entry / length for entry in mode]
            shift = stiffness.product(mode, mode)
        shapes.append(mode)
    return shapes


_CUBIC = ((1, 0, -3, 2), (0, 1, -2, 1), (0, 0, 3, -2), (0, 0, -1, 1))
_QUADRATIC = ((1, -3, 2), (0, 4, -4), (0, -1, 2))


@dataclass(frozen=True)
class Elements:
    """Piecewise polynomials on a uniform mesh of s = 0 .. 1.

    Attributes
    ----------
    count : number of elements
    local : functions of an element on 0 .. 1, in the order of the element's nodal coordinates
    stride : nodal coordinates from one element to the next
    nodal : (n_nodal, n) nodal coordinates of each shape function
    """

    count: int
    local: tuple[Coefficients, ...]
    stride: int
    nodal: Fixed

    def values(self, s: Fixed) -> Values:
        """Return values and derivatives of the n functions. At a node they belong to the element that begins there."""
        element = np.minimum((s * self.count) >> BITS, self.count - 1)
        within = s * self.count - (element << BITS)
        first = element.astype(int) * self.stride
        result = []
        for order in range(3):
            total = np.zeros((self.nodal.shape[1], len(s)), dtype=object)
            for number, function in enumerate(self.local):
                values = polynomial(differentiate(function, order), within) * self.count**order
                total = total + times(self.nodal[first + number].T, values)
            result.append(total)
        f, slope, curvature = result
        return f, slope, curvature


def elements(deformation: Deformation, beam: Beam) -> ShapeFunctions:
    """Return the shape functions of a uniform mesh over s = 0 .. 1 for a deformation of a beam. These are the nodal
    functions with ``deformation.nodal``, else the lowest modes without rigid motions, scaled to ``int f^2 = 1`` over s,
    with a positive value, slope or curvature at the start."""
    bending = deformation.kind.startswith("bending")
    whole = _mesh(deformation.elements, Fraction(beam.length), bending)
    free = deformation.free_nodal
    mesh = replace(whole, nodal=whole.nodal[:, free])
    if deformation.nodal:
        return _family(mesh)
    with mpmath.workprec(WORKING):
        K = _assemble(whole, beam, deformation.kind, 2 if bending else 1)
        M = _assemble(whole, beam, "polar" if deformation.kind == "torsion" else "mass", 0)
        for x, mass, inertia in deformation.masses:
            dof = array([(Fraction(x) - Fraction(beam.start)) / Fraction(beam.length)])
            value, slope, _ = (_numbers(part[:, 0]) for part in whole.values(dof))
            _add(M, value, inertia if deformation.kind == "torsion" else mass)
            if bending:
                _add(M, slope, mpmath.mpf(inertia) / mpmath.mpf(beam.length) ** 2)
        rigid = (2 if bending else 1) if deformation.ends == "free_free" else 0
        shapes = modes(K.submatrix(free), M.submatrix(free), rigid, deformation.modes)
        squares = _assemble(whole, Beam(0.0, 1.0, beam.mass_per_length, ()), "mass", 0).submatrix(free)
        lengths = [mpmath.sqrt(squares.product(mode, mode)) for mode in shapes]
        reduced = np.zeros((len(whole.nodal), len(shapes)), dtype=object)
        for number, (mode, length) in enumerate(zip(shapes, lengths, strict=True)):
            reduced[free, number] = array(entry / length for entry in mode)
        order = {"clamped_free": 2 if bending else 1, "free_free": 0, "pinned_pinned": 1}[deformation.ends]
        at_start = replace(mesh, nodal=reduced).values(np.array([0], dtype=object))[order][:, 0]
        return _family(replace(mesh, nodal=np.where(at_start < 0, -reduced, reduced)))


def _family(mesh: Elements) -> ShapeFunctions:
    """Return a mesh as shape functions: derivatives jump at ends of elements, no panel is shorter than an element."""
    breaks = tuple(Fraction(number, mesh.count) for number in range(1, mesh.count))
    return ShapeFunctions(mesh.nodal.shape[1], 1.0, mesh.values, breaks)


def _mesh(count: int, length: Fraction, bending: bool) -> Elements:
    """Return a uniform mesh on s = 0 .. 1 with all nodal coordinates as shape functions. Cubic with slopes by x, for a
    beam of the given length, if ``bending``; else quadratic."""
    if bending:
        scales = (Fraction(1), length / count) * 2
        local = tuple(tuple(scale * entry for entry in row) for scale, row in zip(scales, _CUBIC, strict=True))
        return Elements(count, local, 2, _identity(2 * count + 2))
    local = tuple(tuple(map(Fraction, row)) for row in _QUADRATIC)
    return Elements(count, local, 2, _identity(2 * count + 1))


def _identity(size: int) -> Fixed:
    return np.asarray(np.eye(size, dtype=int).astype(object) * ONE)


def _numbers(values: Fixed) -> list[Any]:
    return [from_fixed(value) for value in values]


def _assemble(mesh: Elements, beam: Beam, profile: str, derivative: int) -> BandedMatrix:
    """Return the matrix of the integrals of f^(d) f^(d) times a profile along a mesh, with all nodal coordinates.
    ``profile`` names a property of the beam, and d = ``derivative`` is 0, 1 or 2. The property has the value 1."""
    h = Fraction(beam.length) / mesh.count
    functions = [differentiate(function, derivative) for function in mesh.local]
    along = tuple(Fraction(entry) for entry in beam.profiles.get(profile, (1.0,)))
    powers = [tuple(Fraction(int(exponent == power)) for exponent in range(power + 1)) for power in range(len(along))]
    table = [
        [[_number(sum(integrate(product(power, product(f, g))))) for g in functions] for f in functions]
        for power in powers
    ]
    size = len(functions)
    matrix = BandedMatrix(len(mesh.nodal), size - 1)
    for element in range(mesh.count):
        weights = [_number(h * entry / h ** (2 * derivative)) for entry in on_piece(along, element, mesh.count)]
        for row in range(size):
            for column in range(row + 1):
                value = mpmath.fsum(weight * part[row][column] for weight, part in zip(weights, table, strict=True))
                matrix.add(element * mesh.stride + row, element * mesh.stride + column, value)
    return matrix


def _number(fraction: Fraction | int) -> Any:
    exact = Fraction(fraction)
    return mpmath.mpf(exact.numerator) / exact.denominator


def _add(matrix: BandedMatrix, values: list[Any], factor: Any) -> None:
    """Add factor * values values^T to a matrix, in place; ``values``, (n,), are functions at one position."""
    present = [dof for dof, value in enumerate(values) if value]
    for dof in present:
        for column in present:
            if column <= dof:
                matrix.add(dof, column, factor * values[dof] * values[column])
