"""Reference motions, for which formulas read inverse dynamics: ``tau.elbow(servo)``."""

from __future__ import annotations

from eomgen.base.text import key_of
from eomgen.formula.nodes import Formula
from eomgen.scene.control.model import Reference
from eomgen.scene.formula.scope import SPRING_FORCE
from eomgen.scene.joint_types import JOINTS
from eomgen.scene.reading.key_metadata import Table, key
from eomgen.scene.reading.kinds import Value
from eomgen.scene.reading.report import check_reference
from eomgen.scene.reading.values import Values

_BY_JOINT = "table of values by joint"


class ReferenceEntry(Table):
    """Coordinates, velocities and accelerations of joints, in place of the present ones."""

    position: dict[str, Value] = key(
        "of joints of one coordinate, rad or m; others have their present coordinate",
        {},
        refers="joints",
        names=SPRING_FORCE,
        kind=_BY_JOINT,
        shown_default="`{}`",
    )
    velocity: dict[str, Value] = key(
        "the same, rad/s or m/s; others have their present velocity",
        {},
        refers="joints",
        names=SPRING_FORCE,
        kind=_BY_JOINT,
        shown_default="`{}`",
    )
    acceleration: dict[str, Value] = key(
        "the same, rad/s² or m/s²; others have 0",
        {},
        refers="joints",
        names=SPRING_FORCE,
        kind=_BY_JOINT,
        shown_default="`{}`",
    )


def read_reference(name: str, entry: ReferenceEntry, followers: frozenset[str], values: Values) -> Reference:
    """Return a reference motion; ``followers`` are joints that mimic others."""
    parts: dict[str, tuple[tuple[str, Formula], ...]] = {}
    for part in ("position", "velocity", "acceleration"):
        formulas = []
        for joint, text in getattr(entry, part).items():
            place = key_of("references", name, part, joint)
            if not check_reference(place, joint, values.names.joints, "joint", values.report):
                continue
            kind = JOINTS.get(values.names.joints[joint])
            if kind is not None and kind.v_size != 1:
                values.report.add(place, f"a {kind.name} joint has not one coordinate", "a joint of one coordinate")
            if joint in followers:
                values.report.add(place, f"the joint {joint} follows another", "the joint that it follows")
            formulas.append((joint, values.formula(place, text, SPRING_FORCE)))
        parts[part] = tuple(formulas)
    return Reference(name, **parts)
