"""Functions of the caller that compute the outputs of sampled controllers: checked, called by a compiled stepper.

If classes are given, a run makes an object of each for each of its steppers. Whether a function may be called again, by
the runs of an error estimate or by a copy, depends on its memory: memory that the scene declares is part of the
internal states, and is copied with these.
"""

from __future__ import annotations

import functools
import inspect
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.messages import listed, shown
from eomgen.compiled.arguments import check_name
from eomgen.errors import Problem, UsageError
from eomgen.toolchain.library import Library

#: ``f(t, signals)``, with declared memory ``f(t, signals, memory)``, or a class whose objects are called so.
Controller = Callable[..., Any]
#: As the member ``control`` of the settings in C.
_TYPE = "int(void *, int, double, double *, double *, double *)"
#: Share of a run's time, and s, from which on calls are reported.
_SLOW_SHARE, _SLOW = 0.5, 1.0


@dataclass(frozen=True)
class CallerControllers:
    """The functions of a run, in the order of their indices in compiled code.

    Attributes
    ----------
    rows : entry of each controller in the layout of the stepper
    functions : as given by the caller
    """

    rows: tuple[Mapping[str, Any], ...]
    functions: tuple[Controller, ...]

    @property
    def undeclared_names(self) -> str:
        """The names of the controllers that may keep data outside of the states; empty: all go on from any state."""
        return ", ".join(row["name"] for row in self.rows if not row["declared"])

    @property
    def single(self) -> str:
        """The names of the controllers that cannot be made anew for another run; empty: all can."""
        pairs = zip(self.rows, self.functions, strict=True)
        return ", ".join(row["name"] for row, function in pairs if not row["declared"] and not _makes(function))

    def on(self, library: Library) -> BoundControllers:
        """Return the functions for one stepper of a library, with new objects of classes.

        Raises
        ------
        UsageError
            A class cannot be called without arguments, or its objects cannot be called.
        """
        functions = [
            _make_function(row["name"], function) if _makes(function) else function
            for row, function in zip(self.rows, self.functions, strict=True)
        ]
        return BoundControllers(self.rows, functions, library)


