"""A digest of a Scene's data, for caches: a scene that was changed field by field is never taken for the one it was."""

from __future__ import annotations

import hashlib
from collections.abc import Hashable, Iterable, Mapping
from dataclasses import fields, is_dataclass
from fractions import Fraction
from functools import cache
from typing import Any, cast

import numpy as np


def digest_of(data: Mapping[str, Any]) -> bytes:
    """Return SHA-256 of named data of a Scene, to the last bit of each number.

    Raises
    ------
    TypeError
        For a value of a class that no Scene has: its unread parts could differ between two scenes.
    """
    parts: list[bytes] = []
    _add(data, parts)
    parts.append(b"")
    return hashlib.sha256(b"\0".join(parts)).digest()


def _add(value: Any, parts: list[bytes]) -> None:
    """Add bytes that differ for any two different values of the classes in a Scene."""
    kind = type(value)
    if kind is float or kind is str or kind is int:  # most values
        parts.append(f"{kind.__name__}:{value!r}".encode())
    elif kind is tuple or kind is list:
        parts.append(f"of {len(value)}".encode())
        for item in value:
            _add(item, parts)
    elif value is None or isinstance(value, bool | int | float | complex | Fraction | str | bytes):
        parts.append(f"{kind.__name__}:{value!r}".encode())
    elif isinstance(value, np.ndarray):
        parts.append(f"array:{value.dtype.str}{value.shape}".encode())
        parts.append(np.ascontiguousarray(value).tobytes())
    elif isinstance(value, Mapping):
        _add(list(value.items()), parts)
    elif isinstance(value, tuple | list):
        _add(list(value), parts)
    elif isinstance(value, frozenset | set):
        _add_sorted(value, parts)
    elif is_dataclass(value) and not isinstance(value, type):
        parts.append(kind.__qualname__.encode())
        for name in _field_names(cast("Hashable", kind)):
            _add(getattr(value, name), parts)
    elif callable(value) and hasattr(value, "__qualname__"):  # the rules of requirements
        parts.append(f"{value.__module__}.{value.__qualname__}".encode())
    else:
        raise TypeError(f"a {kind.__qualname__} in a scene has no digest")


def _add_sorted(values: Iterable[Any], parts: list[bytes]) -> None:
    """Add the items of a set, in an order of their own."""
    items: list[bytes] = []
    for item in values:
        own: list[bytes] = []
        _add(item, own)
        items.append(b"\0".join(own))
    _add(sorted(items), parts)


@cache
def _field_names(kind: Hashable) -> tuple[str, ...]:
    """Return the names of the fields of a class of data."""
    return tuple(item.name for item in fields(cast("Any", kind)))
