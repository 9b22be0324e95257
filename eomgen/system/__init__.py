"""The contract between front ends and back ends: System, Description, and the register of terms."""

__all__ = [
    "branches",
    "cancellation",
    "description",
    "events",
    "motions",
    "notebook",
    "signals",
    "sparsity",
    "system",
    "terms",
]
