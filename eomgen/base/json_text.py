"""JSON as text: indented, with null in place of numbers that JSON does not have."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any


def json_text(data: Any) -> str:
    """Return data as indented JSON; numbers that JSON does not have become null."""
    return json.dumps(finite(data), indent=2)


def finite(data: Any) -> Any:
    """Return JSON data without the infinities and NaN that JSON does not have."""
    if isinstance(data, Mapping):
        return {str(key): finite(value) for key, value in data.items()}
    if isinstance(data, Sequence) and not isinstance(data, str):
        return [finite(value) for value in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data
