"""Kernels for JAX on cards: a description of the kernels of a term in C memory, which the handler of XLA reads.

JAX calls ``templates/gpu/launch.c.jinja`` with its stream; Python takes no part in a call.
"""

from __future__ import annotations

import ctypes
from typing import TYPE_CHECKING

from eomgen.base.products import optional_package
from eomgen.errors import Problem
from eomgen.products.gpu.driver import BLOCK, driver
from eomgen.products.gpu.kernels import load_kernel

if TYPE_CHECKING:
    from eomgen.pipeline.model import Model

#: Devices of a process at most.
_MOST = 16


class _Card(ctypes.Structure):
    """``eomgen_card`` of the handler."""

    _fields_ = (
        ("launch", ctypes.c_void_p),
        ("device", ctypes.c_void_p),
        ("block", ctypes.c_uint),
        ("kernels", ctypes.c_void_p * _MOST),
    )


class JaxCards:
    """The row by which JAX runs terms on cards.

    Attributes
    ----------
    platform : name of the platform of XLA
    launch : template of the launch
    """

    platform, launch = "CUDA", "gpu/launch.c.jinja"

    def __init__(self) -> None:
        self._kept: list[_Card] = []  # programs of JAX hold addresses, for the time of the process

    def kernels(self, model: Model, term: str) -> int:
        """Return the address of the kernels of a term on all cards that JAX uses. Raises ToolchainError."""
        package, calls = optional_package("jax", Problem("jax", "the package jax is not installed")), driver().calls
        addresses = (ctypes.cast(call, ctypes.c_void_p).value for call in (calls.cuLaunchKernel, calls.cuCtxGetDevice))
        card = _Card(*addresses, BLOCK)
        for number in sorted({numbered.local_hardware_id or 0 for numbered in package.local_devices()}):
            card.kernels[number] = load_kernel(model, term, "double", driver().device(number), fused=False).handle
        self._kept.append(card)
        return ctypes.addressof(card)


CARDS = JaxCards()
