"""Notes on angles of more than a turn that a scene has as plain numbers: they are in rad, and may be meant in
degrees."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from eomgen.formula.units.angles import several_turns
from eomgen.scene.joint_types import JOINTS


def angles_of_several_turns(data: Mapping[str, Any]) -> list[str]:
    """Return a note on each start, limit, rest and offset of joints, each angle of a rotation, and each heading
    of waves, of more than a turn as a plain number.

    Parameters
    ----------
    data : of a scene that is well formed, as it is written: unit strings are not converted
    """
    result = [*_of_joints(data), *_of_springs(data), *_of_rotations(data), *_of_waves(data)]
    return list(dict.fromkeys(note for subject, angle in result if (note := several_turns(subject, angle))))


def _of_joints(data: Mapping[str, Any]) -> Iterator[tuple[str, float]]:
    for name, joint in data.get("joints", {}).items():
        limits = joint.get("limits") or {}
        places = (
            (f"the joint {name} starts at", (joint.get("initial") or {}).get("position")),
            (f"the spring of the joint {name} rests at", joint.get("rest")),
            (f"the joint {name} is offset from what it follows by", (joint.get("mimic") or {}).get("offset")),
            (f"the joint {name} has its lower limit at", limits.get("lower")),
            (f"the joint {name} has its upper limit at", limits.get("upper")),
        )
        # of free and spherical joints a start has no angles: a place in m, and rotations by axis and angle
        units = tuple(JOINTS[joint["type"]].coordinates.values())
        for subject, written in places:
            values = written if isinstance(written, list | tuple) else (written,) * len(units)
            for value, unit in zip(values, units, strict=False):
                if unit == "rad" and isinstance(value, int | float):
                    yield subject, value


def _of_springs(data: Mapping[str, Any]) -> Iterator[tuple[str, float]]:
    for name, spring in data.get("torsion_springs", {}).items():
        if isinstance(value := spring.get("rest"), int | float):
            yield f"the torsion spring {name} rests at", value


def _of_rotations(data: Mapping[str, Any]) -> Iterator[tuple[str, float]]:
    turned = [("the base is turned by", data.get("base") or {})]
    for section, kind in (("joints", "joint"), ("frames", "frame")):
        turned += [(f"the {kind} {name} is turned by", entry) for name, entry in data.get(section, {}).items()]
    for name, constraint in data.get("constraints", {}).items():
        sides = [constraint.get(side) for side in ("first", "second")]
        turned += [(f"a frame of the constraint {name} is turned by", side) for side in sides if isinstance(side, dict)]
    for subject, entry in turned:
        for rotation in entry.get("rotation") or ():
            if isinstance(value := rotation.get("angle"), int | float):
                yield subject, value


def _of_waves(data: Mapping[str, Any]) -> Iterator[tuple[str, float]]:
    for name, sea in data.get("waves", {}).items():
        angles = [(f"the waves {name} run to", sea.get("heading"))]
        for number, wave in enumerate(sea.get("regular") or ()):
            angles.append((f"regular[{number}] of the waves {name} runs to", wave.get("heading")))
        for subject, value in angles:
            if isinstance(value, int | float):
                yield subject, value
