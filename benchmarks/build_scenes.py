"""Scenes whose C is long: a car on four double wishbones, and linkages in absolute coordinates."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

_EXAMPLES = Path(__file__).resolve().parent.parent / "examples"


def four_bar() -> dict[str, Any]:
    """Return the example of a crank and a rocker in absolute coordinates."""
    read = tomllib.loads((_EXAMPLES / "four_bar" / "scene.toml").read_text(encoding="utf-8"))
    return read | {"name": "four_bar_absolute", "coordinates": "absolute"}


def seven_bodies() -> dict[str, Any]:
    """Return Andrews' squeezing mechanism in absolute coordinates: seven bodies, three loops through one pin."""
    d, e, zf, rr, ss, zt, u = 0.028, 0.02, 0.02, 0.007, 0.035, 0.04, 0.04
    a, b = [-0.06934, -0.00227, 0], [-0.03635, 0.03273, 0]
    # body: mass, inertia, centre of mass, parent, place of the joint, initial angle
    rows: dict[str, tuple[float, float, list[float], str, list[float], float]] = {
        "crank": (0.04325, 2.194e-6, [0.00092, 0, 0], "base", [0, 0, 0], -0.0617),
        "rod": (0.00365, 4.410e-7, [-0.0165, 0, 0], "crank", [rr, 0, 0], 0.0),
        "triangle": (0.02373, 5.255e-6, [0.01043, -0.01874, 0], "base", b, 0.4553),
        "lower_rocker": (0.07050, 1.169e-5, [0.00916, 0.02308, 0], "base", a, 0.4874),
        "lower_link": (0.00706, 5.667e-7, [0, -0.00579, 0], "lower_rocker", [zt, 0, 0], 0.2227),
        "upper_rocker": (0.05498, 1.912e-5, [-0.00449, -0.01228, 0], "base", a, 1.2305),
        "upper_link": (0.00706, 5.667e-7, [0.00579, 0, 0], "upper_rocker", [0, -u, 0], -0.2227),
    }
    pins = {"triangle": [0, -ss, 0], "lower_link": [0, -e, 0], "upper_link": [zf, 0, 0]}
    return {
        "format": 1,
        "name": "seven_bodies",
        "coordinates": "absolute",
        "gravity": [0, 0, 0],
        "bodies": {
            name: {"mass": mass, "center_of_mass": center, "inertia": [turn / 2, turn / 2, turn]}
            for name, (mass, turn, center, *_) in rows.items()
        },
        "joints": {
            f"{name}_pin": {
                "type": "revolute",
                "parent": parent,
                "child": name,
                "axis": [0, 0, 1],
                "position": place,
                "initial": {"position": angle},
            }
            for name, (_, _, _, parent, place, angle) in rows.items()
        },
        "constraints": {
            f"{name}_on_rod": {
                "type": "revolute",
                "first": {"body": "rod", "position": [-d, 0, 0], "axis": [0, 0, 1]},
                "second": {"body": name, "position": place, "axis": [0, 0, 1]},
            }
            for name, place in pins.items()
        },
        "efforts": {"motor": {"joint": "crank_pin", "effort": 0.033}},
        "simulation": {"step": 1e-5, "duration": 0.03},
    }


