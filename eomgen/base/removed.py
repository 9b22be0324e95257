"""Names of earlier versions that are gone, with the replacement of each: one message for all of them."""

from __future__ import annotations

from collections.abc import Mapping

#: Replacement by name, for each kind of name. Options follow their verb: "tune --step"; arguments are `tune(step)`.
REMOVED: Mapping[str, Mapping[str, str]] = {
    "method": {
        "hermite": "rk4, or taylor for small errors",
        **{f"{name}_adaptive": f"{name}, with steps of one size" for name in ("tdg1", "tdg1_star", "tdg2", "tdg3")},
    },
}


def fault_of_removed(kind: str, name: str) -> tuple[str, str] | None:
    """Return the fault of a name that was removed, and its replacement; None for any other name."""
    replacement = REMOVED[kind].get(name)
    return replacement and (f"the {kind} {name} was removed [E2236]", replacement)
