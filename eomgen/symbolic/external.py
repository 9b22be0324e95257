"""Calls of external functions on the tape: functions of several numbers with several results, by code of a user.

The tape knows values and slopes of an external function, not the operations inside. The derivative of a call is a
call again, of the slopes along some of the arguments (``Call.columns``).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from eomgen.base.data import dataclass, replace
from eomgen.symbolic.map import Map
from eomgen.symbolic.operations import Counts, Op
from eomgen.symbolic.tape import ZERO, Ref, Tape

#: Largest order of a derivative: slopes of slopes by differences have no digits left for the next one.
HIGHEST_ORDER = 2
_CONST = Op.CONST
Columns = tuple[tuple[int, ...], ...]


class ExternalSource(Protocol):
    """A C file: name and whole text, and the function in Python that the file calls, None for others."""

    @property
    def name(self) -> str: ...
    @property
    def text(self) -> str: ...
    @property
    def python(self) -> Any: ...


class ExternalCode(Protocol):
    """The C functions of an external function.

    Attributes
    ----------
    source : the C file
    function, slopes : names of the C functions of values and of exact slopes along the arguments; no name: slopes by
        differences
    real : number type of these C functions
    prototypes : declarations of these C functions
    """

    @property
    def source(self) -> ExternalSource: ...
    @property
    def function(self) -> str: ...
    @property
    def slopes(self) -> str: ...
    @property
    def real(self) -> str: ...
    @property
    def prototypes(self) -> tuple[str, ...]: ...


class ExternalFunction(Protocol):
    """A function of numbers that is compiled with a model.

    Attributes
    ----------
    label : for messages and comments
    arguments, parameters : number of arguments, and of parameters after the arguments, constant within a run
    results : number of results
    scales : typical size of each argument and parameter, for differences
    code : the C functions
    """

    @property
    def label(self) -> str: ...
    @property
    def arguments(self) -> int: ...
    @property
    def parameters(self) -> int: ...
    @property
    def results(self) -> int: ...
    @property
    def scales(self) -> tuple[float, ...]: ...
    @property
    def code(self) -> ExternalCode: ...
    def evaluate(self, columns: Columns, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return results, or slopes of them along columns, (..., size), at arguments and parameters (..., n)."""
        ...


class HighDerivativeError(ValueError):
    """A derivative of an external function beyond the highest order."""


@dataclass(frozen=True, eq=False)
class Call:
    """An external function at some arguments, or slopes of the function there, in ``Tape.maps`` with the Maps.

    Attributes
    ----------
    function : ExternalFunction
    operands : references of arguments and parameters
    columns : for each derivative, the operands along which slopes are taken; results are row-major: result, first
        column, second column
    """

    function: ExternalFunction
    operands: tuple[Ref, ...]
    columns: Columns = ()

    @property
    def size(self) -> int:
        """Number of results."""
        return self.function.results * int(np.prod([len(columns) for columns in self.columns], dtype=int))

    @property
    def label(self) -> str:
        return self.function.label

    @property
    def references(self) -> tuple[Ref, ...]:
        """References that the call reads, in the order of the operands."""
        return self.operands

    @cached_property
    def key(self) -> tuple[object, ...]:
        """Key that is equal for equal calls."""
        return (id(self.function), self.columns, self.operands)

    @property
    def routine(self) -> tuple[int, Columns]:
        """Key of the compiled function, for any operands."""
        return (id(self.function), self.columns)

    def counts(self) -> Counts:
        """Count the call as one function."""
        return Counts(functions=1, statements=1)

    def join(self, other: object) -> None:
        """Return no joint call: each call is alone."""

    together = staticmethod(Map.together)

    def copy_to(self, target: Tape, there: Callable[[Ref], Ref], *, unrolled: bool) -> list[Ref]:
        """Return the results of the same call on another tape."""
        return add_call(target, replace(self, operands=tuple(map(there, self.operands))))

    def derivative(self, tape: Tape, positions: Iterable[int]) -> tuple[Call, tuple[int, ...]]:
        """Return the call of the slopes along operands, and the operands (by position) along which slopes are taken.

        All arguments that vary are among these, so that slopes along coordinates and along velocities are one call;
        other arguments and parameters only if in ``positions``.

        Raises
        ------
        HighDerivativeError
            The call has slopes of the highest order already.
        """
        if len(self.columns) == HIGHEST_ORDER:
            raise HighDerivativeError(
                f"{self.label} has values and derivatives of first and second order, and order {HIGHEST_ORDER + 1} is"
                " needed"
            )
        varying = {
            position
            for position, ref in enumerate(self.operands[: self.function.arguments])
            if tape.op[abs(ref)] is not _CONST
        }
        columns = tuple(sorted(varying | set(positions)))
        return replace(self, columns=(*self.columns, columns)), columns


