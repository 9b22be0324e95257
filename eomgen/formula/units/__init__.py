"""Units: table, parser, conversion to SI, labels."""

__all__ = ["conversion", "dimensions", "labels", "parser", "table"]
