"""A double wishbone whose hard points have Lotus' numbers, in mm: x rearward, y outward, z up. Printed positions are
of a solver of lengths with 12 digits, with which voila-sus 0.2.0 agrees within 6e-7 mm."""

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
#: Travel of point 19, and points 3, 7, 11, 18, 19.
PRINTED = (
    (
        -80,
        7.761403180,
        708.032249671,
        100.841445380,
        19.042467046,
        658.144079938,
        422.102878046,
        131.483814710,
        679.662543107,
        154.812962264,
        -1.073164159,
        690.174620647,
        240.941607783,
        -1.397922838,
        750.134953163,
        238.000000000,
    ),
    (
        -30,
        5.968426672,
        717.605216795,
        150.436703038,
        22.666506694,
        665.584240291,
        471.123453820,
        130.446717695,
        688.087332104,
        202.000736504,
        -0.475565203,
        698.906590750,
        290.557495045,
        -0.456906059,
        758.885410936,
        288.000000000,
    ),
    (
        40,
        3.827423649,
        719.469913392,
        219.225106184,
        28.283395931,
        658.624111996,
        537.854505130,
        129.599375821,
        689.087833688,
        267.009468477,
        0.761644891,
        696.852131218,
        358.881960402,
        0.490246308,
        756.878362890,
        358.000000000,
    ),
    (
        80,
        2.788711342,
        714.722570278,
        258.249955433,
        31.758110843,
        645.705727566,
        574.829249315,
        129.418534871,
        684.286751288,
        303.676255256,
        1.665561984,
        688.390452844,
        397.283613685,
        0.830955372,
        748.413700194,
        398.000000000,
    ),
)
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
