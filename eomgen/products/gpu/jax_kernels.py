"""Kernels for JAX on cards: a description of the kernels of a term in C memory, which the handler of XLA reads.

JAX calls ``templates/gpu/launch.c.jinja`` with its stream; Python takes no part in a call.
"""

from __future__ import annotations

import ctypes
from importlib import import_module
from typing import TYPE_CHECKING

from eomgen.products.gpu.driver import BLOCK, driver
from eomgen.products.gpu.kernels import load_kernel

if TYPE_CHECKING:
    from eomgen.pipeline.model import Model

#: Devices of a process at most, and arguments of a term.
_MOST = 16


class _Card(ctypes.Structure):
    """``eomgen_card`` of the handler."""

    _fields_ = (
        ("launch", ctypes.c_void_p),
        ("device", ctypes.c_void_p),
        ("block", ctypes.c_uint),
        ("inputs", ctypes.c_int),
        ("places", ctypes.c_int * _MOST),
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
        package, calls = import_module("jax"), driver().calls
        addresses = (ctypes.cast(call, ctypes.c_void_p).value for call in (calls.cuLaunchKernel, calls.cuCtxGetDevice))
        card, inputs = _Card(*addresses, BLOCK), model.functions.inputs(term)
        for number in sorted({numbered.local_hardware_id or 0 for numbered in package.local_devices()}):
            module, arguments = load_kernel(model, term, "double", driver().device(number), fused=False)
            card.kernels[number] = arguments.kernel(module, rows=True).handle
            card.inputs = len(arguments.blocks)
            card.places[: card.inputs] = [inputs.index(block) for block in arguments.blocks]
        self._kept.append(card)
        return ctypes.addressof(card)


CARDS = JaxCards()
