"""Families of integration methods: what each says of itself, and the register of all; order conditions are checked at start."""

__all__ = ["family", "register"]
