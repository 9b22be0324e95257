"""Reading of one key: its kind, its formula, its requirement, and the report of problems."""

__all__ = ["report", "rotations"]
#: Open to the other parts of ``scene`` as well.
WITHIN = [
    "key_metadata",
    "kinds",
    "orientation",
    "part",
    "requirements",
    "rotation_schema",
    "shares",
    "symbol_units",
    "values",
]
