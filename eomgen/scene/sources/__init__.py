"""Where descriptions come from: TOML with included files, XML, URDF."""

__all__ = []
#: Open to the other parts of ``scene`` as well.
WITHIN = ["include", "text", "toml", "urdf"]
