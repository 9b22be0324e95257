"""Joints, their frames, limits and followers, and constraints: what the user writes, and what they become."""

__all__ = ["constraint_model", "model", "unresisted"]
#: Open to the other parts of ``scene`` as well.
WITHIN = ["constraints", "displacement", "frame_schema", "frames", "mimics", "moved_inertia", "reading", "schema", "tree"]
