"""Code of laws: C functions of a file, compiled alone, and called between guards for values in NumPy."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, replace
from eomgen.base.messages import counted
from eomgen.errors import Problem, ToolchainError
from eomgen.system.signals import CSource

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
_CDEF = """\
void eomgen_law(const double *arguments, const double *parameters, double *results);
void eomgen_law_slopes(const double *arguments, const double *parameters, double *partials);
"""


def arguments_of(real: str, results: str) -> str:
    """Return the declaration of the arguments of a C function of a law."""
    return f"const {real} *arguments, const {real} *parameters, {real} *{results}"


class Compiled:
    """The functions of a law in C, called from Python at one point.

    Parameters
    ----------
    ffi : of cffi
    functions : the C functions of values and of slopes; None for no slopes
    sizes : numbers of arguments, parameters and results
    """

    #: Entries of guards around arrays.
    _GUARD = 4

    def __init__(
        self,
        ffi: Any,
        functions: tuple[Callable[..., None], Callable[..., None] | None],
        sizes: tuple[int, int, int],
    ) -> None:
        self._ffi, self._functions, self._sizes = ffi, functions, sizes

    def value(self, x: Array) -> Array:
        """Return the results at arguments and parameters."""
        return self._called(False, x)

    @property
    def slopes(self) -> OfPoint | None:
        """The function of partials, row-major; None if there is none."""
        return None if self._functions[1] is None else lambda x: self._called(True, x)

    def _called(self, of_slopes: bool, x: Array) -> Array:
        n, _, m = self._sizes
        given, result = np.array(x, dtype=np.float64), np.zeros(m * n if of_slopes else m)  # a law may write to both
        first = self._ffi.from_buffer("double[]", given) if len(given) else self._ffi.NULL
        function: Any = self._functions[of_slopes]
        function(first, first + n, self._ffi.from_buffer("double[]", result, True))
        return result

    def guarded(self, of_slopes: bool, x: Array, fill: float) -> tuple[Array, str]:
        """Return values from arrays that lie apart with a fill around, and the first place beside the results that the
        function wrote to; empty for none."""
        n, p, m = self._sizes
        size, guard = m * n if of_slopes else m, self._GUARD
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
            place
            for place, old, new in zip(places, before, arrays, strict=True)
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
    def real(self) -> str:
        """Number type of the functions: double, unless the file names the type that follows the build."""
        return NUMBER if NUMBER in self.source.text else "double"

    @property
    def prototypes(self) -> tuple[str, ...]:
        """Declarations of the functions."""
        names = {self.function: "results", self.slopes: "partials"}
        declared = [f"void {name}({arguments_of(self.real, given)});" for name, given in names.items() if name]
        return (*([_NUMBER_TYPE] if self.real == NUMBER else []), *declared)

    def compiled(self, sizes: tuple[int, int, int]) -> Compiled:
        """Return the functions for Python. Raises ToolchainError."""
        ffi, lib = _routine(self)
        return Compiled(ffi, (lib.eomgen_law, lib.eomgen_law_slopes if self.slopes else None), sizes)


@cache
def _routine(code: CCode) -> tuple[Any, Any]:
    """Return ``ffi`` and ``lib`` of a file that is compiled alone. Raises ToolchainError with lines of the file."""
    from eomgen.toolchain.builder import Builder  # noqa: PLC0415  # scenes are read without a compiler
    from eomgen.toolchain.compiler import faults_in  # noqa: PLC0415

    text = code.source.text if code.source.text.endswith("\n") else f"{code.source.text}\n"
    calls = [("eomgen_law", code.function), *([("eomgen_law_slopes", code.slopes)] if code.slopes else [])]
    lines = [
        *code.prototypes,
        _STRICT,
        f'#line 1 "{code.source.name}"',
        f"{text}",
        *(
            f"{_EXPORTED} void {name}({arguments_of('double', 'y')}) {{ {function}(arguments, parameters, y); }}"
            for name, function in calls
        ),
        "",
    ]
    cdef = "\n".join(_CDEF.splitlines()[: len(calls)])
    try:
        return Builder("reproducible").build_routine("\n".join(lines), cdef)
    except ToolchainError as error:
        names = {"routine.c": code.source.name}
        faults = faults_in(str(error), names)
        signature = f"C99, and void {code.function}({arguments_of(code.real, 'results')})"
        header = "#include <...> of the header with its declaration, as <math.h>, or the function before the call"
        named = [replace(fault, hint=header if "implicit" in str(fault) else signature) for fault in faults]
        if absent := re.search(r"undefined symbol: (\w+)|symbol not found[^']*'_?(\w+)'", str(error)):
            fault = f"the function {absent[1] or absent[2]} is declared or called, and has no body in the file"
            named = [Problem(code.source.name, fault, f"the body in {code.source.name}: a law has one file")]
        raise ToolchainError(named or list(error.problems)) from None
