"""Laws: functions of several numbers with several results, in C files of a scene; words of formulas.

Values in NumPy come from the same C, compiled alone: samples of equations and checks of formulas need values
before there is a model.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.messages import listed
from eomgen.formula.nodes import Formula
from eomgen.formula.words import Signature, Word
from eomgen.products.laws.code import CCode, CompiledLaw, PythonCode
from eomgen.symbolic.external import Columns

if TYPE_CHECKING:
    from eomgen.toolchain.python_functions import PythonFunctions


@dataclass(frozen=True, eq=False)
class FileLaw:
    """A function of a file of the scene; an ``ExternalFunction`` of the tape.

    Attributes
    ----------
    name : of the entry
    inputs, outputs : names of arguments and results, with units
    given : names of parameters, with formulas
    scales : typical size of each argument and parameter
    code : the file, and the functions in that file
    """

    name: str
    inputs: Mapping[str, str]
    outputs: Mapping[str, str]
    given: Mapping[str, Formula]
    scales: tuple[float, ...]
    code: CCode | PythonCode

    def __str__(self) -> str:
        return f"{listed(list(self.outputs))} of {listed(list(self.inputs))} by {self.code}; {self.derivatives}"

    @property
    def derivatives(self) -> str:
        """Origin of the derivatives, as text."""
        if self.code.slopes:
            return f"partials by {self.code.labels[1]}, second ones by differences"
        return "partials and second ones by differences"

    @property
    def label(self) -> str:
        return f"law {self.name}"

    @property
    def arguments(self) -> int:
        return len(self.inputs)

    @property
    def parameters(self) -> int:
        return len(self.given)

    @property
    def results(self) -> int:
        return len(self.outputs)

    @cached_property
    def functions(self) -> CompiledLaw | PythonFunctions:
        """Values and slopes of the law at single points. Raises ModelError or ToolchainError."""
        return self.code.compiled((self.arguments, self.parameters, self.results))

    def evaluate(self, columns: Columns, x: Array) -> Array:
        """Return results at arguments and parameters x (..., n), or their derivatives along ``columns`` of x, (...,
        size). Each of ``columns`` is a tuple of indices of x: none for values, one for first derivatives, two for
        second ones."""
        rows = x.reshape(-1, x.shape[-1])
        relative = float(np.finfo(float).eps) ** (1.0 / (max(1, len(columns) - bool(self.code.slopes)) + 2.0))
        values = [self._derivative(columns, row, relative).ravel() for row in rows]
        return np.asarray(values).reshape((*x.shape[:-1], -1))

    def value(self, word: str, component: int, *arguments: ArrayLike) -> Array:
        """Return the result number ``component`` at arguments and parameters, of their broadcast shape."""
        x = np.stack(np.broadcast_arrays(*(np.asarray(item, dtype=float) for item in arguments)), axis=-1)
        return np.asarray(self.evaluate((), x)[..., component])

    def _derivative(self, columns: Columns, x: Array, relative: float) -> Array:
        """Return the results at a point x (n,), or derivatives along the columns of each set in ``columns``, (results,
        columns, ...): exact partials if there are any, else central differences with steps ``relative`` to the size."""
        if not columns:
            return self.functions.value(x)
        *before, last = columns
        exact = None if before or self.functions.slopes is None else self.functions.slopes(x)
        parts = []
        for column in last:
            if exact is not None and column < self.arguments:
                parts.append(exact.reshape(self.results, -1)[:, column])
                continue
            step = relative * max(abs(x[column]), self.scales[column])
            up, down = x.copy(), x.copy()
            up[column] += step
            down[column] -= step
            rise = self._derivative(tuple(before), up, relative) - self._derivative(tuple(before), down, relative)
            parts.append(rise / (up[column] - down[column]))
        return np.stack(parts, axis=-1)


def _added(law: FileLaw) -> tuple[Formula, ...]:
    return tuple(law.given.values())


def _signature(law: FileLaw) -> Signature:
    return Signature(law.inputs, law.outputs)


LAW = Word(
    name="law",
    section="laws",
    arguments=("x", "y"),
    values=FileLaw.value,
    recording="eomgen.products.laws.checks:recorded",
    added=_added,
    fast=False,
    scope="external",
    signature=_signature,
)