def add_call(tape: Tape, call: Call) -> list[Ref]:
    """Put a call on a tape and return the references of its results; the same call is put there only once."""
    numbers = (number for number, item in enumerate(tape.maps) if cast("Any", item).key == call.key)
    number = next(numbers, len(tape.maps))
    if number == len(tape.maps):
        tape.maps.append(call)
    return [tape.map_result(number, index) for index in range(call.size)]


def call_partials(tape: Tape, call: Call, tangents: Sequence[Mapping[int, Ref]]) -> list[dict[int, Ref]]:
    """Return the tangent {direction: derivative} of every result of a call, from the tangents of the operands. The call
    of the slopes is recorded on the tape. Raises HighDerivativeError beyond the second order."""
    moving = [index for index, tangent in enumerate(tangents) if tangent]
    if not moving:
        return [{} for _ in range(call.size)]
    derivative, columns = call.derivative(tape, moving)
    slopes = add_call(tape, derivative)
    results: list[dict[int, Ref]] = []
    for index in range(call.size):
        result: dict[int, Ref] = {}
        for slope, column in zip(slopes[index * len(columns) :], columns, strict=False):
            for direction, rate in tangents[column].items():
                result[direction] = tape.add(result.get(direction, ZERO), tape.mul(slope, rate))
        results.append(result)
    return results


def call_adjoints(tape: Tape, call: Call, adjoints: Mapping[int, Ref], active: Sequence[bool]) -> list[tuple[Ref, Ref]]:
    """Return pairs (operand, adjoint) for the operands marked in ``active``, from the adjoints by number of the result.
    The call of the slopes is recorded on the tape. Raises HighDerivativeError beyond the second order."""
    derivative, columns = call.derivative(tape, [index for index, moves in enumerate(active) if moves])
    slopes = add_call(tape, derivative)
    pairs = []
    for number, column in enumerate(columns):
        total = ZERO
        for index, adjoint in adjoints.items():
            total = tape.add(total, tape.mul(adjoint, slopes[index * len(columns) + number]))
        if active[column]:
            pairs.append((call.operands[column], total))
    return pairs


def call_values(call: Call, operands: Sequence[Any]) -> list[Any]:
    """Return the results of a call, a list, at numbers or arrays, which broadcast. Imaginary parts of results are the
    slopes times the imaginary parts of arguments; NaN if the order of the slopes is above the highest order."""
    x = np.stack(np.broadcast_arrays(*operands), axis=-1) if operands else np.zeros(0)
    function = call.function
    result: NDArray[Any] = function.evaluate(call.columns, np.ascontiguousarray(x.real))
    if np.iscomplexobj(x):
        every = tuple(range(x.shape[-1]))
        if len(call.columns) == HIGHEST_ORDER:
            unknown = np.any(x.imag != 0.0, axis=-1)[..., np.newaxis]
            result = result + 1j * np.where(unknown, np.nan, 0.0)
            return [result[..., index][()] for index in range(call.size)]
        slopes = function.evaluate((*call.columns, every), np.ascontiguousarray(x.real))
        slopes = slopes.reshape((*result.shape, len(every)))
        result = result + 1j * np.einsum("...ij,...j->...i", slopes, x.imag)
    return [result[..., index][()] for index in range(call.size)]
