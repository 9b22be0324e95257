"""A scene in which every key whose value formulas of parameters can give is there, to try values key by key."""

from __future__ import annotations

import copy
import pathlib
import re
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

from eomgen.scene.document.schema import every_document, section_keys
from eomgen.scene.formula.scope import PARAMETERS
from eomgen.scene.reading.key_metadata import Table, fields_of
from eomgen.scene.sections import bounds_of, own_sections

DOCUMENT = every_document()
SECTIONS = section_keys()

Path = tuple[str | int, ...]

_AT = {"body": "base", "axis": [0, 0, 1], "x_axis": [1, 0, 0], "position": [0.1, 0.2, 0.3]}
_STRAINS = ("stretch", "shear_y", "shear_z", "torsion", "bending_y", "bending_z")
_SECTION = {
    "elastic_modulus": 2e7,
    "density": 1500.0,
    "area": 1e-3,
    "second_moments": [1e-7, 2e-7],
    "shear_modulus": 8e6,
    "torsion_constant": 3e-7,
    "shear_factors": [0.8, 0.9],
}
_MATERIAL = {"elastic_modulus": 2e7, "density": 1500.0, "poisson_ratio": 0.25}
_RECTANGLE = {**_MATERIAL, "shape": "rectangle", "width": 0.02, "height": 0.01}
_TUBE = {**_MATERIAL, "shape": "tube", "diameter": 0.02, "thickness": 0.001}
_LAYERS = [[100.0 if row == column else 1.0 for column in range(6)] for row in range(6)]
_LAYERED_MASS = [
    [0.5, 0.0, 0.0, 0.0, -0.02, 0.1],
    [0.0, 0.2, 0.0, 0.02, 0.0, 0.0],
    [0.0, 0.0, 0.3, -0.1, 0.0, 0.0],
    [0.0, 0.02, -0.1, 1.0, 0.0, 0.0],
    [-0.02, 0.0, 0.0, 0.0, 1.0, 0.0],
    [0.1, 0.0, 0.0, 0.0, 0.0, 1.0],
]
_PART = {"length": 0.5, "elements": 1}
_BEAM = {"modes": 2, "stiffness_damping": 1e-3, "inertia_factor": 1.0}

_MODELS = pathlib.Path(__file__).parents[1] / "models"
_DRAG, _SOLID = _MODELS / "drag.c", _MODELS / "tetrahedron.obj"

