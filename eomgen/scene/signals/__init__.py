"""Parameters, inputs, states, curves, roads and outputs as the user writes them; they become ``system.signals``."""

__all__ = []
#: Open to the other parts of ``scene`` as well.
WITHIN = ["curves", "reading", "schema"]
