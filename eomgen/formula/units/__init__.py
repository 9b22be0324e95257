"""Units: table, parser, conversion to SI, labels."""

__all__ = ["angles", "conversion", "labels", "parser", "table"]
