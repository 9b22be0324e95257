"""What is said of a run does not depend on its units, its place in the world and its orientation.

Units that are powers of two change no digit of the equations, and the order of pivots at most: findings are the same to
twelve digits, unless a threshold is a number of metres, kilograms or seconds. Units in use are told apart by rounding.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.products.studies.ladders.scaling import LENGTH, MASS, TIME, SceneUnits, with_factors
from eomgen.results.finding import Finding
from eomgen.simulation.judgement.register import CHECKS
from tests.oracles.moved_scenes import moved

BINARY = (
    SceneUnits(2.0**-20, 2.0**-30, 2.0**-40),
    SceneUnits(2.0**30, 2.0**40, 2.0**40),
)
#: km-t-h, and nm with masses and times of atoms.
IN_USE = (SceneUnits(1e-3, 1e-3, 1.0 / 3600.0), SceneUnits(1e9, 1e27, 1e15))
#: Checks without a case, and why.
NOT_HERE = {
    "infinite_energy": "it is the largest double",
    "linear_range": "it goes with other findings, by the pivots of M",
    "checkpoint": "files",
    "coarse_quantum": "quanta of the scene",
    "controller_cost": "seconds of the machine",
    "contact_step": "steps and speeds, in tests of contacts",
    "passed_growth": "friction, in tests of resolution",
    "unknown_error": "words of the estimate",
    "model_limits": "words of the scene",
    "method_limits": "words of the method",
    "steep_law": "words of laws that are smoothed",
    "doubtful_call": "words of the call",
    "doubtful_start": "words of the start",
    "turned_start": "turns of angles",
    "chosen_method": "words of the choice",
    "large_deflection": "a share of the length of a beam",
    "turned_element": "turns of elements",
    "lost_digits": "a share of the terms of a sum",
    "partly_examined": "a share of rows, for runs of 20 000 rows and more",
}
#: Checks whose values have a unit.
UNITS = {"unresolved_damping": "1/s", "unresolved_states": "1/s"}
#: Checks whose values are rounded to two digits, in whatever unit.
ROUNDED = ("bounded_steps",)


@dataclass(frozen=True)
class Case:
    """A run in the units of its scene, and the checks that find something.

    Attributes
    ----------
    options : of ``simulate``
    parameters, q, v : where they are not those of the scene
    wave : angular frequency of the input motor, 1/s, of 50 N
    rough : whether rounding changes the values of its findings, and decides which others there are
    """

    scene: str
    end: float
    step: float
    found: tuple[str, ...]
    options: dict[str, Any]
    parameters: dict[str, float] = field(default_factory=dict)
    q: tuple[float, ...] = ()
    v: tuple[float, ...] = ()
    wave: float = 0.0
    rough: bool = False


# -- scenes ------------------------------------------------------------------------------------------------------------

_RAIL = {"type": "prismatic", "parent": "base"}
_FORCES = (
    "-k*q.x - c*v.x - sq*v.x*abs(v.x) + bar*(q.x - place)/width*exp(-((q.x - place)/width)**2)"
    " + (pulse if time < t < time + width else 0)"
)
_SLIDERS = {
    **dict.fromkeys(("k", "c", "sq", "bar", "pulse", "stiff", "aside", "turn"), 0.0),
    **{"place": 0.5, "width": 0.01, "time": 0.5, "rate": 1.0, "low": -1e3, "level": 0.3},
}


def _parameters(**values: float) -> dict[str, Any]:
    return {name: {"value": value, "tunable": True} for name, value in values.items()}


def _link(length: float) -> dict[str, Any]:
    return {"mass": 1.0, "center_of_mass": [length / 2.0, 0, 0], "inertia": [1e-3, 0.02, 0.02]}


def _hinge(parent: str, child: str, place: list[float], axis: list[float], **initial: float) -> dict[str, Any]:
    return {"type": "revolute", "parent": parent, "child": child, "axis": axis, "position": place, "initial": initial}


# fmt: off
SCENES: dict[str, dict[str, Any]] = {
    "sliders": {
        "gravity": [0, 0, 0], "parameters": _parameters(**_SLIDERS), "bodies": {"a": {"mass": 2.0}, "b": {"mass": 0.5}},
        "joints": {
            "x": {**_RAIL, "child": "a", "axis": [1, 0, 0], "initial": {"position": 0.3, "velocity": 1.0},
                  "limits": {"lower": -40.0, "upper": 40.0, "stiffness": 1e4, "onset": 1e-3}},
            "y": {**_RAIL, "child": "b", "axis": [0, 1, 0], "initial": {"position": 0.2}},
        },
        "inputs": {"motor": {"unit": "N"}},
        "states": {"w": {"rate": "rate*(q.x - w)", "unit": "m"}},
        "efforts": {"along": {"joint": "x", "effort": _FORCES},
                    "across": {"joint": "y", "effort": "aside*q.x - stiff*q.y + motor"}},
        "outputs": {"root": {"formula": "sqrt(q.x - low)"}},
        "events": {"cross": {"when": "sin(turn*(q.x - level))"}},
    },
    "bouncing": {
        "gravity": [0, 0, -9.81], "parameters": _parameters(floor=0.0), "bodies": {"a": {"mass": 2.0}},
        "joints": {"z": {**_RAIL, "child": "a", "axis": [0, 0, 1], "initial": {"position": 0.5}}},
        "events": {
            "floor": {"when": "q.z - floor", "direction": "falling", "action": "impact", "restitution": 0.8}
        },
    },
    "tumbling": {
        "gravity": [0, 0, 0],
        "bodies": {"a": {"mass": 2.0, "inertia": [0.01, 0.02, 0.028]},
                   "b": {"mass": 0.7, "center_of_mass": [0.1, 0, 0.2], "inertia": [0.01, 0.012, 0.008]}},
        "joints": {"root": {"type": "free", "parent": "base", "child": "a",
                            "initial": {"velocity": [3, 0.1, 0.2, 1, 0, 0]}},
                   "hinge": _hinge("a", "b", [0.2, 0, 0], [0, 1, 0], velocity=2.0)},
    },
    "four_bar": {
        "gravity": [0, -9.81, 0], "bodies": {"crank": _link(0.3), "rod": _link(1.0), "rocker": _link(0.3)},
        "joints": {"a": _hinge("base", "crank", [0, 0, 0], [0, 0, 1], position=0.8, velocity=8.0),
                   "b": _hinge("crank", "rod", [0.3, 0, 0], [0, 0, 1], position=-0.8),
                   "c": _hinge("base", "rocker", [1.0, 0, 0], [0, 0, 1], position=0.8)},
        "constraints": {"loop": {"type": "point_on_line",
                                 "first": {"body": "rocker", "position": [0.3, 0, 0], "axis": [0, 0, 1]},
                                 "second": {"body": "rod", "position": [1.0, 0, 0]}}},
    },
    "spring": {
        "gravity": [0, 0, 0], "bodies": {"a": {"mass": 2.0}},
        "joints": {"x": {**_RAIL, "child": "a", "axis": [1, 0, 0], "initial": {"position": 0.5, "velocity": -3.0}}},
        "points": {"p": {"body": "base", "position": [0, 0.001, 0]}, "m": {"body": "a"}},
        "springs": {"s": {"first": "p", "second": "m", "stiffness": 10.0, "length": 0.4}},
    },
    "car": {
        "gravity": [0, 0, -9.81], "bodies": {"m": {"mass": 300.0}},
        "joints": {"h": {**_RAIL, "child": "m", "axis": [0, 0, 1], "initial": {"position": 0.1}}},
        "points": {"hub": {"body": "m"}},
        "tyres": {"w": {"center": "hub", "radius": 0.3, "stiffness": 2e5, "damping": 500.0, "onset": 1e-3}},
    },
}
RK4, ALPHA = {"method": "rk4"}, {"method": "generalized_alpha"}
INDEX3, PARTITIONED = {"method": "generalized_alpha_index3"}, {"method": "rk4_partitioned"}
CASES = {
    "coarse": Case("sliders", 6.0, 0.2, ("discretisation_error", "unresolved_coordinate", "unresolved_motion"),
                   {"method": "trapezoidal"}, {"k": 100.0}),
    "unstable": Case("sliders", 4.0, 0.1, ("unstable",), RK4, {"stiff": 2e3}, v=(1.0, 0.3)),
    "antidamped": Case("sliders", 30.0, 0.01, ("unbounded_growth",), RK4, {"c": -3.0}, (1e-9, 0.0), (1e-9, 0.0)),
    "damped": Case("sliders", 1.0, 0.01, ("stopped", "unresolved_damping"), RK4, {"sq": 1e3}),
    "fast state": Case("sliders", 1.0, 0.01, ("unresolved_states",), RK4, {"rate": 1e3}),
    "exchanged": Case("sliders", 0.01, 2.0, ("exchanged_times",), RK4),
    "pulse": Case("sliders", 2.0, 0.05, ("discretisation_error", "unseen_law"), RK4,
                  {"pulse": 50.0, "width": 0.003, "time": 0.5085}),
    "adaptive pulse": Case("sliders", 2.0, 0.5, ("bounded_steps",), {"method": "rk45"},
                           {"pulse": 50.0, "width": 0.003, "time": 0.51}),
    "trembling": Case("sliders", 2.0, 0.02, ("unresolved_coordinate",), ALPHA,
                      {"stiff": 5e3, "k": 10.0}, (0.3, 1e-6), (1.0, 0.0), rough=True),
    "root": Case("sliders", 1.0, 0.01, ("undefined_output",), RK4, {"low": 0.503}),
    "beyond": Case("sliders", 0.1, 0.01, ("start_beyond_limits",), ALPHA, {}, (41.0, 0.0)),
    "missed": Case("sliders", 2.0, 0.2, ("missed_event",), RK4, {"turn": 40.0}),
    "buzzing": Case("sliders", 2.0, 0.01, ("fast_law",), RK4, wave=3000.0),
    "good": Case("sliders", 2.0, 0.002, (), ALPHA, {"k": 10.0, "c": 1.0, "stiff": 5.0}),
    "behind": Case("bouncing", 0.5, 0.01, ("start_on_impact",), RK4, {}, (-0.1,)),
    "bouncing": Case("bouncing", 1.0, 0.01, (), RK4),
    "tumbling": Case("tumbling", 4.0, 0.4, ("halved_steps", "energy_balance", "momentum_drift"), ALPHA),
    "crank": Case("four_bar", 2.0, 0.05, ("energy_balance", "singular_position"), ALPHA),
    "slow crank": Case("four_bar", 0.5, 0.001, (), ALPHA, v=(2.0, -2.0, 2.0)),
    "still crank": Case("four_bar", 1e-6, 1e-9, ("multiplier_rounding",), INDEX3, rough=True),
    "loose crank": Case("four_bar", 0.5, 0.02, ("constraint_violation",),
                        {**INDEX3, "settings": {"rtol": 0.5, "atol": 0.1}}, rough=True),
    "looser crank": Case("four_bar", 0.5, 0.02, ("broken_constraint",), {**ALPHA, "settings": {"rtol": 0.5}},
                          rough=True),
    "passing crank": Case("four_bar", 2.0, 0.01, ("singular_passage",), PARTITIONED),
    "spring": Case("spring", 0.5, 0.01, ("passed_spring",), RK4),
    "car": Case("car", 0.2, 0.001, ("deep_start",), ALPHA),
}
# fmt: on


@cache
def model_of(scene: str) -> eomgen.Model:
    """Return a model with tunable units."""
    data = with_factors({"format": 1, "name": scene, **SCENES[scene]}, (LENGTH, MASS, TIME))
    return eomgen.build(data, profile="instant")


def run_of(case: Case, units: SceneUnits, model: eomgen.Model | None = None) -> tuple[eomgen.Solution, list[Finding]]:
    """Return a run in units, and its findings in the units of the scene."""
    own = model_of(case.scene)
    model = model or own
    start: dict[str, Any] = {}
    for name, given, default, of in (
        ("q", case.q, own.initial_q, model.q_units),
        ("v", case.v, own.initial_v, model.v_units),
        ("z", (), own.initial_z, model.z_units),
    ):
        if len(default):
            start[name] = np.array(given or default, dtype=float) * [units.size(unit) for unit in of]
    known = {**case.parameters, **units.parameters}
    options = dict(case.options)
    if case.wave:
        options["inputs"] = {"motor": lambda t: 50.0 * units.size("N") * math.sin(case.wave * t / units.time)}
    elif "motor" in model.inputs:
        options["inputs"] = {"motor": 0.0}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        run = model.simulate(
            case.end * units.time,
            case.step * units.time,
            initial=start,
            parameters={name: value for name, value in known.items() if name in model.parameters},
            **options,
        )
    sizes = {name: units.size(unit) for name, unit in UNITS.items()}
    if any(finding.name == "unstable" for finding in run.findings):
        name = run.findings[0].text.split(" grows from")[0].split()[-1]
        of_name = dict(zip((*model.v_names, *model.z_names), (*model.v_units, *model.z_units), strict=True))
        sizes["unstable"] = units.size(of_name[name])
    return run, [
        Finding(
            name=finding.name,
            severity=finding.severity,
            text="",
            value=math.nan if finding.name in ROUNDED else finding.value / sizes.get(finding.name, 1.0),
            time=finding.time / units.time,
        )
        for finding in run.findings
    ]


def test_every_check_has_a_case_or_a_reason_for_none() -> None:
    told = {name for case in CASES.values() for name in case.found}
    assert told | NOT_HERE.keys() == {check.name for check in CHECKS}
    assert not told & NOT_HERE.keys()


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_findings_are_the_same_in_other_units(name: str) -> None:
    """But for last digits in units that are powers of two, and for rounding in units in use."""
    case = CASES[name]
    own, expected = run_of(case, SceneUnits())
    assert set(case.found) <= {finding.name for finding in expected}
    if not case.found:
        assert not expected
    for units in BINARY:
        run, found = run_of(case, units)
        same(found, expected, 1e-9)
        if not {finding.name for finding in found} & set(ROUNDED):  # these choose the steps
            np.testing.assert_allclose(run.error.relative, own.error.relative, rtol=1e-9)
    for units in IN_USE:
        found = run_of(case, units)[1]
        if case.rough:
            assert set(case.found) <= {finding.name for finding in found}
        else:
            same(found, expected, 1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["tumbling", "crank", "spring", "bouncing"])
def test_findings_are_the_same_elsewhere_and_turned(name: str) -> None:
    case = CASES[name]
    _, expected = run_of(case, SceneUnits())
    same(run_of(case, SceneUnits(), moved_model(case.scene))[1], expected, 1e-3)


@cache
def moved_model(scene: str) -> eomgen.Model:
    data = {"format": 1, "name": scene, **SCENES[scene]}
    return eomgen.build(moved(data, [300.0, -2e3, 50.0], [0.3, -0.5, 0.8], 2.0), profile="instant")


def same(found: list[Finding], expected: list[Finding], within: float) -> None:
    """Compare findings by name and severity, and values and times by a relative difference."""
    assert [(one.name, one.severity) for one in found] == [(one.name, one.severity) for one in expected]
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose([one.value, one.time], [other.value, other.time], rtol=within)
