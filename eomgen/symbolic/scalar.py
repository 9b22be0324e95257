"""Scalars of a tape with operators, and vectors (3,) and matrices (3, 3) of them.

Vectors are tuples of three scalars, matrices tuples of three rows. Everything folds on the tape: multiplying by a zero
or a one, or rotating by a right angle, records no operation.
"""

from __future__ import annotations

from collections.abc import Sequence

from eomgen.symbolic.operations import Op
from eomgen.symbolic.tape import ONE, ZERO, Ref, Tape

Number = float | int


class Scalar:
    """A reference and its tape.

    Parameters
    ----------
    tape : Tape
        The tape of the operation.
    ref : int
        Reference to the operation; negative references are negated values.
    """

    __slots__ = ("ref", "tape")

    def __init__(self, tape: Tape, ref: Ref) -> None:
        self.tape = tape
        self.ref = ref

    def __add__(self, other: Scalar | Number) -> Scalar:
        tape, ref = self.tape, self.ref
        if not isinstance(other, Scalar):
            return Scalar(tape, tape.add(ref, tape.constant(other)))
        if other.ref == ZERO and ref > 0:  # many are: most of a matrix of an axis
            return self
        return Scalar(tape, tape.add(ref, other.ref))

    def __radd__(self, other: Number) -> Scalar:
        return self + other

    def __sub__(self, other: Scalar | Number) -> Scalar:
        tape = self.tape
        return Scalar(tape, tape.sub(self.ref, other.ref if isinstance(other, Scalar) else tape.constant(other)))

    def __rsub__(self, other: Number) -> Scalar:
        return -self + other

    def __mul__(self, other: Scalar | Number) -> Scalar:
        tape, ref = self.tape, self.ref
        if not isinstance(other, Scalar):
            return Scalar(tape, tape.mul(ref, tape.constant(other)))
        if ZERO in (ref, other.ref):
            return self if ref == ZERO else other
        return Scalar(tape, tape.mul(ref, other.ref))

    def __rmul__(self, other: Number) -> Scalar:
        return self * other

    def __truediv__(self, other: Scalar | Number) -> Scalar:
        tape = self.tape
        return Scalar(tape, tape.div(self.ref, other.ref if isinstance(other, Scalar) else tape.constant(other)))

    def __neg__(self) -> Scalar:
        return self if self.ref == ZERO else Scalar(self.tape, -self.ref)

    def __repr__(self) -> str:
        number = self.number
        return f"Scalar({self.ref})" if number is None else f"Scalar({number!r})"

    @property
    def constant(self) -> float | None:
        """The number of a constant; None for other references, and for generic constants."""
        return self.tape.value(self.ref)

    @property
    def number(self) -> float | None:
        """The number of a constant, also of a generic constant; None for other references."""
        return self.tape.number(self.ref)

    @property
    def is_zero(self) -> bool:
        return self.ref == ZERO


Vector = tuple[Scalar, Scalar, Scalar]
Matrix = tuple[Vector, Vector, Vector]


class Algebra:
    """Makes scalars and applies functions on one tape.

    Parameters
    ----------
    tape : Tape
        The tape of the operations.
    """

    def __init__(self, tape: Tape) -> None:
        self.tape = tape
        self.zero = Scalar(tape, ZERO)
        self.one = Scalar(tape, ONE)
        self.zero_vector: Vector = (self.zero, self.zero, self.zero)
        self.identity: Matrix = (
            (self.one, self.zero, self.zero),
            (self.zero, self.one, self.zero),
            (self.zero, self.zero, self.one),
        )

    def scalar(self, value: Scalar | Number) -> Scalar:
        return value if isinstance(value, Scalar) else Scalar(self.tape, self.tape.constant(value))

    def vector(self, values: Sequence[Scalar | Number]) -> Vector:
        x, y, z = (self.scalar(value) for value in values)
        return (x, y, z)

    def matrix(self, rows: Sequence[Sequence[Scalar | Number]]) -> Matrix:
        x, y, z = (self.vector(row) for row in rows)
        return (x, y, z)

    def named(self, text: str, values: Vector) -> Vector:
        """Name the components of a vector ``text_x, text_y, text_z`` on the tape, and return the vector.

        Inputs and constants get no name, and an earlier name of an operation stays.

        Parameters
        ----------
        text : str
            Beginning of the names in generated C.
        values : sequence of Scalar
            Vector of three components.

        Returns
        -------
        sequence of Scalar
            ``values`` itself.
        """
        for axis, value in zip("xyz", values, strict=True):
            self.tape.name(value.ref, f"{text}_{axis}")
        return values

    def named_matrix(self, text: str, rows: Matrix) -> Matrix:
        """Name the entries of a matrix ``text_xx, text_xy, ...``, row by row, on the tape, and return the matrix.

        Inputs and constants get no name, and an earlier name of an operation stays. The operation of a negated entry is
        named ``minus_text_xx``.

        Parameters
        ----------
        text : str
            Beginning of the names in generated C.
        rows : sequence of sequences of Scalar
            Matrix of three rows and columns.

        Returns
        -------
        sequence of sequences of Scalar
            ``rows`` itself.
        """
        for axis, row in zip("xyz", rows, strict=True):
            for column_axis, value in zip("xyz", row, strict=True):
                self.tape.name(value.ref, f"{text}_{axis}{column_axis}")
        return rows

    def block(self, name: str, size: int) -> list[Scalar]:
        """Return the components of an input block.

        Parameters
        ----------
        name : str
            Name of the block, as in ``system.INPUT_BLOCKS``: ``q``, ``v``, ``u``.
        size : int
            Number of components.

        Returns
        -------
        list of Scalar
            One for each component.
        """
        return [Scalar(self.tape, self.tape.input(name, index)) for index in range(size)]

    def call(self, op: Op, x: Scalar, y: Scalar | None = None) -> Scalar:
        return Scalar(self.tape, self.tape.call(op, x.ref, y.ref if y is not None else 0))

    def length(self, x: Sequence[Scalar]) -> Scalar:
        """Return the Euclidean length of a vector that must not be 0, since values are divided by the length.

        Parameters
        ----------
        x : sequence of Scalar
            Vector (n,).

        Returns
        -------
        Scalar
            The length, noted in ``tape.lengths``. Its derivatives have no value at 0, unlike a root of squares
            (``edges``).
        """
        length = self.call(Op.SQRT, dot(x, x))
        self.tape.lengths.add(abs(length.ref))
        return length

    def select(self, condition: Scalar, then: Scalar, otherwise: Scalar) -> Scalar:
        return Scalar(self.tape, self.tape.select(condition.ref, then.ref, otherwise.ref))


