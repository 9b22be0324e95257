"""The contract between front ends and back ends: named functions on one tape, the register of their names, and what
they are about."""

__all__ = ["description", "signals", "system", "terms"]
