"""Arrays in memory of the processor that say that they are on a card."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from eomgen.products.gpu import driver, nvrtc


def forget() -> None:
    """Let the next call look for driver and NVRTC again."""
    driver.driver.cache_clear()
    nvrtc.nvrtc.cache_clear()


class OnCard:
    """An array that says by DLPack that it is on a card."""

    def __init__(self, array: Any, device: int = 0) -> None:
        self.array, self._device = np.asarray(array), device

    def __dlpack__(self, stream: int | None = None) -> Any:
        return self.array.__dlpack__()

    def __dlpack_device__(self) -> tuple[int, int]:
        return 2, self._device


class _Ndarray(np.ndarray):
    """An array of the stand-in for CuPy, with the attributes of an array on a card."""

    @property
    def data(self) -> Any:
        return SimpleNamespace(ptr=self.ctypes.data)

    @property
    def device(self) -> Any:
        return SimpleNamespace(id=0)


_Ndarray.__module__ = "cupy"


def cupy_array(values: Any, order: str = "C") -> Any:
    """Return an array of the stand-in for CuPy."""
    return np.array(values, order=order).view(_Ndarray)  # type: ignore[call-overload]
