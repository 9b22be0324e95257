"""Parameters, inputs, internal states, curves, roads and outputs of a scene, read into ``system.signals``."""

__all__ = ["curve_schema", "curves", "tables"]
#: Open to the other parts of ``scene`` as well.
WITHIN = ["sampling", "schema", "sections"]
