"""Names of earlier versions that are gone, with the replacement of each: one message for all of them."""

from __future__ import annotations

from collections.abc import Mapping

_NO_CYCLES = "a demand on the error; eomgen simulate --timing measures steps"
#: Replacement by name, for each kind of name. Options follow their verb: "tune --step"; arguments are `tune(step)`.
REMOVED: Mapping[str, Mapping[str, str]] = {
    "method": {
        "hermite": "rk4, or taylor for small errors",
        **{f"{name}_adaptive": f"{name}, with steps of one size" for name in ("tdg1", "tdg1_star", "tdg2", "tdg3")},
    },
    "argument": dict.fromkeys(("tune(real_time)", "tune(iterations)"), _NO_CYCLES),
    "option": dict.fromkeys(("tune --real-time", "tune --iterations"), _NO_CYCLES),
    "attribute": {"Difference.cause": "first and second, the two values"},
    "name": {"RealTime": "Tuned, of a demand on the error"},
}


def fault_of_removed(kind: str, name: str) -> tuple[str, str] | None:
    """Return the fault of a name that was removed, and its replacement; None for any other name."""
    replacement = REMOVED[kind].get(name)
    return (f"the {kind} {name} was removed [E2236]", replacement) if replacement else None
