"""MJCF, the format of MuJoCo: compiled by MuJoCo, and converted to a scene."""

#: Open to the other parts of ``scene``.
WITHIN = ["draft", "source"]
