"""Runs of geometrically exact beams: order in time, free flight, rest of slender beams, elements that turn too far, and
C that does not grow with the number of elements."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

import eomgen
from eomgen.codegen.convert import to_program
from eomgen.codegen.scheduling import rerolling, scheduler
from eomgen.codegen.targets.c.target import generate_files
from eomgen.compiled.rest import loaded_statics
from eomgen.integrators.families.register import method_named
from eomgen.integrators.stepper_data import method_data
from tests.compiled.spaghetti import spaghetti
from tests.models.cosserat import ROLL_UP, beam_scene


def sizes_of_c(elements: int, kind: str, name: str) -> dict[str, int]:
    """Return what may not grow in a beam's C: statements of the model and of its stepper, entries of tables, and for
    each node numbers in the workspaces of the functions of a step."""
    method, constrained = method_named(name), kind != "cosserat"
    terms = method.terms(constrained, False, True) if constrained else ["residual", "iteration", "forward_dynamics"]
    system = eomgen.derive(
        eomgen.load(spaghetti.scene(elements, model=kind)), [term for term in terms if term != "mass"]
    )
    program = to_program(system, method_data(method, system))
    files = generate_files(program)
    model, stepper = files["flying_spaghetti.c"], files["flying_spaghetti_step.c"]
    model = model[model.index(" of beam noodle") :]  # behind the initial state, of which every node has its own
    # but for zeros of all velocities, which are one number in the text
    tables = re.findall(r"static const \w+ \w+\[(\d+)\](?:\[(\d+)\])? = (?!\{ 0\.0 \})", model + stepper)
    entries = sum(int(rows) * int(columns or 1) for rows, columns in tables)
    waiting = {function.name: round(function.workspace / (elements + 1)) for function in program.functions}
    counts = {"model": model.count(";"), "stepper": stepper.count(";"), "entries of tables": entries}
    return counts | {name: waiting[name] for name in ("residual", "iteration") if name in waiting}


@pytest.mark.slow
def test_rest_is_an_arc_under_a_moment_and_a_bow_past_eulers_load(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Of two elements on a hinge with a spring: a moment of 50 N m turns the hinge by 0.05 and bends the beam by 1 rad;
    of a bow, the moment of the spring is that of the load about the hinge."""
    stiff = ROLL_UP | dict.fromkeys(("stretch", "shear_y", "shear_z"), "1e4 * factor") | {"bending_y": 2000.0}
    loads, hinge = {"force": ["push", 0, 0], "torque": [0, "torque", 0]}, {"type": "revolute", "axis": [0, 1, 0]}
    scene = beam_scene(2, loads, {"stiffness": stiff}, **hinge, stiffness=1000.0)
    scene["parameters"] = {"push": {"value": 0.0, "tunable": True}, "factor": {"value": 1.0, "tunable": True}}
    model = eomgen.build(scene | {"inputs": {"torque": {"formula": "25 * t"}}}, profile="instant")
    rests = [model.equilibrium(t=2.0).q, model.equilibrium(u={"torque": 50.0}).q]
    rests += [model.equilibrium_path(name, end).q[-1] for name, end in (("torque", 50.0), ("t", 2.0))]
    pressed = {"factor": 1e4, "push": -8.0}, {"factor": 1e4}
    along = model.equilibrium_path("push", -8.0, parameters=pressed[1]).q[-1]
    np.testing.assert_allclose(along, model.equilibrium(parameters=pressed[0]).q, atol=1e-9)
    soft = [model.equilibrium(parameters={"factor": factor}).frequencies for factor in (1e6, 1e10)]
    monkeypatch.setattr(loaded_statics, "WHOLE", 0)  # as large scenes do
    rests.append(model.equilibrium(u={"torque": 50.0}).q)
    bow = model.equilibrium(parameters={"push": -14.0, "factor": 1e4})
    for q in rests:
        arc = 10.0 * (np.sin(1.05) - np.sin(0.05)), 0.0, 10.0 * (np.cos(1.05) - np.cos(0.05))
        np.testing.assert_allclose([q[0], *q[-3:]], [0.05, *arc], atol=1e-8)
    np.testing.assert_allclose(soft[0][:3], soft[1][:3], rtol=1e-6)
    assert 1000.0 * bow.q[0] == pytest.approx(-14.0 * bow.q[-1], rel=1e-9) and abs(bow.q[0]) > 0.1 and bow.stable
    sides = ("positive", "negative") if bow.q[-5] > 0.0 else ("negative", "positive")
    assert f"the {sides[0]} side of rope.2[1], others may be on its {sides[1]} side" in bow.notes[0]
    start = {"clamp": {"position": 0.5, "velocity": 2.0}}
    moved = model.simulate(1e-3, 1e-3, initial=start, error_estimate=False)  # takes its beam along
    np.testing.assert_allclose(moved.q[0, -3:], [10.0 * np.cos(0.5), 0.0, -10.0 * np.sin(0.5)], atol=1e-12)
    np.testing.assert_allclose(moved.v[0, -6:], [0.0, 2.0, 0.0, 0.0, 0.0, -20.0], atol=1e-7)
    strain = moved.section_loads["rope"].strain
    assert np.max(np.abs(strain[0])) < 1e-13
    stored = eomgen.Solution.load(moved.save(tmp_path / "run.npz"))
    np.testing.assert_array_equal(stored.section_loads["rope"].strain, strain)


