"""Scenes with laws in C beside the same scenes with formulas: a tyre by Pacejka's formula, a table of drag."""

from __future__ import annotations

from pathlib import Path
from typing import Any

#: Combined forces by a friction ellipse of two magic formulas (Pacejka, Tire and Vehicle Dynamics, 2012, chapter 4).
TYRE_C = """\
#include <math.h>

/* Magic formula and its slope. */
static double magic(double x, double b, double c, double *slope)
{
    const double e = 0.3, s = b * x - e * (b * x - atan(b * x));
    const double ds = b - e * (b - b / (1.0 + b * b * x * x));
    *slope = cos(c * atan(s)) * c / (1.0 + s * s) * ds;
    return sin(c * atan(s));
}

void tyre(const double *arguments, const double *parameters, double *results)
{
    const double load = arguments[2], mu = parameters[0], stiffness = parameters[1];
    double slope;
    const double x = magic(arguments[0], stiffness, 1.6, &slope), y = magic(arguments[1], 0.8 * stiffness, 1.3, &slope);
    const double weight = sqrt(1.0 - 0.5 * y * y * x * x);
    results[0] = mu * load * x * weight;
    results[1] = -mu * load * y * weight;
}

void tyre_partials(const double *arguments, const double *parameters, double *partials)
{
    const double load = arguments[2], mu = parameters[0], stiffness = parameters[1];
    double dx, dy;
    const double x = magic(arguments[0], stiffness, 1.6, &dx), y = magic(arguments[1], 0.8 * stiffness, 1.3, &dy);
    const double weight = sqrt(1.0 - 0.5 * y * y * x * x);
    const double by_x = -0.5 * y * y * x / weight, by_y = -0.5 * y * x * x / weight;
    partials[0] = mu * load * (weight + x * by_x) * dx;
    partials[1] = mu * load * x * by_y * dy;
    partials[2] = mu * x * weight;
    partials[3] = -mu * load * y * by_x * dx;
    partials[4] = -mu * load * (weight + y * by_y) * dy;
    partials[5] = -mu * y * weight;
}
"""
_X = "(stiffness * kappa - 0.3 * (stiffness * kappa - atan(stiffness * kappa)))"
_Y = "(0.8 * stiffness * alpha - 0.3 * (0.8 * stiffness * alpha - atan(0.8 * stiffness * alpha)))"
#: The tyre as definitions.
TYRE_DEFINITIONS = {
    "of_kappa": f"sin(1.6 * atan({_X}))",
    "of_alpha": f"sin(1.3 * atan({_Y}))",
    "tyre_weight": "sqrt(1 - 0.5 * of_alpha * of_alpha * of_kappa * of_kappa)",
    "fx": "mu * load * of_kappa * tyre_weight",
    "fy": "-mu * load * of_alpha * tyre_weight",
}
TYRE_LAW: dict[str, Any] = {
    "source": "tyre.c",
    "function": "tyre",
    "partials": "tyre_partials",
    "arguments": {"kappa": "", "alpha": "rad", "load": "N"},
    "results": {"fx": "N", "fy": "N"},
    "parameters": {"mu": "mu", "stiffness": "stiffness"},
    "scales": {"kappa": 0.1, "alpha": 0.1, "load": 1000.0, "stiffness": 10.0},
}
_CALL = "(kappa, alpha, load)"


def wheel_scene(law: dict[str, Any] | None, folder: Path | None = None, **sections: Any) -> dict[str, Any]:
    """Return a wheel on a car that slides sideways and brakes on a spring: tyre by a law, or by definitions.

    With a folder the C file is written there.
    """
    if folder is not None:
        (folder / "tyre.c").write_text(TYRE_C, encoding="utf-8")
    definitions = {
        "load": "300 * 9.81 - 2e4 * q.travel - 800 * v.travel",
        "speed": "sqrt(v.car[1] ** 2 + 1)",
        "kappa": "(0.3 * v.axle - v.car[1]) / speed",
        "alpha": "atan2(v.car[2] - 0.2 * v.car[0], speed)",
        **(TYRE_DEFINITIONS if law is None else {name: f"law.tyre.{name}{_CALL}" for name in ("fx", "fy")}),
    }
    return {
        "format": 1,
        "name": "car",
        "gravity": [0, 0, 0],
        "parameters": {"mu": {"value": 0.9, "tunable": True}, "stiffness": 12.0},
        **({} if law is None else {"laws": {"tyre": law}}),
        "definitions": definitions,
        "bodies": {
            "car": {"mass": 300.0, "inertia": [40, 40, 50]},
            "wheel": {"mass": 30.0, "inertia": [0.5, 1.0, 0.5]},
            "rim": {"mass": 5.0, "inertia": [0.5, 1.0, 0.5]},
        },
        "joints": {
            "car": {
                "type": "planar",
                "parent": "base",
                "child": "car",
                "axis": [0, 0, 1],
                "initial": {"velocity": [0.3, 15, 1]},
            },
            "travel": {
                "type": "prismatic",
                "parent": "car",
                "child": "wheel",
                "axis": [0, 0, 1],
                "initial": {"position": 0.01},
            },
            "axle": {
                "type": "revolute",
                "parent": "wheel",
                "child": "rim",
                "axis": [0, 1, 0],
                "initial": {"velocity": 48},
            },
        },
        "points": {"contact": {"body": "wheel", "position": [0.2, 0, -0.3]}},
        "forces": {"tyre": {"body": "wheel", "point": [0.2, 0, -0.3], "force": ["fx", "fy", 0], "axes": "body"}},
        "efforts": {
            "spring": {"joint": "travel", "effort": "-2e4 * q.travel - 800 * v.travel"},
            "drive": {"joint": "axle", "effort": "-0.3 * fx - 60"},
        },
        "outputs": {"forces": {"formula": ["fx", "fy"], "unit": "N"}},
        "simulation": {"method": "generalized_alpha", "step": 1e-3},
        **sections,
    }
