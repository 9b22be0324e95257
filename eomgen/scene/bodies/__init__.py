"""Rigid bodies and beams: what the user writes, and what they become."""

__all__ = ["beam", "model"]
#: Open to the other parts of ``scene`` as well.
WITHIN = ["beam_reading", "beam_schema", "reading", "schema"]
