"""Forces and force elements: what the user writes, and what they become."""

__all__ = ["model"]
#: Open to the other parts of ``scene`` as well.
WITHIN = ["reading", "schema"]
