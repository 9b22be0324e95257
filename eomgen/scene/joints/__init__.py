"""Joints, their frames, limits and mimic joints, and constraints: schema, reading, model."""

__all__ = ["constraint_model", "model", "reaction_model", "unresisted"]
#: Open to the other parts of ``scene`` as well.
WITHIN = ["constraint_reading", "displacement", "frames", "moved_inertia", "reading", "schema", "tree"]
