"""Scenes of which errors are known: their rates as they stand here, or the equations themselves in other hands."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import make_interp_spline

from eomgen.base.arrays import Array
from tests.models.cosserat import beam_scene

#: Rates of (q, v, z) by time.
Rates = Callable[[float, Array], list[float]]


#: Methods with their options, of which the tolerance is one.
Methods = tuple[tuple[str, Mapping[str, float]], ...]

ALPHA: Methods = (("generalized_alpha", {}),)
FIXED: Methods = (*ALPHA, ("rk4", {}))
BY_TOLERANCE: Methods = (("rk45", {"tolerance": 1e-5}), ("generalized_alpha", {"tolerance": 1e-5}))
METHODS: Methods = (*FIXED, *BY_TOLERANCE)
EXPLICIT: Methods = (("rk4", {}), ("rk45", {"tolerance": 1e-5}))
CONSTRAINED: Methods = (*ALPHA, ("generalized_alpha", {"tolerance": 1e-5}))


class Case(NamedTuple):
    """A scene with its reference and its runs.

    Attributes
    ----------
    rates : of (q, v, z), of sliders and hinges; None: ``Model.rhs``, or a run in finer steps if there are constraints
    duration : s
    breaks : s, times between which rates are smooth
    steps : s, of runs; with a tolerance the first one
    """

    name: str
    scene: dict[str, Any]
    rates: Rates | None
    duration: float
    breaks: tuple[float, ...]
    steps: tuple[float, ...]
    methods: Methods = METHODS


class SampledCase(NamedTuple):
    """A slider with the parameter k in an ensemble: its rates by k, its duration and step, s, and k's values."""

    name: str
    scene: dict[str, Any]
    rates: Callable[[float], Rates]
    duration: float
    step: float
    values: str


def sliders(name: str, efforts: dict[str, str], start: dict[str, tuple[float, float]], **more: Any) -> dict[str, Any]:
    """Return a scene of unit masses on perpendicular rails, pushed by formulas."""
    axes = dict(zip(start, ([1, 0, 0], [0, 1, 0], [0, 0, 1]), strict=False))
    joints = {
        joint: {
            "type": "prismatic", "parent": "base", "child": f"mass_{joint}", "axis": axes[joint],
            "initial": {"position": q, "velocity": v},
        }
        for joint, (q, v) in start.items()
    }  # fmt: skip
    return {
        "format": 1, "name": name, "gravity": [0, 0, 0],
        "bodies": {f"mass_{joint}": {"mass": 1.0} for joint in start}, "joints": joints,
        "efforts": {f"on_{joint}": {"joint": joint, "effort": text} for joint, text in efforts.items()}, **more,
    }  # fmt: skip


def _spring(t: float, y: Array) -> list[float]:
    return [y[1], -100.0 * y[0]]


def _damped(t: float, y: Array) -> list[float]:
    return [y[1], -100.0 * y[0] - 3.0 * y[1] + 5.0 * math.cos(7.0 * t)]


def _van_der_pol(t: float, y: Array) -> list[float]:
    return [y[1], 5.0 * (1.0 - y[0] ** 2) * y[1] - y[0]]


def _kepler(t: float, y: Array) -> list[float]:
    cube = (y[0] ** 2 + y[1] ** 2) ** 1.5
    return [y[2], y[3], -y[0] / cube, -y[1] / cube]


def _filtered(t: float, y: Array) -> list[float]:
    return [y[1], -40.0 * y[0] + 4.0 * y[2], -(y[2] - math.sin(3.0 * t)) / 0.02]


def _floor(t: float, y: Array) -> list[float]:
    return [y[1], -9.81 + (2e3 * max(-y[0], 0.0))]


def _table(t: float, y: Array) -> list[float]:
    return [y[1], -25.0 * y[0] + float(np.interp(t, [0.0, 0.5, 0.9, 1.4, 2.0], [0.0, 3.0, -2.0, 4.0, 0.0]))]


def _pendulum(t: float, y: Array) -> list[float]:
    return [y[1], -9.81 * 0.5 / (0.25 + 1e-9) * math.sin(y[0])]


def _states(name: str, states: dict[str, tuple[float, str]], rates: Rates, duration: float, step: float) -> Case:
    """Return a case of internal states alone, beside a mass that moves on by itself."""
    data = {key: {"initial": start, "rate": rate} for key, (start, rate) in states.items()}
    scene = sliders("states", {"x": "0"}, {"x": (0.0, 1.0)}, states=data)
    return Case(name, scene, lambda t, y: [y[1], 0.0, *rates(t, y[2:])], duration, (), (step, step / 4), EXPLICIT)


