"""The check of ``eomgen doctor`` for cards: driver and compiler, found or not."""

from __future__ import annotations

from eomgen.errors import ToolchainError
from eomgen.products.gpu.driver import driver
from eomgen.products.gpu.nvrtc import INSTALL, nvrtc
from eomgen.toolchain.doctor import ToolchainCheck


def card() -> ToolchainCheck:
    """Return the check of card, driver and NVRTC. A machine without a card is sound: the rest of eomgen needs none."""
    try:
        device = driver().device()
        found = f"{device.name} ({device.architecture}), driver for CUDA {device.driver.version}"
    except ToolchainError as error:
        device, found = None, error.problems[0].what
    try:
        return ToolchainCheck("GPU", True, f"{found}; NVRTC {nvrtc().version} ({nvrtc().path})", needed=False)
    except ToolchainError as error:
        result = f"{found}; {error.problems[0].what}"
        return ToolchainCheck("GPU", device is None, result, "" if device is None else INSTALL, needed=False)
