"""Where descriptions come from: TOML with included files, XML, URDF, and what other distributions read."""

__all__ = ["register", "source"]
#: Open to the other parts of ``scene`` as well.
WITHIN = ["include", "register", "source", "text", "toml", "urdf"]
