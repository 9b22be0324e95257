"""Scene data with its included files, as ``include`` makes them and as they enter the cache key."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from eomgen.base.data import dataclass, field
from eomgen.scene.formula.namespaces import Namespace


@dataclass
class Part:
    """The data of a file with all that it includes.

    Attributes
    ----------
    data : as a scene file without includes holds them.
    lines : ``file:line`` of each dotted key.
    notes : of importers, and of elements left out.
    judged : bodies whose inertias an importer has judged.
    bound : by key, formulas of parameters of included files; they are read even without use.
    spaces : every namespace, in order.
    """

    data: dict[str, Any]
    lines: dict[str, str]
    notes: list[str] = field(default_factory=list)
    judged: set[str] = field(default_factory=set)
    bound: dict[str, str] = field(default_factory=dict)
    spaces: list[Namespace] = field(default_factory=list)


def signature(spaces: Sequence[Namespace]) -> bytes:
    """Return bytes that tell namespaces apart, for the cache key: texts alone do not say whose names they mention."""
    if not spaces:
        return b""
    return json.dumps([[dict(space.names), dict(space.values)] for space in spaces], sort_keys=True).encode()
