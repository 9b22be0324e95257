"""Scene descriptions, read and validated: scene files, URDF, formulas, and the Scene."""

__all__ = [
    "bodies",
    "builder",
    "control",
    "document",
    "forces",
    "formula",
    "geometry",
    "joint_types",
    "joints",
    "load",
    "reading",
    "repeat",
    "scaling",
    "scene",
    "section",
    "signals",
    "sources",
]
