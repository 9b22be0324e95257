"""JSON as text: indented, with null in place of numbers that JSON does not have."""

from __future__ import annotations

import json
import math
from collections.abc import Collection, Mapping, Sequence
from typing import Any


def json_text(data: Any) -> str:
    """Return data as indented JSON; numbers that JSON does not have become null."""
    return _text(data, "\n")


def _text(data: Any, line: str) -> str:
    """Return the indented JSON of data, whose lines begin with ``line``, a line break and blanks; the encoder of the
    standard library is compiled for lists and mappings without containers alone, and takes five times as long for
    indented ones."""
    if isinstance(data, Mapping):
        entries: Any = {str(key): value for key, value in data.items()}
        opened, closed, values = "{", "}", entries.values()
    elif isinstance(data, Sequence) and not isinstance(data, str):
        opened, closed, values = "[", "]", data
        entries = values
    else:
        return json.dumps(finite(data))
    if not values:
        return opened + closed
    inner = f"{line}  "
    if _plain(values):
        content = json.dumps(entries, separators=(f",{inner}", ": "))[1:-1]
    elif opened == "[":
        content = f",{inner}".join(_text(value, inner) for value in values)
    else:
        content = f",{inner}".join(f"{json.dumps(key)}: {_text(value, inner)}" for key, value in entries.items())
    return f"{opened}{inner}{content}{line}{closed}"


def _plain(values: Collection[Any]) -> bool:
    """Return whether values are texts, truth values and finite numbers."""
    kinds = set(map(type, values))
    finite = float not in kinds or all(math.isfinite(value) for value in values if type(value) is float)
    return finite and kinds <= {*_FINITE, float}


#: Types without infinities: names of a beam with many elements are long lists.
_FINITE = {str, int, bool, type(None)}


def finite(data: Any) -> Any:
    """Return JSON data without the infinities and NaN that JSON does not have."""
    if isinstance(data, Mapping):
        return {str(key): finite(value) for key, value in data.items()}
    if isinstance(data, Sequence) and not isinstance(data, str):
        return list(data) if set(map(type, data)) <= _FINITE else [finite(value) for value in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data