def _forced(
    name: str,
    effort: str,
    force: Callable[[float, float, float], float],
    start: tuple[float, float],
    duration: float,
    step: float,
    breaks: tuple[float, ...] = (),
) -> Case:
    """Return a case of one slider under a force of (t, q, v)."""
    scene = sliders("forced", {"x": effort}, {"x": start})
    return Case(name, scene, lambda t, y: [y[1], force(t, y[0], y[1])], duration, breaks, (step, step / 4))


def _tabled(name: str, effort: str, kind: str, duration: float, breaks: tuple[float, ...] = ()) -> Case:
    """Return a case of one slider under a force with a curve."""
    points = np.array(CURVE)
    curve = make_interp_spline(*points.T, k=5, bc_type=([(3, 0), (4, 0)],) * 2) if kind == "quintic" else None

    def bump(x: float) -> float:
        return float(np.interp(x, *points.T) if curve is None else curve(x))

    def rates(t: float, y: Array) -> list[float]:
        names = {"t": t, "bump": bump, "q": SimpleNamespace(x=y[0]), "v": SimpleNamespace(x=y[1])}
        return [y[1], eval(effort, names)]  # of this table

    curves = {"bump": {"points": CURVE, "interpolation": kind}}
    scene = sliders("tabled", {"x": effort}, {"x": (0.05, 0.0)}, curves=curves)
    return Case(name, scene, rates, duration, breaks, (0.01, 0.0025), (*FIXED, ("rk45", {"tolerance": 1e-5})))


def _of_k(effort: str) -> dict[str, Any]:
    """Return a slider under a force with the tunable parameter k."""
    parameters = {"k": {"value": 100.0 if "max" not in effort else 2000.0, "tunable": True}}
    return sliders(
        "sampled", {"x": effort}, {"x": (0.1, 0.0)}, parameters=parameters,
        outputs={"x": {"formula": "q.x", "unit": "m"}},
    )  # fmt: skip


def _example(name: str) -> dict[str, Any]:
    """Return the scene of an example without its outputs."""
    path = Path(__file__).parents[2] / "examples" / name / "scene.toml"
    scene = tomllib.loads(path.read_text(encoding="utf-8"))
    return {key: value for key, value in scene.items() if key not in ("outputs", "simulation")}


def _cantilever(elements: int, **beam: Any) -> dict[str, Any]:
    """Return a beam of 10 m that a force at its end bends far."""
    return beam_scene(elements, {"force": [0.0, 0.0, "20*sin(2*t)"]}, beam)


def _hinge(parent: str, child: str, start: float, place: float) -> dict[str, Any]:
    return {"type": "revolute", "parent": parent, "child": child, "axis": [0, -1, 0], "position": [0, 0, place],
            "initial": {"position": start}}  # fmt: skip


CURVE = [[-1.0, -1.0], [0.0, 0.0], [0.5, 3.0], [0.9, -2.0], [1.4, 4.0], [2.0, 0.0], [3.0, 1.0]]
BENDS = (0.5, 0.9, 1.4)
_BOB = {"mass": 1.0, "center_of_mass": [0, 0, -0.4], "inertia": [0.02, 0.02, 0.001]}
DOUBLE_PENDULUM = {
    "format": 1, "name": "double", "gravity": [0, 0, -9.81], "bodies": {"upper": _BOB, "lower": _BOB},
    "joints": {"shoulder": _hinge("base", "upper", 1.2, 0.0), "elbow": _hinge("upper", "lower", 0.5, -0.8)},
}  # fmt: skip
CART_AND_POLE = {
    "format": 1, "name": "cart", "gravity": [0, 0, -9.81], "bodies": {"cart": {"mass": 2.0}, "pole": _BOB},
    "joints": {
        "rail": {"type": "prismatic", "parent": "base", "child": "cart", "axis": [1, 0, 0], "stiffness": 30.0},
        "pin": _hinge("cart", "pole", 2.5, 0.0),
    },
}  # fmt: skip
TUMBLING = {
    "format": 1, "name": "tumbling", "gravity": [0, 0, 0],
    "bodies": {"body": {"mass": 1.0, "inertia": [0.01, 0.02, 0.028]}},
    "joints": {"ball": {"type": "spherical", "parent": "base", "child": "body",
                        "initial": {"velocity": [0.1, 4.0, 0.1]}}},
}  # fmt: skip
POINTS = {"points": [[0, 0], [0.5, 3], [0.9, -2], [1.4, 4], [2.0, 0]], "interpolation": "linear"}
PENDULUM = {
    "format": 1, "name": "swing", "gravity": [0, 0, -9.81],
    "bodies": {"bob": {"mass": 1.0, "center_of_mass": [0, 0, -0.5], "inertia": [1e-9, 1e-9, 1e-9]}},
    "joints": {"hinge": {
        "type": "revolute", "parent": "base", "child": "bob", "axis": [0, -1, 0], "initial": {"position": 2.0},
    }},
}  # fmt: skip

