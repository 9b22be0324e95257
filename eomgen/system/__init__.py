"""The contract between front ends and back ends: System, Description, and the register of terms."""

__all__ = [
    "branches",
    "cancellation",
    "description",
    "display",
    "events",
    "motions",
    "patterns",
    "random_processes",
    "samples",
    "second_blocks",
    "selection",
    "signals",
    "system",
    "terms",
]
