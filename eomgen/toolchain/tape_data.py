"""Code of the tape engine, which the loader hands over to a library: data that no compiler has read."""

from __future__ import annotations

import ctypes
import struct
from pathlib import Path

#: Fingerprint of the library as text, ended by zero, and the numbers of heads, constants and instructions.
_START = struct.Struct("=24s3q")
#: A library may read its tape for as long as the process runs.
_KEPT: list[object] = []


class _Tape(ctypes.Structure):
    _fields_ = tuple((name, ctypes.c_void_p) for name in ("heads", "numbers", "code", "fingerprint"))


def hand_over(library: Path, tape: bytes) -> None:
    """Give a tape to a loaded library, before the first call."""
    kept = ctypes.create_string_buffer(tape, len(tape))
    _KEPT.append(kept)
    start = ctypes.addressof(kept)
    _, heads, numbers, _ = _START.unpack_from(tape)
    first = start + _START.size
    places = (first, first + 8 * heads, first + 8 * (heads + numbers), start)
    ctypes.CDLL(str(library)).eomgen_take_tape(ctypes.byref(_Tape(*places)))
