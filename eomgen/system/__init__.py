"""The contract between front ends and back ends: named functions on one tape, and the register of their names."""

__all__ = ["system", "terms"]
