"""Archives ``.npz`` of arrays with JSON metadata: solutions, checkpoints, matrices, journals."""

from __future__ import annotations

import json
import math
import tokenize
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.files.writing import nearby, write_file
from eomgen.base.text import shown
from eomgen.errors import FileError, Problem

_METADATA = "metadata"


def write_arrays(path: Path, arrays: Mapping[str, Array], metadata: Mapping[str, Any]) -> None:
    """Write arrays and JSON metadata to an ``.npz`` file. Raises FileError."""
    text = np.array(json.dumps(metadata, sort_keys=True))
    needed = sum(array.nbytes for array in arrays.values()) + text.nbytes
    write_file(path, needed, lambda stream: np.savez(stream, allow_pickle=False, **{**arrays, _METADATA: text}))


def read_arrays(
    path: Path, kind: str = "solution", hint: str = "a .npz file of Solution.save"
) -> tuple[dict[str, Array], dict[str, Any]]:
    """Return arrays and metadata of an archive of ours; ``kind``, ``hint`` for messages. Raises FileError."""
    try:
        with path.open("rb") as stream:
            if not zipfile.is_zipfile(stream):
                raise ValueError("it is no .npz archive, or not all of one")
            _check_sizes(stream)
            stream.seek(0)
            with np.load(stream, allow_pickle=False) as stored:
                arrays = {name: stored[name] for name in stored.files}
        metadata = json.loads(str(arrays.pop(_METADATA)[()]))
        if not isinstance(metadata, dict):
            raise ValueError("its metadata are no mapping")
    except OSError as error:
        raise FileError(Problem(str(path), f"cannot be read: {error.strerror or error}", nearby(path))) from None
    except KeyError as error:
        raise FileError(
            Problem(str(path), f"this is not a {kind} written by eomgen: {error.args[0]} is missing", hint)
        ) from None
    # zipfile raises NotImplementedError for a compression or encryption that it does not know, and NumPy reads headers
    # as Python's text: such a file is not ours
    except (
        ValueError, EOFError, NotImplementedError, SyntaxError, tokenize.TokenError, zlib.error, zipfile.BadZipFile
    ) as error:  # fmt: skip  # a list of kinds
        raise FileError(Problem(str(path), f"this is not a {kind} written by eomgen: {error}", hint)) from None
    except MemoryError:
        raise FileError(Problem(str(path), "its arrays are larger than the memory", hint)) from None
    return arrays, metadata


def _check_sizes(stream: IO[bytes]) -> None:
    """Refuse arrays whose headers promise more bytes than are stored, before memory is asked for.

    Raises
    ------
    ValueError
    """
    with zipfile.ZipFile(stream) as archive:
        for item in archive.infolist():
            with archive.open(item) as member:
                if (version := np.lib.format.read_magic(member)) not in _HEADERS:
                    continue
                shape, _, kind = _HEADERS[version](member)
                stored = item.file_size - member.tell()
            if (promised := math.prod(shape) * kind.itemsize) > stored:
                name = item.filename.removesuffix(".npy")
                raise ValueError(f"the array {shown(name)} should have {promised} bytes, and has {stored}")


_HEADERS = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
