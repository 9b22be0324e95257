"""Rigid bodies and beams: schema, reading, model."""

__all__ = ["beam_schema", "cosserat", "cross_sections", "mesh_files", "model"]
#: Open to the other parts of ``scene`` as well.
WITHIN = ["beam_reading", "beam_schema", "cosserat_reading", "reading", "schema"]
