"""Equilibria, linear models, controllers and runs of the same scenes in units from 1e-6 to 1e6: quantities with a unit
are scaled, and no others change."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.control import OutputFeedback, kalman, lqr
from eomgen.products.linear.linearization import Linearization
from eomgen.products.studies.ladders.scaling import LENGTH, MASS, TIME, SceneUnits, with_factors

#: Units in which no quantity of the scenes keeps its size.
SCALES = [SceneUnits(length=1e-6, mass=1e-6, time=1e-2), SceneUnits(length=1e6, mass=1e6, time=1e3)]
NAMES = ["small", "large"]

_RAIL = {"type": "prismatic", "parent": "base"}
# fmt: off
SCENES: dict[str, dict[str, Any]] = {
    "arm": {  # rests where the moment of weight and load is that of the spring
        "gravity": [0, 0, -9.81], "parameters": {"load": {"value": 5.0, "unit": "N", "tunable": True}},
        "bodies": {"arm": {"mass": 2.0, "center_of_mass": [0.3, 0, 0], "inertia": [0.01, 0.08, 0.08]},
                   "slide": {"mass": 0.5}},
        "joints": {"hinge": {"type": "revolute", "parent": "base", "child": "arm", "axis": [0, 1, 0],
                             "stiffness": 60.0, "damping": 0.4},
                   "rail": {"type": "prismatic", "parent": "arm", "child": "slide", "axis": [1, 0, 0],
                            "stiffness": 900.0, "damping": 3.0}},
        "inputs": {"motor": {"unit": "N"}},
        "efforts": {"push": {"joint": "rail", "effort": "load + motor"}},
    },
    "cantilever": {
        "gravity": [0, 0, -9.81], "joints": {"clamp": {"type": "fixed", "parent": "base", "child": "blade"}},
        "beams": {"blade": {
            "model": "cosserat", "length": 2.0, "elements": 4, "mass_per_length": 1.57,
            "rotary_inertia": [2e-5, 1e-5, 1e-5],
            "stiffness": {"torsion": 270.0, "bending_y": 350.0, "bending_z": 350.0, "stretch": 4.2e7, "shear_y": 1.6e7,
                          "shear_z": 1.6e7}}},
    },
    "gears": {  # from rest and from zero
        "gravity": [0, 0, -9.81],
        "bodies": {name: {"mass": mass} for name, mass in (("a", 1.0), ("b", 3.0))},
        "joints": {name: {**_RAIL, "child": name, "axis": [0, 0, 1]} for name in ("a", "b")},
        "constraints": {"gear": {"type": "formula", "equation": "q.a + 2*q.b", "unit": "m"}},
    },
}
# fmt: on


def data_of(scene: str, units: SceneUnits) -> dict[str, Any]:
    """Return a scene in units that are fixed numbers."""
    data = with_factors({"format": 1, "name": scene, **SCENES[scene]}, (LENGTH, MASS, TIME))
    for name, size in units.parameters.items():
        data["parameters"][name] = {"value": size}
    return data


@cache
def model_of(scene: str, units: SceneUnits) -> eomgen.Model:
    return eomgen.build(data_of(scene, units), profile="instant")


def linear_of(model: eomgen.Model) -> Linearization:
    rest = model.equilibrium()
    return model.linearize(rest.q)


def own(values: Any, units: SceneUnits, of: Any) -> Any:
    """Return values in the units of the scene."""
    return np.asarray(values) / [units.size(unit) for unit in of]


def alike(found: Any, expected: Any, within: float = 1e-7) -> None:
    size = float(np.abs(expected).max(initial=0.0))
    np.testing.assert_allclose(found, expected, rtol=within, atol=within * size)


@pytest.mark.slow
@pytest.mark.parametrize("units", SCALES, ids=NAMES)
def test_equilibria_and_linear_models_are_the_same(units: SceneUnits) -> None:
    found, expected = model_of("arm", units), model_of("arm", SceneUnits())
    rest, known = found.equilibrium(), expected.equilibrium()
    alike(own(rest.q, units, found.q_units), known.q)
    values, of = (linear_of(model).modes().eigenvalues for model in (found, expected))
    alike(values * units.time, of)


@pytest.mark.slow
@pytest.mark.parametrize("units", SCALES, ids=NAMES)
@pytest.mark.parametrize("method", ["rk4_partitioned", "rk45_partitioned", "generalized_alpha", "rosenbrock"])
def test_runs_of_constrained_scenes_are_the_same(method: str, units: SceneUnits) -> None:
    rows = []
    for one in (units, SceneUnits()):
        model = model_of("gears", one)
        known = model_of("gears", SceneUnits())
        start = {  # initial values have no factors
            "q": known.initial_q * [one.size(unit) for unit in model.q_units],
            "v": known.initial_v * [one.size(unit) for unit in model.v_units],
        }
        run = model.simulate(0.2 * one.time, 2e-3 * one.time, initial=start, method=method, record_every=50)
        assert run.success, run.message
        rows.append((own(run.q, one, model.q_units), own(run.v, one, model.v_units)))
    for found, expected in zip(*rows, strict=True):
        alike(found, expected, 1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("units", SCALES, ids=NAMES)
@pytest.mark.parametrize("estimated", [False, True], ids=["state", "estimate"])
def test_scenes_with_controllers_move_the_same(estimated: bool, units: SceneUnits) -> None:
    ends = []
    for one in (units, SceneUnits()):
        linear = linear_of(model_of("arm", one)).state_space()
        weights = {"q.hinge": 100.0, "q.rail": 1e4 / one.size("m") ** 2}
        law: Any = lqr(linear, weights, {"motor": 1.0 / one.size("N") ** 2})
        if estimated:
            noise = {"q.hinge": 1e-6 * one.time, "q.rail": 1e-6 * one.size("m") ** 2 * one.time}
            law = OutputFeedback(law, kalman(linear, {"motor": one.size("N") ** 2 * one.time}, noise))
        model = eomgen.build(eomgen.with_controller(data_of("arm", one), law), profile="instant")
        start = {"q": np.array([0.3, 0.02]) * [one.size(unit) for unit in model.q_units]}
        run = model.simulate(0.5 * one.time, 1e-3 * one.time, initial=start, method="rk4", record_every=50)
        assert run.success, run.message
        ends.append(own(run.q, one, model.q_units))
    alike(ends[0], ends[-1], 1e-6)


@pytest.mark.slow
def test_a_beam_moves_alike_in_megametres_gigatonnes_and_days() -> None:
    motions = []
    for units in (SceneUnits(), SceneUnits(1e-6, 1e-12, 1 / 86400)):
        model = model_of("cantilever", units)
        run = model.simulate(0.02 * units.time, 1e-3 * units.time, error_estimate=False)
        assert run.success, run.message
        motions.append(own(run.q, units, model.q_units))
    assert np.max(np.abs(motions[1] - motions[0])) < 1e-9
