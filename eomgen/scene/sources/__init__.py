"""Sources of descriptions: TOML with included files, XML, URDF, and those of other distributions."""

__all__ = ["register", "source"]
#: Open to the other parts of ``scene`` as well.
WITHIN = ["include", "register", "source", "text", "toml", "urdf"]
