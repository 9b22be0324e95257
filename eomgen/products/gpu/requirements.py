"""The check of ``eomgen doctor`` for cards: driver and compiler, present or not."""

from __future__ import annotations

from eomgen.errors import Message, ToolchainError
from eomgen.products.gpu.driver import driver
from eomgen.products.gpu.nvrtc import INSTALL, nvrtc
from eomgen.toolchain.doctor import ToolchainCheck


def card() -> ToolchainCheck:
    """Return the check of card, driver and NVRTC. A machine without a card is sound: the rest of eomgen needs none."""
    texts, there = [], []
    for look in (_describe_card, _describe_compiler):
        try:
            texts.append(look())
            there.append(True)
        except ToolchainError as error:
            texts.append(Message(str(error.problems[0])).fault_and_remedy()[0])
            there.append(False)
    lacking, words = there == [True, False], "" if there[0] else "none, which eomgen.gpu and --device gpu alone need: "
    return ToolchainCheck("cards", not lacking, words + "; ".join(texts), INSTALL if lacking else "", needed=False)


def _describe_card() -> str:
    device = driver().device()
    return f"{device.name} ({device.architecture}), driver for CUDA {device.driver.version}"


def _describe_compiler() -> str:
    return f"NVRTC {nvrtc().version} ({nvrtc().path})"
