"""Loaded libraries: functions on NumPy arrays, sizes checked once, a bound call costs 0.2 us besides the C; steppers of
several trajectories side by side, and the compiled successor of a library on the tape engine."""

from __future__ import annotations

import hashlib
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.errors import EomgenError, ToolchainError, UsageError
from eomgen.toolchain.cffi_build import load_abi
from eomgen.toolchain.compiler import RunningCompilers, in_background
from eomgen.toolchain.large_stack import with_stack
from eomgen.toolchain.tables import hand_over

Array = NDArray[Any]
#: Seconds before the compiler of a successor begins: the first step goes first.
_DELAY = 0.3


def _wrap_functions(lib: Any, layout: Mapping[str, Any], file: Path, lanes: int = 1) -> Any:
    """Return the functions of a library, called with enough stack for ``lanes`` samples, and raising errors of Python
    laws. For layouts with functions in Python, the pointers of the library at ``file`` are set."""
    if layout.get("python"):
        from eomgen.toolchain.python_functions import Raising, set_functions  # noqa: PLC0415  # few models have any

        lib = Raising(lib)
        set_functions(file, layout)
    return with_stack(lib, lanes * int(layout.get("stack", 0)))


class BoundCall:
    """A function of a library with its arrays: each call evaluates into the same outputs again."""

    __slots__ = ("_arrays", "_call", "_count", "_function", "_inputs", "_outputs", "_strides")

    def __init__(
        self,
        library: Library,
        function: int,
        count: int,
        inputs: Sequence[Array],
        strides: list[int],
        outputs: Sequence[Array],
    ) -> None:
        """Bind the arrays of a call, so that calls take no conversion."""
        ffi = library.ffi
        doubles, pointers, longs = library.types
        buffers = [ffi.from_buffer(doubles, array) for array in inputs]
        results = [ffi.from_buffer(doubles, array, True) for array in outputs]
        self._arrays = (inputs, outputs, buffers, results)  # keeps the memory alive
        self._inputs = ffi.new(pointers, buffers or [ffi.NULL])
        self._outputs = ffi.new(pointers, results or [ffi.NULL])
        self._strides = ffi.new(longs, strides or [0])
        self._call = library.lib.eomgen_call
        self._function = function
        self._count = count

    def __call__(self) -> None:
        if self._call(self._function, self._count, self._inputs, self._strides, self._outputs):
            raise MemoryError("the compiled model could not allocate memory for its arguments")


