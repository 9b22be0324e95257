"""Calls, options of URDF and linear models that once were passed over, or answered by Python alone."""

from __future__ import annotations

import dataclasses
import functools
import math
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import eomgen
from tests.models.urdf import load_urdf

ROBOT = """<robot name="lifter">
  <link name="ground"/>
  <link name="rod"><inertial><origin xyz="0 0 0.2"/><mass value="1.5"/>
    <inertia ixx="0.02" iyy="0.02" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="lift" type="revolute"><parent link="ground"/><child link="rod"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="10" velocity="2"/></joint>
</robot>"""


@functools.cache
def slider() -> eomgen.Model:
    builder = eomgen.SceneBuilder("slider").body("m", 2.0).joint("x", "prismatic", "base", "m", axis=[1, 0, 0])
    builder.input("f", unit="N").effort("f", "x", "f").parameter("load", 0.5, tunable=True)
    builder.effort("g", "x", "-load").output("place", formula="q.x", unit="m")
    return eomgen.build(builder.build(), profile="quick")


@functools.cache
def linear() -> Any:
    return slider().linearize(at="initial")


def setting(owner: Callable[[], Any], name: str) -> Callable[[], Any]:
    return lambda: setattr(owner(), name, 1.0)


def started(**options: Any) -> Any:
    return slider().start(step=1e-3, **options)


def driven(function: Callable[..., Any]) -> Callable[[], Any]:
    return lambda: slider().simulate(0.01, 1e-3, inputs={"f": function})


CALLS: list[tuple[Callable[[], Any], str]] = [
    (setting(slider, "step"), "a Model has no 'step' to set; try: simulate(step=...)"),
    (setting(slider, "load"), "a Model has no 'load' to set; try: simulate(parameters={\"load\": ...})"),
    (
        setting(lambda: slider().scene, "gravity"),
        "a Scene does not change, so 'gravity' is not assigned to; try: gra",
    ),
    (lambda: slider().pose([0.0], "m"), "the name of a body or frame comes first, not list; try: the name, and then q"),
    (
        lambda: slider().jacobian("m", [0.0], "LOCAL"),  # type: ignore[arg-type]
        "t: 'LOCAL' is not a time: a reference goes by its name; try: reference=\"body\"",
    ),
    (driven(lambda _: [1.0, 2.0]), "input f: the function gives 2 numbers at t = 0 s, and one real number is needed"),
    (lambda: linear().modes().frequencies, "a Modes has no 'frequencies'; try: frequency, Hz, or angular_frequency"),
    (lambda: linear().state_space().poles, "a StateSpace has no 'poles'; try: eigenvalues"),
    (
        lambda: eomgen.control.place(linear(), [-1.0, -2.0]).K,  # type: ignore[attr-defined]
        "a Regulator has no 'K'; try: gains",
    ),
    (
        lambda: linear().frequency_response("f", "place", [1.0]),
        "the first argument omega is an array in rad/s, and 'f' is not; try: frequency_response(omega, input, output)",
    ),
    (lambda: slider().steady_motion({"q.x": 1.0}), "'q.x' is a position, and a velocity is given here; try: coord"),
    (lambda: slider().energy([0.0], [0.0])["kin"], "there is no energy 'kin'; try: kinetic"),
    (lambda: slider().simulate(0.01, 1e-3).stats["step"], "there is no statistic 'step'; try: steps"),
    (lambda: slider().simulate(0.01, 1e-3).metadata["metod"], "there is no entry 'metod'; try: method"),
    (lambda: slider().simulate(0.01, 1e-3).error.outputs_at["plac"], "there is no output 'plac'; try: place"),
    (lambda: load_urdf(ROBOT, actuated=["lift"]), "actuated: True or False is needed, not list; try: actuated=True"),
    (
        lambda: load_urdf(ROBOT.replace('lower="-1"', 'lower="2"'), limits=True),
        "robot.urdf:5 (joints.lift.limit): the lower limit, 2, is above the upper one, 1 rad; try: the smaller",
    ),
]


@pytest.mark.slow_cases("a Model has no 'step' to set; try: simul", "a Modes has no 'frequencies'; try: frequ")
@pytest.mark.parametrize(("call", "piece"), CALLS, ids=[piece[:40] for _, piece in CALLS])
def test_each_is_answered_with_what_to_try(call: Callable[[], Any], piece: str) -> None:
    with pytest.raises(eomgen.EomgenError) as error:
        call()
    assert piece in str(error.value)


def test_a_function_of_other_packages_is_told_from_here() -> None:
    with pytest.raises(AttributeError, match=r'buildModelFromUrdf.*try: load\("robot.urdf"\)'):
        _ = eomgen.buildModelFromUrdf  # type: ignore[attr-defined]


def test_a_step_in_the_place_of_the_time_is_noted() -> None:
    note = r"its third argument is t, on which nothing .* try: integrate\(q, v \* dt\)"
    with pytest.warns(RuntimeWarning, match=note) as told:
        assert slider().integrate([0.0], [1.0], 1e-3) == [1.0]
    assert told[0].filename == __file__


def test_what_does_not_change_stays_usable() -> None:
    model = pickle.loads(pickle.dumps(slider()))
    assert model.integrate([0.5], [1.0]) == [1.5] == model.integrate([0.5], [1.0], 0.0)
    assert pickle.loads(pickle.dumps(linear().modes())).frequency == pytest.approx(linear().modes().frequency)
    with pytest.raises(dataclasses.FrozenInstanceError):
        slider().scene.name = "other"
    assert dataclasses.replace(slider().scene, name="other").name == "other"
    assert not hasattr(linear().modes(), "frequencies")


def test_units_of_another_kind_in_a_urdf_are_noted() -> None:
    assert not [note for note in load_urdf(ROBOT).notes if "radians" in note]
    degrees = load_urdf(ROBOT.replace('upper="1"', 'upper="90"')).notes
    text = f"limits of more than a turn at lift: angles of URDF are in radians, and 90 degrees are {math.pi / 2!r}"
    assert text in degrees


@pytest.mark.slow
def test_a_linear_model_at_given_inputs_says_why_it_is_about_the_initial_state() -> None:
    with pytest.warns(RuntimeWarning, match="linear about the initial state, with the inputs that are given: "):
        found = slider().linearize(u=np.array([3.0]))
    assert found.reference.what == "initial state"
