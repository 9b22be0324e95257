"""Conversion of arguments to double arrays in the right shape, and checks of tunable parameters against the
description's requirements; errors name the argument."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eomgen.base.arrays import Array
from eomgen.base.messages import first_of, nearest, shown
from eomgen.base.rounding import WRITTEN
from eomgen.errors import Problem, UsageError
from eomgen.formula.evaluate import OTHER_VALUES, evaluate, evaluate_batch, symbols
from eomgen.formula.units.labels import in_label
from eomgen.formula.units.parser import is_quantity
from eomgen.lie.product import Factor
from eomgen.system.description import Description, Requirement

_SECONDS = "number of seconds"


def numbers(name: str, value: ArrayLike) -> Array:
    """Return real numbers as an array of doubles. Raises UsageError for anything else."""
    array = np.empty(0)
    try:
        array = np.asarray(value)
        if array.dtype.kind not in "fiub":
            raise TypeError(f"{array.dtype} is not real numbers")
        return np.ascontiguousarray(array, dtype=np.float64).reshape(array.shape)
    except (TypeError, ValueError) as error:
        hint = ""
        if isinstance(value, Mapping):
            hint = f"a list of numbers, in the order of the model's {name}_names" if name in ("q", "v") else "a list"
        elif array.dtype.kind == "c":
            hint = "real numbers; partials(...) has derivatives without steps"
        elif isinstance(error, ValueError):
            hint = "lists of equal length"
        fault = f"an array of real numbers is needed, not {type(value).__name__}: {error} [E0235]"
        raise UsageError(Problem(name, fault, hint)) from None


def read_only(values: ArrayLike) -> Array:
    """Return a copy that cannot be written to, for arrays that a model hands out."""
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array


def components(name: str, value: ArrayLike, size: int) -> Array:
    """Return an array of shape (..., size). Raises UsageError with the expected and the given shape."""
    array = numbers(name, value)
    if array.ndim == 0 or array.shape[-1] != size:
        hint = f"{name} as a list of {size} number{'s' if size != 1 else ''}, or a batch of them along leading axes"
        raise UsageError(Problem(name, f"the shape is {array.shape}, (..., {size}) is needed [E0236]", hint))
    return array


def check_finite(name: str, array: Array, labels: Sequence[str] = ()) -> None:
    """Refuse an array with a component that is not finite.

    Parameters
    ----------
    name : of the argument, for the message
    array : of any shape
    labels : names of the components of the last axis, for the message

    Raises
    ------
    UsageError
        With the name of the first component that is not finite.
    """
    finite = np.isfinite(array)
    if finite.all():
        return
    position = tuple(int(index) for index in np.argwhere(~finite)[0])
    label = labels[position[-1]] if labels else f"{name}{list(position) if position else ''}"
    raise UsageError(Problem(name, f"{label} is {array[position]}, not a finite number [E0237]", "a finite number"))


def check_quaternions(name: str, q: Array, factors: Sequence[Factor], tolerance: float = WRITTEN) -> None:
    """Raise UsageError if the length of a quaternion in configurations (..., nq) is off one by more than ``tolerance``.
    ``name`` is the argument in the message, ``factors`` the groups of q; a normalised quaternion is the hint."""
    starts = [factor.q_start for factor in factors if factor.group != "R"]
    if not starts:
        return
    # from some number on NumPy is faster than a loop
    if q.size == q.shape[-1] and len(starts) < 32:
        values = q.ravel().tolist()
        lengths = [math.hypot(*values[start : start + 4]) for start in starts]
        if max(lengths) - 1.0 <= tolerance and 1.0 - min(lengths) <= tolerance:
            return
    every = q[..., np.add.outer(starts, np.arange(4))].reshape(-1, len(starts), 4)
    sizes = np.sqrt(np.sum(every * every, axis=-1))
    wrong = np.abs(sizes - 1.0) > tolerance
    if np.any(wrong):
        joint = int(np.argmax(wrong.any(axis=0)))
        sample = int(np.argmax(wrong[:, joint]))
        size = float(sizes[sample, joint])
        where = f"{name}[..., {starts[joint]}:{starts[joint] + 4}]"
        fault = f"the quaternion (w, x, y, z) of this joint has length {size:.9g}, not 1 [E0238]"
        unit = every[sample, joint] / (size or 1.0)
        hint = f"it divided by its length, [{', '.join(f'{number:.9g}' for number in unit)}]"
        raise UsageError(Problem(where, fault, hint if size else "neutral(), for the joints' places at zero"))


#: Places in the scene where parameters and inputs are declared, for hints.
WHERE: Mapping[str, str] = {
    "parameter": "a tunable parameter in the scene",
    "input": "[inputs] in the scene, named by an effort; of other formats eomgen.load(path, actuated=True)",
}


def check_name(kind: str, name: object, known: Sequence[str], fixed: Sequence[str] = ()) -> None:
    """Refuse a name that is unknown or fixed.

    Parameters
    ----------
    kind : noun for the message: ``parameter``, ``input``
    name : to be checked
    known : admissible names
    fixed : names whose values are fixed in the compiled code

    Raises
    ------
    UsageError
        With the nearest known names, or the remedy for a fixed name.
    """
    if name in fixed and name not in known:
        problem = f"the {kind} {name} exists, but its value is fixed in the code [E0239]"
        hint = f"{name} = {{ value = ..., tunable = true }} in the scene's [parameters], or another value there"
        raise UsageError(Problem("", problem, hint))
    if name not in known:
        hint = nearest(str(name), known) or WHERE.get(kind, "")
        none = "" if known else f": the scene has no {'tunable ' if kind == 'parameter' else ''}{kind}s"
        raise UsageError(Problem("", f"there is no {kind} {shown(str(name))}{none} [E0100]", hint))


def check_place(name: object) -> None:
    """Raise UsageError if an array is given in place of the name of a body or frame, which comes first."""
    if not isinstance(name, str):
        fault = f"the name of a body or frame comes first, not {type(name).__name__} [E0242]"
        raise UsageError(Problem("", fault, 'the name, and then q: pose("body", q)'))


def by_name(
    kind: str,
    values: Mapping[str, Any],
    names: Sequence[str],
    start: Array,
    fixed: Sequence[str] = (),
    units: Mapping[str, str] | None = None,
) -> Array:
    """Return an array (..., n): ``start`` with the components put in that ``values`` gives by name, scalars or batches
    (...).

    ``names`` are the names of the n components, ``kind`` the noun in messages; ``fixed`` are names that exist but
    cannot be given; with ``units``, texts such as "300 mm" are brought to the unit of a name. Raises UsageError for
    unknown names and shapes that do not broadcast.
    """
    arrays: dict[int, Array] = {}
    for name, text_or_numbers in values.items():
        check_name(kind, name, names, fixed)
        value = text_or_numbers
        if isinstance(value, str) and units is not None:
            value = in_label(f"{kind} {name}", value, units.get(name, ""))
        arrays[names.index(name)] = numbers(f"{kind} {name}", value)
    try:
        shape = np.broadcast_shapes(start.shape[:-1], *(array.shape for array in arrays.values()))
    except ValueError:
        shapes = ", ".join(f"{names[index]} {array.shape}" for index, array in arrays.items())
        raise UsageError(
            Problem(f"{kind}s", f"the shapes do not broadcast: {shapes} [E0243]", "batches of equal shape")
        ) from None
    result = np.array(np.broadcast_to(start, (*shape, len(names))))
    for index, array in arrays.items():
        result[..., index] = array
    return result


def read_quantities(name: str, value: Any, units: Sequence[str], otherwise: str = "") -> Any:
    """Return ``value`` with texts such as "30 deg" replaced by numbers in the component's unit.

    ``units`` has one unit for each component of the vector, ``name`` is for messages. ``otherwise`` is the remedy for a
    text that is not a number, if arguments other than numbers are allowed.

    Raises
    ------
    UsageError
        A text that is not a number with a unit, or of another dimension.
    """
    if isinstance(value, str) and otherwise and not is_quantity(value):
        raise UsageError(
            Problem(name, f"{shown(value)} is neither a number nor a number with a unit [E0244]", otherwise)
        )
    if isinstance(value, str):
        return in_label(name, value, units[0]) if len(units) == 1 else value
    if isinstance(value, list | tuple) and len(value) == len(units) and any(isinstance(item, str) for item in value):
        return [
            in_label(f"{name}[{k}]", item, unit) if isinstance(item, str) else item
            for k, (item, unit) in enumerate(zip(value, units, strict=True))
        ]
    return value


def number_of(name: str, value: object, kind: str = _SECONDS) -> float:
    """Return a finite number; of seconds also from a text with a unit, ``5 ms``.

    Parameters
    ----------
    name : of the argument, for the message
    value : a number, or a text with a unit of time
    kind : of the number, for the message

    Raises
    ------
    UsageError
        Any other value, and numbers that are not finite.
    """
    if isinstance(value, str) and kind == _SECONDS:
        value = in_label(name, value, "s")
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        several = name == "t_end" and isinstance(value, list | tuple) and len(value) == 2
        hint = "t_start=..., t_end=... for both ends" if several else ""
        if name == "t_end" and isinstance(value, np.ndarray | list | tuple) and len(value) > 2:
            hint = "t_end=times[-1], step=times[1] - times[0]: rows are a step apart"
        raise UsageError(Problem(name, f"a {kind} is needed, not {type(value).__name__} [E0245]", hint))
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise UsageError(Problem(name, f"{name} is {number}, not a finite number [E0237]", f"a finite {kind}"))
    return number


#: Sets of parameters that are checked at once: as many as caches hold.
_BATCH = 8192


class Requirements:
    """Checks of tunable parameters against the requirements of a description, as positive masses.

    Parameters
    ----------
    description : Description
        With the requirements and the values of fixed parameters.
    names : sequence of str
        Tunable parameters, in the order of arrays.
    """

    def __init__(self, description: Description, names: Sequence[str]) -> None:
        self.names = tuple(names)
        self.required = description.requirements
        self._fixed = description.values({})
        self._met = b""  # the last set of parameters that met everything

    def check(self, parameters: Array) -> None:
        """Check one set of parameters, or a batch (..., np) of sets.

        Raises
        ------
        UsageError
            With all that is wrong at the first set that does not meet a requirement.
        """
        if not self.required:
            return
        if parameters.ndim == 1:
            data = parameters.tobytes()
            if data != self._met:  # loops of a caller, and the runs of this package, hand in the same again and again
                self._check_one(parameters.tolist())
                self._met = data
            return
        rows = parameters.reshape(-1, len(self.names))
        for start in range(0, len(rows), _BATCH):
            part = rows[start : start + _BATCH]
            for row in np.flatnonzero(self._broken(part)).tolist():
                # raises, unless the last digit of a function differs between the two
                self._check_one(part[row].tolist())

    def _check_one(self, row: Sequence[float]) -> None:
        values = self._fixed | dict(zip(self.names, row, strict=True))
        stages: dict[int, list[Problem]] = {}
        for item in self.required:
            problem = _problem(item, values, self.names)
            if problem is not None:
                stages.setdefault(0 if item.rule is None else item.rule.stage, []).append(problem)
        if stages:
            raise UsageError(stages[min(stages)])

    def _broken(self, rows: Array) -> NDArray[np.bool_]:
        """Return a mask of the sets of parameters (n, np) that break a requirement, all at once."""
        varied = (column if (column != column[0]).any() else column[0] for column in rows.T)
        values: dict[str, float | Array] = {**self._fixed, **dict(zip(self.names, varied, strict=True))}
        result = np.zeros(len(rows), dtype=bool)
        known = cache(lambda formula: evaluate_batch(formula, lambda symbol: values[symbol.name]))
        for item in self.required:
            numbers = [known(formula) for formula in item.formulas]
            missing = [np.isnan(number) for number in numbers]
            if any(unknown.any() for unknown in missing):
                numbers = [np.where(unknown, 1.0, number) for unknown, number in zip(missing, numbers, strict=True)]
            for unknown in missing:
                result |= unknown
            if item.rule is not None:
                result |= item.rule.broken(numbers)
        return result


def _problem(item: Requirement, values: Mapping[str, float], names: Sequence[str]) -> Problem | None:
    """Return the problem if a requirement is broken at ``values`` of all parameters, else None. Formulas that cannot be
    evaluated are a problem, too; ``names`` are the tunable parameters, listed in the message."""
    try:
        numbers = [evaluate(formula, lambda symbol: values[symbol.name]) for formula in item.formulas]
    except ArithmeticError as error:
        return Problem(item.where, f"{error} at {_list_values(item, values, names)}", OTHER_VALUES)
    if item.rule is None or not item.rule.broken(numbers):
        return None
    fault, hint = item.rule.fault(numbers)
    return Problem(item.where, f"{fault} at {_list_values(item, values, names)}", hint)


def _list_values(item: Requirement, values: Mapping[str, float], names: Sequence[str]) -> str:
    """Return the tunable parameters that a requirement depends on with their values as text."""
    mentioned = {symbol.name for formula in item.formulas for symbol in symbols(formula) if symbol.kind == "parameter"}
    return first_of([f"{name} = {values[name]:.6g}" for name in names if name in mentioned], 8)
