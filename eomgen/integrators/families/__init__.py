"""Families of integration methods and their register; order conditions are checked at construction."""

__all__ = ["adaptive", "dormand_prince", "family", "register", "runge_kutta"]
