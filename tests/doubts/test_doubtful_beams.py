"""Notes on beams that hardly anyone means, and silence about all others."""

from __future__ import annotations

from typing import Any

import pytest

from eomgen.scene.load import from_data

ROUND = {"shape": "circle", "diameter": 0.01, "density": 7800.0, "elastic_modulus": 2e11, "poisson_ratio": 0.3}
RESISTING = {"torsion": 80.0, "bending_y": 100.0, "bending_z": 100.0, "stretch": 1.5e7, "shear_y": 5e6, "shear_z": 5e6}


def notes_of(beam: dict[str, Any], **sections: Any) -> list[str]:
    """Return the notes of a clamped beam of 1 m, with other keys."""
    entry = {"model": "cosserat", "length": 1.0, "elements": 4, "section": ROUND} | beam
    data = {
        "format": 1,
        "name": "doubtful",
        "beams": {"b": {key: value for key, value in entry.items() if value is not None}},
        "joints": {"clamp": {"type": "fixed", "parent": "base", "child": "b"}},
    }
    return list(from_data(data | sections).notes)


def force_at(*point: float) -> dict[str, Any]:
    return {"forces": {"f": {"body": "b", "point": list(point), "force": [0, 0, 1]}}}


def resisting(mass_per_length: float = 0.6, **stiffness: float) -> dict[str, Any]:
    inertia = [2e-5, 1e-5, 1e-5]
    given = {"section": None, "mass_per_length": mass_per_length, "rotary_inertia": inertia}
    return given | {"stiffness": RESISTING | stiffness}


DEFLECTING = {"model": None, "elements": None, "bending_y": {"modes": 1}}

OFF = "5 m off the axis of the beam b, which is 1 m long: a rigid arm reaches from its sections to there"


THICK = "is more than the length of the beam, 1 m"


STIFF = "the stiffness of stretch is 1e+30 N, by which rounding of positions exerts 1e+14 N"


DOUBTED: list[tuple[dict[str, Any], dict[str, Any], str]] = [
    ({}, force_at(0.5, 0.0, 5.0), f"forces.f.point: {OFF}"),
    (DEFLECTING, force_at(0.5, 0.0, 5.0), f"forces.f.point: {OFF}"),
    ({}, {"points": {"p": {"body": "b", "position": [1.0, 3.0, 4.0]}}}, f"points.p.position: {OFF}"),
    (resisting(stretch=1e30), {}, f"beams.b.stiffness.stretch: {STIFF}"),
    ({"length": 1000.0}, {}, "beams.b: the beam is 1000 m long, 1e+05 times as long as its sections are thick"),
    ({"section": ROUND | {"diameter": 10.0}}, {}, f"beams.b.section.diameter: 10 m {THICK}; 0.01 if it is in mm"),
    (DEFLECTING | {"section": ROUND | {"diameter": 10.0}}, {}, f"beams.b.section.diameter: 10 m {THICK}"),
    ({"section": ROUND | {"diameter": "10 * (1 + s)"}}, {}, f"beams.b.section.diameter: 15 m {THICK}; 0.015"),
]

QUIET: list[tuple[dict[str, Any], dict[str, Any]]] = [
    ({}, force_at(0.5, 0.0, 0.2)),
    ({}, force_at(0.5, 0.0, 0.0)),
    (DEFLECTING, force_at(0.5, 0.1, 0.0)),
    ({"length": 200.0}, {}),  # a cable
    (resisting(stretch=1e12), {}),
    (resisting(stretch=1e6, bending_y=1e-8, bending_z=1e-8), {}),  # a cable without stiffness in bending
    ({"model": "inextensible"}, {}),
    ({"section": ROUND | {"diameter": 0.5}}, {}),
]


@pytest.mark.parametrize(("beam", "sections", "note"), DOUBTED)
def test_what_hardly_anyone_means_is_noted(beam: dict[str, Any], sections: dict[str, Any], note: str) -> None:
    (told,) = notes_of(beam, **sections)
    assert told.startswith(note)


@pytest.mark.parametrize(("beam", "sections"), QUIET)
def test_what_is_meant_is_not_noted(beam: dict[str, Any], sections: dict[str, Any]) -> None:
    assert notes_of(beam, **sections) == []
