"""Units: table, parser, conversion to SI, labels."""
