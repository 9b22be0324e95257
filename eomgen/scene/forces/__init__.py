"""Forces and force elements: schema, reading, model."""

__all__ = ["model"]
#: Open to the other parts of ``scene`` as well.
WITHIN = ["reading", "schema"]
