"""Virtual work to separated terms: kinematics, bodies, base motion, forces, partials."""

__all__ = ["derivation", "derive", "describe", "forces", "initial_coordinates", "savings", "tree"]
