"""Functions of a user in Python that compiled code calls: prototypes of laws, by pointers that the loader of a library
sets. Calls take the interpreter's lock, so threads take turns."""

from __future__ import annotations

import importlib.abc
import threading
import traceback
import types
from collections.abc import Callable, Mapping
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.base.messages import counted, shown
from eomgen.errors import EomgenError, ModelError, Problem
from eomgen.toolchain.cffi_build import load_abi

Array = NDArray[np.float64]
_POINTER = "void (*{})(const double *, const double *, double *)"
#: Callbacks by setter; a library may keep a pointer for as long as the process runs.
_CALLBACKS: dict[str, tuple[Any, Any]] = {}
_FAILED = threading.local()


class PythonFunctions:
    """Values and slopes of a function in a Python file at single points.

    Parameters
    ----------
    data : mapping
        ``label`` of the function in messages, ``file`` and ``text`` of the Python file, names ``function`` and
        ``partials`` in the file, ``complex_step``, and ``sizes``: numbers of arguments, parameters and results.

    Raises
    ------
    ModelError
        The file fails when it is executed, or has no such functions.
    """

    def __init__(self, data: Mapping[str, Any]) -> None:
        self._data, self._sizes = data, tuple(data["sizes"])
        names = vars(_execute(str(data["label"]), str(data["file"]), str(data["text"])))
        self._function = self._function_named(names, data["function"])
        self._partials = self._function_named(names, data["partials"]) if data["partials"] else None

    def __reduce__(self) -> tuple[Any, ...]:
        return PythonFunctions, (self._data,)  # functions of such a file are in no module that can be imported

    def value(self, x: Array) -> Array:
        """Return the results at arguments and parameters."""
        return self._call(self._function, [float(number) for number in x], self._sizes[2], float)

    @property
    def slopes(self) -> Callable[[Array], Array] | None:
        """The function of partials, row-major; None if there is none."""
        if self._partials is not None:
            return self._by_partials
        return self._by_complex_steps if self._data["complex_step"] else None

    def _by_partials(self, x: Array) -> Array:
        n, _, m = self._sizes
        return self._call(self._partials, [float(number) for number in x], m * n, float)

    def _by_complex_steps(self, x: Array) -> Array:
        n, _, m = self._sizes
        slopes, step = np.zeros((m, n)), 1e-100  # whose square is far below the rounding of any number
        for column in range(n):
            moved = [complex(number) for number in x]
            moved[column] += complex(0.0, step)
            slopes[:, column] = self._call(self._function, moved, m, complex).imag / step
        return slopes.ravel()

    def _call(self, function: Any, x: list[Any], size: int, kind: type) -> NDArray[Any]:
        """Return the ``size`` numbers of type ``kind`` that a Python function gives at the numbers x, flat. Raises
        ModelError for an exception in the function, and for results that are not as many numbers."""
        try:
            result = function(*x)
        except EomgenError:
            raise
        except (Exception, SystemExit) as error:
            raise self._failure(error, x) from error
        try:
            if np.asarray(result).dtype.kind not in "biufc":  # NumPy makes numbers of None and of texts
                raise TypeError
            numbers: NDArray[Any] = np.asarray(result, dtype=kind).ravel()
        except (TypeError, ValueError) as error:
            fault = f"{function.__name__} gives {shown(result)}, and {counted(size, 'number')} are needed [E2126]"
            raise self._fault(fault, "return a number, or a list of all results") from error
        if len(numbers) != size:
            fault = f"{function.__name__} gives {counted(len(numbers), 'number')}, and {size} are needed [E2126]"
            raise self._fault(fault, "return a number, or a list of all results")
        return numbers

    def _failure(self, error: BaseException, x: list[Any]) -> ModelError:
        """Return the ModelError for an exception in a user's function, with file, line and arguments."""
        location, within = _place(error, str(self._data["file"]))
        point = ", ".join(f"{number.real:.6g}" for number in x)
        hint = "results for all numbers"
        if isinstance(error, TypeError) and not within:  # of the call
            hint = f"a function of {counted(sum(self._sizes[:2]), 'number')}: the arguments, then the parameters"
        elif isinstance(error, TypeError) and "not subscriptable" in str(error):  # written as in C
            taken = ", ".join(f"u{k}" for k in range(self._sizes[0])) or "..."
            taken += "".join(f", c{k}" for k in range(self._sizes[1]))
            hint = f"arguments and parameters as numbers, one by one: def {self._function.__name__}({taken})"
        elif self._data["complex_step"]:
            hint += "; a function for complex steps calls numpy or cmath in place of math"
        return self._fault(f"{location}: {type(error).__name__}: {error}, at the arguments {point} [E2127]", hint)

    def _fault(self, fault: str, hint: str) -> ModelError:
        return ModelError(Problem(str(self._data["label"]), fault, hint))

    def _function_named(self, names: Mapping[str, Any], name: str) -> Callable[..., Any]:
        function = names.get(name)
        if not callable(function):
            raise self._fault(
                f"{Path(self._data['file']).name} has no function {name} [E0904]", f"def {name}(...): in the file"
            )
        made: Callable[..., Any] = function
        return made


