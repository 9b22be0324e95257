"""Forces and force elements, a module for each kind with schema, model and reading."""

#: The module whose imports from this package are open to other packages: every kind in the register, and common parts.
OPENED_BY = "register"
#: Open to the other parts of ``scene`` as well.
WITHIN = ["register"]
