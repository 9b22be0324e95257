"""Frames by name: poses, Jacobians, their rates and drifts in three references, and inverse operational-space inertias.

Oracles: complex steps of the poses and of the Jacobians.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from eomgen.errors import DescriptionError
from eomgen.formula.nodes import Number
from eomgen.mechanics.derive import derive
from eomgen.scene.builder import SceneBuilder
from eomgen.scene.load import load, load_toml
from eomgen.scene.scene import Scene
from eomgen.system.terms import REFERENCES
from tests.mechanics.checks import states_of
from tests.mechanics.test_jacobians import in_absolute_coordinates, scene_of
from tests.oracles.evaluation import relative_error, tape_evaluator
from tests.oracles.pinocchio_oracle import robot_file
from tests.oracles.states import angular_velocity, derivative, jacobian, rotation_of

KINDS = ("frame_jacobians", "frame_jacobian_rates", "frame_drifts")
TERMS = ["frame_poses", *(f"{kind}{ending}" for kind in KINDS for ending, _ in REFERENCES.values())]


def with_frames(scene: Scene, *, absolute: bool) -> Scene:
    """Return a scene with a turned frame on each body, on the base and in the world."""
    carriers = [*(body.name for body in scene.bodies), "base", "world"]
    place = (Number(0.3), Number(-0.2), Number(0.1))
    turned = load(robot_file("ur_description/urdf/ur5_robot.urdf"))
    tool = next(frame for frame in turned.frames if frame.name == "tool0")
    frames = tuple(replace(tool, name=f"on_{name}", body=name, position=place) for name in carriers)
    return replace(in_absolute_coordinates(scene) if absolute else scene, frames=frames)


def check_by_complex_steps(scene: Scene, rng: np.random.Generator, reach: float = 1.0) -> None:
    """Jacobians against complex steps of the poses, and their rates against complex steps of the Jacobians."""
    system = derive(scene, [*TERMS, "mass", "frame_mobilities"])
    evaluate, state = tape_evaluator(system), states_of(system, rng)
    state["q"] = reach * state["q"] if reach != 1.0 else state["q"]
    poses = evaluate("frame_poses", state)["frame_pose"]
    rates = jacobian(evaluate, system.factors, "frame_poses", "frame_pose", state, "q")
    v = state["v"]
    along = {"q": v, "t": np.ones((4, 1))}
    for k, name in enumerate(system.frames):
        own = angular_velocity(poses[:, k, :4, np.newaxis], rates[:, k, :4], axis=1)
        R, velocity = rotation_of(poses[:, k, :4]), rates[:, k, 4:]
        turned = R @ own
        at = np.broadcast_to(poses[:, k, 4:, np.newaxis], velocity.shape)
        expected = {
            "": np.concatenate([own, np.swapaxes(R, -1, -2) @ velocity], axis=1),
            "_aligned": np.concatenate([turned, velocity], axis=1),
            "_world": np.concatenate([turned, velocity + np.cross(at, turned, axis=1)], axis=1),
        }
        for ending, J in expected.items():
            found = evaluate(f"frame_jacobians{ending}", state)["J"][:, k]
            assert relative_error(found, J, 2, floor=1e-3) <= 1e-12, (name, ending)
            rate = derivative(evaluate, system.factors, f"frame_jacobians{ending}", state, along)["J"][:, k]
            found = evaluate(f"frame_jacobian_rates{ending}", state)["J_dot"][:, k]
            assert relative_error(found, rate, 2, floor=1e-3) <= 1e-12, (name, ending)
            found = evaluate(f"frame_drifts{ending}", state)["drift"][:, k]
            assert relative_error(found, np.einsum("sij,sj->si", rate, v), floor=1e-3) <= 1e-11, (name, ending)
    if "frame_mobilities" in system.functions:
        J, M = evaluate("frame_jacobians_aligned", state)["J"], evaluate("mass", state)["M"][:, np.newaxis]
        mobility = J @ np.linalg.solve(M, np.swapaxes(J, -1, -2))
        (found,) = evaluate("frame_mobilities", state).values()
        assert relative_error(found, mobility, 3) <= 1e-10


@pytest.mark.slow_except("1-False", "2-True")
@pytest.mark.parametrize(("seed", "absolute"), [(0, True), (1, False), (2, True), (3, False)])
def test_by_complex_steps(seed: int, absolute: bool, rng: np.random.Generator) -> None:
    check_by_complex_steps(with_frames(scene_of(seed), absolute=absolute), rng)


def test_a_frame_on_a_base_that_moves_and_turns(rng: np.random.Generator) -> None:
    builder = SceneBuilder("shaken").base(["0.3 * sin(2 * t)", "t", "0.2 * t**2"], [([1, 2, 3], "0.7 * t")])
    builder.body("rod", 1.0, inertia=[0.1, 0.2, 0.25]).joint("hinge", "revolute", "base", "rod", axis=[0, 1, 1])
    builder.frame("tip", "rod", [1.0, 0.2, -0.3], rotation=[{"axis": [0, 1, 0], "angle": 0.4}])
    check_by_complex_steps(builder.build(), rng)


def test_frames_on_a_beam(rng: np.random.Generator) -> None:
    builder = SceneBuilder("mast").beam(
        "mast",
        1.0,
        mass_per_length=2.0,
        bending_y={"modes": 2, "stiffness": 100.0},
        stretch={"modes": 1, "stiffness": 1e4},
    )
    builder.joint("hinge", "revolute", "base", "mast", axis=[0, 0, 1])
    builder.frame("tip", "mast", [1.0, 0.0, 0.0], rotation=[{"axis": [0, 1, 0], "angle": 0.4}])
    builder.body("bob", 0.5, inertia=[0.1, 0.1, 0.2]).joint(
        "pin", "revolute", "mast", "bob", axis=[1, 2, 0], position=[1.0, 0.0, 0.0]
    )
    check_by_complex_steps(builder.build(), rng, reach=0.01)


#: term, exact operations for the flange of the Panda and the tool of the UR5
COUNTS = {
    "frame_poses": (236, 155),
    "frame_jacobians": (280, 112),
    "frame_jacobians_aligned": (169, 128),
    "frame_jacobians_world": (147, 108),
    "frame_jacobian_rates": (609, 281),
    "frame_jacobian_rates_aligned": (466, 345),
    "frame_jacobian_rates_world": (418, 302),
    "frame_drifts": (243, 199),
    "frame_drifts_aligned": (305, 259),
    "frame_drifts_world": (444, 397),
    "frame_mobilities": (1255, 737),
}


@pytest.mark.parametrize("term", COUNTS)
def test_number_of_operations(term: str) -> None:
    panda = load(robot_file("panda_description/urdf/panda.urdf"), task_frames=["panda_hand_tcp"])
    ur5 = load(robot_file("ur_description/urdf/ur5_robot.urdf"), task_frames=["tool0"])
    found = tuple(derive(scene, [term]).counts[term].flops for scene in (panda, ur5))
    assert found == COUNTS[term]


BROKEN = """\
format = 1
name = "arm"
task_frames = ["tol"]
[bodies.link]
mass = 1
inertia = [1, 1, 1]
[joints.hinge]
type = "revolute"
parent = "base"
child = "link"
axis = [0, 1, 0]
[points.tip]
body = "link"
[frames.tip]
body = "link"
[frames.link]
body = "link"
[frames.tool]
body = "lnk"
orientation = [[1, 0, 0], [0, 1, 0], [0, 0, -1]]
"""


def test_what_is_said_of_mistakes() -> None:
    with pytest.raises(DescriptionError) as caught:
        load_toml(BROKEN, file="arm.toml")
    said = str(caught.value)
    assert "arm.toml:3 (task_frames[0]): there is no body or frame 'tol'; try: tool" in said
    assert (
        "arm.toml:14 (frames.tip): the name tip is both a point and a frame; try: the frame alone: its origin" in said
    )
    assert (
        "arm.toml:16 (frames.link): the name link is both a body and a frame; try: another name for the frame" in said
    )
    assert "arm.toml:19 (frames.tool.body): there is no body 'lnk'; try: link" in said
    assert "arm.toml:20 (frames.tool.orientation): the axes are left-handed: the determinant is -1" in said