def wishbone_car() -> dict[str, Any]:
    """Return a car on four double wishbones in joint coordinates: 18 bodies, 17 rows of constraints.

    Each corner has a lower and an upper arm, an upright and a wheel, a ball that closes the loop of the arms, and a rod
    of fixed length that steers the upright; the rods of the front axle end on a rack, which time drives.
    """
    scene: dict[str, Any] = {
        "format": 1,
        "name": "wishbone_car",
        "parameters": {
            "spring": {"value": 4e4, "unit": "N/m", "tunable": True},
            "damper": {"value": 3e3, "unit": "N s/m", "tunable": True},
            "tyre": {"value": 2e5, "unit": "N/m", "tunable": True},
        },
        "bodies": {
            "chassis": {"mass": 1200, "center_of_mass": [0.05, 0, 0.25], "inertia": [400, 1800, 2000]},
            "rack": {"mass": 3, "inertia": [0.3, 0.01, 0.3]},
        },
        "joints": {
            "car": {"type": "free", "parent": "base", "child": "chassis", "initial": {"position": [0, 0, 0.3]}},
            "steering": {
                "type": "prismatic",
                "parent": "chassis",
                "child": "rack",
                "axis": [0, 1, 0],
                "position": [1.25, 0, 0.05],
                "drive": "0.01 * sin(2 * t)",
            },
        },
        "points": {},
        "springs": {},
        "tyres": {},
        "constraints": {},
        "simulation": {"step": 1e-3, "duration": 1.0},
    }
    for axle, x in (("front", 1.4), ("rear", -1.3)):
        for side, sign in (("left", 1), ("right", -1)):
            _add_corner(scene, f"{axle}_{side}", x, sign, axle)
    return scene


def _add_corner(scene: dict[str, Any], corner: str, x: float, sign: int, axle: str) -> None:
    lower, upper, upright, wheel = (f"{part}_{corner}" for part in ("lower", "upper", "upright", "wheel"))
    rack = {"body": "rack", "position": [0, sign * 0.35, 0]}
    held = {"body": "chassis", "position": [x - 0.15, sign * 0.35, 0.05]}
    scene["bodies"] |= {
        lower: {"mass": 6, "center_of_mass": [0.01, sign * 0.18, 0], "inertia": [0.08, 0.05, 0.12]},
        upper: {"mass": 3, "center_of_mass": [-0.01, sign * 0.12, 0], "inertia": [0.03, 0.02, 0.05]},
        upright: {"mass": 12, "center_of_mass": [0, sign * 0.03, 0.12], "inertia": [0.2, 0.2, 0.1]},
        wheel: {"mass": 20, "inertia": [0.8, 1.3, 0.8]},
    }

    def revolute(parent: str, child: str, axis: list[float], position: list[float]) -> dict[str, Any]:
        return {"type": "revolute", "parent": parent, "child": child, "axis": axis, "position": position}

    scene["joints"] |= {
        f"arm_{lower}": revolute("chassis", lower, [1, 0, 0.03], [x, sign * 0.35, 0]),
        f"arm_{upper}": revolute("chassis", upper, [1, 0, -0.05], [x - 0.02, sign * 0.42, 0.25]),
        f"ball_{corner}": {
            "type": "spherical",
            "parent": lower,
            "child": upright,
            "position": [0.0, sign * 0.36, 0.0],
        },
        f"axle_{corner}": revolute(upright, wheel, [0, 1, 0], [0, sign * 0.06, 0.12]),
    }
    scene["points"] |= {
        f"seat_{corner}": {"body": lower, "position": [0, sign * 0.22, 0.02]},
        f"tower_{corner}": {"body": "chassis", "position": [x, sign * 0.45, 0.55]},
        f"hub_{corner}": {"body": wheel},
    }
    scene["springs"][corner] = {
        "first": f"seat_{corner}",
        "second": f"tower_{corner}",
        "stiffness": "spring",
        "damping": "damper",
        "length": 0.65,
    }
    scene["tyres"][corner] = {"center": f"hub_{corner}", "radius": 0.31, "stiffness": "tyre", "damping": 200}
    scene["constraints"] |= {
        f"upper_ball_{corner}": {
            "type": "spherical",
            "first": {"body": upper, "position": [0, sign * 0.27, 0.0]},
            "second": {"body": upright, "position": [-0.02, -sign * 0.02, 0.25]},
        },
        f"tie_rod_{corner}": {
            "type": "distance",
            "first": rack if axle == "front" else held,
            "second": {"body": upright, "position": [-0.14, -sign * 0.02, 0.06]},
            "length": 0.345,
        },
    }
