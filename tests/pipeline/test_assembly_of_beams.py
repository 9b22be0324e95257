"""Loops with geometrically exact beams: joints turn before beams strain; closure by trigonometry, strains by hand."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.pipeline.pipeline import derive
from eomgen.system.system import System
from tests.models.cosserat import ROLL_UP, beam_scene
from tests.models.four_bar_with_beam import STEEL, closed, four_bar
from tests.oracles.evaluation import Array, tape_evaluator

START = 1.0


def assembled(off: float, model: str = "cosserat", **more: Any) -> System:
    """Return a four-bar linkage whose guess is off by so much at the coupler and the rocker, rad."""
    coupler, rocker = closed(START)
    return derive(eomgen.load(four_bar(START, coupler + off, rocker - off, model, **more)))


def angles(system: System) -> dict[str, float]:
    return {factor.name: float(np.array(system.initial_q)[factor.q][0]) for factor in system.factors}


def unstrained(system: System) -> None:
    """Assert that the energy of strains, and the stretch of all elements, are those of rounding errors."""
    state: dict[str, Array] = {name: np.zeros(system.nv) for name in ("v", "a")}
    state |= {"q": np.array(system.initial_q), "lam": np.zeros(len(system.multipliers))}
    state |= {"p": np.array([item.value for item in system.parameters])}
    found = tape_evaluator(system)("section_loads", state)["strain"]
    assert np.max(np.abs(found)) < 1e-13
    names = [note for note in system.notes if "strained" in note]
    assert names == []


@pytest.mark.slow_cases("half a degree", "absolute")
@pytest.mark.parametrize(
    ("off", "model", "more"),
    [
        (0.6, "cosserat", {}),
        (1e-2, "inextensible", {"closing": "revolute"}),
        (0.3, "kirchhoff", {"coordinates": "absolute", "elements": 2}),
    ],
    ids=["far", "half a degree", "absolute"],
)
def test_joints_turn_before_a_beam_is_strained(off: float, model: str, more: dict[str, Any]) -> None:
    system = assembled(off, model, **more)
    unstrained(system)
    if "coordinates" not in more:
        found = angles(system)
        assert (found["B"], found["D"]) == pytest.approx(closed(found["A"]), abs=1e-12)


@pytest.mark.slow
def test_several_beams_in_one_loop_turn_together() -> None:
    """The crank, the coupler and the rocker are beams, each carried by the one before or by the base."""
    coupler, rocker = closed(START)
    scene = four_bar(START, coupler + 0.2, rocker - 0.2)
    scene["bodies"] = {}
    beam = scene["beams"]["coupler"]
    scene["beams"] = {
        "crank": {**beam, "length": 0.3, "elements": 2},
        "coupler": beam,
        "rocker": {**beam, "length": 0.6},
    }
    system = derive(eomgen.load(scene))
    unstrained(system)
    found = angles(system)
    assert (found["B"], found["D"]) == pytest.approx(closed(found["A"]), abs=1e-12)


def held(end: list[float], model: str, **beam: Any) -> dict[str, Any]:
    """Return a straight beam of 10 m, clamped at the base, whose other end is fixed to a place."""
    stiffness = {name: value for name, value in ROLL_UP.items() if model == "cosserat" or "shear" not in name}
    scene = beam_scene(8, {"force": [0.0, 0.0, 0.0]}, {"model": model, "stiffness": stiffness, **beam})
    far = {"body": "rope", "position": [10.0, 0.0, 0.0]}
    scene["constraints"] = {"held": {"type": "fixed", "first": {"body": "base", "position": end}, "second": far}}
    return scene


@pytest.mark.parametrize("model", ["cosserat", pytest.param("kirchhoff", marks=pytest.mark.slow)])
def test_a_loop_that_closes_strained_says_by_how_much(model: str) -> None:
    """EA x^2 / 2 l and EA x / l of a bar that is 0.1 m longer than 10 m, in all its elements alike."""
    system = derive(eomgen.load(held([10.1, 0.0, 0.0], model)))
    energy, force = 0.5 * 1e4 * 0.1**2 / 10.0, 1e4 * 0.1 / 10.0
    (note,) = (note for note in system.notes if "strained" in note)
    assert f"the loop closes only with strained beams: strain energy {energy:.3g} J" in note
    assert f"largest section force {force:.3g} N in element " in note and "of the beam rope" in note
    places = [np.array(system.initial_q)[factor.q][4] for factor in system.factors if factor.name.startswith("rope.")]
    np.testing.assert_allclose(places, 10.1 * np.arange(1, 9) / 8.0, rtol=1e-9)


@pytest.mark.slow
def test_a_side_step_of_a_held_end_is_the_one_of_a_clamped_beam() -> None:
    """The energy 6 EI d^2 / l^3 of a beam clamped at both ends, one of which is moved across by d: 8 elements."""
    system = derive(eomgen.load(held([10.0, 0.0, 2e-3], "kirchhoff")))
    (note,) = (note for note in system.notes if "strained" in note)
    energy = re.search(r"strain energy (\S+) J", note)
    assert energy is not None
    assert float(energy[1]) == pytest.approx(6.0 * 500.0 * 2e-3**2 / 10.0**3, rel=0.02)


@pytest.mark.parametrize("off", [1e-2, 0.3])
def test_joints_turn_before_a_beam_of_shape_functions_deforms(off: float) -> None:
    """Least kinetic size gave 18 mm of deflection to a beam of steel of 1 m for half a degree, and no start for 0.3."""
    coupler, rocker = closed(START)
    scene = four_bar(START, coupler + off, rocker - off)
    bending = {"shapes": "clamped_free", "modes": 1, "stiffness": STEEL["bending_z"]}
    scene["beams"]["coupler"] = {"length": 1.0, "mass_per_length": 1.57, "bending_z": bending}
    scene["beams"]["coupler"]["stretch"] = {"modes": 1, "stiffness": STEEL["stretch"]}
    scene["joints"]["A"]["initial"]["velocity"] = 2.0
    system = derive(eomgen.load(scene))
    at = {factor.name: np.array(system.initial_q)[factor.q] for factor in system.factors}
    speed = {factor.name: np.array(system.initial_v)[factor.v] for factor in system.factors}
    np.testing.assert_array_equal(at["coupler"], [0.0, 0.0])
    np.testing.assert_allclose(speed["coupler"], [0.0, 0.0], atol=1e-12)
    assert (at["B"][0], at["D"][0]) == pytest.approx(closed(at["A"][0]), abs=1e-12)
    near = np.array([closed(at["A"][0] + sign * 1e-6) for sign in (1.0, -1.0)])
    rates = (near[0] - near[1]) / 2e-6 * speed["A"][0]
    assert (speed["B"][0], speed["D"][0]) == pytest.approx(tuple(rates), rel=1e-6)


def test_a_prestrained_string_that_fits_stays_as_it_is() -> None:
    system = derive(eomgen.load(held([10.0, 0.0, 0.0], "cosserat", prestrain={"stretch": 0.01})))
    assert [note for note in system.notes if "corrected" in note or "strained" in note] == []


@pytest.mark.slow
def test_nodes_follow_joints_and_parameters_of_a_run() -> None:
    coupler, rocker = closed(START)
    scene = four_bar(START, coupler, rocker, elements=2)
    model = eomgen.build(scene, profile="quick")
    run = {"error_estimate": False, "method": "generalized_alpha"}
    for given_values in (
        {"initial": {"A": 1.2}},
        {"initial": {"A": {"velocity": 3.0}}},
        {"parameters": {"ground": 0.95}},
    ):
        solution = model.simulate(2e-3, 1e-3, **run, **given_values)
        ground = given_values.get("parameters", {}).get("ground", 1.0)
        at = {name: float(solution.q[0, model.q_names.index(f"q.{name}")]) for name in "ABD"}
        assert (at["B"], at["D"]) == pytest.approx(closed(at["A"], ground), abs=1e-11)
        assert abs(solution.energy["potential"][0]) < 1e-15
        loads = solution.section_loads["coupler"]
        assert np.max(np.abs(loads.force[0])) < 1e-12 * STEEL["stretch"]
        # rates of strain would make forces of EA v dt / l within a step
        assert np.max(np.abs(loads.strain[1])) < 1e-6
