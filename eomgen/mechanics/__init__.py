"""Virtual work to separated terms: kinematics, bodies, base motion, forces, partials."""

__all__ = ["derivation", "derive", "initial_coordinates", "prescribed_motion", "savings", "terms"]
