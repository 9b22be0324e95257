"""What the rest of the package may know of a scene."""

from __future__ import annotations

from collections.abc import Iterator

from eomgen.formula.prescribed_motion import Law
from eomgen.scene.joint_types import DRIVE_UNITS
from eomgen.scene.reading.report import Report
from eomgen.scene.scene import Scene
from eomgen.text import key_of


def laws_of(scene: Scene) -> Iterator[Law]:
    """Yield the laws of a scene: drives of constraints, position and rotation of the base."""
    where = Report(scene.name, scene.source).where
    for constraint in scene.constraints:
        if constraint.drive is not None:
            key, what = where(key_of("constraints", constraint.name, "drive")), constraint.kind.drive
            yield Law(key, f"driven {what}", DRIVE_UNITS[what], constraint.drive)
    if scene.base is not None:
        for place, formula in enumerate(scene.base.position):
            yield Law(where(key_of("base", "position", place)), "position of the base", "m", formula)
        for place, rotation in enumerate(scene.base.rotations):
            yield Law(where(key_of("base", "rotation", place, "angle")), "angle of the base", "rad", rotation.angle)
