"""Inputs over time: numbers, functions of t and tables on the step grid, sampled for the compiled stepper."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, replace
from eomgen.compiled.arguments import check_finite, check_name, numbers, read_quantities
from eomgen.errors import Problem, UsageError
from eomgen.toolchain.library import Library

Function = Callable[[float], float]
#: From times (n,) to rows of all inputs (n, nu).
InputRows = Callable[[Array], Array]


@dataclass(frozen=True)
class LawOverTime:
    """A function of t for an input, which is evaluated at many times at once: from times (n,) to values (n,)."""

    over: Callable[[Array], Array]

    def __call__(self, t: float) -> float:
        return float(self.over(np.array([t]))[0])


Signal = ArrayLike | Function
CheckedSignal = float | Array | Function


@dataclass(frozen=True)
class InputSignals:
    """The signals of a model's inputs.

    Parameters
    ----------
    names : tuple of str
    given : mapping from name to number, callable of t, or (steps + 1,) array on the step grid, linear in between
    formulas : callable or None
        From times (n,) to the inputs (n, nu) by the scene's formulas; used for inputs that are not given. Without this
        function, inputs that are not given are zero.
    step : float
        Step of the grid, in s; the grid begins at ``start``.
    left_to_stepper : bool
        Whether the stepper evaluates the scene's formulas itself, see ``jumps_known``.
    """

    names: tuple[str, ...]
    given: Mapping[str, CheckedSignal]
    formulas: InputRows | None
    step: float
    start: float = 0.0
    left_to_stepper: bool = False

    def rows(self, times: Array) -> Array:
        """Return all inputs at times (n,) in s, (n, nu): given signals, else the scene's formulas, else zero. Raises
        UsageError if a function of the caller fails or gives no finite number."""
        if self.formulas is None or len(self.given) == len(self.names):
            table = np.zeros((len(times), len(self.names)))
        else:
            table = np.array(self.formulas(times))
        for name, signal in self.given.items():
            column = self.names.index(name)
            if isinstance(signal, LawOverTime):
                table[:, column] = _finite(name, signal.over(times), times)
            elif callable(signal):
                table[:, column] = _call_at(name, signal, times)
            elif isinstance(signal, np.ndarray):
                position = (times - self.start) / self.step
                table[:, column] = np.interp(position, np.arange(len(signal)), signal)
            else:
                table[:, column] = signal
        return table

    @property
    def held(self) -> Array | None:
        """Inputs (nu,) for a stepper if the same at all times, with NaN for inputs that the stepper evaluates; else
        None."""
        by_formulas = self.formulas is not None and len(self.given) < len(self.names)
        if by_formulas and not self.left_to_stepper:
            return None
        row = np.empty(len(self.names))
        row[:] = np.nan if self.left_to_stepper else 0.0
        for name, value in self.given.items():
            if not isinstance(value, float):
                return None
            row[self.names.index(name)] = value
        return row

    def table(self, times: Array) -> Array:
        """Return the inputs handed to a stepper, (n, nu): ``rows``, or NaN for inputs that the stepper evaluates from
        formulas of the scene."""
        if not self.left_to_stepper:
            return self.rows(times)
        nothing = replace(self, formulas=lambda at: np.full((len(at), len(self.names)), np.nan))
        return nothing.rows(times)


class HeldRows:
    """A function from times (n,) to rows (n, nu) of inputs that are the same at all times; ``row`` is one of them."""

    __slots__ = ("_table", "row")

    def __init__(self, row: Array) -> None:
        self.row = row
        self._table = row[np.newaxis]

    def __call__(self, times: Array) -> Array:
        return self.over(len(times))

    def over(self, count: int) -> Array:
        """Return a number of rows, read-only: the rows are kept for the next call."""
        if count > len(self._table):
            self._table = np.empty((count, len(self.row)))
            self._table[:] = self.row
        return self._table[:count]


def kind_of(signal: CheckedSignal) -> str:
    """Return the kind of an input's signal: ``function``, ``table`` or ``number``."""
    return "function" if callable(signal) else "table" if isinstance(signal, np.ndarray) else "number"


def jumps_known(library: Library) -> bool:
    """Return whether a stepper evaluates the scene's formulas for inputs that are not given.

    True if the stepper knows the times of jumps, has adaptive steps, or expands inputs in series.
    """
    by_formulas = any(function["name"] == "inputs" for function in library.layout["functions"])
    method = library.layout["method"]
    follows_jumps = "jumps" in method or method.get("own_steps", False) or method.get("inputs") != "sampled"
    return by_formulas and follows_jumps


def check_reach(layout: Mapping[str, Any], signals: Mapping[str, CheckedSignal], start: float, end: float) -> None:
    """Raise UsageError if a run, from start to end in s, leaves the points of a curve or the known time of a random
    process. Curves of inputs in `signals`, the caller's, do not count. `layout` is the library's."""
    for item in layout["validity"]:
        first, last = float(item["start"]), float(item["end"])
        rounding = 1e-9 * (last - first)
        if item["input"] in signals or (start >= first - rounding and end <= last + rounding):
            continue
        early = start < first - rounding
        process, mode, _ = str(item["name"]).partition(" mode ")
        if mode and not early:
            known = f"the random process {process} is known up to t = {last:.9g} s"
            hint = f"t_end = {last:.9g}, or duration = {end:.9g} in [random.{process}]"
            raise UsageError(Problem("t_end", f"{known}, the run ends at t = {end:.9g} s [E2064]", hint))
        verb, there, meets = ("begin", first, start) if early else ("end", last, end)
        fault = (
            f"the points of {item['name']} {verb} at t = {there:.9g} s, the run {verb}s at t = {meets:.9g} s [E2063]"
        )
        beyond = 'outside = "hold" or "periodic"'
        if early:  # on the command line every run begins at t = 0
            hint = f"{beyond}, points from t = {start:.9g} s on, or in Python t_start = {first:.9g}"
            raise UsageError(Problem("t_start", fault, hint))
        raise UsageError(Problem("t_end", fault, f"t_end = {last:.9g}, or {beyond}"))


