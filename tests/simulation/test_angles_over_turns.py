"""Joint angles in absolute coordinates over many turns: the same as in joint coordinates, wherever they are used as
numbers."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import eomgen

METHODS = ("generalized_alpha", "generalized_alpha_index3", "rk4_partitioned", "rattlie")
BODY = {"mass": 1.0, "center_of_mass": [0.3, 0.1, 0.2], "inertia": [0.02, 0.03, 0.04]}
#: About the hinge's axis y.
INERTIA, STIFFNESS, REST = 0.03 + 0.3**2 + 0.2**2, 1e-3, -4.0


def hinge(coordinates: str) -> eomgen.Scene:
    """Return a body on a hinge with a soft spring, without weight."""
    builder = eomgen.SceneBuilder(f"turning_{coordinates}", coordinates=coordinates, gravity=[0, 0, 0])
    start, spring = {"position": 7.0, "velocity": 6.0}, {"stiffness": STIFFNESS, "rest": REST}
    builder.body("body", **BODY).joint("hinge", "revolute", "base", "body", axis=[0, 1, 0], initial=start, **spring)
    return builder.output("angle", formula="q.hinge").output("rate", formula="v.hinge").build()


@cache
def model(coordinates: str = "absolute") -> eomgen.Model:
    return eomgen.build(hinge(coordinates), profile="quick")


def started(angle: float, speed: float) -> dict[str, np.ndarray]:
    """Return the body where the hinge is at an angle, turning with a speed."""
    center, axis = np.array(BODY["center_of_mass"]), np.array([0.0, 1.0, 0.0])
    c, s = np.cos(angle), np.sin(angle)
    place = np.array([c * center[0] + s * center[2], center[1], -s * center[0] + c * center[2]])
    q = np.concatenate([[np.cos(angle / 2)], np.sin(angle / 2) * axis, place, [angle]])
    return {"q": q, "v": speed * np.concatenate([axis, np.cross(axis, center)])}


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_a_spring_winds_up_over_several_turns(method: str) -> None:
    """From 7 rad at 6 rad/s for 20 turns and back, against the closed form; the start is 7 rad, not 7 - 2 pi."""
    run = model().simulate(150.0, 0.01, method=method, record_every=10)
    assert run.success, run.message
    omega = np.sqrt(STIFFNESS / INERTIA)
    exact = REST + (7.0 - REST) * np.cos(omega * run.t) + 6.0 / omega * np.sin(omega * run.t)
    assert run.outputs["angle"][0] == 7.0
    assert exact.max() > 15.0 * np.pi
    np.testing.assert_allclose(run.outputs["angle"], exact, atol=1e-8 if method.startswith("rk4") else 2e-3)
    np.testing.assert_allclose(run.q[:, -1], run.outputs["angle"], rtol=1e-14, atol=1e-12)
    total = run.energy["total"]
    np.testing.assert_allclose(total, total[0], rtol=1e-4)


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@example(angle=1.0, turns_a_step=5e-324, step=0.015625, method="generalized_alpha")
@given(
    angle=st.floats(-500.0, 500.0),
    turns_a_step=st.floats(-0.85, 0.85, allow_subnormal=False),
    step=st.floats(1e-3, 0.02),
    method=st.sampled_from(METHODS),
)
def test_any_angle_and_any_speed_give_the_angle_of_joint_coordinates(
    angle: float, turns_a_step: float, step: float, method: str
) -> None:
    """Up to 0.85 of a turn in one step, from starts within 80 turns."""
    speed = 2.0 * np.pi * turns_a_step / step
    run = model().simulate(20 * step, step, method=method, initial=started(angle, speed))
    of_joint = method if method == "rattlie" else "generalized_alpha" if method.startswith("gen") else "rk4"
    start = {"hinge": {"position": angle, "velocity": speed}}
    expected = model("joint").simulate(20 * step, step, method=of_joint, initial=start)
    assert run.success, run.message
    scale = 1.0 + abs(angle) + abs(speed) * 20 * step
    np.testing.assert_allclose(run.outputs["angle"], expected.outputs["angle"], rtol=0.0, atol=1e-9 * scale)


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_more_than_0_9_of_a_turn_in_a_step_stops_and_names_the_joint(method: str) -> None:
    run = model().simulate(0.1, 0.01, method=method, initial=started(0.0, 2.0 * np.pi * 0.95 / 0.01))
    assert not run.success
    assert run.message == (
        "stopped at t = 0 s, after 0 of 10 steps: a body or a joint turns by more than 0.9 of a full turn within one"
        " step; reduce the step; the joint hinge turns by 5.97 rad in a step; try: a step smaller than 0.01 s"
    )


def pair(coordinates: str) -> eomgen.Scene:
    """Return a rotor on a wheel on a base that turns: stops, a belt, an effort, a lag and a rack, all of angles of many
    turns."""
    builder = eomgen.SceneBuilder(f"pair_{coordinates}", coordinates=coordinates, gravity=[0.0, 0.0, -0.5])
    builder.base(rotation=[([0, 0, 1], "3 * t")], position=["0.1 * sin(t)", 0, 0])
    builder.body("wheel", **BODY).body("rotor", **BODY, group="R3xSO3").body("rack", **BODY)
    stops = {"lower": -4.0, "upper": 17.0, "stiffness": 4.0, "damping": 0.05, "onset": 0.5}
    start = {"position": 7.0, "velocity": 9.0}
    builder.joint("wheel", "revolute", "base", "wheel", axis=[0, 1, 0], limits=stops, initial=start)
    rubbing = {"friction": {"coulomb": 0.01, "velocity": 0.5}, "initial": {"position": -4.0, "velocity": -40.0}}
    builder.joint("rotor", "revolute", "wheel", "rotor", axis=[0, 0, 1], position=[0.2, 0, 0], **rubbing)
    geared = {"joint": "wheel", "multiplier": 0.05}
    builder.joint("rack", "prismatic", "base", "rack", axis=[0, 0, 1], mimic=geared)
    builder.torsion_spring("belt", "wheel", "rotor", stiffness=0.03, rest=2.0, damping=0.001)
    builder.effort("motor", "wheel", "-0.02 * q.rotor + 0.01 * sin(q.wheel) + 0.01 * lag")
    builder.state("lag", rate="q.rotor - lag")
    return builder.output("angles", formula=["q.wheel", "q.rotor", "lag", "sin(q.rotor)"]).build()


@pytest.fixture(scope="module")
def expected() -> eomgen.Solution:
    terms = ["forward_dynamics", "outputs", "internal_rate"]
    return eomgen.build(pair("joint"), terms, profile="quick", method="rk4").simulate(1.5, 5e-4, method="rk4")


#: Joints that have angles, starting several turns from zero.
JOINTS: dict[str, tuple[str, list[float], list[float], dict[str, Any]]] = {
    "hinge": ("revolute", [7.0], [9.0], {"stiffness": 0.1, "rest": 9.0}),
    "sleeve": ("cylindrical", [-9.0, 0.1], [-12.0, 0.2], {"stiffness": [0.02, 1.0]}),
    "thread": ("helical", [5.0], [20.0], {"stiffness": 0.05, "pitch": 0.02}),
    "gimbal": ("universal", [4.0, -5.0], [8.0, 1.0], {"stiffness": [0.05, 0.04], "second_axis": [0, 1, 0]}),
    "table": ("planar", [-6.0, 0.1, 0.0], [10.0, 0.1, 0.3], {"stiffness": [0.05, 2.0, 2.0]}),
}


def all_joints(coordinates: str, group: str) -> eomgen.Scene:
    """Return one body on each type of joint that has angles."""
    builder = eomgen.SceneBuilder(f"joints_{coordinates}", coordinates=coordinates, gravity=[0.0, 0.0, -0.5])
    for number, (name, (kind, position, velocity, keys)) in enumerate(JOINTS.items()):
        builder.body(f"on_{name}", 1.0, center_of_mass=[0.1, 0.05, 0.02], inertia=BODY["inertia"], group=group)
        axis = [1, 0, 0] if name == "gimbal" else [0, 0.6, 0.8]
        start = {"position": position, "velocity": velocity}
        placed = {"axis": axis, "position": [number, 0, 0], "initial": start}
        builder.joint(name, kind, "base", f"on_{name}", **placed, **keys)
    builder.effort("drive", "gimbal", "-0.02 * q.table[0] + 0.01 * sin(q.sleeve[0])")
    names = ["q.hinge", "q.sleeve[0]", "q.thread", "q.gimbal[0]", "q.gimbal[1]", "q.table[0]"]
    return builder.output("angles", formula=names).build()


@pytest.mark.long_cases("R3xSO3", "SE3")
@pytest.mark.slow
@pytest.mark.parametrize("group", ["SE3", "R3xSO3"])
def test_all_joints_with_angles(group: str) -> None:
    """Several turns of each joint, by the method of order 4: helical joints tie travel to angle all the way."""
    terms = ["forward_dynamics", "outputs", "energy"]
    joints = eomgen.build(all_joints("joint", group), terms, profile="quick", method="rk4")
    expected = joints.simulate(4.0, 1e-3, method="rk4")
    absolute = eomgen.build(all_joints("absolute", group), ["outputs", "energy"], profile="quick")
    assert absolute.angles == ("hinge.angle", "sleeve.angle", "gimbal.angle[0]", "gimbal.angle[1]", "table.angle")
    run = absolute.simulate(4.0, 1e-3, method="rk4_partitioned")
    assert run.success, run.message
    assert np.all(np.ptp(expected.outputs["angles"], axis=0) > [4.0 * np.pi] * 4 + [0.5 * np.pi, 4.0 * np.pi])
    np.testing.assert_allclose(run.outputs["angles"], expected.outputs["angles"], atol=1e-6)
    np.testing.assert_allclose(run.energy["total"], expected.energy["total"], rtol=1e-6)


def test_a_turning_joint_is_judged_beside_constraints_of_velocities_alone() -> None:
    builder = eomgen.SceneBuilder("gear", gravity=[0, 0, 0])
    for name, speed in (("drive", 2.4), ("driven", 1.2)):
        builder.body(name, 1.0, inertia=[0.1, 0.1, 0.1])
        builder.joint(f"{name}_axle", "revolute", "base", name, axis=[0, 0, 1], initial={"velocity": speed})
    builder.constraint("mesh", "formula", velocity_equation="v.drive_axle - 2 * v.driven_axle")
    run = eomgen.build(builder.build(), profile="quick").simulate(10.0, 1e-2)
    assert run.message == "reached t = 10 s in 1000 steps" and run.error.relative < 1e-9
    np.testing.assert_allclose(run.q[-1], [24.0, 12.0], rtol=1e-9)
