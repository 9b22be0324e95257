"""Parameters, inputs, states, curves, roads and outputs: what the user writes, and what they become."""

__all__ = ["model"]
#: Open to the other parts of ``scene`` as well.
WITHIN = ["curves", "reading", "schema"]
