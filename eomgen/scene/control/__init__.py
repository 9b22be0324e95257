"""Controllers and state feedback: schema, reading, model."""

__all__ = ["controllers", "model", "sampled"]
#: Open to the other parts of ``scene`` as well.
WITHIN = ["controllers", "schema", "sections"]
