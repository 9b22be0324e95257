"""Texts by which a run can be refused or end, which no other test reads: ``eomgen extremes`` counts a refusal as a good
answer, so its words have to be good."""

from __future__ import annotations

import dataclasses
import pickle
from collections.abc import Callable
from functools import cache
from types import SimpleNamespace
from typing import Any

import pytest

import eomgen
from eomgen.integrators.families.partitioned import partition_data
from eomgen.integrators.stepper_layout import default_settings
from eomgen.lie.product import Factor
from eomgen.scene.load import from_data
from eomgen.simulation.stepping.stepper import Stepper
from tests.models.scenes import absolute

# -- texts that are met here -------------------------------------------------------------------------------------------


def slider(**more: Any) -> dict[str, Any]:
    """Return nested data of a mass on a line; ``joint`` are keys of its joint."""
    joint = {"type": "prismatic", "parent": "base", "child": "b", "axis": [1, 0, 0], **more.pop("joint", {})}
    scene = {
        "format": 1,
        "name": "slider",
        "gravity": [0, 0, 0],
        "bodies": {"b": {"mass": 1.0}},
        "joints": {"x": joint},
    }
    return scene | more


@cache
def free() -> eomgen.Model:
    return eomgen.build(slider(), profile="quick")


@cache
def driven() -> eomgen.Model:
    push = {"push": {"formula": "0", "unit": "N"}}
    return eomgen.build(slider(inputs=push, efforts={"e": {"joint": "x", "effort": "push"}}), profile="quick")


@cache
def pushed(effort: str) -> eomgen.Model:
    """Return a model whose mass starts at 1 m with 1 m/s."""
    joint = {"initial": {"position": 1.0, "velocity": 1.0}}
    return eomgen.build(slider(joint=joint, efforts={"e": {"joint": "x", "effort": effort}}), profile="quick")


def strange() -> None:
    """A solution that no run made."""
    solution = free().simulate(0.02, 0.01)
    known = {key: value for key, value in solution.metadata.items() if key != "fingerprint"}
    free().attach(dataclasses.replace(solution, metadata=known))


def state_of_another_scene() -> None:
    other = eomgen.build(slider() | {"name": "other"}, profile="quick")
    free().start(step=0.01).restore(other.start(step=0.01).state)


def at_rest(**more: Any) -> None:
    eomgen.build(slider(joint={"stiffness": 1.0}, **more), profile="quick").equilibrium()


def by_hand(model: eomgen.Model) -> eomgen.Model:
    """Return a model that does not know how it was made."""
    return eomgen.Model(model.description, model.library, model.stepper)


