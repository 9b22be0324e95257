"""Model directives: files that weld models to one scene."""

__all__: list[str] = []
#: Open to the other sources as well.
WITHIN = ["conversion"]
