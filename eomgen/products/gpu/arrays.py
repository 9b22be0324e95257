"""Arrays of other packages on a device: address, shape and strides without copies, and new arrays of the same package.

Any object with the DLPack protocol, or with ``__cuda_array_interface__``, can be read. PyTorch and CuPy make results.
"""

from __future__ import annotations

import ctypes
import functools
import math
import operator
from collections.abc import Callable, Hashable, Sequence
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np

from eomgen.errors import Problem, UsageError
from eomgen.products.gpu.driver import Memory, driver

Shape = tuple[int, ...]
#: Kinds of devices of DLPack whose memory a kernel reads: of CUDA, and managed memory.
_CUDA = (2, 13)
#: Kinds of numbers of DLPack.
_KINDS = {0: "int", 1: "uint", 2: "float", 4: "bfloat", 5: "complex", 6: "bool"}


class View(NamedTuple):
    """An array on a device: address of the first number, shape, strides in numbers, type such as ``float64``, and the
    number of the device, -1 for memory of the processor."""

    pointer: int
    shape: Shape
    strides: Shape
    dtype: str
    device: int


class ArrayPackage:
    """How arrays of a package are read, and made; this class reads arrays by DLPack, and makes none.

    Attributes
    ----------
    pointer : returns the address of an array
    """

    def __init__(self) -> None:
        self.pointer: Callable[[Any], int] = lambda array: self.view(array).pointer

    def signature(self, array: Any) -> Hashable:
        """Return all of an array but its address, to find a call that was prepared before."""
        return self.view(array)[1:]

    def view(self, array: Any) -> View:
        """Return an array's address and form. Raises UsageError for an array that no kernel takes."""
        if hasattr(array, "__dlpack__"):
            return _view_by_dlpack(array)
        interface = array.__cuda_array_interface__
        number = np.dtype(interface["typestr"])
        shape, strides = tuple(interface["shape"]), interface.get("strides")
        strides = contiguous(shape) if strides is None else _in_numbers(strides, number.itemsize)
        return View(interface["data"][0], shape, strides, number.name if number.isnative else number.str, 0)

    def stream(self, device: int) -> int:
        """Return the handle of the stream on which the caller works."""
        return 0

    def maker(self, shape: Shape, dtype: str, device: int, *, columns: bool) -> Callable[[], Any]:
        """Return a function that makes an array; with ``columns`` neighbours along the first axis are neighbours in
        memory."""
        size, place = math.prod(shape) * np.dtype(dtype).itemsize, driver().device(device)
        return lambda: DeviceArray(place.allocate(size), shape, dtype, column_strides(shape) if columns else ())

    def upload(self, array: Any, device: int) -> Any:
        """Return an array of numbers as an array on the device."""
        return DeviceArray(driver().device(device).upload(array), array.shape, array.dtype.name)

    def compact(self, array: Any, shape: Shape) -> Any:
        """Return a copy of an array, broadcast to a shape. Raises UsageError."""
        fault = f"the strides of shape {tuple(array.shape)} do not fit samples of shape {shape[:-1]} [E2279]"
        raise UsageError(Problem("shape", fault, "contiguous arrays of equal leading axes"))


class DeviceArray:
    """Numbers in memory of eomgen on a device, for callers with arrays of NumPy or of a package without rules here."""

    def __init__(self, memory: Memory, shape: Shape, dtype: str, strides: Shape = ()) -> None:
        self.memory, self.shape, self.dtype, self.strides = memory, shape, dtype, strides or contiguous(shape)

    @property
    def __cuda_array_interface__(self) -> dict[str, Any]:
        number = np.dtype(self.dtype)
        strides = tuple(stride * number.itemsize for stride in self.strides)
        form = {"shape": self.shape, "typestr": number.str, "strides": strides}
        return {**form, "data": (self.memory.pointer, False), "version": 3}

    def numpy(self) -> Any:
        """Return the numbers, which lie in rows, as an array of the processor."""
        return self.memory.read(np.empty(self.shape, self.dtype))


