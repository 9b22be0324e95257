"""A digest of a Scene's data, for caches: a scene that was changed field by field is never taken for the one it was."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from fractions import Fraction
from typing import Any

import numpy as np


def digest_of(data: Mapping[str, Any]) -> bytes:
    """Return SHA-256 of named data of a Scene, to the last bit of each number.

    Raises
    ------
    TypeError
        For a value of a class that no Scene has: its unread parts could differ between two scenes.
    """
    total = hashlib.sha256()
    for part in _parts(data):
        total.update(part + b"\0")
    return total.digest()


def _parts(value: Any) -> Iterator[bytes]:
    """Yield bytes that differ for any two different values of the classes in a Scene."""
    if value is None or isinstance(value, bool | int | float | complex | Fraction | str | bytes):
        yield f"{type(value).__name__}:{value!r}".encode()
    elif isinstance(value, np.ndarray):
        yield f"array:{value.dtype.str}{value.shape}".encode()
        yield np.ascontiguousarray(value).tobytes()
    elif isinstance(value, Mapping):
        yield from _all(value.items(), len(value))
    elif isinstance(value, tuple | list):
        yield from _all(value, len(value))
    elif isinstance(value, frozenset | set):
        parts = sorted(b"\0".join(_parts(item)) for item in value)
        yield from _all(parts, len(parts))
    elif is_dataclass(value) and not isinstance(value, type):
        yield type(value).__qualname__.encode()
        for item in fields(value):
            yield from _parts(getattr(value, item.name))
    elif callable(value) and hasattr(value, "__qualname__"):  # the rules of requirements
        yield f"{value.__module__}.{value.__qualname__}".encode()
    else:
        raise TypeError(f"a {type(value).__qualname__} in a scene has no digest")


def _all(values: Any, count: int) -> Iterator[bytes]:
    yield f"of {count}".encode()
    for item in values:
        yield from _parts(item)
