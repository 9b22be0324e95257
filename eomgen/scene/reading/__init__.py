"""Reading of one key: its kind, its formula, its requirement, and the report of problems."""

__all__ = ["key_metadata", "kinds", "report", "requirements", "values"]
#: Open to the other parts of ``scene`` as well.
WITHIN = ["kinds"]
