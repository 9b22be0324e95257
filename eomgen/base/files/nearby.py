"""Hints for a file that is missing: files in its folder with similar names."""

from __future__ import annotations

import difflib
import itertools
from pathlib import Path

_COMPARED = 2000  # of a folder


def nearby(path: Path, otherwise: str = "another path") -> str:
    """Return a hint: the files in the same folder with the nearest names, or the folder, if it is missing itself.

    Parameters
    ----------
    otherwise : str
        The hint if the file exists, or if no name is near.
    """
    folder = path.parent
    try:
        if path.exists():
            return otherwise
        if not folder.is_dir():
            return f"another path: there is no folder {str(folder)!a}"
        every: dict[str, list[str]] = {}
        for file in itertools.islice(folder.iterdir(), _COMPARED):
            every.setdefault(file.stem.lower(), []).append(file.name)
    except (OSError, ValueError):
        return otherwise
    close = difflib.get_close_matches(path.stem.lower(), every, n=3, cutoff=0.6)
    # of the same ending if there are any
    names = [name for stem in close for name in every[stem]]
    alike = [name for name in names if name.endswith(path.suffix)] or names
    named = [str(folder / name) for name in alike[:3]]
    return " or ".join(name if name.isascii() and name.isprintable() else ascii(name) for name in named) or otherwise
