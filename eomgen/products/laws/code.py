"""Code of laws: C functions of a file, compiled alone, and called between guards for values in NumPy."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable
from dataclasses import asdict
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, replace
from eomgen.base.files import template_folder
from eomgen.base.messages import counted
from eomgen.errors import Problem, ToolchainError
from eomgen.system.signals import CSource, PythonFunction

if TYPE_CHECKING:
    from eomgen.toolchain.python_functions import PythonFunctions

#: Name of the number type that follows the type of a build, and the definition for files with this name.
NUMBER = "eomgen_number"
_NUMBER_TYPE = f"""\
#if defined(EOMGEN_REAL_FLOAT)
typedef float {NUMBER};
#else
typedef double {NUMBER};
#endif"""
#: Calls of unknown functions are faults: older compilers guess their arguments.
_STRICT = '#pragma GCC diagnostic error "-Wimplicit-function-declaration"'
#: Function of one point: from arguments and parameters (n,) to results.
OfPoint = Callable[[Array], Array]
_EXPORTED = '__attribute__((visibility("default")))'


def arguments_of(real: str, results: str) -> str:
    """Return the declaration of the arguments of a C function of a law."""
    return f"const {real} *arguments, const {real} *parameters, {real} *{results}"


def _prototypes(code: CCode | PythonCode) -> tuple[str, ...]:
    names = {code.function: "results", code.slopes: "partials"}
    return tuple(f"void {name}({arguments_of(code.real, output)});" for name, output in names.items() if name)


class CompiledLaw:
    """The functions of a law in C, called from Python at one point.

    Parameters
    ----------
    ffi : of cffi
    functions : the C functions of values and of slopes; None for no slopes
    sizes : numbers of arguments, parameters and results
    """

    def __init__(
        self,
        ffi: Any,
        functions: tuple[Callable[..., None], Callable[..., None] | None],
        sizes: tuple[int, int, int],
    ) -> None:
        self._ffi, self._functions, self._sizes = ffi, functions, sizes

    def value(self, x: Array) -> Array:
        """Return the results at arguments and parameters."""
        return self.guarded(False, x, 0.0)[0]

    @property
    def slopes(self) -> OfPoint | None:
        """The function of partials, row-major; None if there is none."""
        return None if self._functions[1] is None else lambda x: self.guarded(True, x, 0.0)[0]

    def guarded(self, of_slopes: bool, x: Array, fill: float) -> tuple[Array, str]:
        """Return values (or partials, ``of_slopes``) at a point, computed in arrays surrounded by the number ``fill``,
        and the first place outside the results to which the function wrote, in words; empty for none."""
        n, p, m = self._sizes
        size, guard = m * n if of_slopes else m, 4
        arrays = []
        for numbers in (x[:n], x[n : n + p], np.full(size, fill)):
            arrays.append(np.full(len(numbers) + 2 * guard, fill))
            arrays[-1][guard : guard + len(numbers)] = numbers
        before = [array.copy() for array in arrays]
        pointers = [self._ffi.from_buffer("double[]", array, True) + guard for array in arrays]
        function: Any = self._functions[of_slopes]
        function(*pointers)
        values = arrays[-1][guard : guard + size].copy()
        arrays[-1][guard : guard + size] = fill
        places = ("the arguments", "the parameters", f"beyond {counted(size, 'entry', 'entries')}")
        written = (
            region
            for region, old, new in zip(places, before, arrays, strict=True)
            if not np.array_equal(old, new, equal_nan=True)
        )
        return values, next(written, "")


@dataclass(frozen=True)
class CCode:
    """Functions in a C file."""

    source: CSource
    function: str
    slopes: str = ""

    def __str__(self) -> str:
        return f"{self.function} in {self.source.name}"

    @property
    def labels(self) -> tuple[str, str]:
        """Functions of values and partials for messages."""
        return self.function, self.slopes

    @property
    def real(self) -> str:
        """Number type of the functions: double, unless the file names the type that follows the build."""
        return NUMBER if NUMBER in self.source.text else "double"

    @property
    def prototypes(self) -> tuple[str, ...]:
        """Declarations of the functions."""
        return (*([_NUMBER_TYPE] if self.real == NUMBER else []), *_prototypes(self))

    def compiled(self, sizes: tuple[int, int, int]) -> CompiledLaw:
        """Return the functions for Python. Raises ToolchainError."""
        ffi, lib = _routine(self)
        return CompiledLaw(ffi, (lib.eomgen_law, lib.eomgen_law_slopes if self.slopes else None), sizes)


