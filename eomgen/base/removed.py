"""Names of earlier versions that are gone, with the replacement of each: one message for all of them."""

from __future__ import annotations

from collections.abc import Mapping

#: Names, by kind: replacement by name. An option stands behind its verb, an argument in brackets behind its function.
REMOVED: Mapping[str, Mapping[str, str]] = {
    "method": {"hermite": "rk4, or taylor for small errors"},
}


def fault_of_removed(kind: str, name: str) -> tuple[str, str] | None:
    """Return the fault of a name that was removed, and its replacement; None for any other name."""
    replacement = REMOVED[kind].get(name)
    return replacement and (f"the {kind} {name} was removed [E2236]", replacement)
