"""A planar four-bar linkage whose coupler is a geometrically exact beam, and its closure by trigonometry."""

from __future__ import annotations

import math
from typing import Any

CRANK, COUPLER, ROCKER, GROUND = 0.3, 1.0, 0.6, 1.0
#: Steel, 10 mm x 20 mm.
STEEL = {
    "stretch": 4.2e7,
    "shear_y": 1.4e7,
    "shear_z": 1.4e7,
    "torsion": 300.0,
    "bending_y": 350.0,
    "bending_z": 1400.0,
}
WITHOUT: dict[str, tuple[str, ...]] = {
    "cosserat": (),
    "kirchhoff": ("shear_y", "shear_z"),
    "inextensible": ("shear_y", "shear_z", "stretch"),
}


def four_bar(crank: float, coupler: float, rocker: float, model: str = "cosserat", **more: Any) -> dict[str, Any]:
    """Return a scene with a guess of the angles of its joints, rad.

    Parameters
    ----------
    more : ``elements``, ``closing`` (a type of constraint), ``coordinates``
    """
    elements, closing = more.get("elements", 4), more.get("closing", "point_on_line")
    hinge = {"type": "revolute", "axis": [0, 0, 1]}
    tip = {"body": "rocker", "position": [ROCKER, 0.0, 0.0]}
    end = {"body": "coupler", "position": [COUPLER, 0.0, 0.0]}
    closings: dict[str, dict[str, Any]] = {
        "point_on_line": {"C": {"type": closing, "first": {**tip, "axis": [0, 0, 1]}, "second": end}},
        "revolute": {"C": {"type": closing, "first": {**tip, "axis": [0, 0, 1]}, "second": {**end, "axis": [0, 0, 1]}}},
        "distance": {
            f"C{k}": {
                "type": "distance",
                "first": {"body": "rocker", "position": place},
                "second": end,
                "length": math.dist(place, [ROCKER, 0.0, 0.0]),
            }
            for k, place in enumerate(([ROCKER, 0.2, 0.0], [ROCKER - 0.2, 0.1, 0.0]))
        },
    }
    return {
        "format": 1,
        "name": "flexible_four_bar",
        "gravity": [0.0, 0.0, 0.0],
        "coordinates": more.get("coordinates", "joint"),
        "parameters": {"ground": {"value": GROUND, "tunable": True}},
        "bodies": {
            "crank": {"mass": 1.0, "center_of_mass": [0.15, 0.0, 0.0], "inertia": [1e-3, 1e-2, 1e-2]},
            "rocker": {"mass": 1.0, "center_of_mass": [0.3, 0.0, 0.0], "inertia": [1e-3, 1e-2, 1e-2]},
        },
        "beams": {
            "coupler": {
                "model": model,
                "length": COUPLER,
                "elements": elements,
                "mass_per_length": 1.57,
                "rotary_inertia": [6.5e-5, 1.3e-5, 5.2e-5],
                "stiffness": {name: value for name, value in STEEL.items() if name not in WITHOUT[model]},
            }
        },
        "joints": {
            "A": {**hinge, "parent": "base", "child": "crank", "initial": {"position": crank}},
            "B": {
                **hinge,
                "parent": "crank",
                "child": "coupler",
                "position": [CRANK, 0, 0],
                "initial": {"position": coupler},
            },
            "D": {
                **hinge,
                "parent": "base",
                "child": "rocker",
                "position": ["ground", 0, 0],
                "initial": {"position": rocker},
            },
        },
        "constraints": closings[closing],
    }


def closed(crank: float, ground: float = GROUND) -> tuple[float, float]:
    """Return the angles of the coupler's and the rocker's joint, the coupler's end above the line from crank to D."""
    x, y = ground - CRANK * math.cos(crank), -CRANK * math.sin(crank)
    across = math.hypot(x, y)
    turned = math.acos((COUPLER**2 + across**2 - ROCKER**2) / (2.0 * COUPLER * across)) + math.atan2(y, x)
    end = CRANK * math.cos(crank) + COUPLER * math.cos(turned), CRANK * math.sin(crank) + COUPLER * math.sin(turned)
    return turned - crank, math.atan2(end[1], end[0] - ground)