def _place(error: BaseException, file: str) -> tuple[str, bool]:
    """Return the name of a file, with the last line on the way to an error if there is one, and whether there is."""
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == file]
    return f"{Path(file).name}:{lines[-1]}" if lines else Path(file).name, bool(lines)


class _Loader(importlib.abc.SourceLoader):
    """Imports a Python file from the text that was read with the scene, without files of bytecode."""

    def __init__(self, file: str, text: str) -> None:
        self._file, self._text = file, text

    def get_filename(self, fullname: str) -> str:
        """Return the path for tracebacks."""
        return self._file

    def get_data(self, path: bytes | str) -> bytes:
        """Return the text."""
        return self._text.encode()


@cache
def _execute(label: str, file: str, text: str) -> types.ModuleType:
    """Return the module of a Python file ``text`` as it was read with the scene, executed once per process. Raises
    ModelError with the line that fails; ``label`` is the law in the message."""
    module = types.ModuleType(Path(file).stem)
    module.__file__ = file
    try:
        _Loader(file, text).exec_module(module)
    except (Exception, SystemExit) as error:
        fault = f"{_place(error, file)[0]}: {type(error).__name__}: {error} [E2233]"
        raise ModelError(Problem(label, fault, "a file that Python runs without an error")) from error
    return module


def set_functions(path: Path, layout: Mapping[str, Any]) -> None:
    """Set the pointers of the library at ``path`` to callbacks of the Python functions in the layout, if any."""
    for data in layout.get("python", ()):
        setter = str(data["setter"])
        pointers = ", ".join(_POINTER.format(name) for name in ("values", "slopes"))
        ffi, lib = load_abi(path, f"void {setter}({pointers});")
        if setter not in _CALLBACKS:
            functions = PythonFunctions(data)
            _CALLBACKS[setter] = (
                _callback(ffi, functions.value, data["sizes"]),
                ffi.NULL if functions.slopes is None else _callback(ffi, functions.slopes, data["sizes"]),
            )
        getattr(lib, setter)(*_CALLBACKS[setter])


def _callback(ffi: Any, function: Callable[[Array], Array], sizes: tuple[int, int, int]) -> Any:
    """Return a function of (arguments and parameters) as a C function pointer. ``sizes`` are the numbers of arguments,
    parameters and results. A call that fails keeps the error for ``Raising``, and leaves results that are not
    numbers."""
    n, p, _ = sizes

    def call(arguments: Any, parameters: Any, results: Any) -> None:
        try:
            x = np.array([*ffi.unpack(arguments, n), *(ffi.unpack(parameters, p) if p else ())])
            values = function(x)
            for index, number in enumerate(values.tolist()):
                results[index] = number
        except BaseException as error:
            if getattr(_FAILED, "error", None) is None:
                _FAILED.error = error

    return ffi.callback(_POINTER.format(""), call)


class Raising:
    """The functions of a library that calls Python: a call raises the error of a function in Python."""

    def __init__(self, lib: Any) -> None:
        self._lib = lib

    def __getattr__(self, name: str) -> Any:
        return partial(self._call, getattr(self._lib, name))

    @staticmethod
    def _call(function: Callable[..., Any], *arguments: Any) -> Any:
        _FAILED.error = None
        result = function(*arguments)
        error, _FAILED.error = _FAILED.error, None
        if error is not None:
            raise error
        return result
