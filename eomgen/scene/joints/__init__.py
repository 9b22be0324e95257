"""Joints, their frames, limits and mimic joints, and constraints: schema, reading, model."""

__all__ = ["model", "reaction_model", "unresisted"]
#: Open to the other parts of ``scene`` as well.
WITHIN = ["frames", "moved_inertia", "reading", "schema", "tree"]
