"""Generated C in single precision: what rounding does to a run is said."""

from __future__ import annotations

import re

import pytest

import eomgen

RODS = {
    "format": 1,
    "name": "rods",
    "coordinates": "absolute",
    "bodies": {
        "upper": {"mass": 1.0, "center_of_mass": [0, 0, -0.25], "inertia": [0.02, 0.021, 0.002]},
        "lower": {"mass": 0.6, "center_of_mass": [0.02, 0, -0.2], "inertia": [0.01, 0.011, 0.001]},
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
    },
}


@pytest.mark.long
def test_multipliers_that_are_rounding_are_said() -> None:
    model = eomgen.build(RODS, real="float")
    held = model.simulate(1.0, 1e-3)
    assert held.message == "reached t = 1 s in 1000 steps"
    for step in (1e-3, 1e-4):
        run = model.simulate(1.0, step, method="generalized_alpha_index3")
        said = r"up to \S+ % of the multipliers is rounding, which grows as 1/step\^2"
        hint = f"try: generalized_alpha, a step larger than {step:g} s, or double precision"
        assert re.fullmatch(
            rf"reached t = 1 s in \d+ steps; (the estimated error is .*, and )?{said}; {hint}", run.message
        )


@pytest.mark.long
def test_a_machine_at_rest_has_no_impulses_to_be_rounded() -> None:
    still = {
        name: {**joint, "initial": {**joint["initial"], "velocity": 0.0}} for name, joint in RODS["joints"].items()
    }
    still["ball"]["initial"]["velocity"] = [0.0, 0.0, 0.0]
    run = eomgen.build({**RODS, "joints": still, "gravity": [0, 0, 0]}).simulate(
        0.1, 1e-3, method="generalized_alpha_index3"
    )
    assert run.message == "reached t = 0.1 s in 100 steps" and run.stats["max_rounding"] == 0.0
