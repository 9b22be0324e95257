"""A double wishbone whose hard points have Lotus' numbers, in mm: x rearward, y outward, z up."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import eomgen

#: Hard points: lower arm 1 to 3, upper arm 5 to 7, tie rod 11 and 12, spindle 18 and 19.
POINTS = {
    "lower_front": (-150, 350, 190),
    "lower_rear": (180, 360, 200),
    "lower_ball": (5, 720, 180),
    "upper_front": (-90, 430, 490),
    "upper_rear": (160, 440, 470),
    "upper_ball": (25, 665, 500),
    "tie": (130, 690, 230),
    "center": (0, 760, 318),
}
RACK, SPINDLE = (140, 340, 240), (0, 700, 320)
_CORNER = Path(__file__).parents[2] / "examples/car/system/double_wishbone.toml"
_MEASURED = ("lower_ball", "upper_ball", "tie", "spindle", "center")


def positions(travels: Sequence[float]) -> list[NDArray[np.float64]]:
    """Return the positions (5, 3) of the points at travels of the wheel's centre, mm."""
    numbers = {f"{name}_{key}": 1e-3 * x for name, place in POINTS.items() for key, x in zip("xyz", place, strict=True)}

    def design(body: str, place: Sequence[float]) -> dict[str, object]:
        return {"body": body, "position": [1e-3 * x for x in place], "in": "base"}

    scene = {
        "format": 1,
        "name": "corner",
        "parameters": {"travel": {"value": 0.0, "tunable": True}},
        "include": {"corner": {"file": str(_CORNER), "prefix": "", "parameters": numbers}},
        "points": {
            "rack": {"body": "base", "position": [1e-3 * x for x in RACK]},
            "spindle": design("carrier", SPINDLE),
        },
        "constraints": {
            "tie_rod": {"type": "distance", "first": "rack", "second": "tie"},
            "pad": {"type": "formula", "equation": "position.center[2] - center_z - travel", "unit": "m"},
        },
        "outputs": {name: {"position": name} for name in _MEASURED},
    }
    model = eomgen.build(scene, profile="quick")
    still, found, q = np.zeros(model.nv), {}, None
    for travel in sorted(travels, key=abs):
        values = {"travel": 1e-3 * travel}
        q = model.equilibrium(initial=None if q is None else {"q": q}, parameters=values).q
        outputs = model.outputs(q, still, still, parameters=values)
        found[travel] = np.array([1e3 * outputs[name] for name in _MEASURED])
    return [found[travel] for travel in travels]