@pytest.mark.long
@pytest.mark.parametrize(("kind", "name"), [("cosserat", "generalized_alpha"), ("kirchhoff", "rattlie")])
def test_the_c_of_more_elements_is_as_long(kind: str, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scheduler, "REROLL_FROM", 0)
    monkeypatch.setattr(scheduler, "REROLLED_PART", 1.0)
    monkeypatch.setattr(rerolling, "MINIMUM_SAVED", 40)
    sizes = [sizes_of_c(elements, kind, name) for elements in (40, 44)]
    assert sizes[0] == sizes[1]
    assert sizes[0]["entries of tables"] < (3000 if kind == "cosserat" else 7000)
    if kind == "cosserat":  # rotations and poses, and of `residual` accelerations, with those of turning frames
        assert (sizes[0]["residual"], sizes[0]["iteration"]) == (33, 21)


@pytest.mark.slow
def test_a_run_in_which_an_element_turns_too_far_has_not_succeeded() -> None:
    scene = beam_scene(2, {"torque": [0.0, 0.0, "2000 * load"]}, {"stiffness_damping": 0.02})
    run = eomgen.build(scene, profile="quick").simulate(4.0, 2e-3, error_estimate=False)
    assert not run.success
    assert re.search(r"element \d of the beam rope turns by more than half a turn at t = ", run.message)


@pytest.mark.long
def test_branches_on_a_turning_hub_move_alike_in_both_coordinates() -> None:
    section = {
        "elastic_modulus": 2e7, "density": 1200.0, "area": 1e-3, "second_moments": [8e-8, 8e-8],
        "shear_modulus": 8e6, "torsion_constant": 1.6e-7, "shear_factors": [0.9, 0.9],
    }  # fmt: skip  # a table
    beam = {"model": "cosserat", "section": section}
    hinge = {"type": "revolute", "axis": [0, 1, 0]}
    turned = {"type": "fixed", "rotation": [{"axis": [0, 0, 1], "angle": 1.5}]}
    scene = {
        "format": 1,
        "name": "branches",
        "bodies": {
            "hub": {"mass": 2.0, "inertia": [0.1, 0.1, 0.1]},
            "ball": {"mass": 0.5, "inertia": [0.01, 0.01, 0.02]},
        },
        "beams": {
            "arm": {**beam, "length": 1.0, "elements": 4, "curvature": [0.0, 0.0, 0.5], "stiffness_damping": 1e-3},
            "branch": {**beam, "length": 0.5, "elements": 2},
        },
        "joints": {
            "pivot": {**hinge, "parent": "base", "child": "hub", "initial": {"velocity": [2.0]}},
            "root": {**turned, "parent": "hub", "child": "arm", "position": [0.1, 0.0, 0.0]},
            "fork": {**turned, "parent": "arm", "child": "branch", "position": [0.5, 0.0, 0.0]},
            "tip": {"type": "spherical", "parent": "arm", "child": "ball", "position": [1.0, 0.0, 0.0]},
        },
        "points": {"end": {"body": "branch", "position": [0.5, 0.0, 0.0]}},
        "outputs": {"end": {"position": "end"}},
    }  # fmt: skip  # one line for each joint
    ends = []
    for coordinates in ("joint", "absolute"):
        model = eomgen.build(eomgen.load(scene, coordinates=cast("Any", coordinates)), profile="quick")
        run = model.simulate(0.1, 5e-4, error_estimate=False)
        assert run.success, run.message
        assert run.stats["energy_error"] < 1e-5
        ends.append(run.outputs["end"])
    assert np.abs(ends[0][-1] - ends[0][0]).max() > 0.01
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-6)


@pytest.mark.slow
def test_a_bent_beam_at_rest_rests_and_its_outputs_are_not_in_doubt() -> None:
    scene = beam_scene(3, {"force": [0.0, "15 * (load - 1)", 0.0]}, {"curvature": [0.03, 0.0, 0.07]})
    scene["outputs"] = {"moment": {"section_moment": "rope", "at": 0.0}, "clamp": {"reaction_moment": "clamp"}}
    model = eomgen.build(scene, profile="quick")
    run = model.simulate(0.5, 1e-3)
    assert run.message == "reached t = 0.5 s in 500 steps"
    assert run.stats["energy_error"] == 0.0 and run.error.largest_output is None
    assert np.abs(run.outputs["moment"]).max() < 1e-9
    moved = model.simulate(0.5, 1e-3, parameters={"load": 1.0 + 1e-6})
    assert moved.success and moved.error.largest_output.share < 0.1