def plus(x: Vector, y: Vector) -> Vector:
    return (x[0] + y[0], x[1] + y[1], x[2] + y[2])


def minus(x: Vector, y: Vector) -> Vector:
    """Return the difference of two vectors in space.

    Parameters
    ----------
    x, y : Vector
        Vectors (3,).

    Returns
    -------
    Vector
        The difference x - y, (3,).
    """
    return (x[0] - y[0], x[1] - y[1], x[2] - y[2])


def negative(x: Vector) -> Vector:
    return (-x[0], -x[1], -x[2])


def scaled(factor: Scalar | Number, x: Vector) -> Vector:
    """Return a multiple of a vector in space.

    Parameters
    ----------
    factor : Scalar or float
        The factor.
    x : Vector
        Vector (3,).

    Returns
    -------
    Vector
        The product factor x, (3,).
    """
    return (x[0] * factor, x[1] * factor, x[2] * factor)


def dot(x: Sequence[Scalar], y: Sequence[Scalar]) -> Scalar:
    """Return the scalar product x . y.

    Parameters
    ----------
    x, y : sequence of Scalar
        Vectors (n,) of equal length n, at least 1; components may be numbers.

    Returns
    -------
    Scalar
        The sum of products; a number if all components are numbers.

    Raises
    ------
    ValueError
        Unequal lengths.
    """
    try:
        tape, sum_of_products = x[0].tape, ZERO
        for first, second in zip(x, y, strict=True):
            x_ref, y_ref = first.ref, second.ref
            if ZERO not in (x_ref, y_ref):  # most have one
                sum_of_products = tape.add(sum_of_products, tape.mul(x_ref, y_ref))
        return Scalar(tape, sum_of_products)
    except AttributeError:  # operands are numbers, or some are
        total = x[0] * y[0]
        for first, second in zip(x[1:], y[1:], strict=True):
            total = total + first * second
        return total


def cross(x: Vector, y: Vector) -> Vector:
    return (x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0])


def all_zero(*x: Sequence[Scalar]) -> bool:
    """Return whether all components of vectors are zero by structure.

    Parameters
    ----------
    *x : sequence of Scalar
        Vectors of any length, such as the rows of a matrix.

    Returns
    -------
    bool
        Whether each component is the constant 0.
    """
    return all(entry.is_zero for part in x for entry in part)


def apply(A: Matrix, x: Vector) -> Vector:
    """Return the product of a matrix and a vector in space.

    Parameters
    ----------
    A : Matrix
        Matrix (3, 3).
    x : Vector
        Vector (3,).

    Returns
    -------
    Vector
        A x, (3,).
    """
    return (dot(A[0], x), dot(A[1], x), dot(A[2], x))


def transpose(A: Matrix) -> Matrix:
    """Return the transpose of a matrix.

    Parameters
    ----------
    A : Matrix
        Matrix (3, 3).

    Returns
    -------
    Matrix
        A^T, (3, 3).
    """
    return ((A[0][0], A[1][0], A[2][0]), (A[0][1], A[1][1], A[2][1]), (A[0][2], A[1][2], A[2][2]))


def multiply(A: Matrix, B: Matrix) -> Matrix:
    """Return A B."""
    columns = transpose(B)
    rows = [(dot(row, columns[0]), dot(row, columns[1]), dot(row, columns[2])) for row in A]
    return (rows[0], rows[1], rows[2])


def matrix_plus(A: Matrix, B: Matrix) -> Matrix:
    return (plus(A[0], B[0]), plus(A[1], B[1]), plus(A[2], B[2]))


def skew(x: Vector) -> Matrix:
    """Return the matrix of the cross product with x."""
    zero = Scalar(x[0].tape, ZERO)
    return ((zero, -x[2], x[1]), (x[2], zero, -x[0]), (-x[1], x[0], zero))


def outer(x: Vector, y: Vector) -> Matrix:
    """Return x y^T."""
    return (scaled(x[0], y), scaled(x[1], y), scaled(x[2], y))
