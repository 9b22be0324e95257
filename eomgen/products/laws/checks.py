"""Record of a law on the tape, and checks of the C functions at some points before: faults that no compiler sees."""

from __future__ import annotations

import contextlib
import faulthandler
import os
import select
import signal
from collections.abc import Sequence
from weakref import WeakSet

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.drawing_process import fork
from eomgen.base.messages import counted, listed
from eomgen.errors import ModelError, Problem
from eomgen.products.laws.code import CompiledLaw, OfPoint, PythonCode
from eomgen.products.laws.law import FileLaw
from eomgen.symbolic.external import Call, add_call
from eomgen.symbolic.scalar import Algebra, Scalar

#: Steps of differences relative to the scales, of which the second is the smaller one.
_STEPS = (1e-4, 2e-5)
#: Relative differences from which on partials are wrong, and from which on partials are wrong at five or more points:
#: laws in float agree at a few points by chance.
_WRONG, _DOUBTFUL = 1e-2, 1e-3
#: Longest time of a call, s.
_LONGEST = 10.0


def recorded(algebra: Algebra, law: FileLaw, word: str, component: int, arguments: Sequence[Scalar]) -> Scalar:
    """Check a law, record a call of its function on the tape, and return the scalar of the result number ``component``.
    ``arguments`` are the arguments, then the parameters."""
    check(law)
    with algebra.tape.block(law.label):
        results = add_call(algebra.tape, Call(law, tuple(argument.ref for argument in arguments)))
    return Scalar(algebra.tape, results[component])


def check(law: FileLaw) -> None:
    """Check the functions of a law, once.

    Raises
    ------
    ModelError
        A function that reads or writes beyond the arrays, leaves results unset, keeps numbers from call to call, or
        whose partials differ from differences.
    ToolchainError
        The file cannot be compiled.
    """
    if law in _CHECKED:
        return
    made = zip(law.code.labels, (law.functions.value, law.functions.slopes), strict=True)
    functions = [(name, function) for name, function in made if function is not None]
    points = _points(law)
    _check_return(law, functions, points)
    if isinstance(law.code, PythonCode):
        points = _sound_points(functions, points)
    for name, function in functions:
        first = [function(point) for point in points]
        for point, values in zip(points, first, strict=True):
            if not np.array_equal(values, function(point), equal_nan=True):
                fault = f"{name} gives other values in a second call with the same arguments [E0879]"
                raise _error(law, fault, "no static variables: models run in several threads, and steps are repeated")
    if isinstance(law.functions, CompiledLaw):
        for of_slopes, (name, _) in enumerate(functions):
            _check_memory(law, law.functions, name, bool(of_slopes), points)
    if law.functions.slopes is not None:
        _check_partials(law, law.functions.value, law.functions.slopes, points)
    _CHECKED.add(law)


#: Laws that passed; a law stands for a file and for formulas of parameters.
_CHECKED: WeakSet[FileLaw] = WeakSet()


def _points(law: FileLaw) -> Array:
    """Return twelve points (points, arguments and parameters), random, of the size of the scales, half of them all
    positive."""
    rng, size = np.random.default_rng(36), (12, len(law.scales))
    signs = np.where(np.arange(size[0])[:, np.newaxis] % 2, rng.choice([-1.0, 1.0], size), 1.0)
    return np.asarray(signs * rng.uniform(0.2, 1.0, size) * np.array(law.scales))


def _check_return(law: FileLaw, functions: Sequence[tuple[str, OfPoint]], points: Array) -> None:
    """Check in another process that functions come back at all points; raise ModelError for a fault of memory, exit()
    or a loop longer than 10 s, which would end or hold this process. ``functions`` are pairs of name and function.
    Without fork, as in Windows, the check is left out."""
    if not hasattr(os, "fork"):
        return
    calls = [(name, function, point) for name, function in functions for point in points]
    reader, writer = os.pipe()
    child = fork()
    if not child:
        try:
            faulthandler.disable()
            for _, function, point in calls:
                os.write(writer, b".")
                with contextlib.suppress(ModelError):  # of a function in Python
                    function(point)
            os.write(writer, b".")
        finally:
            os.kill(os.getpid(), signal.SIGKILL)  # without the work of Python's end
    os.close(writer)
    begun, hangs, more = 0, False, b"."
    try:
        while more and not hangs:
            hangs = not select.select([reader], [], [], _LONGEST)[0]
            more = b"" if hangs else os.read(reader, 4096)
            begun += len(more)
    finally:
        os.close(reader)
        if hangs or more:
            os.kill(child, signal.SIGKILL)
        _, status = os.waitpid(child, 0)
    if begun > len(calls):
        return
    name, _, point = calls[max(begun, 1) - 1]
    code = os.waitstatus_to_exitcode(status)
    end = signal.Signals(-code).name if code < 0 else f"exit({code})"
    hint = (
        "loops that end" if hangs else "results for all numbers: reads and writes within the arrays, no exit, no assert"
    )
    arguments = ", ".join(f"{label} = {x:.6g}" for label, x in zip([*law.inputs, *law.given], point, strict=True))
    fault = f"{name} ends the process by {end} at {arguments} [E0878]"
    raise _error(law, f"{name} does not return within {_LONGEST:g} s at {arguments} [E0877]" if hangs else fault, hint)


