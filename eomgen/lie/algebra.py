"""Algebras over which the groups are defined: NumPy arrays, or scalars on a tape."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from eomgen.symbolic.operations import Op
from eomgen.symbolic.scalar import Algebra as ScalarAlgebra
from eomgen.symbolic.scalar import Scalar
from eomgen.symbolic.tape import Tape

#: A NumPy array of any batch shape (real or complex) or a Scalar of a tape; a plain float if it is constant.
Value = Any


class Algebra(Protocol):
    """Functions on values, arrays or scalars of a tape. A condition is a value that is not zero if the condition
    holds."""

    def sqrt(self, x: Value) -> Value: ...
    def sin(self, x: Value) -> Value: ...
    def cos(self, x: Value) -> Value: ...
    def atan2(self, y: Value, x: Value) -> Value: ...
    def less(self, x: Value, y: Value) -> Value: ...
    def select(self, condition: Value, then: Value, otherwise: Value) -> Value: ...


class NumpyAlgebra:
    """Functions on NumPy arrays of any batch shape, also complex ones: comparisons look at real parts."""

    def sqrt(self, x: Value) -> Value:
        return np.sqrt(x)

    def sin(self, x: Value) -> Value:
        return np.sin(x)

    def cos(self, x: Value) -> Value:
        return np.cos(x)

    def atan2(self, y: Value, x: Value) -> Value:
        if np.iscomplexobj(y) or np.iscomplexobj(x):
            angle = np.arctan2(np.real(y), np.real(x))
            slope = (np.real(x) * np.imag(y) - np.real(y) * np.imag(x)) / (np.real(x) ** 2 + np.real(y) ** 2)
            return angle + 1j * slope
        return np.arctan2(y, x)

    def less(self, x: Value, y: Value) -> Value:
        return np.real(x) < np.real(y)

    def select(self, condition: Value, then: Value, otherwise: Value) -> Value:
        return np.where(condition, then, otherwise)


class TapeAlgebra:
    """Functions on scalars of one tape, which record operations; plain numbers become constants."""

    def __init__(self, tape: Tape) -> None:
        self._algebra = ScalarAlgebra(tape)

    def scalar(self, x: Value) -> Scalar:
        return self._algebra.scalar(x)

    def sqrt(self, x: Value) -> Value:
        return self._algebra.call(Op.SQRT, self.scalar(x))

    def sin(self, x: Value) -> Value:
        return self._algebra.call(Op.SIN, self.scalar(x))

    def cos(self, x: Value) -> Value:
        return self._algebra.call(Op.COS, self.scalar(x))

    def atan2(self, y: Value, x: Value) -> Value:
        return self._algebra.call(Op.ATAN2, self.scalar(y), self.scalar(x))

    def less(self, x: Value, y: Value) -> Value:
        return self._algebra.call(Op.LT, self.scalar(x), self.scalar(y))

    def select(self, condition: Value, then: Value, otherwise: Value) -> Value:
        return self._algebra.select(self.scalar(condition), self.scalar(then), self.scalar(otherwise))
