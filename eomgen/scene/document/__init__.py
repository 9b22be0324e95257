"""A whole scene file as data: schema, validation entry by entry, assembly into a Scene, its reference page."""

__all__ = ["notes", "quantities", "reference", "schema", "units", "validation"]
#: Open to the other parts of ``scene`` as well.
WITHIN = ["assemble", "parts_schema", "schema", "units", "validation"]
