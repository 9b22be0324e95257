"""Joint types: the sizes, units and names of their coordinates, and the rows of constraints of the same names."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

JointType = Literal["fixed", "revolute", "prismatic", "helical", "cylindrical", "universal", "planar", "spherical", "free"]
#: Numbers of coordinates and of velocity components of each joint type.
SIZES: Mapping[str, tuple[int, int]] = {
    "fixed": (0, 0), "revolute": (1, 1), "prismatic": (1, 1), "helical": (1, 1), "cylindrical": (2, 2), "universal": (2, 2),
    "planar": (3, 3), "spherical": (4, 3), "free": (7, 6),
}  # fmt: skip
#: Numbers of coordinates that are angles, which come first.
ANGLES: Mapping[str, int] = {"revolute": 1, "helical": 1, "cylindrical": 1, "universal": 2, "planar": 1}
CONFIGURATION_SIZE: Mapping[str, int] = {kind: size for kind, (size, _) in SIZES.items()}
VELOCITY_SIZE: Mapping[str, int] = {kind: size for kind, (_, size) in SIZES.items()}
#: Joints whose coordinates are plain numbers: the unit of each coordinate by its meaning.
COORDINATES: Mapping[str, Mapping[str, str]] = {
    "revolute": {"angle": "rad"}, "prismatic": {"travel": "m"}, "helical": {"angle": "rad"},
    "cylindrical": {"angle": "rad", "travel": "m"}, "universal": {"first angle": "rad", "second angle": "rad"},
    "planar": {"angle": "rad", "x": "m", "y": "m"},
}  # fmt: skip
ConstraintType = Literal[
    "spherical", "revolute", "universal", "cylindrical", "helical", "prismatic", "planar", "fixed", "distance", "point_on_line",
    "rolling",
]  # fmt: skip
#: Number of equations of each type: (holonomic, velocity level).
ROWS: dict[str, tuple[int, int]] = {
    "spherical": (3, 0), "revolute": (5, 0), "universal": (4, 0), "cylindrical": (4, 0), "helical": (5, 0), "prismatic": (5, 0),
    "planar": (3, 0), "fixed": (6, 0), "distance": (1, 0), "point_on_line": (2, 0), "rolling": (1, 2),
}  # fmt: skip


def by_coordinate(angular: str, linear: str) -> dict[str, str | tuple[str, ...]]:
    """Return the unit of what belongs to each coordinate, by type of joint."""
    return {
        "revolute": angular,
        "prismatic": linear,
        "helical": angular,
        "cylindrical": (angular, linear),
        "universal": (angular, angular),
        "planar": (angular, linear, linear),
    }


EFFORT_UNITS = by_coordinate("N m", "N")
