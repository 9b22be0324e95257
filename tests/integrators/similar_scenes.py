"""Small scenes for tests of similarity: every kind of joint, of configuration group and of row that steppers tell
apart.

Formulas in states of joints name their units; initial states are brought onto the constraints by the tests.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

import eomgen
from tests.oracles.similarity import Similar, in_units

_GRAVITY = [0.0, 0.0, -9.81]
#: What tests of motions need of a model; energies, outputs and the like would take most of the time of building.
_TERMS = ("residual", "partials", "forward_dynamics", "mass")
_CONSTRAINED = (
    "mass",
    "residual",
    "constraint",
    "constraint_velocity",
    "constraint_bias",
    "constraint_jacobian",
    "constraint_size",
    "equations",
    "iteration",
    "jacobian_values",
)


def _body(mass: float, center: list[float], inertia: list[float], **more: Any) -> dict[str, Any]:
    return {"mass": mass, "center_of_mass": center, "inertia": inertia, **more}


def tree() -> dict[str, Any]:
    """Return a hinge with a spring, a slider with a damper, a ball, and springs and forces between and on them."""
    return {
        "format": 1,
        "name": "tree",
        "gravity": _GRAVITY,
        "bodies": {
            "arm": _body(2.0, [0.3, 0.1, 0.0], [0.02, 0.06, 0.05]),
            "slug": _body(0.5, [0.0, 0.02, 0.0], [0.004, 0.003, 0.005]),
            "bob": _body(0.8, [0.05, 0.0, -0.3], [0.012, 0.011, 0.004]),
        },
        "joints": {
            "hinge": {
                "type": "revolute",
                "parent": "base",
                "child": "arm",
                "axis": [0.0, 0.8, 0.6],
                "stiffness": 20.0,
                "damping": 0.3,
                "rest": 0.2,
                "initial": {"position": 0.5, "velocity": 2.0},
            },
            "slide": {
                "type": "prismatic",
                "parent": "arm",
                "child": "slug",
                "axis": [1, 0, 0],
                "position": [0.1, 0.0, 0.05],
                "damping": 0.4,
                "stiffness": 90.0,
                "initial": {"position": 0.15, "velocity": -0.3},
            },
            "ball": {
                "type": "spherical",
                "parent": "arm",
                "child": "bob",
                "position": [0.6, 0.0, 0.0],
                "initial": {"velocity": [1.0, 3.0, -2.0]},
            },
        },
        "points": {
            "tip": {"body": "bob", "position": [0, 0, -0.5]},
            "wall": {"body": "base", "position": [1.0, 0.4, -0.2]},
        },
        "springs": {"cord": {"first": "wall", "second": "tip", "stiffness": 40.0, "damping": 0.5, "length": 0.3}},
        "forces": {"push": {"body": "slug", "force": [0.0, "2 * sin(7 * t)", 0.0]}},
        "terms": list(_TERMS),
    }


def flight() -> dict[str, Any]:
    """Return a free body without gravity that carries a screw, a sleeve, a cross and a plane."""
    return {
        "format": 1,
        "name": "flight",
        "gravity": [0, 0, 0],
        "bodies": {
            "hull": _body(4.0, [0.1, 0.0, 0.05], [0.3, 0.4, 0.5]),
            "nut": _body(1.0, [0.05, 0, 0], [0.01, 0.02, 0.02]),
            "tube": _body(0.8, [0, 0.02, -0.1], [0.012, 0.011, 0.004]),
            "cross": _body(0.6, [0, 0, -0.2], [0.01, 0.012, 0.003]),
            "puck": _body(0.4, [0.03, 0, 0], [0.002, 0.002, 0.003]),
        },
        "joints": {
            "root": {
                "type": "free",
                "parent": "base",
                "child": "hull",
                "initial": {"velocity": [0.4, -0.2, 1.7, 0.3, 0.1, 0.5]},
            },
            "screw": {
                "type": "helical",
                "parent": "hull",
                "child": "nut",
                "axis": [1, 0, 0],
                "pitch": 0.02,
                "stiffness": 2.0,
                "initial": {"position": 0.3, "velocity": 1.0},
            },
            "sleeve": {
                "type": "cylindrical",
                "parent": "nut",
                "child": "tube",
                "axis": [0, 0, 1],
                "position": [0.1, 0, 0],
                "stiffness": [1.0, 70.0],
                "initial": {"position": [0.2, 0.05], "velocity": [2.0, 0.0]},
            },
            "cardan": {
                "type": "universal",
                "parent": "tube",
                "child": "cross",
                "axis": [1, 0, 0],
                "second_axis": [0, 1, 0],
                "position": [0, 0, -0.2],
                "initial": {"position": [0.4, -0.3], "velocity": [0.5, 1.0]},
            },
            "table": {
                "type": "planar",
                "parent": "cross",
                "child": "puck",
                "axis": [0, 1, 0],
                "position": [0, 0, -0.3],
                "stiffness": [0.5, 60.0, 50.0],
                "initial": {"position": [0.1, 0.02, 0], "velocity": [1.0, 0, 0.3]},
            },
        },
        "terms": list(_TERMS),
    }


def servo() -> dict[str, Any]:
    """Return a pendulum driven through a filter and an integrator: internal states with and without a unit of
    length."""
    return {
        "format": 1,
        "name": "servo",
        "gravity": _GRAVITY,
        "bodies": {
            "rod": _body(1.0, [0, 0, -0.3], [0.02, 0.02, 0.002]),
            "bob": _body(0.5, [0, 0, 0], [0.001, 0.001, 0.001]),
        },
        "joints": {
            "hinge": {
                "type": "revolute",
                "parent": "base",
                "child": "rod",
                "axis": [0, -1, 0],
                "damping": 0.05,
                "initial": {"position": 0.6, "velocity": 1.0},
            },
            "slide": {
                "type": "prismatic",
                "parent": "rod",
                "child": "bob",
                "axis": [0, 0, 1],
                "position": [0, 0, -0.5],
                "stiffness": 60.0,
                "initial": {"position": 0.02},
            },
        },
        "states": {
            "filtered": {"rate": "(q.hinge - filtered) / (0.05 * unit_time)", "unit": "rad"},
            "drift": {"rate": "v.slide - 0.5 * drift / unit_time", "unit": "m"},
        },
        "efforts": {
            "motor": {"joint": "hinge", "effort": "-4 * filtered * unit_mass * unit_length**2 / unit_time**2"},
            "pull": {"joint": "slide", "effort": "-30 * drift * unit_mass / unit_time**2"},
        },
        "terms": [*_TERMS, "internal_rate", "internal_partials", "equations", "iteration"],
    }


def four_bar() -> dict[str, Any]:
    """Return crank, coupler and rocker in the xz plane, closed by a point on a line across it; the ground is at
    ``place``."""
    return {
        "format": 1,
        "name": "bars",
        "gravity": _GRAVITY,
        "parameters": {"place": {"value": 0.0, "tunable": True}},
        "bodies": {
            "crank": _body(2.0, [0.05, 0, 0], [0.001, 0.02, 0.02]),
            "coupler": _body(0.7, [0.175, 0, 0], [0.0002, 0.007, 0.007]),
            "rocker": _body(0.6, [0.15, 0, 0], [0.0002, 0.0045, 0.0045]),
        },
        "joints": {
            "drive": {
                "type": "revolute",
                "parent": "base",
                "child": "crank",
                "axis": [0, -1, 0],
                "position": ["place * unit_length", 0, 0],
                "initial": {"position": 0.5, "velocity": 30.0},
            },
            "pin": {
                "type": "revolute",
                "parent": "crank",
                "child": "coupler",
                "axis": [0, -1, 0],
                "position": [0.1, 0, 0],
                "initial": {"position": 0.3},
            },
            "support": {
                "type": "revolute",
                "parent": "base",
                "child": "rocker",
                "axis": [0, -1, 0],
                "position": ["(place + 0.4) * unit_length", 0, 0],
                "initial": {"position": 1.5},
            },
        },
        "constraints": {
            "rocker_pin": {
                "type": "point_on_line",
                "first": {"body": "rocker", "position": [0.3, 0, 0], "axis": [0, 1, 0]},
                "second": {"body": "coupler", "position": [0.35, 0, 0]},
            },
        },
        "terms": list(_CONSTRAINED),
    }


def slider_crank() -> dict[str, Any]:
    """Return the slider-crank in space of Haug (1989), 12.4: ball joint and universal joint, on a tree."""
    return {
        "format": 1,
        "name": "crank_in_space",
        "gravity": _GRAVITY,
        "bodies": {
            "crank": _body(0.12, [0, 0, 0], [0.0001, 0.00001, 0.0001]),
            "rod": _body(0.5, [0.15, 0, 0], [0.0004, 0.004, 0.004]),
            "slider": _body(2.0, [0, 0, 0], [0.0001, 0.0001, 0.0001]),
        },
        "joints": {
            "shaft": {
                "type": "revolute",
                "parent": "base",
                "child": "crank",
                "axis": [1, 0, 0],
                "position": [0, 0.1, 0.12],
                "initial": {"velocity": 90.0},
            },
            "ball": {
                "type": "spherical",
                "parent": "crank",
                "child": "rod",
                "position": [0, 0, 0.08],
                "initial": {
                    "rotation": [
                        {"axis": [0, 0, 1], "angle": "-atan(0.5)"},
                        {"axis": [0, 1, 0], "angle": "asin(2 / 3)"},
                    ],
                    "velocity": [-84.0, "-90 / sqrt(5)", "-60 / sqrt(5)"],
                },
            },
            "guide": {
                "type": "prismatic",
                "parent": "base",
                "child": "slider",
                "axis": [1, 0, 0],
                "initial": {"position": 0.2, "velocity": 3.6},
            },
        },
        "constraints": {
            "cross": {
                "type": "universal",
                "first": {"body": "slider", "axis": [0, -1, 0], "x_axis": [0, 0, 1]},
                "second": {"body": "rod", "position": [0.3, 0, 0], "axis": [0, 0, 1], "x_axis": [1, 0, 0]},
            },
        },
        "terms": list(_CONSTRAINED),
    }


def rods(group: str) -> dict[str, Any]:
    """Return a ball joint with a skew hinge and a slider with a spring, in absolute coordinates."""
    return {
        "format": 1,
        "name": f"rods_{group.lower()}",
        "gravity": _GRAVITY,
        "coordinates": "absolute",
        "bodies": {
            "upper": _body(1.0, [0, 0, -0.25], [0.02, 0.021, 0.002], group=group),
            "lower": _body(0.6, [0.02, 0, -0.2], [0.01, 0.011, 0.001], group=group),
            "ring": _body(0.3, [0, 0.01, 0], [0.001, 0.0012, 0.0015], group=group),
        },
        "joints": {
            "ball": {
                "type": "spherical",
                "parent": "base",
                "child": "upper",
                "initial": {"rotation": [{"axis": [1, 0, 0], "angle": 0.5}], "velocity": [0.5, 1.0, 2.0]},
            },
            "hinge": {
                "type": "revolute",
                "parent": "upper",
                "child": "lower",
                "axis": [0, 1, 0.2],
                "position": [0, 0, -0.5],
                "initial": {"position": 0.4, "velocity": 1.0},
            },
            "slide": {
                "type": "prismatic",
                "parent": "upper",
                "child": "ring",
                "axis": [0, 0, 1],
                "position": [0, 0, -0.2],
                "stiffness": 40.0,
                "initial": {"position": 0.03},
            },
        },
        "terms": list(_CONSTRAINED),
    }


def driven() -> dict[str, Any]:
    """Return a planar slider-crank whose crank is driven by a formula of the time."""
    return {
        "format": 1,
        "name": "driven",
        "gravity": _GRAVITY,
        "coordinates": "absolute",
        "bodies": {
            "crank": _body(0.5, [0.05, 0, 0], [0.0002, 0.001, 0.001]),
            "rod": _body(0.4, [0.15, 0, 0], [0.0002, 0.004, 0.004]),
            "slider": _body(1.0, [0, 0, 0], [0.001, 0.001, 0.001]),
        },
        "joints": {
            "shaft": {
                "type": "revolute",
                "parent": "base",
                "child": "crank",
                "axis": [0, -1, 0],
                "initial": {"velocity": 20.0},
            },
            "pin": {
                "type": "revolute",
                "parent": "crank",
                "child": "rod",
                "axis": [0, -1, 0],
                "position": [0.1, 0, 0],
                "initial": {"velocity": -26.0},
            },
            "wrist": {
                "type": "universal",
                "parent": "rod",
                "child": "slider",
                "axis": [0, 1, 0],
                "second_axis": [0, 0, 1],
                "position": [0.3, 0, 0],
                "initial": {"velocity": [-6.0, 0]},
            },
        },
        "constraints": {
            "motor": {
                "type": "revolute",
                "drive": "20 * t + 0.3 * sin(15 * t)**2",
                "first": {"body": "base", "axis": [0, -1, 0], "x_axis": [1, 0, 0]},
                "second": {"body": "crank", "axis": [0, -1, 0], "x_axis": [1, 0, 0]},
            },
            "guide": {
                "type": "prismatic",
                "first": {"body": "base", "axis": [1, 0, 0], "x_axis": [0, 1, 0]},
                "second": {"body": "slider", "axis": [1, 0, 0], "x_axis": [0, 1, 0]},
            },
        },
        "terms": list(_CONSTRAINED),
    }


def rolling() -> dict[str, Any]:
    """Return a disc that rolls on the ground: one row at position level and two at velocity level."""
    return {
        "format": 1,
        "name": "wheel",
        "gravity": _GRAVITY,
        "bodies": {"wheel": _body(3.0, [0, 0, 0], [0.02, 0.04, 0.02])},
        "joints": {
            "wheel": {
                "type": "free",
                "parent": "base",
                "child": "wheel",
                "initial": {
                    "position": [0, 0, 0.2],
                    "rotation": [{"axis": [1, 0, 0], "angle": 0.1}],
                    "velocity": [0, 8, 0.5, 0, 0, 0],
                },
            }
        },
        "constraints": {
            "ground": {
                "type": "rolling",
                "first": {"body": "base", "axis": [0, 0, 1]},
                "second": {"body": "wheel", "axis": [0, 1, 0]},
                "radius": 0.2,
            }
        },
        "terms": list(_CONSTRAINED),
    }


def rail() -> dict[str, Any]:
    """Return a trolley on a rail with a load on a rope: a cylindrical constraint and a distance."""
    return {
        "format": 1,
        "name": "trolley",
        "gravity": _GRAVITY,
        "bodies": {
            "trolley": _body(3.0, [0, 0, 0.02], [0.02, 0.04, 0.03]),
            "load": _body(5.0, [0, 0, 0], [0.1, 0.1, 0.1]),
        },
        "joints": {
            "trolley": {
                "type": "free",
                "parent": "base",
                "child": "trolley",
                "initial": {"velocity": [0.5, 0, 0, 1.5, 0, 0]},
            },
            "load": {
                "type": "free",
                "parent": "base",
                "child": "load",
                "initial": {"position": [0.3, 0.2, -1.1], "velocity": [0, 0.4, 0, 1, 0.5, 0]},
            },
        },
        "constraints": {
            "rail": {
                "type": "cylindrical",
                "first": {"body": "base", "axis": [1, 0, 0]},
                "second": {"body": "trolley", "axis": [1, 0, 0]},
            },
            "rope": {
                "type": "distance",
                "length": 1.05,
                "first": {"body": "trolley", "position": [0, 0, -0.1]},
                "second": {"body": "load"},
            },
        },
        "terms": list(_CONSTRAINED),
    }


#: Scenes without constraints, and with them.
FREE: Mapping[str, Any] = {"tree": tree, "flight": flight, "servo": servo}
BOUND: Mapping[str, Any] = {
    "four_bar": four_bar,
    "slider_crank": slider_crank,
    "rods_se3": lambda: rods("SE3"),
    "rods_r3xso3": lambda: rods("R3xSO3"),
    "driven": driven,
    "rolling": rolling,
    "rail": rail,
}
#: Steps of runs, s in the scene's own units of time; 2e-3 unless they are here.
STEPS: Mapping[str, float] = {"four_bar": 5e-4, "slider_crank": 2e-4, "driven": 5e-4}


@cache
def similar(name: str) -> Similar:
    """Return the model of a scene in any units, with a start on its constraints."""
    scene = {**FREE, **BOUND}[name]()
    return Similar(eomgen.build(in_units(scene), profile="quick"))
