"""Reading of one key: kind, formula, requirement, and the report of problems."""

__all__ = ["formula_units", "key_metadata", "kinds", "report", "requirements", "values", "xml"]
#: Open to the other parts of ``scene`` as well.
WITHIN = ["kinds", "xml"]
