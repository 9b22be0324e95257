"""Controllers and state feedback: what the user writes, and what they become."""

__all__ = ["model"]
#: Open to the other parts of ``scene`` as well.
WITHIN = ["controllers", "schema"]
