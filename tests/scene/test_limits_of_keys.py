"""Limits of the keys of scenes are a contract: accepted scenes stay accepted, and documents name the limits."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from eomgen.scene.document.reference import json_schema

#: By limits: keys, each after its table. Numbers, lengths of texts, and numbers of items.
LIMITS = {
    "items 3 to 3": (
        "BaseEntry.acceleration BaseEntry.position BeamEntry.curvature BeamEntry.rotary_inertia BeamPart.curvature "
        "BeamPart.rotary_inertia BeamShape.points BodyEntry.center_of_mass BodyFrame.orientation BodyFrame.position "
        "BushingEntry.damping BushingEntry.preload BushingEntry.rest BushingEntry.rotational_damping "
        "BushingEntry.rotational_preload BushingEntry.rotational_stiffness BushingEntry.stiffness "
        "ConstraintEntry.semi_axes DistributedLoadEntry.force DistributedLoadEntry.moment Document.gravity "
        "DrawnShape.axis DrawnShape.position DrawnShape.semi_axes DrawnShape.size ForceEntry.force ForceEntry.point "
        "ForceEntry.torque HullEntry.end HullEntry.start Include.position JointEntry.axis JointEntry.orientation "
        "JointEntry.position JointEntry.second_axis JointEntry.x_axis PointEntry.position RotationEntry.axis "
        "ShapeFrame.position SlipEntry.axis"
    ),
    "1 to 2": "BeamEntry.order",
    "1 to 10000": "BeamEntry.elements BeamPart.elements",
    "items 6 to 6": (
        "BeamEntry.inertia_matrix BeamEntry.stiffness_matrix BeamPart.inertia_matrix BeamPart.stiffness_matrix "
        "BushingEntry.damping_matrix BushingEntry.stiffness_matrix"
    ),
    "items 2 to 2": (
        "BeamEntry.center_of_mass BeamPart.center_of_mass CalibrationEntry.poles CurveEntry.points InputEntry.points "
        "RandomProcess.band RandomProcess.coherence RandomProcess.points RandomProcess.quantiles RoadEntry.points "
        "SeaSpectrum.points SeaWaves.band SectionEntry.second_moments SectionEntry.shear_factors"
    ),
    "1 to 100": "Bending.modes Stretch.modes Torsion.modes",
    "1 to 400": "Bending.elements Stretch.elements Torsion.elements",
    "items 3 to 3, items 6 to 6": "BodyEntry.inertia",
    "1 to 100000": "CalibrationEntry.modes",
    "length  to 200": "ControllerEntry.coordinates ControllerEntry.outputs",
    "length 1 to 1000": (
        "ControllerEntry.source DrawnShape.file Include.file LawEntry.python LawEntry.source MapFile.file "
        "TableFile.file"
    ),
    "length 1 to 64": "ControllerEntry.function LawEntry.function LawEntry.partials",
    "0 to 256": "ControllerEntry.memory",
    "length  to 64": (
        "ControllerEntry.unit CurveEntry.argument_unit CurveEntry.unit Include.prefix InputEntry.unit MapEntry.unit "
        "MapEntry.value_unit MapEntry.x_unit MapEntry.y_unit MapFile.value_unit MapFile.x_unit MapFile.y_unit "
        "OutputEntry.unit RandomProcess.unit StateEntry.unit TableFile.argument_unit TableFile.value_unit"
    ),
    "length  to 10000": (
        "ControllerEntry.description CurveEntry.description Document.description EventEntry.description "
        "InputEntry.description LawEntry.description MapEntry.description ModeEntry.description "
        "OutputEntry.description RandomProcess.description SeaWaves.description StateEntry.description"
    ),
    "0 to 5": "EffortEntry.index",
    "1 to 200": "HullEntry.stations",
    "exclusive 0.0 to": "LawEntry.scales",
    "0 to 9223372036854775807": "ProfileEntry.seed RandomProcess.seed RoadEntry.seed SeaWaves.seed",
    "1 to 2000": "ProfileEntry.harmonics RoadEntry.harmonics SeaWaves.components",
    "1 to": "RandomProcess.modes",
    "2 to 40": "SimulationEntry.order",
    "1 to 1000000000": "SimulationEntry.record_every",
    "2 to 99": "Spread.directions",
    "0 to 9999, length  to 200": "TableFile.argument TableFile.value",
    "0 to 1": "TorsionSpringEntry.first_index TorsionSpringEntry.second_index",
}

_BOUNDS = (
    ("minimum", "maximum"),
    ("exclusiveMinimum", "exclusiveMaximum"),
    ("minLength", "maxLength"),
    ("minItems", "maxItems"),
)


def limits() -> dict[str, str]:
    """Return by table and key all limits: ``1 to 40``, with the words length and items in front, if of these."""
    schema = json.loads(json_schema())
    found: dict[str, list[str]] = {}
    for table, node in [*schema["$defs"].items(), ("Document", schema)]:
        for key, part in node.get("properties", {}).items():
            texts = list(dict.fromkeys(_of(part)))
            if texts:
                found[f"{table}.{key}"] = texts
    return {key: ", ".join(texts) for key, texts in found.items()}


def _of(node: Any) -> Iterator[str]:
    if isinstance(node, dict):
        for low, high in _BOUNDS:
            if low in node or high in node:
                noun = low[3:].lower() if low.startswith("min") and low != "minimum" else low.removesuffix("Minimum")
                begin = "" if low == "minimum" else f"{noun} "
                yield f"{begin}{node.get(low, '')} to {node.get(high, '')}".strip()
        for part in node.values():
            yield from _of(part)
    elif isinstance(node, list):
        for part in node:
            yield from _of(part)


def test_limits_of_keys_are_kept() -> None:
    expected = {key: texts for texts, keys in LIMITS.items() for key in keys.split()}
    assert limits() == expected
