"""Limits of the keys of scenes are a contract: accepted scenes stay accepted, and documents name the limits."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from eomgen.scene.document.reference import json_schema

#: By limits: keys, each after its table. Numbers, lengths of texts, and numbers of items.
LIMITS = {
    "items 3 to 3": (
        "Base.acceleration Base.position Beam.curvature Beam.rotary_inertia BeamPart.curvature BeamPart.rotary_inertia "
        "BeamShape.points Body.center_of_mass BodyFrame.orientation BodyFrame.position BushingEntry.damping "
        "BushingEntry.preload BushingEntry.rest BushingEntry.rotational_damping "
        "BushingEntry.rotational_preload BushingEntry.rotational_stiffness BushingEntry.stiffness "
        "Constraint.semi_axes DistributedLoadEntry.force DistributedLoadEntry.moment Document.gravity "
        "DrawnShape.axis DrawnShape.position DrawnShape.semi_axes DrawnShape.size "
        "ForceEntry.force ForceEntry.point ForceEntry.torque HullEntry.end HullEntry.start Include.position "
        "Joint.axis Joint.orientation Joint.position Joint.second_axis Joint.x_axis Point.position "
        "Rotation.axis ShapeFrame.position SlipEntry.axis"
    ),
    "1 to 2": "Beam.order",
    "1 to 10000": "Beam.elements BeamPart.elements",
    "items 6 to 6": (
        "Beam.inertia_matrix Beam.stiffness_matrix BeamPart.inertia_matrix BeamPart.stiffness_matrix "
        "BushingEntry.damping_matrix BushingEntry.stiffness_matrix"
    ),
    "items 2 to 2": (
        "Beam.center_of_mass BeamPart.center_of_mass Calibration.poles Curve.points Input.points "
        "RandomProcess.band RandomProcess.coherence RandomProcess.points RandomProcess.quantiles Road.points "
        "SeaSpectrum.points SeaWaves.band Section.second_moments Section.shear_factors"
    ),
    "1 to 100": "Bending.modes Stretch.modes Torsion.modes",
    "1 to 400": "Bending.elements Stretch.elements Torsion.elements",
    "items 3 to 3, items 6 to 6": "Body.inertia",
    "1 to 100000": "Calibration.modes",
    "length  to 200": "Controller.coordinates Controller.outputs",
    "length 1 to 1000": (
        "Controller.source DrawnShape.file Include.file LawEntry.python LawEntry.source MapFile.file TableFile.file"
    ),
    "length 1 to 64": "Controller.function LawEntry.function LawEntry.partials",
    "0 to 256": "Controller.memory",
    "length  to 64": (
        "Controller.unit Curve.argument_unit Curve.unit Include.prefix Input.unit Map.unit Map.value_unit "
        "Map.x_unit Map.y_unit MapFile.value_unit MapFile.x_unit MapFile.y_unit Output.unit RandomProcess.unit "
        "State.unit TableFile.argument_unit TableFile.value_unit"
    ),
    "length  to 10000": (
        "Controller.description Curve.description Document.description Event.description Input.description "
        "LawEntry.description Map.description Mode.description Output.description RandomProcess.description "
        "SeaWaves.description State.description"
    ),
    "0 to 5": "EffortEntry.index",
    "1 to 200": "HullEntry.stations",
    "exclusive 0.0 to": "LawEntry.scales",
    "0 to 9223372036854775807": "Profile.seed RandomProcess.seed Road.seed SeaWaves.seed",
    "1 to 2000": "Profile.harmonics Road.harmonics SeaWaves.components",
    "1 to": "RandomProcess.modes",
    "2 to 40": "Simulation.order",
    "1 to 1000000000": "Simulation.record_every",
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
