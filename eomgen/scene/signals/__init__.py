"""Parameters, inputs, internal states, curves, roads and outputs of a scene, read into ``system.signals``."""

__all__ = ["curves", "schema", "tables"]
#: Open to the other parts of ``scene`` as well.
WITHIN = ["sampling", "sections"]
