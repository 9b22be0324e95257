"""Joints, frames, limits and mimic joints, and constraints: schema, reading, model."""

__all__ = ["constraint_numbers", "constraint_reading", "constraint_schema", "frames", "model", "tree"]
#: Open to the other parts of ``scene`` as well.
WITHIN = [
    "constraint_reading",
    "constraint_schema",
    "moved_inertia",
    "reading",
    "schema",
    "tree",
    "unresisted",
]
