"""What the user writes, read and checked: scene files, URDF, formulas, and the Scene they become."""

__all__ = [
    "bodies", "builder", "control", "disturbances", "document", "forces", "formula", "geometry", "joint_types",
    "joints", "load", "prescribed_motion", "reading", "scene", "signals", "units",
]  # fmt: skip
