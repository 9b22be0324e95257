"""Units: table, parser, conversion to SI, labels."""

__all__ = ["labels", "parser"]
#: Open to the other parts of ``scene`` as well.
WITHIN = ["conversion", "table"]
