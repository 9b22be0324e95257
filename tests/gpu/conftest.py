"""The stand-in for the driver and NVRTC, compiled once and put in place of both; arrays of a stand-in for CuPy."""

from __future__ import annotations

import ctypes
import hashlib
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

from eomgen.products.gpu import arrays, driver, nvrtc
from eomgen.toolchain.cache import Cache
from tests.gpu.arrays_on_card import cupy_array, forget

SOURCE = Path(__file__).with_name("stand_in.cpp")


@pytest.fixture(scope="session")
def stand_in_library(shared_cache: Path) -> str:
    """Return the path of the stand-in."""
    if shutil.which("c++") is None:
        pytest.skip("the stand-in needs a C++ compiler")

    def fill(folder: Path) -> None:
        options = ["-std=c++20", "-O1", "-shared", "-fPIC", str(SOURCE), "-ldl"]
        subprocess.run(["c++", *options, "-o", str(folder / "stand_in.so")], check=True)

    key = hashlib.sha256(b"stand-in\0" + SOURCE.read_bytes()).hexdigest()
    return str(Cache().take(key, fill).file("stand_in.so"))


@pytest.fixture
def stand_in(stand_in_library: str, monkeypatch: pytest.MonkeyPatch) -> Iterator[ctypes.CDLL]:
    """Put the stand-in in place of the driver and of NVRTC, and return its library."""
    monkeypatch.setattr(driver, "NAMES", (stand_in_library,))
    monkeypatch.setattr(nvrtc, "candidates", lambda: iter([stand_in_library]))
    forget()
    library = ctypes.CDLL(stand_in_library)
    for name in ("calls", "memory", "stream"):
        getattr(library, f"stand_in_{name}").restype = ctypes.c_longlong
    yield library
    forget()


@pytest.fixture
def cupy(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Put a package ``cupy`` in place whose arrays are in memory of the processor, and return its module."""
    package: Any = ModuleType("cupy")
    package.asarray = cupy_array
    package.empty = lambda shape, dtype: cupy_array(np.full(shape, np.nan, dtype))
    package.ascontiguousarray = cupy_array
    package.broadcast_to = np.broadcast_to
    package.moveaxis = np.moveaxis

    class Device:
        def __init__(self, number: int) -> None:
            assert number == 0

        def __enter__(self) -> None: ...

        def __exit__(self, *_: object) -> None: ...

    package.cuda = SimpleNamespace(Device=Device, get_current_stream=lambda device: SimpleNamespace(ptr=77))
    monkeypatch.setitem(sys.modules, "cupy", package)
    monkeypatch.setattr(arrays, "_READERS", dict(arrays._READERS))
    arrays._reader.cache_clear()
    yield package
    arrays._reader.cache_clear()
