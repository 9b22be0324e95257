"""The stand-in for the driver and NVRTC, compiled once and put in place of both."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from eomgen.products.gpu import driver, nvrtc


@pytest.fixture(scope="session")
def stand_in_library(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return the path of the stand-in."""
    if shutil.which("c++") is None:
        pytest.skip("the stand-in needs a C++ compiler")
    library = tmp_path_factory.mktemp("stand_in") / "stand_in.so"
    source = Path(__file__).with_name("stand_in.cpp")
    subprocess.run(["c++", "-std=c++20", "-O1", "-shared", "-fPIC", source, "-o", library, "-ldl"], check=True)
    return str(library)


@pytest.fixture
def stand_in(stand_in_library: str, monkeypatch: pytest.MonkeyPatch) -> Iterator[ctypes.CDLL]:
    """Put the stand-in in place of the driver and of NVRTC, and return its library."""
    monkeypatch.setattr(driver, "NAMES", (stand_in_library,))
    monkeypatch.setattr(nvrtc, "candidates", lambda: iter([stand_in_library]))
    forget()
    library = ctypes.CDLL(stand_in_library)
    library.stand_in_calls.restype = library.stand_in_memory.restype = ctypes.c_longlong
    yield library
    forget()


def forget() -> None:
    """Let the next call look for driver and NVRTC again."""
    driver.driver.cache_clear()
    nvrtc.nvrtc.cache_clear()
