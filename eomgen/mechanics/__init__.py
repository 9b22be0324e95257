"""Virtual work to separated terms: kinematics, bodies, base motion, forces, partials."""

__all__ = ["controller", "derive", "describe", "forces", "initial_coordinates", "savings", "scene_tape", "tree"]
