"""Scene descriptions, read and validated: scene files, URDF, formulas, and the Scene."""

__all__ = [
    "bodies", "builder", "control", "document", "forces", "geometry", "hamiltonian", "joint_types",
    "joints", "load", "reading", "scaling", "scene", "sources",
]  # fmt: skip  # a table
