"""Products around the core: packages that import the core, and that the core does without. Each registers itself by
the row ``PRODUCT`` in its ``__init__``."""

__all__ = ["exported", "model_methods", "offered", "solution_methods"]
