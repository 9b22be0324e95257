"""Lie groups of the configuration, defined for all algebras: NumPy, the tape and the C steppers; the tree and the SymPy
kernels repeat the product of quaternions in their own order of operations."""

__all__ = ["algebra", "few_poses", "groups", "kernels", "numeric", "product", "rotations"]
