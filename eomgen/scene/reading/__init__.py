"""Reading one key: its kind, its value as a formula, what it must be, and the report of all problems."""