CASES = (
    Case("spring", sliders("spring", {"x": "-100*q.x"}, {"x": (0.1, 0.0)}), _spring, 5.0, (), (0.02, 0.005)),
    Case("damped, driven", sliders("damped", {"x": "-100*q.x - 3*v.x + 5*cos(7*t)"}, {"x": (0.1, 0.0)}),
         _damped, 5.0, (), (0.02, 0.005)),
    Case("van der Pol", sliders("pol", {"x": "5*(1-q.x**2)*v.x - q.x"}, {"x": (2.0, 0.0)}),
         _van_der_pol, 10.0, (), (0.02, 0.005)),
    Case("Kepler 0.5", sliders(
        "kepler", {axis: f"-q.{axis}/(q.x**2+q.y**2)**1.5" for axis in "xy"},
        {"x": (0.5, 0.0), "y": (0.0, math.sqrt(3))}),
        _kepler, 13.0, (), (0.02, 0.005)),
    Case("filtered force", sliders("filtered", {"x": "-40*q.x + 4*lag"}, {"x": (0.1, 0.0)},
                                   states={"lag": {"rate": "-(lag - sin(3*t))/0.02"}}),
         _filtered, 4.0, (), (0.01, 0.002)),
    Case("contact", sliders("contact", {"x": "-9.81 + 2000*max(-q.x, 0)"}, {"x": (0.3, 0.0)}),
         _floor, 1.2, (), (0.004, 0.001)),
    Case("linear table", sliders("table", {"x": "-25*q.x + push"}, {"x": (0.1, 0.0)}, inputs={"push": POINTS}),
         _table, 2.0, (0.5, 0.9, 1.4), (0.02, 0.005)),
    Case("pendulum", PENDULUM, _pendulum, 5.0, (), (0.02, 0.005)),
    # -- internal states ---------------------------------------------------------------------------------------
    _states("Lorenz", {"a": (1.0, "10*(b - a)"), "b": (1.0, "a*(28 - c) - b"), "c": (20.0, "a*b - 8/3*c")},
            lambda t, z: [10 * (z[1] - z[0]), z[0] * (28 - z[2]) - z[1], z[0] * z[1] - 8 / 3 * z[2]], 2.0, 0.005),
    _states("stiff state", {"a": (1.0, "-200*(a - cos(3*t))")},
            lambda t, z: [-200 * (z[0] - math.cos(3 * t))], 2.0, 0.002),
    Case("Bouc-Wen", sliders("boucwen", {"x": "-20*q.x - 40*w + 8*sin(2*t)"}, {"x": (0.0, 0.0)}, states={
        "w": {"rate": "v.x - 5*abs(v.x)*w - 5*v.x*abs(w)"}}),
         lambda t, y: [y[1], -20 * y[0] - 40 * y[2] + 8 * math.sin(2 * t),
                       y[1] - 5 * abs(y[1]) * y[2] - 5 * y[1] * abs(y[2])], 4.0, (), (0.02, 0.005)),
    # -- forces ------------------------------------------------------------------------------------------------
    _forced("hard spring", "-100*q.x - 1e4*q.x**3", lambda t, q, v: -100 * q - 1e4 * q**3, (0.1, 0.0), 2.0, 0.01),
    _forced("well", "q.x**-13 - q.x**-7", lambda t, q, v: q**-13 - q**-7, (0.95, 0.0), 4.0, 0.01),
    _forced("switched", "-40*q.x + (5 if t > 0.5 else 0)", lambda t, q, v: -40 * q + (5 if t > 0.5 else 0),
            (0.1, 0.0), 2.0, 0.01, (0.5,)),
    _forced("pulse", "-40*q.x + (200 if 0.7 < t < 0.72 else 0)",
            lambda t, q, v: -40 * q + (200 if 0.7 < t < 0.72 else 0), (0.1, 0.0), 2.0, 0.01, (0.7, 0.72)),
    # -- friction, contacts, stops -----------------------------------------------------------------------------
    _forced("smooth friction", "-50*q.x - 2*tanh(v.x/0.05)", lambda t, q, v: -50 * q - 2 * math.tanh(v / 0.05),
            (0.3, 0.0), 2.0, 0.005),
    _forced("stick and slip", "20*(0.2*t - q.x) - 2*tanh(v.x/0.02)",
            lambda t, q, v: 20 * (0.2 * t - q) - 2 * math.tanh(v / 0.02), (0.0, 0.0), 3.0, 0.002),
    _forced("stops", "-5*q.x - 4e3*max(q.x - 0.1, 0) + 4e3*max(-0.1 - q.x, 0)",
            lambda t, q, v: -5 * q - 4e3 * max(q - 0.1, 0.0) + 4e3 * max(-0.1 - q, 0.0), (0.0, 1.0), 1.0, 0.002),
    _forced("Hertz", "-9.81 + 1e4*max(-q.x, 0)**1.5", lambda t, q, v: -9.81 + 1e4 * max(-q, 0.0) ** 1.5,
            (0.2, 0.0), 1.0, 0.002),
    # -- tables ------------------------------------------------------------------------------------------------
    _tabled("quintic table", "-25*q.x + bump(t)", "quintic", 2.0),
    _tabled("linear curve", "-25*q.x + bump(t)", "linear", 2.0, BENDS),
    _tabled("spring of a curve", "-20*q.x - bump(10*q.x + 1)", "quintic", 2.0),
    # -- several freedoms --------------------------------------------------------------------------------------
    Case("cart and pole", CART_AND_POLE, None, 3.0, (), (0.02, 0.005), (*ALPHA, *BY_TOLERANCE)),
    Case("double pendulum", DOUBLE_PENDULUM, None, 2.0, (), (0.01, 0.002), (*ALPHA, *BY_TOLERANCE)),
    Case("tumbling body", TUMBLING, None, 3.0, (), (0.02, 0.005), (*FIXED, ("rk45", {"tolerance": 1e-5}))),
    # -- loops and absolute coordinates ------------------------------------------------------------------------
    Case("slider-crank", _example("slider_crank_planar"), None, 0.02, (), (2e-4, 5e-5), CONSTRAINED),
    Case("four-bar", _example("four_bar"), None, 0.3, (), (2e-3, 5e-4), CONSTRAINED),
    Case("absolute pendulum", {**PENDULUM, "name": "absolute_swing", "coordinates": "absolute"},
         None, 2.0, (), (0.02, 0.005), ALPHA),
    Case("absolute double pendulum", {**DOUBLE_PENDULUM, "name": "absolute_double", "coordinates": "absolute"},
         None, 1.0, (), (0.01, 0.002), ALPHA),
    # -- geometrically exact beams -----------------------------------------------------------------------------
    Case("cantilever", _cantilever(4), None, 2.0, (), (0.02, 0.005), ALPHA),
    Case("damped cantilever", _cantilever(4, stiffness_damping=0.05), None, 2.0, (), (0.02,), ALPHA),
    # -- few steps ---------------------------------------------------------------------------------------------
    *(Case(f"{count} steps", sliders("few", {"x": "-100*q.x - 300*q.x**3"}, {"x": (0.1, 0.5)}),
           lambda t, y: [y[1], -100 * y[0] - 300 * y[0] ** 3], 0.02 * count, (), (0.02,), FIXED)
      for count in (1, 5, 20)),
)  # fmt: skip  # a table
SAMPLED = (
    SampledCase("samples of a spring", _of_k("-k*q.x"), lambda k: lambda t, y: [y[1], -k * y[0]],
                2.0, 0.02, "uniform(50, 150)"),
    SampledCase("samples of damping", _of_k("-100*q.x - k*v.x"), lambda k: lambda t, y: [y[1], -100 * y[0] - k * y[1]],
                2.0, 0.01, "uniform(1, 20)"),
    SampledCase("samples of a contact", _of_k("-9.81 + k*max(-q.x, 0)"),
                lambda k: lambda t, y: [y[1], -9.81 + k * max(-y[0], 0.0)], 0.4, 0.002, "uniform(1000, 3000)"),
)  # fmt: skip  # a table
