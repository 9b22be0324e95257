"""Scenes that tests share: one file of TOML for each, read with changes.

``scene("pendulum", joints__hinge__damping=0.1)`` returns the data of ``pendulum.toml`` with another damping;
``scene_text`` and ``scene_file`` give the same as TOML. A value of None removes the key. ``scene("four_bar/scene")``
is a file of ``examples``.
"""

from __future__ import annotations

import copy
import tomllib
from functools import cache
from pathlib import Path
from typing import Any

from tests.models.toml_text import toml_text

_FILES, _EXAMPLES = Path(__file__).parent, Path(__file__).parents[3] / "examples"


@cache
def _data(file: str) -> dict[str, Any]:
    folder = _EXAMPLES if "/" in file else _FILES
    return tomllib.loads((folder / f"{file}.toml").read_text(encoding="utf-8"))


def scene(file: str, /, **changes: Any) -> dict[str, Any]:
    """Return the data of a scene; a change names a key with its tables before it, joined by ``__``."""
    data = copy.deepcopy(_data(file))
    for path, value in changes.items():
        *tables, key = path.split("__")
        table = data
        for part in tables:
            table = table.setdefault(part, {})
        if value is None:
            del table[key]
        else:
            table[key] = value
    return data


def scene_text(file: str, /, **changes: Any) -> str:
    """Return the TOML of ``scene``."""
    return toml_text(scene(file, **changes))


def scene_file(folder: Path, file: str, /, **changes: Any) -> Path:
    """Write the TOML of ``scene`` to a file in a folder, and return its path."""
    path = folder / f"{file.rpartition('/')[2]}.toml"
    path.write_text(scene_text(file, **changes), encoding="utf-8")
    return path
