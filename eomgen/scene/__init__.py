"""Scene descriptions, read and validated: scene files, formulas, and the Scene."""

__all__ = [
    "bodies",
    "builder",
    "control",
    "design_poses",
    "document",
    "forces",
    "formula",
    "inertia",
    "joint_types",
    "joints",
    "load",
    "reading",
    "repeat",
    "rotations",
    "scene",
    "section",
    "sections",
    "signals",
    "sources",
]
