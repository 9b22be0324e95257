"""Code of the tape engine, which the loader hands over to a library: data that no compiler has read."""

from __future__ import annotations

import ctypes
import hashlib
import struct
from pathlib import Path

#: Fingerprint of the library as text, ended by zero, and the numbers of heads, constants and instructions.
_START = struct.Struct("=24s3q")
#: Memory of each tape by its digest, which libraries may read for as long as the process runs.
_KEPT: dict[bytes, ctypes.Array[ctypes.c_char]] = {}


class _Tape(ctypes.Structure):
    _fields_ = tuple((name, ctypes.c_void_p) for name in ("heads", "numbers", "code", "fingerprint"))


def hand_over(library: Path, tape: bytes) -> None:
    """Give a tape to a loaded library, before the first call."""
    digest = hashlib.sha256(tape).digest()
    if digest not in _KEPT:
        _KEPT[digest] = ctypes.create_string_buffer(tape, len(tape))
    start = ctypes.addressof(_KEPT[digest])
    _, heads, numbers, _ = _START.unpack_from(tape)
    first = start + _START.size
    places = (first, first + 8 * heads, first + 8 * (heads + numbers), start)
    ctypes.CDLL(str(library)).eomgen_take_tape(ctypes.byref(_Tape(*places)))
