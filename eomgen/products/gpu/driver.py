"""The driver of NVIDIA's cards, by ctypes: devices, machine code, launches on streams, and memory.

Contexts are the primary contexts of the devices, which PyTorch, CuPy and JAX use as well: pointers and streams of these
packages are valid here.
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from eomgen.base.data import replace
from eomgen.errors import NumericalError, Problem, ToolchainError

#: Names of the library of the driver for the loader.
NAMES = ("nvcuda.dll",) if sys.platform == "win32" else ("libcuda.so.1", "libcuda.so", "/usr/lib/wsl/lib/libcuda.so.1")
#: Threads of a block: kernels are compiled for 64 at most, and 64, 128 and 256 were equally fast on an H100.
BLOCK = 64
_INSTALL = "a card of NVIDIA with its driver from nvidia.com/drivers (nvidia-smi shows both), or the processor"
_WHERE = "driver of the card"
#: Status of a call without memory, of a call in a thread with no context or the context of another device, and of a
#: call that no graph can record.
_NO_MEMORY, _OTHER_CONTEXT, _RECORDED = 2, (201, 400), range(900, 908)
_Read = TypeVar("_Read", bound=NDArray[Any])
_POINTER, _SIZE, _INT, _UINT = ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int, ctypes.c_uint
#: Attributes of devices, and one of functions.
_PROCESSORS, _MAJOR, _MINOR = 16, 75, 76
_LOCAL = 3


@functools.cache
def driver() -> Driver:
    """Return the driver of this machine. Raises ToolchainError without a driver, or without a card."""
    faults = []
    for name in NAMES:
        try:
            return Driver(name)
        except (OSError, AttributeError) as error:
            faults.append(str(error))
    fault = f"no driver for cards of NVIDIA was found: {faults[0] if faults else 'no name of a library'} [E2270]"
    raise ToolchainError(Problem("GPU", fault, _INSTALL))


class Driver:
    """The driver, with at least one device.

    Parameters
    ----------
    path : of the library

    Attributes
    ----------
    calls : the library
    version : such as ``13.0``, the newest CUDA that the driver knows
    count : number of devices
    """

    def __init__(self, path: str) -> None:
        """Load the library. Raises ToolchainError if there is no card."""
        self.calls = ctypes.CDLL(path)
        self._devices: dict[int, Device] = {}
        number = _INT()
        try:
            self.call("cuInit", _UINT(0))
            self.call("cuDeviceGetCount", ctypes.byref(number))
        except ToolchainError as error:
            raise ToolchainError(replace(error.problems[0], where="GPU", hint=_INSTALL)) from None
        self.count = number.value
        if not self.count:
            raise ToolchainError(Problem("GPU", "the driver of NVIDIA finds no card [E2272]", _INSTALL))
        self.call("cuDriverGetVersion", ctypes.byref(number))
        self.version = f"{number.value // 1000}.{number.value % 1000 // 10}"

    def call(self, name: str, *arguments: Any) -> None:
        """Call a function of the driver. Raises the error of its status."""
        status = getattr(self.calls, name)(*arguments)
        if status:
            raise self.error(status, name)

    def error(self, status: int, name: str) -> ToolchainError:
        """Return the error of the status of a function."""
        text = ctypes.c_char_p()
        self.calls.cuGetErrorString(_INT(status), ctypes.byref(text))
        meaning = (text.value or b"unknown").decode()
        fault = f"{name} failed with status {status}: {meaning} [E2273]"
        hint = "fewer samples" if status == _NO_MEMORY else "nvidia-smi, and a new process: errors of kernels stay"
        if status in _RECORDED:
            hint = "for a record of a graph: one call before it, and arrays on the card for all arguments"
        if name == "cuModuleLoadData":
            hint = f"a version of NVRTC that the driver knows, of CUDA {self.version} or older"
        return ToolchainError(Problem(_WHERE, fault, hint))

    def device(self, index: int = 0) -> Device:
        """Return a device by number. Raises ToolchainError for a number that no device has."""
        if not isinstance(index, int | np.integer) or not 0 <= index < self.count:
            fault = f"there is no device {index!r} among {self.count} [E2294]"
            raise ToolchainError(Problem(_WHERE, fault, f"device 0 to {self.count - 1}"))
        return self._devices.get(index) or self._devices.setdefault(int(index), Device(self, int(index)))


def arguments_of(values: Sequence[Any]) -> Any:
    """Return the arguments of a kernel, ctypes objects, as an array of pointers that keeps the objects alive."""
    pointers: Any = (_POINTER * len(values))(*(ctypes.addressof(value) for value in values))
    pointers.values = values  # an address alone keeps no object alive
    return pointers


class Device:
    """One card.

    Attributes
    ----------
    index : number of the device
    name : of the card
    architecture : such as ``sm_90``
    processors : number of multiprocessors
    """

    def __init__(self, owner: Driver, index: int) -> None:
        self.driver, self.index = owner, index
        number, handle, context = _INT(), _INT(), _POINTER()
        owner.call("cuDeviceGet", ctypes.byref(handle), _INT(index))
        text = ctypes.create_string_buffer(256)
        owner.call("cuDeviceGetName", text, _INT(256), handle)
        self.name = text.value.decode()

        def attribute(which: int) -> int:
            owner.call("cuDeviceGetAttribute", ctypes.byref(number), _INT(which), handle)
            return number.value

        self.architecture = f"sm_{attribute(_MAJOR)}{attribute(_MINOR)}"
        self.processors = attribute(_PROCESSORS)
        owner.call("cuDevicePrimaryCtxRetain", ctypes.byref(context), handle)
        self._context = context

    @contextlib.contextmanager
    def current(self) -> Iterator[None]:
        """Make this device the current one of the thread for the time of a context."""
        self.driver.call("cuCtxPushCurrent_v2", self._context)
        try:
            yield
        finally:
            self.driver.call("cuCtxPopCurrent_v2", ctypes.byref(_POINTER()))

    def call(self, name: str, *arguments: Any) -> None:
        """Call a function of the driver on this device. Raises the error of its status."""
        with self.current():
            self.driver.call(name, *arguments)

    def load(self, image: bytes) -> Module:
        """Return machine code, loaded on this device. Raises ToolchainError for code of another architecture."""
        return Module(self, image)

    def memory(self) -> tuple[int, int]:
        """Return the bytes of memory that are free, and all bytes."""
        free, total = _SIZE(), _SIZE()
        self.call("cuMemGetInfo_v2", ctypes.byref(free), ctypes.byref(total))
        return free.value, total.value

    def allocate(self, size: int) -> Memory:
        """Return memory of some bytes. Raises NumericalError, with both numbers, if the device has not as much."""
        return Memory(self, size)

    def upload(self, array: NDArray[Any]) -> Memory:
        """Return memory with the bytes of an array, whose copy has ended."""
        source, memory = np.ascontiguousarray(array), self.allocate(array.nbytes)
        address, size = ctypes.c_uint64(memory.pointer), _SIZE(source.nbytes)
        self.call("cuMemcpyHtoD_v2", address, _POINTER(source.ctypes.data), size)
        self.wait()  # for streams that do not wait for the default one
        return memory

    def wait(self) -> None:
        """Wait for the end of all work on all streams. Raises the error of a kernel."""
        self.call("cuCtxSynchronize")


class Module:
    """Machine code on a device, with functions by name."""

    def __init__(self, device: Device, image: bytes) -> None:
        self.device, self._handle = device, _POINTER()
        device.call("cuModuleLoadData", ctypes.byref(self._handle), image)
        self._functions: dict[str, Function] = {}

    def function(self, name: str) -> Function:
        """Return a kernel by name."""
        if name not in self._functions:
            handle = _POINTER()
            self.device.call("cuModuleGetFunction", ctypes.byref(handle), self._handle, name.encode())
            self._functions[name] = Function(self.device, name, handle.value or 0)
        return self._functions[name]


class Function:
    """A kernel on a device; ``handle`` is the driver's."""

    def __init__(self, device: Device, name: str, handle: int) -> None:
        self.device, self.name, self.handle = device, name, handle

    @property
    def local_bytes(self) -> int:
        """Bytes of the stack and of spilled registers of a thread."""
        number = _INT()
        self.device.call("cuFuncGetAttribute", ctypes.byref(number), _INT(_LOCAL), _POINTER(self.handle))
        return number.value

    def launcher(self, threads: int, pointers: Any, block: int = BLOCK, shared: int = 0) -> Callable[[int], None]:
        """Return a function of a stream that starts the kernel and returns before its end, for one thread of Python.

        Parameters
        ----------
        threads : of the kernel at least; blocks are whole
        pointers : of ``arguments_of``, whose numbers may change between launches
        shared : bytes of shared memory of a block
        """
        blocks = -(-threads // block)
        start, place = self.device.driver.calls.cuLaunchKernel, _POINTER()
        grid = [_UINT(number) for number in (blocks, 1, 1, block, 1, 1, shared)]
        arguments = _POINTER(self.handle), *grid, place, pointers, _POINTER()

        def launch(stream: int) -> None:
            place.value = stream
            status = start(*arguments)
            if status in _OTHER_CONTEXT:
                with self.device.current():
                    status = start(*arguments)
            if status:
                raise self.device.driver.error(status, f"cuLaunchKernel of {self.name}")

        return launch if blocks else lambda stream: None

    def launch(
        self, threads: int, arguments: Sequence[Any], stream: int = 0, block: int = BLOCK, shared: int = 0
    ) -> None:
        """Start the kernel with ctypes objects as arguments on a stream, 0: the default stream; see ``launcher``."""
        self.launcher(threads, arguments_of(arguments), block, shared)(stream)


class Memory:
    """Memory of a device, freed with the object.

    Attributes
    ----------
    pointer : address on the device
    size : bytes
    """

    def __init__(self, device: Device, size: int) -> None:
        self.device, self.size = device, size
        self.pointer = 0
        address = ctypes.c_uint64()
        try:
            device.call("cuMemAlloc_v2", ctypes.byref(address), _SIZE(max(size, 1)))
        except ToolchainError as error:
            free, total = device.memory()
            if size <= free:
                raise
            fault = f"{size / 1e9:.3g} GB are needed, and {free / 1e9:.3g} of {total / 1e9:.3g} GB are free [E2275]"
            raise NumericalError(Problem(f"memory of {device.name}", fault, "fewer samples")) from error
        self.pointer = address.value

    def forget(self) -> Memory:
        """Fill the memory with numbers that are not a number, and return it."""
        self.device.call("cuMemsetD8_v2", ctypes.c_uint64(self.pointer), ctypes.c_ubyte(255), _SIZE(self.size))
        return self

    def read(self, array: _Read) -> _Read:
        """Copy the memory to a contiguous array of the processor after the work of all streams; return the array."""
        self.device.wait()
        address, size = ctypes.c_uint64(self.pointer), _SIZE(array.nbytes)
        self.device.call("cuMemcpyDtoH_v2", _POINTER(array.ctypes.data), address, size)
        return array

    def __del__(self) -> None:
        if getattr(self, "pointer", 0):
            with contextlib.suppress(ToolchainError):
                self.device.call("cuMemFree_v2", ctypes.c_uint64(self.pointer))
            self.pointer = 0