def called_by(layout: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Return the sampled controllers of a compiled stepper whose functions the caller gives."""
    return [item for item in layout["method"].get("samples", {}).get("controllers", ()) if not item["function"]]


def read_controllers(functions: Mapping[str, Controller] | None, layout: Mapping[str, Any]) -> CallerControllers | None:
    """Return the caller's functions for the sampled controllers of a stepper, checked; None if none are needed.

    `functions` has functions by the names of controllers, `layout` is the library's.

    Raises
    ------
    UsageError
        Anything but a mapping from names to functions; names that are unknown or missing; a function that does not take
        the arguments of its calls.
    """
    rows = called_by(layout)
    names = tuple(str(row["name"]) for row in rows)
    if functions is not None and not isinstance(functions, Mapping):
        kind = "a function" if callable(functions) else type(functions).__name__
        hint = f'controllers={{"{names[0] if names else "name"}": function}}'
        fault = f"a mapping from names to functions is needed, not {kind} [E2054]"
        raise UsageError(Problem("controllers", fault, hint))
    for name, function in (functions or {}).items():
        if not names:
            fault = "no controller of the scene leaves its function to the caller [E2055]"
            hint = 'type = "sampled" without a source in the scene'
            raise UsageError(Problem(f"controller {shown(str(name))}", fault, hint))
        check_name("controller", name, names)
        if not callable(function):
            fault = f"a function of t and its signals is needed, not {type(function).__name__} [E2056]"
            raise UsageError(Problem(f"controller {name}", fault, "def law(t, signals): return ..."))
    problems = []
    for row in rows:
        where, fault = f"controller {row['name']}", ""
        if row["name"] not in (functions or {}):
            fault = "the scene leaves its function to the caller [E2058]"
            hint = f"controllers={{{row['name']!r}: law}} in Python, where law({_arguments(row)}) gives {_numbers(row)}"
        elif not _takes_arguments(functions[row["name"]], row):  # type: ignore[index]  # a mapping, if a name is in it
            count = 2 + bool(row["memory_states"])
            fault = f"the function does not take the {count} arguments that it is called with [E2057]"
            hint = f"def law({_arguments(row)}), where {_meaning(row)}"
        if fault:
            problems.append(Problem(where, fault, hint))
    if problems:
        raise UsageError(problems)
    return CallerControllers(tuple(rows), tuple((functions or {})[name] for name in names)) if rows else None


class BoundControllers:
    """The functions of a run as one C function, with their errors and their cost.

    Attributes
    ----------
    calls, seconds : of all functions so far
    """

    def __init__(self, rows: Sequence[Mapping[str, Any]], functions: Sequence[Controller], library: Library) -> None:
        self.calls, self.seconds = 0, 0.0
        self._rows, self._functions = rows, functions
        self._ffi = library.ffi
        self._failure: BaseException | None = None
        # C returns 1 if Python cannot begin, for instance for lack of memory.
        self._callback = library.ffi.callback(_TYPE, self._call, error=1)

    @property
    def address(self) -> int:
        return int(self._ffi.cast("uintptr_t", self._callback))

    def raise_failure(self) -> None:
        """Raise the error of the last call of compiled code, once, if a function failed."""
        failure, self._failure = self._failure, None
        if failure is not None:
            raise failure

    def cost(self, wall: float) -> str:
        """Return a sentence on the time in the functions if it is most of a run's ``wall`` s; else an empty text."""
        if not self.calls or self.seconds < max(_SLOW, _SLOW_SHARE * wall):
            return ""
        each = self.seconds / self.calls
        share = self.seconds / wall
        return f"{share:.0%} of the time went into the functions of controllers: {self.calls} calls of {each:.3g} s"

    def _call(self, _: Any, number: int, t: float, signals: Any, values: Any, memory: Any) -> int:
        """Call a controller's Python function from C, and write its values and memory into the C arrays. Returns 0, or
        1 for a failure, whose error is kept for ``raise_failure``. `number` is the controller's index, `t` in s;
        `signals`, `values` and `memory` are pointers to doubles."""
        row, began = self._rows[number], time.perf_counter()
        try:
            inputs = self._array(signals, len(row["signal_states"]))
            if row["memory_states"]:
                state = self._array(memory, len(row["memory_states"]))
                result = self._functions[number](t, inputs, state)
                _check_finite(row, "leaves in its memory", state, t)
                memory[0 : len(state)] = state.tolist()
            else:
                result = self._functions[number](t, inputs)
            outputs = _values(row, result, t)
            values[0 : len(outputs)] = outputs.tolist()
        except UsageError as error:
            self._failure = error
        except Exception as error:
            fault = f"the function failed at t = {t:.9g} s: {type(error).__name__}: {error} [E2020]"
            hint = f"the traceback above this message; the arguments are {_arguments(row)}, where {_meaning(row)}"
            self._failure = UsageError(Problem(f"controller {row['name']}", fault, hint))
            self._failure.__cause__ = error
        except BaseException as error:  # Ctrl-C, exit: passed on through compiled code.
            self._failure = error
        self.calls += 1
        self.seconds += time.perf_counter() - began
        return int(self._failure is not None)

    def _array(self, numbers: Any, size: int) -> Array:
        """Return a copy, which functions may keep."""
        if not size:
            return np.zeros(0)
        return np.frombuffer(self._ffi.buffer(numbers, 8 * size), dtype=np.float64).copy()


def _makes(controller: Controller) -> bool:
    """Return whether a controller is a class, or a partial of a class, whose objects are functions."""
    return isinstance(controller.func if isinstance(controller, functools.partial) else controller, type)


def _make_function(name: str, controller: Controller) -> Controller:
    kind = controller.func if isinstance(controller, functools.partial) else controller
    label = getattr(kind, "__name__", str(kind))
    try:
        result = controller()
    except Exception as error:
        fault = f"the class {label} makes no object: {type(error).__name__}: {error} [E2060]"
        hint = "a class without arguments, or functools.partial(...) with them"
        raise UsageError(Problem(f"controller {name}", fault, hint)) from error
    if not callable(result):
        fault = f"objects of the class {label} cannot be called [E2059]"
        raise UsageError(Problem(f"controller {name}", fault, "def __call__(self, t, signals): return ..."))
    function: Controller = result
    return function


def _arguments(row: Mapping[str, Any]) -> str:
    return "t, signals, memory" if row["memory_states"] else "t, signals"


def _meaning(row: Mapping[str, Any]) -> str:
    """Return the meaning of the arguments of a function, in the order of arrays."""
    order = ", ".join(f"signals[{k}] = {name}" for k, name in enumerate(row["signals"])) or "signals is empty"
    size = len(row["memory_states"])
    kept = f", and memory is an array of {size} to read and to write, which the next call is handed" if size else ""
    return f"t is in s, {order}{kept}"


def _takes_arguments(controller: Controller, row: Mapping[str, Any]) -> bool:
    """Return whether a controller can be called with (t, signals), or (t, signals, memory) if declared; True if
    unknown."""
    if _makes(controller):
        return True
    try:
        inspect.signature(controller).bind(*[None] * (2 + bool(row["memory_states"])))
    except TypeError:
        return False
    except ValueError:  # no signature is known of some functions in C
        return True
    return True


def _numbers(row: Mapping[str, Any]) -> str:
    names = listed(row["outputs"])
    return f"one number, {names}" if len(row["outputs"]) == 1 else f"{len(row['outputs'])} numbers: {names}"


def _values(row: Mapping[str, Any], result: object, t: float) -> Array:
    """Return the result of a controller's function as an array (number of outputs,). Raises UsageError if the result at
    time t in s has another shape or is not finite; `row` is the layout of the controller."""
    where, size = f"controller {row['name']}", len(row["outputs"])
    try:
        array = np.asarray(result, dtype=float)
    except (TypeError, ValueError):
        array = np.zeros((0, 0))
    if result is None or array.shape not in ((size,), () if size == 1 else (size,)):
        label = "nothing" if result is None else f"an array of shape {array.shape}"
        if result is not None and array.shape == (0, 0):
            label = f"{type(result).__name__}, which is not an array of numbers"
        fault = f"the function gives {label} at t = {t:.9g} s, and has to give {_numbers(row)} [E2061]"
        single = f"return value, the number that {row['outputs'][0]} holds"
        several = f"return {', '.join(row['outputs'])}"
        raise UsageError(Problem(where, fault, single if size == 1 else several))
    numbers = array.reshape(size)
    _check_finite(row, "gives", numbers, t)
    return numbers


def _check_finite(row: Mapping[str, Any], verb: str, array: Array, t: float) -> None:
    if not np.all(np.isfinite(array)):
        fault = f"the function {verb} {array[int(np.argmin(np.isfinite(array)))]} at t = {t:.9g} s [E2062]"
        hint = f"finite numbers over the whole run; the arguments are {_arguments(row)}, where {_meaning(row)}"
        raise UsageError(Problem(f"controller {row['name']}", fault, hint))