def without_stepper(call: Callable[[], object]) -> None:
    """Call a function while no stepper begins."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Stepper, "initialize", lambda *given: 3)
        call()


def between_rows() -> None:
    solution = free().simulate(0.1, 0.01, method="taylor")
    without_stepper(lambda: solution.at(0.005))


def more_rows_than_velocities() -> None:
    system: Any = SimpleNamespace(factors=[Factor("R", "x", 0, 1, 0, 1)], multipliers=("one", "two"))
    partition_data(system)


def curve_asked_at(argument: str) -> None:
    curve = {"points": [[0, 0], [1, 1], [2, 4], [3, 9]], "outside": "error"}
    scene = slider(efforts={"e": {"joint": "x", "effort": f"c({argument})"}}, parameters={"far": 5.0})
    eomgen.build(scene | {"curves": {"c": curve}}, profile="quick")


BEHIND = "model error: the curve c has no value at 5; try: an argument within its points"


@pytest.mark.slow_cases("<lambda>-text4")
@pytest.mark.parametrize(
    ("call", "text"),
    [
        (
            strange,
            "usage error: attach: the solution does not say of which run it is (fingerprint is missing): by hand, or"
            " older; try: a solution of simulate",
        ),
        (
            lambda: eomgen.build(slider(), terms=["mass"], profile="quick").simulate(0.1, 0.01, method="rk4"),
            "usage error: simulate: rk4 needs the terms forward_dynamics, which this model was built without; try:"
            " eomgen.build(scene, terms=[..., 'forward_dynamics'])",
        ),
        (
            state_of_another_scene,
            "model error: state: this is a state of the scene 'other', the simulator runs 'slider'; try: the model,"
            " method and compiler that made it, or start(initial={'q': state.q, 'v': state.v})",
        ),
        (
            lambda: free().simulate(0.1, 0.01, method="hht", alpha=-0.1),
            "usage error: method.alpha: alpha of hht must lie in 0..1/3, not -0.1: the papers and Abaqus"
            " have the opposite sign; try: 0.1",
        ),
        (
            lambda: at_rest(states={"angle": {"rate": "1", "unit": "rad"}}),
            "numerical error: equilibrium: the forces balance, but the state angle does not rest: it changes at 1 rad"
            " per s; try: inputs and parameters with which its rate is 0, as of an integral of an error that is 0 at"
            " rest",
        ),
        (
            lambda: pickle.dumps(by_hand(free())),
            "usage error: pickle: this model was made by hand and cannot be sent to another process; try:"
            " eomgen.build(scene), whose models can",
        ),
        (
            between_rows,
            "numerical error: no state at t = 0.005 s: a value became infinite or not a number; try: times of rows",
        ),
        (
            more_rows_than_velocities,
            "model error: method: there are 2 constraint rows for 1 velocity components: some repeat others; try: leave"
            " out the rows that follow from others",
        ),
        (lambda: curve_asked_at("5.0"), BEHIND),
    ],
)
def test_what_is_refused(call: Callable[[], object], text: str) -> None:
    with pytest.raises(eomgen.EomgenError) as caught:
        call()
    assert str(caught.value) == text


def test_models_made_by_hand_compile_no_terms_for_constraints() -> None:
    ends = {"first": {"body": "base", "position": [0, 1, 0]}, "second": {"body": "b"}}
    scene = slider(constraints={"rod": {"type": "distance", **ends, "length": 1.0}})
    model = by_hand(eomgen.build(scene, terms=["mass"], profile="quick"))
    with pytest.raises(eomgen.UsageError) as caught:
        model.consistent([0.0], [0.0])
    said = str(caught.value)
    assert said.startswith("usage error: the terms ") and said.endswith(
        " are needed to make an initial state consistent; try: build with them"
    )


@pytest.mark.slow
@pytest.mark.parametrize("method", ["rk45", "generalized_alpha"])
def test_a_motion_that_goes_to_infinity_at_once_ends_where_its_steps_do(method: str) -> None:
    """x = 1/(1 - t) by its equation of motion."""
    run = pushed("2*q.x*q.x*q.x").simulate(2.0, 0.1, method=method, tolerance=1e-6)
    text = "the step became too small for the time to move on: the motion has a singularity near, or forces jump"
    assert not run.success and 0.8 < run.t[-1] < 1.05 and text in run.message


@pytest.mark.slow
def test_a_row_that_takes_too_many_steps_ends_the_run() -> None:
    stiff = eomgen.build(slider(joint={"stiffness": 1e14, "initial": {"position": 1.0}}), profile="quick")
    run = stiff.simulate(10.0, 10.0, method="rk45", tolerance=1e-9)
    text = (
        "1000000 steps were not enough for one row: the tolerance is too small for this order, or the motion is stiff"
    )
    assert not run.success and text in run.message


def test_a_scene_whose_numbers_have_no_text_is_not_scaled() -> None:
    found = eomgen.extremes(from_data(slider()), ladders=["length"])
    why = "its numbers cannot be scaled: the scene is given as a Scene, whose numbers have no text"
    assert found.left_out == {"length": why}


@cache
def stopping() -> eomgen.Model:
    events = {"far": {"when": "q.x - 0.05", "action": "stop"}}
    return eomgen.build(slider(joint={"initial": {"velocity": 1.0}}, events=events), profile="quick")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("made", "method", "number", "text"),
    [
        (free, "rk4", 2, "the mass matrix is singular"),
        (free, "generalized_alpha", 2, "the mass or iteration matrix is singular"),
        (
            absolute,
            "generalized_alpha",
            2,
            "the mass or iteration matrix is singular: constraints that repeat each other, or a part without mass",
        ),
        (free, "taylor", 1, "the Taylor series disagrees with the equations where it ends, however short the step"),
        (stopping, "rk4", 20, "an event of the scene has ended the run"),
    ],
)
def test_what_steppers_say_of_what_few_scenes_come_to(
    made: Callable[[], eomgen.Model], method: str, number: int, text: str
) -> None:
    """Python says where an event ends a run; of matrices without an inverse most are told before a run."""
    library = made().stepper(method)
    settings = default_settings(library.layout["method"])
    assert Stepper(library, settings, made().parameter_array({})).status_text(number) == text
