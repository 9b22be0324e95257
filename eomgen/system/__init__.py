"""The contract between front ends and back ends: System, Description, and the register of terms."""

__all__ = [
    "blocks",
    "branches",
    "cancellation",
    "description",
    "display",
    "motions",
    "samples",
    "selection",
    "signals",
    "system",
    "terms",
]
