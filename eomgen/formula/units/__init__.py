"""Units: table, parser, conversion to SI, labels."""

__all__ = ["conversion", "labels", "parser", "table"]
