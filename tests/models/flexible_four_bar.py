"""A four-bar linkage in space whose coupler is a geometrically exact beam, soft enough for steps of 2^-6 s."""

from __future__ import annotations

from typing import Any

from eomgen.scene.bodies.cosserat import CONSTRAINED

STIFFNESS = {
    "torsion": 20.0,
    "bending_y": 30.0,
    "bending_z": 30.0,
    "stretch": 400.0,
    "shear_y": 300.0,
    "shear_z": 300.0,
}


def flexible_four_bar(model: str) -> dict[str, Any]:
    """Return the scene: hinges carry the coupler of three elements, a ball joint closes the loop, and a force pushes
    the coupler out of the plane."""
    hinge = {"type": "revolute", "axis": [0, 1, 0]}
    coupler = {
        "model": model,
        "length": 3.0,
        "elements": 3,
        "mass_per_length": 1.0,
        "rotary_inertia": [0.2, 0.1, 0.1],
        "stiffness": {strain: value for strain, value in STIFFNESS.items() if strain not in CONSTRAINED[model]},
    }
    end = {"body": "coupler", "position": [3.0, 0.0, 0.0]}
    return {
        "format": 1,
        "name": "flexible_four_bar",
        "gravity": [0.0, 0.0, -9.81],
        "bodies": {
            "crank": {"mass": 1.0, "center_of_mass": [0.0, 0.0, 0.5], "inertia": [0.1, 0.1, 0.02]},
            "rocker": {"mass": 2.0, "center_of_mass": [0.0, 0.0, 0.75], "inertia": [0.4, 0.4, 0.05]},
        },
        "beams": {"coupler": coupler},
        "joints": {
            "drive": {**hinge, "parent": "base", "child": "crank", "initial": {"velocity": [1.0]}},
            "pin": {
                **hinge,
                "parent": "crank",
                "child": "coupler",
                "position": [0.0, 0.0, 1.0],
                "initial": {"velocity": [-1.0]},
            },
            "foot": {
                **hinge,
                "parent": "base",
                "child": "rocker",
                "position": [3.0, 0.0, -0.5],
                "initial": {"velocity": [1.0 / 1.5]},
            },
        },
        "constraints": {
            "end": {"type": "spherical", "first": end, "second": {"body": "rocker", "position": [0.0, 0.0, 1.5]}}
        },
        "forces": {"push": {"body": "coupler", "point": [1.0, 0.0, 0.0], "force": [0.0, "8 * sin(6 * t)", 0.0]}},
    }
