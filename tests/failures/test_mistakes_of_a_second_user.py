"""What a second user tried by mistake: every answer says what is meant, and what to write in its place."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pytest

import eomgen
from tests.failures.failure import SCENE
from tests.failures.mistakes import arm, changed, scene_of, slider

pytestmark = pytest.mark.slow

SERVO = """
[controllers.servo]
type = "sampled"
sample = "10 ms"
signals = { error = "0.1 - q.shoulder", speed = "v.shoulder" }
memory = 1
[efforts.servo]
joint = "shoulder"
effort = "servo"
"""
CORD = '[springs.cord]\nfirst = "tip"\nsecond = "o"\nstiffness = 10\n[points.o]\nbody = "base"\nposition = [0, 0, 3]\n'
ORDER = "signals[0] = error, signals[1] = speed, and memory is an array of 1"
ROBOT = """<robot name="r"><link name="b"/><link name="c"><inertial><mass value="1"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<joint name="lift" type="prismatic"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/></joint>MORE</robot>"""
GEAR = """<transmission name="t"><type>transmission_interface/SimpleTransmission</type>
<joint name="lft"/><actuator name="m"/></transmission>"""


@cache
def servo() -> eomgen.Model:
    return eomgen.build(scene_of(SCENE + SERVO), profile="quick")


def refused(call: Callable[[], Any]) -> str:
    with pytest.raises(eomgen.EomgenError) as caught:
        call()
    return str(caught.value)


def test_functions_of_controllers_are_told_their_arguments_in_order() -> None:
    text = refused(lambda: servo().simulate(0.02, 1e-3, controllers={"servo": lambda t, x: 0.0}))
    assert "controller servo: the function does not take the 3 arguments that it is called with" in text
    assert f"try: def law(t, signals, memory), where t is in s, {ORDER}" in text
    text = refused(lambda: servo().simulate(0.02, 1e-3, controllers={"servo": lambda t, s, memory: s["error"]}))
    assert "IndexError" in text
    assert ORDER in text


def test_a_function_with_further_defaults_and_one_without_a_signature_are_taken() -> None:
    def law(t: float, signals: Any, memory: Any, gain: float = 2.0) -> float:
        return gain * float(signals[0])

    assert servo().simulate(0.02, 1e-3, controllers={"servo": law}, error_estimate=False).success
    assert servo().simulate(0.02, 1e-3, controllers={"servo": lambda *given: 0.0}, error_estimate=False).success


def test_the_size_of_a_step_is_no_input() -> None:
    run = arm().start(step=1e-3)
    with pytest.warns(
        RuntimeWarning, match=r"step\(0.001\) takes 0.001 as the input motor, not as the size of"
    ) as told:
        run.step(1e-3)
    assert told[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run.step(1e-3)  # within a motion inputs may be any number
        arm().start(step=1e-3).step(2e-3)
        arm().start(step=1e-3).step([1e-3])
    text = refused(lambda: eomgen.build(slider().build(), profile="quick").start(step=1e-3).step(1e-3))
    assert "u: these are the inputs of a step, and the scene has none; a step is 0.001 s long" in text
    assert "the size of steps is set by start(step=...)" in text


@pytest.mark.parametrize(
    ("call", "pieces"),
    [
        (
            lambda: arm().start(step=1e-3).set_parameter("length", 0.5),
            ("the parameter length exists, but its value is fixed", "tunable = true"),
        ),
        (lambda: arm().jacobian("tip", [0.1]), ("no body or frame 'tip'", "point_jacobian(body, r, q), or [frames]")),
        (
            lambda: arm().simulate(0.01, 1e-3, initial={"v.shoulder": 1}),
            (
                "'v.shoulder' is a component, and initial states are given by joints",
                'initial={"shoulder": {"velocity": ...}}',
            ),
        ),
        (
            lambda: arm().simulate(0.01, 1e-3, inputs={"motor": lambda t, q: 0.0}),
            ("the function failed", "inputs see the time only"),
        ),
        (
            lambda: eomgen.build("scene.toml", coordinates="absolute"),
            ("no argument 'coordinates'", "eomgen.load(path, coordinates=...)"),
        ),
        (changed('"revolute"', '"hinge"'), ("'hinge' is not known here; try: revolute",)),
        (changed('"revolute"', '"ball"'), ("'ball' is not known here; try: spherical",)),
        (
            changed('effort = "motor"', 'effort = "gravity.shoulder()"'),
            ("gravity.shoulder is a quantity, not a function", "gravity.shoulder without brackets"),
        ),
        (
            changed("", "", '[events.a]\nwhen = "q.shoulder - 0.1 * mode.gear"\n'),
            ("mode.gear: the scene has no [modes]", "try: [modes] and gear = 1"),
        ),
        (
            changed('tip = { position = "tip" }', 'f = { reaction_force = "cord" }', CORD),
            ("cord is in [springs], and no joint, constraint or reaction", "try: tension.cord in a formula"),
        ),
        (
            changed('tip = { position = "tip" }', 'f = { formula = "reaction.cord.force[0]" }', CORD),
            ("cord is in [springs]", "try: tension.cord in a formula"),
        ),
    ],
)
def test_what_is_meant_is_told(call: Callable[[], Any], pieces: tuple[str, ...]) -> None:
    text = refused(call)
    missing = [piece for piece in pieces if piece not in text]
    assert not missing, f"{missing} in: {text}"


def test_degrees_without_their_unit_are_noted_in_runs_too() -> None:
    note = 'the joint shoulder starts at 45 rad, 7.16 turns: angles without a unit are radians, "30 deg" is in degrees'
    for given in (45, {"position": 45.0}):
        assert note in arm().simulate(0.01, 1e-3, initial={"shoulder": given}).metadata["notes"]
    assert note in arm().start({"shoulder": 45}, step=1e-3).notes
    assert arm().start({"shoulder": "2578 deg"}, step=1e-3).notes == ()
    assert arm().start({"shoulder": 6.0}, step=1e-3).notes == ()
    assert arm().start({"shoulder": 45.0312}, step=1e-3).notes == ()  # as of the end of another run


def test_options_of_robots_have_their_counterparts_in_scenes(tmp_path: Path) -> None:
    (tmp_path / "arm.toml").write_text(SCENE)
    text = refused(lambda: eomgen.load(tmp_path / "arm.toml", actuated=True))
    assert "for URDF only; try: [inputs] and [efforts] in the scene file" in text


def test_transmissions_that_are_missing_or_misspelt_are_noted(tmp_path: Path) -> None:
    file = tmp_path / "r.urdf"
    file.write_text(ROBOT.replace("MORE", ""))
    none = "the file has no <transmission>, so none gives inputs; actuated=True gives one for each joint"
    assert none in eomgen.load(file, transmissions=True).notes
    assert none not in eomgen.load(file).notes
    file.write_text(ROBOT.replace("MORE", GEAR))
    notes = eomgen.load(file, transmissions=True).notes
    assert none not in notes
    assert "not modelled: transmissions to joints that are not there (1: lft), perhaps lift" in notes


def test_velocities_are_called_v() -> None:
    assert "a Model has no 'qd'; try: initial_v or v_names; velocities are called v" in refused(lambda: arm().qd)
    assert "try: v" in refused(lambda: arm().simulate(0.01, 1e-3).qdot)