class CopiedArrays(ArrayPackage):
    """Arrays of eomgen."""

    def view(self, array: Any) -> View:
        return View(array.memory.pointer, array.shape, array.strides, array.dtype, array.memory.device.index)


class TorchArrays(ArrayPackage):
    """Tensors of PyTorch; ``kind`` is the kind of their device."""

    kind = "cuda"

    def __init__(self) -> None:
        self._torch = import_module("torch")
        self.pointer = self._torch.Tensor.data_ptr
        self._grad = self._torch.is_grad_enabled
        self._current = getattr(getattr(self._torch, "_C", None), "_cuda_getCurrentRawStream", None)  # faster
        self._dtypes: dict[str, Any] = {"float64": self._torch.float64, "float32": self._torch.float32}

    def signature(self, array: Any) -> Hashable:
        return array.shape, array.stride(), array.dtype, array.get_device(), array.requires_grad and self._grad()

    def view(self, array: Any) -> View:
        if array.requires_grad and self._grad():
            fault = "the tensor requires a gradient, and calls of the card have no derivative rules for PyTorch [E2280]"
            raise UsageError(Problem("torch", fault, "x.detach(); eomgen.torch(model) has gradients, on the processor"))
        dtype, place = str(array.dtype).removeprefix("torch."), array.device
        number = (place.index or 0) if place.type == self.kind else -1
        return View(array.data_ptr(), tuple(array.shape), array.stride(), dtype, number)

    def stream(self, device: int) -> int:
        handle: int = self._current(device) if self._current else self._torch.cuda.current_stream(device).cuda_stream
        return handle

    def maker(self, shape: Shape, dtype: str, device: int, *, columns: bool) -> Callable[[], Any]:
        strides = column_strides(shape) if columns else contiguous(shape)
        options = {"dtype": self._dtypes[dtype], "device": self._torch.device(self.kind, device)}
        return functools.partial(self._torch.empty_strided, shape, strides, **options)

    def upload(self, array: Any, device: int) -> Any:
        return self._torch.as_tensor(array, device=self._torch.device(self.kind, device))

    def compact(self, array: Any, shape: Shape) -> Any:
        return array.expand(shape).contiguous()


class CupyArrays(ArrayPackage):
    """Arrays of CuPy."""

    def __init__(self) -> None:
        self._cupy = import_module("cupy")
        self.pointer = operator.attrgetter("data.ptr")

    def signature(self, array: Any) -> Hashable:
        return array.shape, array.strides, array.dtype.num, array.device.id

    def view(self, array: Any) -> View:
        strides = _in_numbers(array.strides, array.itemsize)
        return View(array.data.ptr, array.shape, strides, array.dtype.name, array.device.id)

    def stream(self, device: int) -> int:
        return int(self._cupy.cuda.get_current_stream(device).ptr)

    def maker(self, shape: Shape, dtype: str, device: int, *, columns: bool) -> Callable[[], Any]:
        def make() -> Any:
            with self._cupy.cuda.Device(device):
                array = self._cupy.empty((*shape[1:], shape[0]) if columns else shape, dtype)
                return self._cupy.moveaxis(array, -1, 0) if columns else array

        return make

    def upload(self, array: Any, device: int) -> Any:
        with self._cupy.cuda.Device(device):
            return self._cupy.asarray(array)

    def compact(self, array: Any, shape: Shape) -> Any:
        return self._cupy.ascontiguousarray(self._cupy.broadcast_to(array, shape))


class JaxArrays(ArrayPackage):
    """Arrays of JAX, which are not filled in place and may have no values yet: other functions take these."""

    def view(self, array: Any) -> View:
        fault = "JAX fills its arrays itself, also on cards [E2292]"
        raise UsageError(Problem("jax", fault, "eomgen.jax(model), whose functions are kernels on a card"))


_PACKAGES: dict[str, type[ArrayPackage]] = {
    **{"torch": TorchArrays, "cupy": CupyArrays, "eomgen": CopiedArrays},
    **dict.fromkeys(("jax", "jaxlib"), JaxArrays),
}


