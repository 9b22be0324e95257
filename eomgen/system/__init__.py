"""The contract between front ends and back ends: System, Description, and the register of terms."""

__all__ = [
    "branches",
    "cancellation",
    "description",
    "display",
    "events",
    "motions",
    "normal_series",
    "patterns",
    "samples",
    "second_blocks",
    "selection",
    "signals",
    "system",
    "terms",
]
