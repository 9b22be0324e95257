"""The driver of NVIDIA's cards, by ctypes: devices, machine code, launches on streams, and memory.

Contexts are the primary contexts of the devices, which PyTorch, CuPy and JAX use as well: pointers and streams of these
packages are valid here.
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from eomgen.errors import NumericalError, Problem, ToolchainError

#: Names of the library of the driver for the loader.
NAMES = ("nvcuda.dll",) if sys.platform == "win32" else ("libcuda.so.1", "libcuda.so", "/usr/lib/wsl/lib/libcuda.so.1")
#: Threads of a block by default.
BLOCK = 128
_INSTALL = "the driver from nvidia.com/drivers, on a machine with a card of NVIDIA; nvidia-smi shows both"
_WHERE = "driver of the card"
#: Status of a call without memory, and of a call in a thread with no context or the context of another device.
_NO_MEMORY, _OTHER_CONTEXT = 2, (201, 400)
_Read = TypeVar("_Read", bound=NDArray[Any])
_POINTER, _SIZE, _INT, _UINT = ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int, ctypes.c_uint
#: Attributes of devices, and of functions.
_PROCESSORS, _MAJOR, _MINOR = 16, 75, 76
_LOCAL, _REGISTERS = 3, 4


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
        self._lock = threading.Lock()
        number = _INT()
        try:
            self.call("cuInit", _UINT(0))
            self.call("cuDeviceGetCount", ctypes.byref(number))
        except ToolchainError as error:
            raise ToolchainError(Problem("GPU", f"{error.problems[0].what} [E2271]", _INSTALL)) from None
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
        return ToolchainError(Problem(_WHERE, fault, hint))

    def device(self, index: int = 0) -> Device:
        """Return a device by number. Raises ToolchainError for a number that no device has."""
        found = self._devices.get(index)
        if found is None:
            if not 0 <= index < self.count:
                fault = f"there is no device {index} among {self.count} [E2274]"
                raise ToolchainError(Problem(_WHERE, fault, f"device 0 to {self.count - 1}"))
            with self._lock:
                found = self._devices.get(index) or self._devices.setdefault(index, Device(self, index))
        return found


def arguments_of(values: Sequence[Any]) -> Any:
    """Return the arguments of a kernel, ctypes objects, as an array of pointers that keeps the objects alive."""
    pointers: Any = (_POINTER * len(values))(*(ctypes.addressof(value) for value in values))
    pointers.values = values  # ctypes keeps no reference to an object behind an address
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

    def upload(self, array: NDArray[Any], stream: int = 0) -> Memory:
        """Return memory with the bytes of an array."""
        memory = self.allocate(array.nbytes)
        memory.fill(array, stream)
        return memory

    def wait(self, stream: int | None = None) -> None:
        """Wait for the end of all work on a stream, of all streams by default. Raises the error of a kernel."""
        if stream is None:
            self.call("cuCtxSynchronize")
        else:
            self.call("cuStreamSynchronize", _POINTER(stream))


class Module:
    """Machine code on a device, with functions by name."""

    def __init__(self, device: Device, image: bytes) -> None:
        self.device, self._handle = device, _POINTER()
        device.call("cuModuleLoadData", ctypes.byref(self._handle), image)
        self._functions: dict[str, Function] = {}

    def function(self, name: str) -> Function:
        """Return a kernel by name."""
        found = self._functions.get(name)
        if found is None:
            handle = _POINTER()
            self.device.call("cuModuleGetFunction", ctypes.byref(handle), self._handle, name.encode())
            found = self._functions.setdefault(name, Function(self.device, name, handle.value or 0))
        return found

    def constant(self, name: str) -> tuple[int, int]:
        """Return the address and the bytes of a variable of the code."""
        address, size = ctypes.c_uint64(), _SIZE()
        arguments = ctypes.byref(address), ctypes.byref(size), self._handle, name.encode()
        self.device.call("cuModuleGetGlobal_v2", *arguments)
        return address.value, size.value


class Function:
    """A kernel on a device; ``handle`` is the driver's."""

    def __init__(self, device: Device, name: str, handle: int) -> None:
        self.device, self.name, self.handle = device, name, handle

    @property
    def local_bytes(self) -> int:
        """Bytes of the stack and of spilled registers of a thread."""
        return self._attribute(_LOCAL)

    @property
    def registers(self) -> int:
        """Registers of a thread."""
        return self._attribute(_REGISTERS)

    def _attribute(self, which: int) -> int:
        number = _INT()
        self.device.call("cuFuncGetAttribute", ctypes.byref(number), _INT(which), _POINTER(self.handle))
        return number.value

    def prepared(self, threads: int, pointers: Any, block: int = BLOCK, shared: int = 0) -> Callable[[int], None]:
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
        """Start the kernel with ctypes objects as arguments on a stream, 0: the default stream; see ``prepared``."""
        self.prepared(threads, arguments_of(arguments), block, shared)(stream)


class Memory:
    """Memory of a device, freed with the object.

    Attributes
    ----------
    pointer : address on the device
    size : bytes
    """

    def __init__(self, device: Device, size: int) -> None:
        self.device, self.size = device, size
        self._free: Callable[..., None] = device.call
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

    def fill(self, array: NDArray[Any], stream: int = 0) -> None:
        """Copy an array of the processor to the memory, in order on a stream, and wait for the copy."""
        source = np.ascontiguousarray(array)
        address, size = ctypes.c_uint64(self.pointer), _SIZE(source.nbytes)
        self.device.call("cuMemcpyHtoDAsync_v2", address, _POINTER(source.ctypes.data), size, _POINTER(stream))
        self.device.wait(stream)

    def read(self, array: _Read, stream: int = 0) -> _Read:
        """Copy the memory to a contiguous array of the processor, in order on a stream, and return the array."""
        address, size = ctypes.c_uint64(self.pointer), _SIZE(array.nbytes)
        self.device.call("cuMemcpyDtoHAsync_v2", _POINTER(array.ctypes.data), address, size, _POINTER(stream))
        self.device.wait(stream)
        return array

    def clear(self, stream: int = 0) -> None:
        """Set all bytes to zero, in order on a stream."""
        address = ctypes.c_uint64(self.pointer)
        self.device.call("cuMemsetD8Async", address, ctypes.c_ubyte(0), _SIZE(self.size), _POINTER(stream))

    def __del__(self) -> None:
        if getattr(self, "pointer", 0):
            with contextlib.suppress(ToolchainError):
                self._free("cuMemFree_v2", ctypes.c_uint64(self.pointer))
            self.pointer = 0