#: Gravity of scenes in which no water has to be level.
TILTED = (0.1, 0.2, -9.81)
#: Sections whose entries need level water.
LEVEL = ("hulls",)
SCENE: dict[str, Any] = {
    "format": 1,
    "name": "every_value",
    "gravity": [0.0, 0.0, -9.81],
    "parameters": {"X": {"value": 1.0, "tunable": True}},
    "bodies": {
        "arm": {"mass": 2.0, "center_of_mass": [0.1, 0.2, -0.5], "inertia": [0.3, 0.4, 0.25, 0.01, 0.02, 0.03]},
        "tip": {"mass": 0.0, "center_of_mass": [0.1, 0, 0], "inertia": [0.01, 0.02, 0.03]},
        "slider": {"mass": 1.0},
        "nut": {"mass": 0.5, "inertia": [0.1, 0.1, 0.1]},
        "disc": {"mass": 3.0, "center_of_mass": [0, 0, 0.01], "inertia": [0.1, 0.1, 0.2]},
        "cross": {"mass": 1.0, "center_of_mass": [0.1, 0.2, 0.3], "inertia": [0.1, 0.1, 0.1]},
        "ball": {"mass": 1.0, "inertia": [0.1, 0.2, 0.3]},
        "puck": {"mass": 1.0, "center_of_mass": [0.1, 0, 0], "inertia": [0.1, 0.1, 0.1]},
        "tube": {"mass": 1.0, "inertia": [0.1, 0.1, 0.1]},
        "crank": {"mass": 0.0, "inertia": [0.0, 0.0, 0.0]},
        "follower": {"mass": 1.0, "inertia": [0.1, 0.1, 0.1]},
    },
    "beams": {
        "blade": {
            "length": 2.0,
            "section": {
                "elastic_modulus": 2e11,
                "density": 7800.0,
                "area": 1e-3,
                "second_moments": [1e-8, 2e-8],
                "shear_modulus": 8e10,
                "torsion_constant": 3e-8,
            },
            "bending_y": _BEAM,
            "bending_z": _BEAM,
            "stretch": _BEAM,
            "torsion": _BEAM,
        },
        "rod": {
            "length": 1.0,
            "mass_per_length": 1.5,
            "polar_inertia": 0.01,
            "bending_y": {**_BEAM, "stiffness": 80.0},
            "bending_z": {**_BEAM, "stiffness": 90.0},
            "stretch": {**_BEAM, "stiffness": 1e6},
            "torsion": {**_BEAM, "stiffness": 70.0},
        },
        "rope": {
            "model": "cosserat",
            "length": 2.0,
            "elements": 2,
            "mass_per_length": 1.0,
            "rotary_inertia": [0.02, 0.01, 0.01],
            "stiffness": dict.fromkeys(_STRAINS, 1000.0),
            "damping": dict.fromkeys(_STRAINS, 0.1),
            "stiffness_damping": 1e-3,
            "prestrain": dict.fromkeys(_STRAINS, 0.01),
        },
        "vane": {
            "model": "cosserat",
            "length": 2.0,
            "elements": 2,
            "stiffness_matrix": _LAYERS,
            "inertia_matrix": _LAYERED_MASS,
        },
        "hose": {"model": "cosserat", "length": 2.0, "elements": 2, "section": _SECTION},
        "strip": {"model": "cosserat", "length": 2.0, "elements": 2, "section": _RECTANGLE},
        "pipe": {"model": "cosserat", "length": 2.0, "elements": 2, "section": _TUBE},
        "blade_of_layers": {
            "model": "cosserat",
            "mass_per_length": 1.0,
            "rotary_inertia": [0.02, 0.01, 0.01],
            "stiffness_matrix": _LAYERS,
            "center_of_mass": [0.1, 0.2],
            "parts": [
                {
                    **_PART,
                    "mass_per_length": 2.0,
                    "rotary_inertia": [0.02, 0.01, 0.01],
                    "stiffness": dict.fromkeys(_STRAINS, 1000.0),
                    "damping": dict.fromkeys(_STRAINS, 0.1),
                    "stiffness_damping": 1e-3,
                    "prestrain": dict.fromkeys(_STRAINS, 0.01),
                },
                {**_PART, "stiffness_matrix": _LAYERS, "center_of_mass": [0.1, 0.2]},
                {**_PART, "inertia_matrix": _LAYERED_MASS},
                {**_PART, "section": _SECTION},
                {**_PART, "section": _RECTANGLE},
                {**_PART, "section": _TUBE},
            ],
        },
    },
    "joints": {
        "rope_end": {"type": "fixed", "parent": "base", "child": "rope"},
        "strip_end": {"type": "fixed", "parent": "base", "child": "strip"},
        "pipe_end": {"type": "fixed", "parent": "base", "child": "pipe"},
        "layers_end": {"type": "fixed", "parent": "base", "child": "blade_of_layers"},
        "vane_end": {"type": "fixed", "parent": "base", "child": "vane"},
        "hose_end": {"type": "free", "parent": "base", "child": "hose"},
        "hinge": {
            "type": "revolute",
            "parent": "base",
            "child": "arm",
            "axis": [0, 1, 0],
            "position": [0.1, 0.2, 0.3],
            "stiffness": 5.0,
            "damping": 0.1,
            "rest": 0.2,
            "rotor_inertia": 0.01,
            "limits": {"lower": -0.2, "upper": 0.5, "stiffness": 100.0, "damping": 1.0, "onset": 1e-3},
            "friction": {"coulomb": 0.3, "velocity": 0.01, "static": 0.4, "stribeck": 0.1},
        },
        "weld": {"type": "fixed", "parent": "arm", "child": "tip", "position": [0.5, 0.0, 0.1]},
        "rail": {
            "type": "prismatic",
            "parent": "base",
            "child": "slider",
            "axis": [1, 0, 0],
            "rotor_inertia": 0.0,
            "limits": {"lower": -1.0, "upper": 1.0, "stiffness": 1e3},
        },
        "screw": {"type": "helical", "parent": "base", "child": "nut", "axis": [0, 0, 1], "pitch": 0.01},
        "free": {"type": "free", "parent": "base", "child": "disc", "initial": {"position": [0, 0, 0.3]}},
        "cardan": {
            "type": "universal",
            "parent": "base",
            "child": "cross",
            "axis": [1, 0, 0],
            "second_axis": [0, 1, 0],
            "rotor_inertia": [0.0, 0.1],
            "stiffness": [1.0, 2.0],
        },
        "socket": {"type": "spherical", "parent": "base", "child": "ball"},
        "table": {
            "type": "planar",
            "parent": "base",
            "child": "puck",
            "axis": [0, 0, 1],
            "rotor_inertia": [0.1, 0.2, 0.3],
        },
        "sleeve": {
            "type": "cylindrical",
            "parent": "base",
            "child": "tube",
            "axis": [0, 0, 1],
            "rotor_inertia": [0.0, 0.0],
            "limits": {
                "lower": [-1, -2],
                "upper": [1, 2],
                "stiffness": [10, 20],
                "damping": [1, 2],
                "onset": [0.01, 0.02],
            },
        },
        "lead": {"type": "revolute", "parent": "base", "child": "crank", "axis": [0, 0, 1], "rotor_inertia": 0.0},
        "follow": {
            "type": "prismatic",
            "parent": "base",
            "child": "follower",
            "axis": [1, 0, 0],
            "rotor_inertia": 0.0,
            "mimic": {"joint": "lead", "multiplier": 0.5, "offset": 0.1},
        },
        "root": {"type": "fixed", "parent": "base", "child": "blade"},
        "clamp": {"type": "fixed", "parent": "base", "child": "rod"},
    },
    "points": {
        "ground": {"body": "base", "position": [0.0, 0.3, 0.0]},
        "end": {"body": "arm", "position": [0.1, 0.2, -1.0]},
        "hub": {"body": "disc", "position": [0.0, 0.0, 0.1]},
    },
    "frames": {"flange": {"body": "arm", "position": [0.1, 0.2, -1.0]}},
    "shapes": {
        "bonnet": {"type": "box", "body": "arm", "position": [0.1, 0.2, 0.3], "size": [0.4, 0.3, 0.2]},
        "pipe": {"type": "cylinder", "body": "base", "radius": 0.1, "length": 0.5},
        "tyre": {"type": "wheel", "body": "disc", "radius": 0.3, "width": 0.1},
        "cover": {"type": "mesh", "body": "arm", "file": str(_SOLID), "scale": 0.001},
        "mirrored": {"type": "mesh", "body": "arm", "file": str(_SOLID), "scale": [0.001, -0.001, 0.001]},
        "egg": {"type": "ellipsoid", "body": "disc", "semi_axes": [0.2, 0.1, 0.1]},
    },
    "constraints": {
        "rope": {
            "type": "distance",
            "length": 0.5,
            "first": {"body": "base", "position": [1, 2, 3]},
            "second": {"body": "ball", "position": [1, 0, 0]},
        },
        "wheel": {
            "type": "rolling",
            "first": _AT,
            "second": {"body": "disc", "axis": [0, 0, 1], "position": [0, 0, 0.1]},
            "radius": 0.3,
        },
        "hill": {
            "type": "rolling",
            "first": _AT,
            "second": {"body": "disc", "position": [0, 0, 0.1]},
            "shape": "sphere",
            "radius": 0.3,
            "surface": "0.1 * x * y",
        },
        "ring": {
            "type": "sliding",
            "shape": "torus",
            "first": _AT,
            "second": {**_AT, "body": "disc"},
            "radius": 0.3,
            "tube_radius": 0.05,
        },
        "stone": {
            "type": "rolling",
            "shape": "ellipsoid",
            "first": _AT,
            "second": {**_AT, "body": "cross"},
            "semi_axes": [0.2, 0.03, 0.02],
        },
        "thread": {"type": "helical", "first": _AT, "second": {**_AT, "body": "cross"}, "pitch": 0.02},
    },
    "springs": {
        "coil": {"first": "ground", "second": "end", "stiffness": 5.0, "damping": 0.1, "length": 0.4},
    },
    "torsion_springs": {"twist": {"first": "hinge", "second": "screw", "stiffness": 5.0, "damping": 0.1, "rest": 0.4}},
    "tendons": {
        "rope": {
            "points": ["ground", "end", "hub"],
            "stiffness": 5.0,
            "damping": 0.1,
            "length": 0.4,
            "wraps": [
                {
                    "after": "ground",
                    "shape": "cylinder",
                    "center": {"body": "puck", "position": [0.0, 0.1, 0.0], "axis": [1.0, 0.0, 0.0]},
                    "radius": 0.1,
                }
            ],
        }
    },
    "bushings": {
        "mount": {
            "first": _AT,
            "second": {**_AT, "body": "puck"},
            "stiffness": [1.0, 2.0, 3.0],
            "damping": [0.1, 0.2, 0.3],
            "rotational_stiffness": [4.0, 5.0, 6.0],
            "rotational_damping": [0.4, 0.5, 0.6],
            "rest": [0.1, 0.2, 0.3],
            "preload": [1.0, 2.0, 3.0],
            "rotational_preload": [4.0, 5.0, 6.0],
        }
    },
    "tyres": {
        "tyre": {
            "center": "hub",
            "radius": 0.3,
            "stiffness": 1e4,
            "damping": 30.0,
            "onset": 1e-3,
            "slip": {"stiffness": [15.0, 12.0], "friction": 0.9, "velocity": 0.1},
        }
    },
    "laws": {
        "drag": {
            "source": str(_DRAG),
            "function": "drag",
            "arguments": {"u": "m/s"},
            "results": {"force": "N"},
            "parameters": {"coefficient": 0.7},
        }
    },
    "inputs": {"track": {"road": {"class": "C", "speed": 20.0}}},
    "waves": {"sea": {"spectrum": {"type": "jonswap", "height": 1.1, "period": 9.0}, "components": 2}},
    "hulls": {
        "leg": {
            "body": "arm",
            "start": [0.1, 0.2, -0.9],
            "end": [0.2, 0.1, 0.8],
            "diameter": 0.2,
            "area": 0.03,
            "level": 0.1,
            "density": 30.0,
            "added_mass": 0.9,
            "wet": 1.0,
            "drag": 1.1,
            "axial_added_mass": 0.7,
            "axial_drag": 2.0,
            "stations": 3,
        }
    },
    "forces": {"wind": {"body": "arm", "point": [0.1, 0.2, 0.3], "force": [1, 0, 0]}},
    "distributed_loads": {"wind": {"beam": "blade", "force": [1, "t", "v.hinge"], "profile": [1, -0.5]}},
    "controllers": {
        "limited": {
            "type": "pi",
            "signal": "-q.hinge",
            "proportional": 1.0,
            "integral": 2.0,
            "minimum": -1.0,
            "maximum": 1.0,
            "tracking": 0.3,
        },
        "ratio": {"type": "pi", "signal": "-q.hinge", "proportional": 1.0, "integral": 2.0, "maximum": 1.0},
        "full": {
            "type": "pid",
            "signal": "-q.hinge",
            "proportional": 1.0,
            "integral": 2.0,
            "derivative": 0.1,
            "time_constant": 0.01,
        },
        "slow": {"type": "low_pass", "signal": "-q.hinge", "gain": 2.0, "time_constant": 0.1},
        "ahead": {"type": "lead_lag", "signal": "-q.hinge", "gain": 2.0, "time_constant": 0.1, "lead": 0.2},
        "sky": {
            "type": "skyhook",
            "spring": "coil",
            "damping": 100.0,
            "groundhook": 10.0,
            "clipped": True,
            "minimum_damping": 5.0,
            "maximum_damping": 200.0,
            "width": 0.01,
        },
    },
}


