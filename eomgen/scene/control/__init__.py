"""Controllers and state feedback: schema, reading, model."""

__all__ = ["model"]
#: Open to the other parts of ``scene`` as well.
WITHIN = ["controllers", "sampled", "schema", "sections"]
