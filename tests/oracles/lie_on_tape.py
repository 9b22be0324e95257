"""The groups on a tape: references in, references out."""

from __future__ import annotations

from collections.abc import Sequence

from eomgen.lie.algebra import TapeAlgebra
from eomgen.lie.groups import Group
from eomgen.lie.rotations import Rows
from eomgen.symbolic.scalar import Scalar
from eomgen.symbolic.tape import Ref, Tape

Refs = tuple[Ref, ...]


def exp(tape: Tape, group: Group, theta: Sequence[Ref]) -> Refs:
    """Return exp of an increment."""
    algebra = TapeAlgebra(tape)
    return _refs(algebra, group.exp(algebra, _scalars(tape, theta)))


def log(tape: Tape, group: Group, q: Sequence[Ref]) -> Refs:
    """Return the logarithm with a rotation angle of at most pi."""
    algebra = TapeAlgebra(tape)
    return _refs(algebra, group.log(algebra, _scalars(tape, q)))


def compose(tape: Tape, group: Group, first: Sequence[Ref], second: Sequence[Ref]) -> Refs:
    """Return first * second."""
    return _refs(TapeAlgebra(tape), group.compose(_scalars(tape, first), _scalars(tape, second)))


def inverse(tape: Tape, group: Group, q: Sequence[Ref]) -> Refs:
    """Return q^-1."""
    return _refs(TapeAlgebra(tape), group.inverse(_scalars(tape, q)))


def adjoint(tape: Tape, group: Group, q: Sequence[Ref]) -> Refs:
    """Return Ad(q), row by row."""
    return _matrix(tape, group.adjoint(_scalars(tape, q)))


def bracket_matrix(tape: Tape, group: Group, v: Sequence[Ref]) -> Refs:
    """Return ad(v), row by row."""
    return _matrix(tape, group.bracket_matrix(_scalars(tape, v)))


def tangent(tape: Tape, group: Group, theta: Sequence[Ref]) -> Refs:
    """Return T(theta), row by row."""
    return _matrix(tape, group.tangent(TapeAlgebra(tape), _scalars(tape, theta)))


def tangent_inverse(tape: Tape, group: Group, theta: Sequence[Ref]) -> Refs:
    """Return T(theta)^-1, row by row, for rotation angles below 2 pi."""
    return _matrix(tape, group.tangent_inverse(TapeAlgebra(tape), _scalars(tape, theta)))


def _scalars(tape: Tape, refs: Sequence[Ref]) -> list[Scalar]:
    return [Scalar(tape, ref) for ref in refs]


def _refs(algebra: TapeAlgebra, values: Sequence[object]) -> Refs:
    return tuple(algebra.scalar(value).ref for value in values)


def _matrix(tape: Tape, rows: Rows) -> Refs:
    return _refs(TapeAlgebra(tape), [entry for row in rows for entry in row])
