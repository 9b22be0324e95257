"""A kernel's launch for arrays of one form: checked and laid out once, so that addresses alone change from call to
call."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from eomgen.errors import Problem, UsageError
from eomgen.products.gpu.arrays import ArrayPackage, Shape, View, merged_stride, package_of
from eomgen.products.gpu.driver import Module
from eomgen.products.gpu.kernels import Term

#: Names of arguments by block, if these differ.
ARGUMENTS = {"p": "parameters", "lam": "multipliers"}
#: Types of arrays by the number type of functions.
TYPES = {"double": "float64", "float": "float32"}
#: Numbers of an array in the arguments of a kernel: address, stride of samples, stride of components.
_WORDS = 3


class Call:
    """A launch for arrays of one form, for the thread that has made it.

    Parameters
    ----------
    term : whose arguments and outputs the arrays are
    module : with the kernels of the term
    package : of the results
    dtype : of all numbers
    values : arrays by argument, None for constants
    constants : addresses of the constants by argument
    out : arrays of the results, or none
    """

    def __init__(
        self,
        term: Term,
        module: Module,
        package: ArrayPackage,
        dtype: str,
        values: Sequence[Any],
        constants: Sequence[int],
        out: Sequence[Any],
    ) -> None:
        """Check forms, types and places of the arrays. Raises UsageError."""
        self._package, self._dtype, self._device = package, dtype, module.device.index
        names = [ARGUMENTS.get(block, block) for block in term.blocks]
        readers = [None if value is None else package_of(value) or package for value in values]
        views = [
            None if reader is None else self._check_argument(name, size, reader.view(value))
            for name, size, reader, value in zip(names, term.sizes, readers, values, strict=True)
        ]
        given = zip(names, views, strict=True)
        shape = _leading_axes(term, {name: view.shape[:-1] for name, view in given if view is not None})
        self._count, arrays = math.prod(shape), len(values) + len(term.names)
        self._words = (ctypes.c_longlong * (_WORDS * arrays + 1))(*[0] * _WORDS * arrays, self._count)
        first, size = ctypes.addressof(self._words), ctypes.sizeof(ctypes.c_longlong)
        pointers = (ctypes.c_void_p * (arrays + 1))(*(first + _WORDS * size * k for k in range(arrays + 1)))
        self._inputs: list[tuple[int, int, Callable[[Any], int]]] = []
        self._compacted: list[tuple[int, ArrayPackage, Shape]] = []
        for k, (reader, view) in enumerate(zip(readers, views, strict=True)):
            if reader is None or view is None:
                self._words[_WORDS * k : _WORDS * (k + 1)] = [constants[k], 0, 1]
            else:
                self._add_input(k, reader, view, shape, with_components=term.blocks[k] != "t")
        self._results = range(_WORDS * len(values), _WORDS * arrays, _WORDS)
        self._makers = [] if out else self._new_results(term, shape, _in_columns(views))
        for k, array in zip(self._results, out, strict=bool(out)):
            self._set_result(k, "out", (*shape, *term.shapes[k // _WORDS - len(values)]), len(shape), array)
        kernel = term.kernel(module, rows=all(self._words[k + 2] <= 1 for k in self._results))
        self._start = kernel.launcher(self._count, pointers)

    def __call__(self, values: Sequence[Any], out: Sequence[Any], stream: int | None) -> Sequence[Any]:
        """Start the kernel on a stream, None: the current one of the package, and return the results."""
        words, package = self._words, self._package
        if self._compacted:
            values = [*values]
            for k, reader, shape in self._compacted:
                values[k] = reader.compact(values[k], shape)
        for k, position, pointer in self._inputs:
            words[position] = pointer(values[k])
        results = [make() for make in self._makers] or out
        for position, result in zip(self._results, results, strict=True):
            words[position] = package.pointer(result)
        self._start(package.stream(self._device) if stream is None else stream)
        return results

    def _check_argument(self, name: str, size: int, view: View) -> View:
        """Return the view of an argument, with an axis of components also of t. Raises UsageError for other numbers,
        places and shapes."""
        if name == "t":
            view = view._replace(shape=(*view.shape, 1), strides=(*view.strides, 1))
        if not view.shape or view.shape[-1] != size:
            fault = f"the shape is {view.shape}, (..., {size}) is needed [E2281]"
            raise UsageError(Problem(name, fault, "samples along leading axes"))
        self._check_numbers(name, view)
        return view

    def _check_numbers(self, name: str, view: View) -> None:
        if view.dtype != self._dtype:
            fault = f"the numbers are {view.dtype}, and the functions are compiled for {self._dtype} [E2282]"
            other = [f'eomgen.gpu(model, real="{real}")' for real, dtype in TYPES.items() if dtype == view.dtype]
            hint = " or ".join([f"numbers of {self._dtype}", *other])
            raise UsageError(Problem(name, fault, hint))
        if view.device != self._device:
            where = "in memory of the processor" if view.device < 0 else f"on device {view.device}"
            fault = f"the array is {where}, and the first array on device {self._device} [E2283]"
            raise UsageError(Problem(name, fault, "all arrays on one device"))

    def _add_input(self, k: int, reader: ArrayPackage, view: View, shape: Shape, *, with_components: bool) -> None:
        """Add an argument, which is copied at each call if the samples are not equally spaced."""
        missing = len(shape) + 1 - len(view.shape)
        strides = (*(0,) * missing, *(0 if n == 1 else s for n, s in zip(view.shape[:-1], view.strides, strict=False)))
        stride, component = merged_stride(shape, strides), view.strides[-1]
        if stride is None:
            size = view.shape[-1]
            self._compacted.append((k, reader, (*shape, size) if with_components else shape))
            stride, component = size, 1
        self._words[_WORDS * k + 1 : _WORDS * k + 3] = [stride, component]
        self._inputs.append((k, _WORDS * k, reader.pointer))

    def _new_results(self, term: Term, shape: Shape, columns: bool) -> list[Callable[[], Any]]:
        """Return functions that allocate the results, in columns if the first argument lies in columns."""
        makers = []
        for position, output in zip(self._results, term.shapes, strict=True):
            size = math.prod(output)
            self._words[position + 1 : position + 3] = [1, self._count] if columns else [size, 1]
            makers.append(self._package.maker((*shape, *output), self._dtype, self._device, columns=columns))
        return makers

    def _set_result(self, position: int, name: str, shape: Shape, axes: int, array: Any) -> None:
        """Set the strides of an array that the caller gives for a result. Raises UsageError for another form."""
        view = self._package.view(array)
        if view.shape != shape:
            raise UsageError(Problem(name, f"the shape is {view.shape}, {shape} is needed [E2284]", "a new array"))
        self._check_numbers(name, view)
        sample, component = (
            merged_stride(shape[part], view.strides[part]) for part in (slice(axes), slice(axes, None))
        )
        if sample is None or component is None or (self._count > 1 and not sample):
            fault = f"the strides {view.strides} do not fit samples at equal distances [E2285]"
            raise UsageError(Problem(name, fault, "a contiguous array"))
        self._words[position + 1 : position + 3] = [sample, component]


def _leading_axes(term: Term, leading: Mapping[str, Shape]) -> Shape:
    """Return the axes of the batch. Raises UsageError if the leading axes of the arguments do not broadcast."""
    try:
        return np.broadcast_shapes(*leading.values())
    except ValueError:
        shapes = ", ".join(f"{block} {axes}" for block, axes in leading.items())
        fault = f"the leading axes do not broadcast: {shapes} [E2286]"
        raise UsageError(Problem(term.name, fault, "batches of equal shape")) from None


def _in_columns(views: Sequence[View | None]) -> bool:
    """Return whether the first argument with samples has the numbers of all samples side by side."""
    first = next((view for view in views if view is not None and len(view.shape) == 2 and view.shape[0] > 1), None)
    return first is not None and first.shape[1] > 1 and first.strides[0] == 1
