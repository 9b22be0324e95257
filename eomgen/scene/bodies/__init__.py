"""Rigid bodies and beams: schema, reading, model."""

__all__ = ["cosserat", "mesh_files", "model"]
#: Open to the other parts of ``scene`` as well.
WITHIN = [
    "beam_reading",
    "beam_schema",
    "cosserat_reading",
    "cross_sections",
    "reading",
    "schema",
]
