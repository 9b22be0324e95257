"""Files that a scene includes: read by their sources, renamed, and put into the scene; entries that repeat."""

__all__: list[str] = ["repeat"]
#: Open to the other parts of ``scene``.
WITHIN = ["include"]
