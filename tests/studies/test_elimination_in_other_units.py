"""Elimination in the matrices of beams whose scenes are written in other units."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.integrators.families.register import method_named
from eomgen.integrators.stepper_data import method_data
from eomgen.products.studies.ladders.scaling import LENGTH, MASS, TIME, SceneUnits, with_factors

#: Units of length, mass and time of a scene: m-kg-s, mm-g-ms, Mm-Gt-d.
SYSTEMS = {
    "SI": SceneUnits(),
    "mm-g-ms": SceneUnits(1e3, 1e3, 1e3),
    "Mm-Gt-d": SceneUnits(1e-6, 1e-12, 1 / 86400),
}


def cantilever(model: str) -> dict[str, Any]:
    stiffness = {"torsion": 270.0, "bending_y": 350.0, "bending_z": 350.0}
    stretch = {} if model == "inextensible" else {"stretch": 4.2e7}
    shear = {"shear_y": 1.6e7, "shear_z": 1.6e7} if model == "cosserat" else {}
    blade = {
        "model": model,
        "length": 2.0,
        "elements": 4,
        "mass_per_length": 1.57,
        "rotary_inertia": [2e-5, 1e-5, 1e-5],
    }
    return {
        "format": 1,
        "name": "cantilever",
        "gravity": [0, 0, -9.81],
        "beams": {"blade": {**blade, "stiffness": {**stiffness, **stretch, **shear}}},
        "joints": {"clamp": {"type": "fixed", "parent": "base", "child": "blade"}},
    }


def in_units(scene: dict[str, Any], units: SceneUnits) -> dict[str, Any]:
    scaled = with_factors(scene, (LENGTH, MASS, TIME))
    return scaled | {"parameters": {name: {"value": value} for name, value in units.parameters.items()}}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("model", "system_of_units"), [("kirchhoff", "Mm-Gt-d"), ("cosserat", "mm-g-ms"), ("inextensible", "SI")]
)
def test_beams_have_pivots_in_any_units(model: str, system_of_units: str) -> None:
    units, method = SYSTEMS[system_of_units], method_named("generalized_alpha")
    system = method.prepared(eomgen.derive(in_units(cantilever(model), units)))
    for step in (1e-5 * units.time, 1e-3 * units.time, 1e-3):
        assert method_data(method, system, step)


@pytest.mark.slow
def test_a_beam_moves_alike_in_other_units() -> None:
    motions = []
    for units in (SYSTEMS["SI"], SYSTEMS["Mm-Gt-d"]):
        compiled = eomgen.build(in_units(cantilever("cosserat"), units), profile="quick")
        run = compiled.simulate(0.02 * units.time, 1e-3 * units.time, error_estimate=False)
        assert run.success, run.message
        motions.append(np.array(run.q) / np.array([units.size(unit) for unit in compiled.q_units]))
    assert np.max(np.abs(motions[1] - motions[0])) < 1e-9
