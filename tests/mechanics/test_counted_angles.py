"""Absolute coordinates count the revolutions of an angle if a formula changes by a whole turn, and else do not."""

from __future__ import annotations

import math
from typing import Any

import pytest

from eomgen.formula.evaluate import evaluate
from eomgen.formula.nodes import Symbol
from eomgen.mechanics.constraints.joints import counted_angles
from eomgen.scene.load import from_data
from eomgen.scene.scene import Scene

FORMULAS = (
    "q.hinge", "2*q.hinge", "q.hinge*v.hinge", "sin(q.hinge)", "cos(2*q.hinge)", "sin(q.hinge*3 + 0.1)",
    "sin(-q.hinge)", "tan(q.hinge - t)", "sin(0.5*q.hinge)", "sin(q.hinge/2)", "sin(q.hinge/1)", "cos(q.hinge*0.1)",
    "sin(q.hinge**2)", "sin(q.hinge*q.hinge)", "exp(sin(q.hinge))", "sin(exp(q.hinge))", "q.hinge*sin(q.hinge)",
    "sin(2*(q.hinge + 3*q.hinge))", "sin(sin(q.hinge) + q.hinge)", "sin(2*q.hinge)*0.5", "abs(q.hinge)", "v.hinge",
    "2*sin(q.hinge) - 0.5*cos(q.hinge)", "sin(1.5*(2*q.hinge))",
)  # fmt: skip  # a table
#: Changes by a whole number of turns, which the rules do not see; counting an angle is never wrong.
UNSEEN = {"sin(q.hinge/1)", "sin(1.5*(2*q.hinge))"}


def _scene(formula: str, coordinates: str = "absolute", **joint: Any) -> Scene:
    hinge = {"type": "revolute", "parent": "base", "child": "arm", "axis": [0, 1, 0], **joint}
    return from_data(
        {
            "format": 1,
            "name": "arm",
            "coordinates": coordinates,
            "bodies": {"arm": {"mass": 1.0, "center_of_mass": [0, 0, -1], "inertia": [0.1, 0.1, 0.1]}},
            "joints": {"hinge": hinge},
            "outputs": {"angle": {"formula": formula}},
            "curves": {"c": {"points": [[-1, 2], [0, 3], [9, 1]], "interpolation": "linear", "outside": "hold"}},
        }
    )


def _changes_by_a_turn(scene: Scene) -> bool:
    (formula,) = scene.outputs[0].values

    def value(turns: int) -> float:
        known = {"q": 0.7 + 2.0 * math.pi * turns, "v": 1.3, "time": 0.4}

        def known_value(symbol: Symbol) -> float:
            return known[symbol.kind]

        return evaluate(formula, known_value)

    return any(abs(value(turns) - value(0)) > 1e-9 * max(1.0, abs(value(turns))) for turns in (1, 2, 3))


@pytest.mark.parametrize("formula", FORMULAS)
def test_an_angle_is_counted_if_a_turn_changes_the_formula(formula: str) -> None:
    scene = _scene(formula)
    counted = counted_angles(scene)
    assert counted in ((), (("hinge", 0),))
    assert bool(counted) == (_changes_by_a_turn(scene) or formula in UNSEEN)
    assert counted_angles(_scene(formula, "joint")) == ()


@pytest.mark.parametrize(
    ("joint", "counted"),
    [
        ({}, False),
        ({"stiffness": 2.0}, True),
        ({"damping": 2.0}, False),
        ({"limits": {"lower": -1.0, "upper": 1.0, "stiffness": 10.0}}, True),
    ],
)
def test_springs_and_stops_count_revolutions_and_dampers_do_not(joint: dict[str, Any], counted: bool) -> None:
    assert bool(counted_angles(_scene("sin(q.hinge)", **joint))) == counted
    assert counted_angles(_scene("c(q.hinge)")) == (("hinge", 0),)
    assert counted_angles(_scene("c(sin(q.hinge))")) == ()
