"""The contract between front ends and back ends: System, Description, and the register of terms."""

__all__ = [
    "branches",
    "cancellation",
    "description",
    "events",
    "motions",
    "notebook",
    "samples",
    "signals",
    "sparsity",
    "system",
    "terms",
]
