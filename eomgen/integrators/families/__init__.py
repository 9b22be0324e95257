"""Families of integration methods and their register."""

__all__ = ["adaptive", "embedded_pair", "family", "literature", "register", "runge_kutta"]
