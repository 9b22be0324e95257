"""Forces and force elements, a module for each kind with schema, model and reading."""

#: All modules but these are open to other packages: every kind that the register reads, and common parts.
CLOSED = ["register"]
#: Open to the other parts of ``scene`` as well.
WITHIN = ["register"]
