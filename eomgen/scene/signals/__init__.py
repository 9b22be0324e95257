"""Parameters, inputs, internal states, curves, roads and outputs of a scene, read into ``system.signals``."""

__all__ = []
#: Open to the other parts of ``scene`` as well.
WITHIN = ["curves", "sampling", "schema", "sections", "tables"]