class Library:
    """A compiled model with the generic interface.

    Attributes
    ----------
    ffi, lib : of cffi; ``lib`` has the functions of the interface, on a stack of their own if the functions need a
        large stack.
    layout : mapping
        Data stored with the library; ``functions[k]`` has ``input_sizes`` and ``outputs`` with ``size``.
    mode : str
        ``api`` or ``abi``.
    folder : Path
        Folder of the library and its sources.
    digest : of the compiled code; equal digests give equal bits on one machine.
    dtype : NumPy type of inputs and outputs: float64, or complex128 for a complex build.
    kept : results that callers computed from this library once, by names that the callers choose
    profile : name of the build profile
    successor : Successor, or None
        Of a library on the tape engine: the compiled library that is being made; of a library that lacks functions: the
        library with all functions.
    predecessor : Library, or None
        The library that this library replaced.
    lacking : names of the functions of the layout that are only in the successor
    companion : callable, or None if there is no compiler, or numbers are not double
        ``companion(function)`` returns the library with this one function for as many samples as there are lanes, or
        None if that library is not in the cache; ``companion(function, running)`` compiles the library in that case.
    """

    profile = ""
    successor: Successor | None = None
    predecessor: Library | None = None
    companion: Callable[..., Library | None] | None = None

    def __init__(
        self, ffi: Any, lib: Any, layout: Mapping[str, Any], mode: str, file: Path, tables: bytes = b""
    ) -> None:
        """Read the number type, fingerprint and functions of a loaded library. Raises ToolchainError."""
        if tables:
            hand_over(file, tables)
        self.ffi, self._interface = ffi, lib
        self.lib = _wrap_functions(lib, layout, file)
        self.layout = layout
        self.mode = mode
        self.kept: dict[str, Any] = {}
        self.folder = folder = file.parent
        self.real = ffi.string(lib.eomgen_number_type()).decode()
        self.fingerprint: str = ffi.string(lib.eomgen_fingerprint()).decode()
        self.dtype = np.dtype(np.complex128 if self.real == "complex" else np.float64)
        self.lacking = frozenset(layout.get("later", ()))
        # a library with all functions has the bits of the library of runs that was made before
        self.digest = layout.get("digest") or hashlib.sha256(file.read_bytes() + tables).hexdigest()
        self._width = self.dtype.itemsize // 8
        self.types = tuple(ffi.typeof(text) for text in ("double[]", "double *[]", "long[]"))
        functions = layout["functions"]
        if lib.eomgen_size(0) != len(functions):
            raise ToolchainError(
                f"the library in {folder} has {lib.eomgen_size(0)} functions, its layout {len(functions)} [E2118]",
                "building again",
            )
        self._input_sizes = [tuple(function["input_sizes"]) for function in functions]
        self._output_sizes = [tuple(output["size"] for output in function["outputs"]) for function in functions]
        self.index = {function["name"]: number for number, function in enumerate(functions)}

    def address(self, name: str) -> int:
        """Return the address of a function of the interface for C that calls it, on ``layout["stack"]`` bytes."""
        return int(self.ffi.cast("uintptr_t", self.ffi.addressof(self._interface, name)))

    def bind(self, function: int | str, inputs: Sequence[Array], outputs: Sequence[Array]) -> BoundCall:
        """Return a function of the library bound to arrays, which a call without arguments evaluates.

        Parameters
        ----------
        function : number or name.
        inputs : arrays, C-contiguous, of the library's dtype
            ``(size,)`` for the same values in every sample, ``(count, size)`` for one row per sample.
        outputs : arrays of ``size`` numbers (one sample) or ``count * size``, filled in place.

        Raises
        ------
        UsageError
            An array of the wrong type, size or memory order.
        """
        number = self.index[function] if isinstance(function, str) else function
        if self.lacking and self._name(number) in self.lacking:
            return self.whole().bind(number, inputs, outputs)
        sizes, results = self._input_sizes[number], self._output_sizes[number]
        if len(inputs) != len(sizes) or len(outputs) != len(results):
            raise UsageError(
                f"{self._name(number)} takes {len(sizes)} arrays and fills {len(results)}, not {len(inputs)} and"
                f" {len(outputs)} [E2119]",
                f"inputs {', '.join(self.layout['functions'][number]['inputs'])}",
            )
        count, strides = 0, []
        for position, (array, size) in enumerate(zip(inputs, sizes, strict=True)):
            if array.dtype != self.dtype or not array.flags.c_contiguous:
                raise self._wrong_kind(array, number, "inputs", position)
            if array.shape == (size,):
                strides.append(0)
            elif array.ndim == 2 and array.shape[1] == size and count in (0, len(array)) and len(array):
                count = len(array)
                strides.append(size * self._width)
            else:
                name = self._argument(number, "inputs", position)
                fault = f"{name} has shape {array.shape} [E2121]"
                if count:
                    fault = f"{name} has shape {array.shape} where other inputs have {count} samples [E2120]"
                raise UsageError(fault, f"({size},) or ({count or 'samples'}, {size})")
        count = count or 1
        self._check_outputs(number, count, outputs)
        return BoundCall(self, number, count, inputs, strides, outputs)

    def _check_outputs(self, number: int, count: int, outputs: Sequence[Array]) -> None:
        for position, (array, size) in enumerate(zip(outputs, self._output_sizes[number], strict=True)):
            if array.dtype != self.dtype or not array.flags.c_contiguous:
                raise self._wrong_kind(array, number, "outputs", position)
            if array.size != count * size:
                raise UsageError(
                    f"{self._argument(number, 'outputs', position)} has {array.size} numbers for {count} samples of"
                    f" {size} [E2123]"
                )

    def call(self, function: int | str, inputs: Sequence[Array], outputs: Sequence[Array]) -> None:
        """Evaluate a function, by number or name, once and fill ``outputs`` in place; see ``bind`` for the arrays."""
        self.bind(function, inputs, outputs)()

    def whole(self) -> Library:
        """Return the library with all functions: this one, or its successor, which is made now or waited for.

        Raises
        ------
        EomgenError
            The successor cannot be made.
        """
        if not self.lacking or self.successor is None:
            return self
        return self.successor.result()

    def _name(self, number: int) -> str:
        return str(self.layout["functions"][number]["name"])

    def _argument(self, number: int, kind: str, position: int) -> str:
        argument = self.layout["functions"][number][kind][position]
        return f"{kind[:-1]} {argument if kind == 'inputs' else argument['name']} of {self._name(number)}"

    def _wrong_kind(self, array: Array, number: int, kind: str, position: int) -> UsageError:
        order = "" if array.flags.c_contiguous else ", not contiguous"
        return UsageError(
            f"{self._argument(number, kind, position)} is {array.dtype}{order} [E2124]",
            f"numpy.ascontiguousarray(x, dtype=numpy.{self.dtype})",
        )


class Successor:
    """The library that takes the place of a library on the tape engine, or of a library that lacks functions.

    Attributes
    ----------
    library : None until the library is made
    error : of the compiler, if the compiler failed

    Parameters
    ----------
    make : makes the library; the compilers are entered in the collection, if one is given
    at_once : whether compilers begin at once in the background, else when the library is asked for
    """

    def __init__(self, make: Callable[[RunningCompilers | None], Library], *, at_once: bool = True) -> None:
        self.library: Library | None = None
        self.error: EomgenError | OSError | None = None
        self._make = make
        self._ended = threading.Event()
        if at_once:
            in_background("eomgen-successor", self._work)
        else:
            self._ended.set()

    def _work(self, running: RunningCompilers) -> None:
        time.sleep(_DELAY)
        try:
            self.library = self._make(running)
        except (EomgenError, OSError) as error:
            self.error = error
        finally:
            self._ended.set()

    def wait(self, seconds: float | None = None) -> bool:
        """Wait until the compiler has ended, at most for the given seconds; return whether the compiler has ended."""
        return self._ended.wait(seconds)

    def result(self) -> Library:
        """Return the library, which is waited for, and made now if the background has not made it.

        Raises
        ------
        EomgenError
            The library cannot be made.
        """
        self.wait()
        if self.library is None:
            self.library = self._make(None)
        return self.library


class LaneLibrary:
    """A compiled stepper of several trajectories side by side, ``lanes`` at a time.

    Attributes
    ----------
    lanes : number of trajectories
    state_size, workspace_size : doubles of the memory of all trajectories together
    layout : of the library of one trajectory
    """

    def __init__(self, path: Path, cdef: str, layout: Mapping[str, Any], tables: bytes = b"") -> None:
        self.ffi, lib = load_abi(path, cdef)
        if tables:
            hand_over(path, tables)
        self.lanes = int(lib.eomgen_lanes_size(0))
        self.state_size, self.workspace_size = (int(lib.eomgen_lanes_size(k)) // 8 for k in (1, 2))
        self.lib = _wrap_functions(lib, layout, path, self.lanes)
        self.layout = layout
        self.path = path