def parameter_keys(model: type[Table] = DOCUMENT, before: str = "") -> Iterator[str]:
    """Yield every key of the schema whose value formulas of parameters give, without names of entries."""
    for name, (meaning, inner) in fields_of(model).items():
        key = f"{before}.{name}" if before else name
        if key == "include":  # an include is made of entries of other sections before values are read
            continue
        if inner is not None:
            yield from parameter_keys(inner.model, key)
        elif meaning.names is PARAMETERS or key in bounds_of(own_sections()):
            yield key


@cache
def places() -> tuple[Path, ...]:
    """Return the places of all numbers in the scene that formulas of parameters could give in their stead."""
    keys = frozenset(parameter_keys())
    return tuple(place for place in _numbers(SCENE, ()) if key_at(place) in keys)


def _numbers(value: Any, place: Path) -> Iterator[Path]:
    if isinstance(value, dict):
        for name, entry in value.items():
            yield from _numbers(entry, (*place, name))
    elif isinstance(value, list):
        for number, entry in enumerate(value):
            yield from _numbers(entry, (*place, number))
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield place


def key_at(place: Path) -> str:
    """Return the key of the schema for a place; names of values in a table of formulas are no keys."""
    words = [part for part in place if isinstance(part, str)]
    key = ".".join(words[:1] + words[2:] if words[0] in SECTIONS else words)
    return key.removesuffix(f".{words[-1]}") if words[0] == "laws" else key


def number_at(place: Path) -> float:
    """Return the number that the scene has at a place."""
    value: Any = SCENE
    for part in place:
        value = value[part]
    return float(value)


def scene_with(place: Path, formula: str | float, X: float = 1.0) -> dict[str, Any]:
    """Return the scene with a formula of the tunable parameter X at a place, and the default of X."""
    return scene_of({place: formula}, X)


def scene_of(formulas: Mapping[Path, str | float], X: float = 1.0) -> dict[str, Any]:
    """Return the scene with formulas of the tunable parameter X at places, and the default of X."""
    scene = copy.deepcopy(SCENE)
    scene["parameters"]["X"]["value"] = X
    for place, formula in formulas.items():
        inner: Any = scene
        for part in place[:-1]:
            inner = inner[part]
        inner[place[-1]] = formula
    return scene


def without_value(text: str) -> str:
    """Return a message of a build, or of a call, without where the value came from."""
    return re.sub(r" at X = [^;,]*(?=$|;)|at the default parameters, ", "", text)