#: Readers by the class of an array; None for numbers, lists and arrays of the processor.
_READERS: dict[type, ArrayPackage | None] = {type(None): None, float: None}


def package_of(array: Any) -> ArrayPackage | None:
    """Return the reader of an array; None for numbers, lists and arrays of the processor."""
    kind = type(array)
    if kind not in _READERS:
        names = [base.__module__.partition(".")[0] for base in kind.__mro__]
        reader = next((_reader(name) for name in names if name in _PACKAGES), None)
        known = hasattr(kind, "__dlpack__") or hasattr(kind, "__cuda_array_interface__")
        if reader is None and known and not issubclass(kind, np.ndarray | np.generic):
            reader = _reader("")
        _READERS[kind] = reader
    return _READERS[kind]


@functools.cache
def _reader(name: str) -> ArrayPackage:
    return _PACKAGES.get(name, ArrayPackage)()


def _in_numbers(strides: Sequence[int], size: int) -> Shape:
    """Return strides in numbers of some bytes. Raises UsageError if numbers do not lie at whole distances, as in a
    field of a structured array."""
    if any(stride % size for stride in strides):
        fault = f"the strides {tuple(strides)} are not multiples of the {size} bytes of a number [E2466]"
        raise UsageError(Problem("strides", fault, "a contiguous copy of the array"))
    return tuple(stride // size for stride in strides)


def contiguous(shape: Shape) -> Shape:
    """Return the strides of an array without gaps, the last axis first."""
    return tuple(math.prod(shape[k + 1 :]) for k in range(len(shape)))


def column_strides(shape: Shape) -> Shape:
    """Return the strides of an array without gaps whose first axis has stride 1, and the others in order."""
    return (1, *(shape[0] * stride for stride in contiguous(shape[1:])))


def merged_stride(shape: Shape, strides: Sequence[int]) -> int | None:
    """Return the one stride of some axes as a single axis, 0 for one element or equal elements; None if these are not
    equally spaced."""
    result, length = 0, 1
    for size, stride in zip(reversed(shape), reversed(strides), strict=True):
        if size == 1:
            continue
        if length == 1:
            result = stride
        elif stride != result * length:
            return None
        length *= size
    return result


class _DlTensor(ctypes.Structure):
    """The description of an array by DLPack."""

    _fields_ = (
        ("data", ctypes.c_void_p),
        ("device_type", ctypes.c_int32),
        ("device_id", ctypes.c_int32),
        ("ndim", ctypes.c_int32),
        ("code", ctypes.c_uint8),
        ("bits", ctypes.c_uint8),
        ("lanes", ctypes.c_uint16),
        ("shape", ctypes.POINTER(ctypes.c_int64)),
        ("strides", ctypes.POINTER(ctypes.c_int64)),
        ("byte_offset", ctypes.c_uint64),
    )


_POINTER_IN = ctypes.pythonapi.PyCapsule_GetPointer
_POINTER_IN.restype, _POINTER_IN.argtypes = ctypes.c_void_p, (ctypes.py_object, ctypes.c_char_p)


def _view_by_dlpack(array: Any) -> View:
    """Return the view of an array with the DLPack protocol. The capsule is read, and not taken: the array stays the
    owner, and the caller keeps the array for the time of a call."""
    kind, number = array.__dlpack_device__()
    capsule = array.__dlpack__(stream=1) if kind in _CUDA else array.__dlpack__()
    tensor = _DlTensor.from_address(_POINTER_IN(capsule, b"dltensor") or 0)
    shape = tuple(tensor.shape[: tensor.ndim])
    strides = tuple(tensor.strides[: tensor.ndim]) if tensor.strides else contiguous(shape)
    dtype = f"{_KINDS.get(tensor.code, 'type')}{tensor.bits}"
    return View((tensor.data or 0) + tensor.byte_offset, shape, strides, dtype, number if kind in _CUDA else -1)
