"""Runs of geometrically exact beams: order in time, free flight, rest of slender beams, elements that turn too far, and
C that does not grow with the number of elements."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

import eomgen
from eomgen.codegen.convert import to_program
from eomgen.codegen.scheduling import rerolling, scheduler
from eomgen.codegen.targets.c.target import generate_files
from eomgen.integrators.families.register import method_named
from eomgen.integrators.stepper_data import method_data
from eomgen.simulation.judgement.beams import turned_elements
from tests.compiled.spaghetti import spaghetti
from tests.models.cosserat import beam_scene


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
    tables = re.findall(r"static const \w+ \w+\[(\d+)\](?:\[(\d+)\])? =", model + stepper)
    entries = sum(int(rows) * int(columns or 1) for rows, columns in tables)
    waiting = {function.name: round(function.workspace / (elements + 1)) for function in program.functions}
    counts = {"model": model.count(";"), "stepper": stepper.count(";"), "entries of tables": entries}
    return counts | {name: waiting[name] for name in ("residual", "iteration") if name in waiting}


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


def turned_by(angles: Any) -> str:
    """Return what is said of a beam of two elements whose last node turns through these angles about z."""
    half = 0.5 * np.asarray(angles)
    pose = np.zeros((len(half), 3, 7))
    pose[:, :, 0] = 1.0
    pose[:, 2, 0], pose[:, 2, 3] = np.cos(half), np.sin(half)
    model = SimpleNamespace(
        description=SimpleNamespace(exact_beams=(("rope", "rope.1", "rope.2"),)),
        functions={"poses": None},
        bodies=("rope", "rope.1", "rope.2"),
        evaluate=lambda _, q, **__: {"pose": pose[q[:, 0]]},
    )
    t = np.linspace(0.0, 1.0, len(half))
    found = turned_elements(cast("Any", model), t, np.arange(len(half))[:, np.newaxis], np.zeros(0))
    return "" if found is None else str(found)


def test_an_element_that_turns_by_more_than_half_a_turn_is_named() -> None:
    assert turned_by(np.linspace(0.0, 3.1, 50)) == ""
    assert turned_by(np.linspace(0.0, 4.0, 101)) == (
        "element 2 of the beam rope turns by more than half a turn at t = 0.79 s, which strains cannot show; try:"
        " elements = 4, which turn less each"
    )
    angles = np.zeros(10_000)
    angles[4096:4099] = 3.0, 3.3, 3.0
    assert "turns by more than half a turn" in turned_by(angles)
    assert turned_by(0.9 * angles) == ""


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
