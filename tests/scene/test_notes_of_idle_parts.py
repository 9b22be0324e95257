"""Notes on idle or doubtful parts (springs without a law, negative coefficients given as formulas, wheels on their
side, loads without a size, parameters of other methods), and remedies of formulas with words of other languages."""

from __future__ import annotations

import re
from typing import Any

import pytest

import eomgen
from eomgen.errors import DescriptionError, ModelError
from eomgen.integrators.families.register import canonical_name, without_effect
from eomgen.system.description import Simulation

ARM: dict[str, Any] = {
    "format": 1,
    "name": "arm",
    "parameters": {"drag": 0.4},
    "bodies": {"arm": {"mass": 1.0, "center_of_mass": [0, 0, -0.2]}},
    "joints": {"hinge": {"type": "revolute", "parent": "base", "child": "arm", "axis": [0, 1, 0]}},
    "points": {"tip": {"body": "arm", "position": [0, 0, -0.4]}, "wall": {"body": "base", "position": [1, 0, 0]}},
}


@pytest.mark.parametrize("damping", ["-drag", "-0.4", "-0.4 N m s/rad"])
def test_negative_damping_is_noted_in_formulas_too(damping: str) -> None:
    joints = {"hinge": {**ARM["joints"]["hinge"], "damping": damping}}
    note = "joints.hinge.damping: the damping -0.4 is negative, and adds energy to every motion; 0.4 takes it away"
    assert note in eomgen.load({**ARM, "joints": joints}).notes


def test_a_spring_without_a_law_is_noted_unless_a_formula_reads_it() -> None:
    scene = {**ARM, "springs": {"stay": {"first": "tip", "second": "wall"}}}
    note = "springs.stay: a spring without stiffness, damping and force has no effect"
    assert note in eomgen.load(scene).notes
    assert note not in eomgen.load({**scene, "outputs": {"span": {"formula": "length.stay"}}}).notes


def test_a_wheel_that_lies_on_its_side_is_noted_and_one_without_a_heading_refused() -> None:
    heave = {"type": "prismatic", "parent": "base", "child": "car", "axis": [0, 0, 1], "initial": {"position": 0.3}}
    slip = {"axis": [0, 0, 1], "stiffness": 10}
    car: dict[str, Any] = {
        "format": 1,
        "name": "car",
        "bodies": {"car": {"mass": 300}},
        "joints": {"car": heave},
        "points": {"hub": {"body": "car"}},
        "tyres": {"wheel": {"center": "hub", "radius": 0.3, "stiffness": 2e5, "slip": slip}},
    }
    note = (
        "tyres.wheel.slip.axis: the spin axis stands nearly upright at the start, and the wheel lies on its side; try:"
        " a level axis, as [0, 1, 0] of a wheel that rolls along x"
    )
    assert note in eomgen.load(car).notes
    fault = (
        "tyres.wheel.slip.axis: the spin axis is normal to the road for all coordinates, so the wheel has no heading"
    )
    with pytest.raises(ModelError, match=fault):
        eomgen.derive(car)
    car["tyres"]["wheel"]["slip"]["axis"] = [0, 1, 0]
    assert note not in eomgen.load(car).notes


@pytest.mark.parametrize(
    ("effort", "remedy"),
    [
        ("5 if t > 1", "try: both branches: 5 if t > 1 else 0"),
        ("2 * sin q.hinge", "try: sin(q.hinge)"),
        ("mod(t, 1)", 'try: a curve with outside = "periodic", or an input with a wave, whose jumps have known times'),
        ("t % 1", 'try: a curve with outside = "periodic" for t % T'),
        ("√(2)", "try: sqrt(x)"),
        ("2*kg", 'try: "2 kg": a number, a space and its unit, alone'),
    ],
)
def test_formulas_of_other_languages_have_remedies(effort: str, remedy: str) -> None:
    with pytest.raises(DescriptionError, match=re.escape(remedy)):
        eomgen.load({**ARM, "efforts": {"push": {"joint": "hinge", "effort": effort}}})


def test_loads_without_a_size_or_a_component_are_noted() -> None:
    floating = {"hinge": {"type": "free", "parent": "base", "child": "arm"}}
    bodies = {"arm": {"mass": 1.0, "inertia": [0.1, 0.1, 0.1]}}
    scene = {**ARM, "bodies": bodies, "joints": floating, "forces": {"wind": {"body": "arm"}}}
    assert "forces.wind: a load without force and torque has no effect" in eomgen.load(scene).notes
    note = "efforts.lift: without an index the effort acts on v.hinge[0] of 6 components; angular ones come first"
    lift = {"joint": "hinge", "effort": 9.81}
    assert note in eomgen.load({**scene, "efforts": {"lift": lift}}).notes
    assert note not in eomgen.load({**scene, "efforts": {"lift": {**lift, "index": 5}}}).notes


@pytest.mark.parametrize(
    ("simulation", "sentence"),
    [
        ({"method": "rk4", "tolerance": 1e-6}, "the scene's tolerance of 1e-06 has no effect: rk4 takes no tolerance"),
        ({"method": "hht", "gamma": 0.9}, "the scene's gamma of 0.9 has no effect: hht takes no gamma"),
        ({"method": "generalized_alpha", "tolerance": 1e-6}, ""),
        ({"method": "newmark", "gamma": 0.9}, ""),
        ({"method": "rk4", "rho_inf": 0.5}, ""),
    ],
)
def test_parameters_that_the_scenes_method_does_not_take_have_a_sentence(
    simulation: dict[str, Any], sentence: str
) -> None:
    own = Simulation(**simulation)
    found = without_effect(canonical_name(own.method, own.tolerance), own)
    assert [text.split("; try: ")[0] for text in found] == ([sentence] if sentence else [])
    assert without_effect("taylor", own) == []


def test_a_run_says_that_its_scenes_tolerance_has_no_effect() -> None:
    scene = {**ARM, "simulation": {"method": "rk4", "tolerance": 1e-6, "duration": 0.01}}
    message = eomgen.build(scene, profile="instant").simulate().message
    assert message.endswith("the scene's tolerance of 1e-06 has no effect: rk4 takes no tolerance; try: rk45")