def check_held(method: str, signals: Mapping[str, CheckedSignal]) -> None:
    """Raise UsageError if an input of the caller is not a number, for a method that expands inputs in series of
    time."""
    for name, signal in signals.items():
        if not isinstance(signal, float):
            kind = "a function" if callable(signal) else "a table"
            fault = f"{method} needs the time derivatives of inputs, which {kind} from outside does not have [E2065]"
            hint = f"a number here; a formula or a curve of the scene for the input {name}; or another method"
            raise UsageError(Problem(f"input {name}", fault, hint))


def signals_by_name(inputs: Mapping[str, Signal] | None, names: Sequence[str]) -> Mapping[str, Signal]:
    """Return the signals that a caller gives for some of the inputs ``names``; empty for None. Raises UsageError for
    anything but a mapping."""
    if inputs is None or isinstance(inputs, Mapping):
        return inputs or {}
    kind = "a function" if callable(inputs) else type(inputs).__name__
    hint = f'inputs={{"{names[0] if names else "name"}": signal}}, each a number, a function of t, or a table'
    raise UsageError(Problem("inputs", f"a mapping from the names of inputs is needed, not {kind} [E2066]", hint))


def read_signals(
    inputs: Mapping[str, Signal] | None,
    names: tuple[str, ...],
    steps: int,
    units: Mapping[str, str] | None = None,
) -> dict[str, CheckedSignal]:
    """Return the signals given for the inputs of a run of ``steps`` steps by name, checked: numbers, functions or
    tables.

    Tables are copied, (steps + 1,); a text such as ``1 N m`` is converted to the unit of the input in `units`. `names`
    are all inputs.

    Raises
    ------
    UsageError
        Anything but a mapping; unknown names; arrays that do not fit the step grid; values that are not finite.
    """
    read: dict[str, CheckedSignal] = {}
    for name, signal in ({} if inputs is None else signals_by_name(inputs, names)).items():
        if type(signal) is float and math.isfinite(signal) and name in names:  # optimisations give numbers
            read[name] = signal
            continue
        check_name("input", name, names)
        if callable(signal):
            read[name] = signal
            continue
        law = f"a function, lambda t: ..., or [inputs] {name} = {{ formula = ... }} in the scene"
        array = numbers(f"input {name}", read_quantities(f"input {name}", signal, [(units or {}).get(name, "")], law))
        check_finite(f"input {name}", array)
        if array.ndim == 0:
            read[name] = float(array)
        elif array.shape == (steps + 1,):
            read[name] = array.copy()  # the caller may write to his own before all of the run is evaluated
        else:
            fault = f"the shape is {array.shape}, ({steps + 1},) is needed: one value at every point of the step grid"
            hint = "a number, a function of t, or a table of that length"
            if array.ndim == 2 and 2 in array.shape:
                hint = "lambda t: np.interp(t, times, values), of the times and the values that it holds"
            raise UsageError(Problem(f"input {name}", f"{fault} [E2067]", hint))
    return read


def _call_at(name: str, signal: Function, times: Array) -> Array:
    """Return the values (n,) of the caller's function for the input `name` at times (n,) in s. Raises UsageError if the
    function fails, or gives anything but a finite number."""
    values = np.empty(len(times))
    for index, t in enumerate(times):
        try:
            value = signal(float(t))
        except Exception as error:
            fault = f"the function failed at t = {t:.9g} s: {type(error).__name__}: {error} [E2020]"
            hint = "a function that gives a number at every time of the run"
            if isinstance(error, TypeError):
                hint = "lambda t: ..., as inputs see the time only"
                hint += "; feedback is a sampled controller, a formula of the scene, or model.start"
            raise UsageError(Problem(f"input {name}", fault, hint)) from error
        if value is None:
            fault = f"the function returns None at t = {t:.9g} s [E2068]"
            raise UsageError(Problem(f"input {name}", fault, "a return statement with its value"))
        try:
            values[index] = value
        except (TypeError, ValueError):
            shape = np.shape(value) if isinstance(value, np.ndarray | list | tuple) else ()
            kind = f"{math.prod(shape)} numbers" if shape else type(value).__name__
            fault = f"the function gives {kind} at t = {t:.9g} s, and one real number is needed [E2069]"
            hint = "one function for each input" if shape else "float(...) of the value that is meant"
            raise UsageError(Problem(f"input {name}", fault, hint)) from None
    return _finite(name, values, times)


def _finite(name: str, values: Array, times: Array) -> Array:
    """Return the values of a function, (n,), at times (n,). Raises UsageError if one is not finite."""
    if not np.all(np.isfinite(values)):
        index = int(np.argmin(np.isfinite(values)))
        fault = f"the function gives {values[index]} at t = {times[index]:.9g} s [E2070]"
        raise UsageError(Problem(f"input {name}", fault, "finite numbers over the whole run"))
    return values
