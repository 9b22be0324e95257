"""Reading one key: its kind, its value as a formula, what it must be, and the report of all problems."""

__all__ = ["report", "rotations"]
#: Open to the other parts of ``scene`` as well.
WITHIN = ["keys", "kinds", "part", "requirements", "rotation_schema", "values"]
