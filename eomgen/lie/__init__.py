"""Lie groups of the configuration, each defined once and used by NumPy, by the tape and by the C steppers."""

__all__ = ["algebra", "first_order", "groups", "interpolation", "kernels", "numeric", "product", "rotations"]
