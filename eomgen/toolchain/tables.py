"""Tables of a library: its numbers, and code of the tape engine. The loader hands them over; no compiler has read them.

A library is a structure, so models that differ in numbers alone have copies of one file, each with numbers of its own:
the system's loader gives memory of its own to each file.
"""

from __future__ import annotations

import ctypes
import hashlib
import json
import struct
from array import array
from collections.abc import Mapping, Sequence
from pathlib import Path

#: File of the tables in an entry of the cache.
TABLES = "tables.bin"
#: Fingerprints of the library and of its texts, ended by zeros, and the lengths of heads, numbers, instructions, and of
#: the sizes of the arrays in C by name as JSON.
_START = struct.Struct("=24s24s4q")
#: Memory of the tables of each library on the tape engine by digest, which is read for as long as the process runs.
_KEPT: dict[bytes, ctypes.Array[ctypes.c_char]] = {}


def packed_tables(
    texts: bytes,
    numbers: Mapping[str, Sequence[float]],
    heads: Sequence[int] = (),
    code: Sequence[int] = (),
    fingerprint: bytes = b"",
) -> bytes:
    """Return the tables of a library as bytes, for the file ``TABLES``.

    Parameters
    ----------
    texts : fingerprint of the library's texts
    numbers : by the name of their array in C, in the order in which the library takes the arrays
    heads, code : of functions on the tape engine
    fingerprint : of the library; by default made of ``texts`` and of the tables
    """
    sizes = json.dumps({name: len(values) for name, values in numbers.items()}).encode()
    values = array("d", [value for row in numbers.values() for value in row])
    data = array("q", heads).tobytes() + values.tobytes() + array("H", code).tobytes() + sizes
    mark = fingerprint or hashlib.sha256(texts + data).hexdigest()[:16].encode()
    return _START.pack(mark, texts, len(heads), len(values), len(code), len(sizes)) + data


def fingerprints_and_numbers(tables: bytes) -> tuple[bytes, bytes, dict[str, list[float]]]:
    """Return the fingerprints of a library and of its texts, and its numbers by the name of their array in C."""
    mark, texts, heads, count, code, _ = _START.unpack_from(tables)
    offset = _START.size + 8 * heads
    values = array("d", tables[offset : offset + 8 * count]).tolist()
    numbers: dict[str, list[float]] = {}
    for name, size in json.loads(tables[offset + 8 * count + 2 * code :]).items():
        numbers[name], values = values[:size], values[size:]
    return mark.rstrip(b"\0"), texts.rstrip(b"\0"), numbers


def library_texts(folder: Path) -> dict[str, str]:
    """Return the C sources and headers of a library. Raises OSError or UnicodeError for files that cannot be read."""
    files = sorted(file for file in folder.iterdir() if file.suffix in (".c", ".h"))
    return {file.name: file.read_text(encoding="utf-8") for file in files}


def tables_in(folder: Path) -> bytes:
    """Return the tables of a library, empty for a library with its numbers in the text."""
    file = folder / TABLES
    return file.read_bytes() if file.is_file() else b""


def hand_over(library: Path, tables: bytes) -> None:
    """Pass its tables (``packed_tables``) to a loaded library, before the first call. Memory of code of the tape engine
    is kept for as long as the process runs."""
    _, _, heads, numbers, code, _ = _START.unpack_from(tables)
    memory = ctypes.create_string_buffer(tables, len(tables))
    if code:
        memory = _KEPT.setdefault(hashlib.sha256(tables).digest(), memory)
    start = ctypes.addressof(memory)
    first = start + _START.size
    places = (start, first + 8 * heads, first, first + 8 * (heads + numbers))
    ctypes.CDLL(str(library)).eomgen_take_tables(*map(ctypes.c_void_p, places))
