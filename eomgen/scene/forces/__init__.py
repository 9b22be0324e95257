"""Forces and force elements, a module for each kind with schema, model and reading."""

#: The module whose imports from this room are open to others: every kind in the register, and their common parts.
OPENED_BY = "register"
#: Open to the other parts of ``scene`` as well.
WITHIN = ["register"]
