"""Families of integration methods and their register; order conditions are checked at construction."""

__all__ = ["adaptive", "embedded_pair", "family", "literature", "register", "runge_kutta"]
