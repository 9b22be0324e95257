"""Sweeps of linear steps in C, the same for all models: compiled once, of real or of complex numbers."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any

from eomgen.base.resources import template_folder
from eomgen.toolchain.builder import Builder


@functools.cache
def routine(files: Sequence[str], cdef: str, *, in_complex: bool = False) -> tuple[Any, Any]:
    """Return ``ffi`` and ``lib`` of files of ``templates/c/sensitivities``, as one source behind ``algebra.c``."""
    folder = template_folder() / "c" / "sensitivities"
    texts = [(folder / name).read_text(encoding="utf-8") for name in ("algebra.c", *files)]
    source = "\n".join(["#define EG_COMPLEX"] * in_complex + texts)
    return Builder().build_routine(source, cdef)
