"""Products around the core: packages that import the core, and that the core does without. Each registers itself by
the row ``PRODUCT`` in its ``__init__``."""

__all__ = ["derivatives", "ensembles", "exported", "offered", "pages", "solution_methods", "statics"]