@dataclass(frozen=True)
class PythonCode:
    """Functions in a Python file, for prototypes: C functions of the model call these functions through pointers."""

    source: CSource
    python: PythonFunction
    real: str = "double"

    def __str__(self) -> str:
        return f"{self.python.function} in {Path(self.python.file).name}"

    @property
    def function(self) -> str:
        """Name of the C function."""
        return f"{self.python.setter}_values"

    @property
    def slopes(self) -> str:
        """Name of the C function of partials; empty for differences."""
        return f"{self.python.setter}_slopes" if self.python.partials or self.python.complex_step else ""

    @property
    def labels(self) -> tuple[str, str]:
        """Functions of values and partials for messages."""
        return self.python.function, self.python.partials or "complex steps"

    @property
    def prototypes(self) -> tuple[str, ...]:
        """Declarations of the C functions."""
        return _prototypes(self)

    def compiled(self, _: tuple[int, int, int]) -> PythonFunctions:
        """Return the functions for Python. Raises ModelError."""
        from eomgen.toolchain.python_functions import PythonFunctions  # noqa: PLC0415  # executed at a build

        return PythonFunctions(asdict(self.python))


def python_code(
    label: str, file: Path, text: str, functions: tuple[str, str], complex_step: bool, sizes: tuple[int, int, int]
) -> PythonCode:
    """Return the code of a law in Python, with the C through whose pointers a model calls it.

    The pointers are the only variables of this kind in all files that eomgen writes: a variable outside of functions
    would let two models or two threads act on each other. The pointers are sound because the loader sets the pointers
    once, to the same functions each time, before anything is called, and because such a file never leaves the machine:
    ``generate`` refuses prototypes.

    Parameters
    ----------
    label : of the law
    file, text : the Python file and its text
    functions : names of the functions of values and of partials; no name: none
    complex_step : whether partials are by complex steps
    sizes : numbers of arguments, parameters and results
    """
    path = str(file.resolve())
    content = repr((label, path, text, functions, complex_step, sizes))
    setter = f"python_law_{hashlib.sha256(content.encode()).hexdigest()[:12]}"
    python = PythonFunction(label, path, text, *functions, complex_step, sizes, setter)
    template = (template_folder() / "laws/python_law.c").read_text(encoding="utf-8")
    arguments = arguments_of("double", "results")
    written = template.format(setter=setter, arguments=arguments, values=sizes[2], slopes=sizes[0] * sizes[2])
    return PythonCode(CSource(f"{file.stem}_{setter}.c", written, python), python)


@cache
def _routine(code: CCode) -> tuple[Any, Any]:
    """Return ``ffi`` and ``lib`` of cffi for a C file that is compiled alone, with functions ``eomgen_law`` and
    ``eomgen_law_slopes``. Raises ToolchainError with lines of the file."""
    from eomgen.toolchain.builder import Builder  # noqa: PLC0415  # scenes are read without a compiler
    from eomgen.toolchain.compiler import faults_in  # noqa: PLC0415

    calls = [("eomgen_law", code.function), *([("eomgen_law_slopes", code.slopes)] if code.slopes else [])]
    lines = [
        *code.prototypes,
        _STRICT,
        f'#line 1 "{code.source.name}"',
        code.source.text.removesuffix("\n"),
        "",
        *(
            f"{_EXPORTED} void {name}({arguments_of('double', 'y')}) {{ {function}(arguments, parameters, y); }}"
            for name, function in calls
        ),
        "",
    ]
    cdef = "\n".join(f"void {name}({arguments_of('double', 'y')});" for name, _ in calls)
    try:
        return Builder("reproducible").build_routine("\n".join(lines), cdef)
    except ToolchainError as error:
        names = {"routine.c": code.source.name}
        faults = faults_in(str(error), names)
        signature = f"C99, and void {code.function}({arguments_of(code.real, 'results')})"
        header = "#include <...> of the header with its declaration, as <math.h>, or the function before the call"
        named = [replace(fault, hint=header if "implicit" in str(fault) else signature) for fault in faults]
        if absent := re.search(r"undefined symbol: (\w+)|symbol not found[^']*'_?(\w+)'", str(error)):
            fault = f"the function {absent[1] or absent[2]} is declared or called, and has no body in the file [E0887]"
            named = [Problem(code.source.name, fault, f"the body in {code.source.name}: a law has one file")]
        raise ToolchainError(named or list(error.problems)) from None
