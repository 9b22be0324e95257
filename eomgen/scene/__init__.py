"""What the user writes, read and checked: scene files, URDF, formulas, and the Scene they become."""

__all__ = [
    "bodies", "builder", "control", "document", "forces", "geometry", "joint_types",
    "joints", "load", "reading", "scene", "sources",
]  # fmt: skip