def _check_memory(law: FileLaw, compiled: CompiledLaw, name: str, of_slopes: bool, points: Array) -> None:
    """Raise ModelError for a function in C that reads or writes beyond its arrays or leaves a result unset, as values
    around the arrays show."""
    for point in points:
        values, _ = compiled.guarded(of_slopes, point, 0.0)
        for fill in (np.nan, 7.0) if np.all(np.isfinite(values)) else ():
            guarded_values, beyond = compiled.guarded(of_slopes, point, fill)
            if unset := np.flatnonzero(guarded_values != values).tolist():
                read = f"{counted(law.arguments, 'argument')} and {counted(law.parameters, 'parameter')}"
                fault = f"{name} reads beyond {read}, or leaves entry {unset[0]} of {len(values)} unset [E0880]"
                raise _error(law, fault, _order(law, name))
            if beyond:
                fault = f"{name} writes {'' if 'beyond' in beyond else 'to '}{beyond} [E0881]"
                raise _error(law, fault, _order(law, name))


def _sound_points(functions: Sequence[tuple[str, OfPoint]], points: Array) -> Array:
    """Return the points at which functions in Python raise no error. Raises the error of the first point if there are
    none."""
    sound, failures = [], []
    for point in points:
        try:
            for _, function in functions:
                function(point)
            sound.append(point)
        except ModelError as error:
            failures.append(error)
    if not sound:
        raise failures[0]
    return np.array(sound)


def _order(law: FileLaw, name: str) -> str:
    """Return the order of the arrays of the function ``name`` for a hint: partials, or arguments, parameters and
    results."""
    results, arguments = list(law.outputs), list(law.inputs)
    if name == law.code.slopes:
        return (
            f"partials[{law.arguments} * i + j] of result i among {listed(results)} by argument j among"
            f" {listed(arguments)}"
        )
    order = f"arguments are {listed(arguments)}"
    order += f", parameters {listed(list(law.given))}" if law.given else ""
    return f"{order}, and results {listed(results)}, in this order"


def _check_partials(law: FileLaw, value: OfPoint, slopes: OfPoint, points: Array) -> None:
    """Raise ModelError if partials disagree with central differences of the values, at points at which differences with
    two steps agree."""
    n, scales, centred = law.arguments, np.array(law.scales), np.eye(len(law.scales))
    compared = np.zeros((law.results, n), dtype=int)
    wrong = np.zeros((law.results, n), dtype=int)
    doubtful = np.zeros((law.results, n), dtype=int)
    shown: dict[tuple[int, int], str] = {}
    for point in points:
        exact = slopes(point).reshape(law.results, n)
        middle = value(point)
        for j in range(n):
            moved = [step * scales[j] * centred[j] for step in _STEPS]
            large, small = ((value(point + by) - value(point - by)) / (2.0 * by[j]) for by in moved)
            size = np.abs(large) + np.abs(middle) / scales[j] * 1e-6
            sound = np.isfinite(exact[:, j]) & (np.abs(large - small) <= _STEPS[0] * size)
            off = np.abs(exact[:, j] - small) / np.maximum(np.maximum(size, np.abs(exact[:, j])), np.finfo(float).tiny)
            compared[:, j] += sound
            wrong[:, j] += sound & (off > _WRONG)
            doubtful[:, j] += sound & (off > _DOUBTFUL)
            for i in map(int, np.flatnonzero(sound & (off > _DOUBTFUL))):
                where = ", ".join(f"{name} = {x:.6g}" for name, x in zip(law.inputs, point, strict=False))
                shown.setdefault((i, j), f"{exact[i, j]:.6g} and not {small[i]:.6g} at {where}")
    for (i, j), text in shown.items():
        often = doubtful[i, j] >= 5 and 2 * doubtful[i, j] > compared[i, j]
        if often or 2 * wrong[i, j] > compared[i, j]:
            result, argument = list(law.outputs)[i], list(law.inputs)[j]
            function, partials = law.code.labels
            fault = f"the derivative of {result} by {argument} is {text}, as differences of {function} say"
            hint = f"{_order(law, law.code.slopes)}; or no partials"
            if isinstance(law.code, PythonCode):
                hint = "rows by result and columns by argument; or no partials"
                hint = (
                    hint if law.code.python.partials else "no abs, comparison or rounding of arguments; or differences"
                )
            raise _error(law, f"{partials}: {fault} [E0886]", hint)


def _error(law: FileLaw, fault: str, hint: str) -> ModelError:
    return ModelError(Problem(f"laws.{law.name}", fault, hint))
