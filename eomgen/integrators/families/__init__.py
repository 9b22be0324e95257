"""Families of integration methods and their register; order conditions are checked at construction."""

__all__ = ["adaptive", "embedded_pair", "family", "register", "runge_kutta"]
