"""Constraints and coordinates in scene files: frames as they are written, and where every message points."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from eomgen.errors import DescriptionError, UsageError
from eomgen.formula.nodes import Number, Operation, Symbol
from eomgen.scene.builder import SceneBuilder
from eomgen.scene.joints.frames import check_two_bodies
from eomgen.scene.joints.model import Constraint, Frame, Joint
from eomgen.scene.load import load, load_toml
from eomgen.scene.reading.report import Report
from eomgen.scene.rotations import frame_about, is_rotation
from eomgen.scene.scene import Scene

FOUR_BAR = """\
format = 1
name = "four_bar"
[parameters]
crank = 0.3
[bodies.crank]
mass = 1
inertia = [0.1, 0.1, 0.1]
[bodies.rod]
mass = 2
inertia = [0.1, 0.1, 0.1]
[bodies.plate]
mass = 1
inertia = [0.1, 0.1, 0.1]
[joints]
first = { type = "revolute", parent = "base", child = "crank", axis = [0, 1, 0] }
second = { type = "revolute", parent = "crank", child = "rod", axis = [0, 1, 0], position = ["crank", 0, 0] }
weld = { type = "fixed", parent = "rod", child = "plate" }
[points]
tip = { body = "rod", position = [0, 0, "2*crank"] }
[constraints.loop]
"""
PIN = 'first = { body = "base", axis = [0, 2, 0] }\nsecond = { point = "tip", axis = [0, 1, 0] }\n'
HINGE = 'type = "revolute"\n' + PIN
ABSOLUTE = FOUR_BAR.replace("format = 1", 'format = 1\ncoordinates = "absolute"')
ABSOLUTE = ABSOLUTE.replace("mass = 2", 'mass = 2\ngroup = "R3xSO3"')
ZERO = (Number(0.0),) * 3
UNITS = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def read(loop: str = HINGE, text: str = FOUR_BAR) -> Scene:
    return load_toml(text + loop, file="scene.toml")


def loop(text: str) -> Constraint:
    return read(text).constraints[0]


def problems(loop: str, text: str = FOUR_BAR) -> list[str]:
    with pytest.raises(DescriptionError) as caught:
        read(loop, text)
    return [str(problem) for problem in caught.value.problems]


def test_defaults() -> None:
    scene = load_toml(FOUR_BAR.replace("[constraints.loop]\n", ""))
    assert (scene.coordinates, dict(scene.groups), scene.constraints) == ("joint", {}, ())


def test_frames_by_axis_point_and_rotation() -> None:
    pin = loop(HINGE)
    assert (pin.name, pin.type, pin.drive) == ("loop", "revolute", None)
    assert pin.first == Frame("base", ZERO, pin.second.orientation)
    assert pin.second.body == "rod"
    assert pin.second.position == (*ZERO[:2], Operation("mul", (Number(2.0), Symbol("parameter", "crank"))))
    assert np.array(pin.first.orientation)[:, 2].tolist() == [0.0, 1.0, 0.0]
    turned = loop(
        'type = "prismatic"\nfirst = { body = "crank", position = ["crank", 0, 1], axis = [0, 0, 1], x_axis = [0, 3, 4]'
        ' }\nsecond = { body = "rod", rotation = [{ axis = [0, 0, 1], angle = "pi/2" }] }\n'
    )
    assert turned.first.position == (Symbol("parameter", "crank"), Number(0.0), Number(1.0))
    assert turned.first.orientation == turned.second.orientation == ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    weld = loop('type = "fixed"\nfirst = "tip"\nsecond = { body = "base" }\n')
    assert (weld.first.body, weld.first.orientation, weld.second) == ("rod", UNITS, Frame("base"))


@pytest.mark.parametrize(
    "axis", [*np.eye(3), -np.eye(3)[1], np.array([0.6, 0.0, 0.8]), np.array([2.0, -1.0, 2.0]) / 3.0]
)
def test_frames_about_an_axis(axis: np.ndarray) -> None:
    free, given = frame_about(axis), frame_about(axis, np.array([0.36, 0.48, 0.8]))
    for matrix in (free, given):
        assert is_rotation(matrix)
        np.testing.assert_allclose(matrix[:, 2], axis, atol=1e-15)
    assert given[:, 0] @ np.array([0.36, 0.48, 0.8]) > 0.0
    assert abs(given[:, 1] @ np.array([0.36, 0.48, 0.8])) < 1e-15


TIP = 'first = { point = "tip"'
BASE = 'second = { body = "base" }\n'


@pytest.mark.parametrize(
    ("kind", "keys", "message"),
    [
        ("spherical", 'first = "tip"\nsecond = "base"', 'base is a body, not a point; try: { body = "base" }'),
        ("spherical", f"{TIP}, position = [0, 0, 0] }}\n{BASE}", "first.position): the point gives the position"),
        ("spherical", f"{TIP}, axis = [0, 0, 1] }}\n{BASE}", "first.axis): a spherical constraint has no axis in this"),
        ("spherical", f"{TIP}, x_axis = [0, 0, 1] }}\n{BASE}", "first.x_axis): x_axis has no meaning without axis"),
        ("fixed", f"{TIP}, axis = [0, 1, 0], x_axis = [0, -2, 0] }}\n{BASE}", "first.x_axis): x_axis is parallel"),
        ("fixed", f"{TIP}, axis = [0, 0, 0], x_axis = [1, 0, 0] }}\n{BASE}", "first.axis): the axis has no direction"),
        (
            "distance",
            'first = { body = "crank" }\n' + BASE,
            "loop): a distance constraint needs a length, and the design position gives none: both places are the same",
        ),
    ],
)
def test_one_problem(kind: str, keys: str, message: str) -> None:
    [found] = problems(f'type = "{kind}"\n{keys}\n')
    assert message in found


@pytest.mark.parametrize("seed", range(20))
def test_frames_are_in_one_body_if_fixed_joints_join_their_rigid_bodies(seed: int) -> None:
    """In random trees of rigid bodies and beams, against sets of bodies that are merged by hand."""
    rng = np.random.default_rng(seed)
    bodies = [f"b{number}" for number in range(6)]
    beams = [name for name in bodies if rng.random() < 0.3]
    merged = {name: {name} for name in (*bodies, "base", "world")}
    joints = []
    for number, child in enumerate(bodies):
        parent = ["base", *bodies[:number]][rng.integers(number + 1)]
        moves = bool(rng.random() < 0.4)
        joints.append(cast(Joint, SimpleNamespace(parent=parent, child=child, kind=SimpleNamespace(moves=moves))))
        if not moves and parent not in beams and child not in beams:
            whole = merged[parent] | merged[child]
            merged |= dict.fromkeys(whole, whole)
    for one in (*merged, "unknown"):
        for other in (*merged, "unknown"):
            report = Report("scene.toml", {})
            first, second = (cast(Frame, SimpleNamespace(body=body)) for body in (one, other))
            check_two_bodies([("constraints.loop", (first, second))], joints, beams, report)
            joined = one != "unknown" and other in merged[one] and one not in beams
            assert [problem.what.split(":")[0] for _, problem in report.noted] == (
                ["both frames are in the same rigid body"] if joined else []
            )


def test_a_second_joint_of_a_body_is_no_loop() -> None:
    again = '[joints.again]\ntype = "revolute"\nparent = "base"\nchild = "rod"\naxis = [0, 1, 0]\n'
    (found,) = problems(HINGE + again)
    assert found.endswith("by the joint second; try: one joint for each body, and [constraints] for loop closures")


def test_groups_and_coordinates() -> None:
    text = ABSOLUTE
    scene = read(text=text)
    assert (scene.coordinates, dict(scene.groups)) == ("absolute", {"rod": "R3xSO3"})
    assert load_toml(text + HINGE, coordinates="joint").coordinates == "joint"
    assert load_toml(text + HINGE, coordinates="joint").digest != scene.digest
    (found,) = problems(HINGE, text.replace('"R3xSO3"', '"SO3"'))
    assert "(bodies.rod.group): 'SO3' is not known here; try: one of SE3 or R3xSO3" in found
    (found,) = problems(HINGE, FOUR_BAR.replace("[bodies.plate]", '[bodies.plate]\ngroup = "SE3"'))
    assert "(bodies.plate.group): the body plate has no motion of its own: a fixed joint carries it" in found
    (found,) = problems(HINGE, FOUR_BAR.replace("format = 1", 'format = 1\ncoordinates = "polar"'))
    assert found == "scene.toml:2 (coordinates): 'polar' is not known here; try: one of joint or absolute"


def test_coordinates_of_a_file_are_overridden(tmp_path: Path) -> None:
    path = tmp_path / "four_bar.toml"
    path.write_text(FOUR_BAR + HINGE)
    absolute = load(path, coordinates="absolute")
    assert absolute.coordinates == "absolute"
    assert replace(absolute, coordinates="joint", content=b"") == replace(load(path), content=b"")
    text = FOUR_BAR.replace("format = 1", 'format = 1\ncoordinates = "absolute"')
    assert absolute.digest == load_toml(text + HINGE).digest
    with pytest.raises(UsageError, match="coordinates are 'polar'; try: joint or absolute"):
        load(path, coordinates="polar")  # type: ignore[arg-type]


def test_coordinates_of_a_urdf(tmp_path: Path) -> None:
    inertial = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    joint = '<joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint>'
    path = tmp_path / "arm.urdf"
    path.write_text(f'<robot name="arm"><link name="a"/><link name="b">{inertial}</link>{joint}</robot>')
    assert (load(path).coordinates, load(path, coordinates="absolute").coordinates) == ("joint", "absolute")


def test_a_builder_names_the_line_of_a_mistake() -> None:
    builder = SceneBuilder("four_bar").body("rod", 2, inertia=[0.1, 0.1, 0.1]).joint("free", "free", "base", "rod")
    builder.constraint("length", "distance", {"body": "rod"}, {"body": "base"}, radius=1)
    with pytest.raises(DescriptionError, match=r"\.py:\d+ \(constraints\.length\.radius\): radius has no meaning for"):
        builder.build()


SLIDERS = """format = 1
name = "sliders"
parameters.c = 0.7
inputs.u = { formula = "1.0" }
states.s = { rate = "-s" }
curves.bent = { points = [[0, 0], [1, 2], [3, 2]], interpolation = "linear" }
curves.steps = { points = [[0, 0], [1, 2]], interpolation = "steps" }
bodies.carriage = { mass = 1 }
bodies.bead = { mass = 1 }
joints.x = { type = "prismatic", parent = "base", child = "carriage", axis = [1, 0, 0] }
joints.z = { type = "prismatic", parent = "carriage", child = "bead", axis = [0, 0, 1] }
points.bead = { body = "bead" }
points.peg = { body = "base" }
[constraints.wire]
type = "formula"
"""
_NEEDS = "a constraint needs two derivatives of its equation, and "
_SMOOTH = "; try: a smooth function, such as sqrt(x**2 + d**2) for abs(x)"
_NO_UNIT = "the unit of the equation does not follow from its text; try: unit = "
_FRAMES = 'first = { body = "base" }\nsecond = { body = "bead" }\n'
_ONE_OF = "a formula constraint needs one of equation and velocity_equation, not "
_EXAMPLE = '; try: equation = "q.rod - lift(q.cam)", which is 0 on the constraint'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", f"(constraints.wire): {_ONE_OF}none{_EXAMPLE}"),
        ('equation = "y - q.x"', "wire.equation): unknown name 'y' (column 1)"),
        (f'{_FRAMES}equation = "t - 1"', "the equation names no coordinate, so it holds no motion; try: x, y or z"),
        ('equation = "position.peg[2] - 1"', "wire.equation): the equation names points of the base and of the world"),
        ('equation = "q.z - abs(q.x)"', f"wire.equation): {_NEEDS}abs has a corner{_SMOOTH}"),
        ('equation = "q.z - steps(q.x)"', f'{_NEEDS}steps jumps at 1; try: interpolation = "quintic"'),
        ('equation = "q.z - (q.x > 0)"', f"wire.equation): {_NEEDS}a comparison has a jump{_SMOOTH}"),
        ('equation = "q.z - s"', f"the state 's' cannot be used here: {_NEEDS}the second ones of states are not known"),
        ('velocity_equation = "v.z - sign(q.x) * v.x"', "a constraint needs one derivative of its equation, and sign"),
        ('velocity_equation = "v.z if v.x > 0 else q.x"', "the equation is not linear in velocities"),
        ('velocity_equation = "q.z - q.x"', "the equation names no velocity; try: equation = ... for positions"),
        ('velocity_equation = "t"', "the equation names no velocity, so it holds no motion"),
        (f'{_FRAMES}velocity_equation = "v.z"', "an equation between two frames holds positions alone"),
        ('equation = "q.z = q.x"', 'try: "q.z - (q.x)": the formula is 0 on the constraint'),
        ('velocity_equation = "v.z == 0"', 'try: "v.z": the formula is 0 on the constraint'),
        ('equation = "q.z + t"', "the equation adds q.z in m and t in s; try: a factor that turns one unit into"),
        ('velocity_equation = "q.z * v.x"', f'{_NO_UNIT}"m/s", or "rad/s" of angles and numbers'),
        ('equation = "t + 0 * q.x"', "the equation is in s; try: an equation in m or rad"),
        ('equation = "q.z"\nunit = "rad"', '(constraints.wire.unit): the equation is in m, not in rad; try: "m"'),
        ('equation = "q.z"\nunit = "m/s"', "an equation of positions is in m or rad, not in m/s; try: m"),
        (f'{_FRAMES}equation = "Z - 1"', "wire.equation): unknown name 'Z' (column 1); try: z"),
    ],
)
def test_one_problem_of_a_formula(text: str, message: str) -> None:
    [problem] = problems(text, SLIDERS)
    assert message in problem


SPHERE = ' }\nshape = "sphere"\nradius = 1\n'
TORUS = ', axis = [0, 1, 0], x_axis = [1, 0, 0] }\nshape = "torus"\nradius = 0.1\ntube_radius = 0.2\n'


def rolling(first: str, second: str, rest: str) -> str:
    return f'type = "rolling"\nfirst = {{ body = "{first}", axis = [0, 1, 0] }}\nsecond = {{ body = "{second}"{rest}'


@pytest.mark.parametrize(
    ("text", "note"),
    [
        (rolling("rod", "base", SPHERE), ": second, the base, carries the sphere, and first the plane; try: the body"),
        (rolling("base", "rod", TORUS), ".tube_radius: a tube of radius 0.2 about a centre line of radius 0.1 leaves"),
        (rolling("base", "rod", SPHERE) + 'surface = "stiffness * x"\n', ".surface: the formula is a force (N),"),
    ],
)
def test_doubtful_contacts_are_noted(text: str, note: str) -> None:
    stiffness = '[parameters.stiffness]\nvalue = 1\nunit = "N/m"\n' if "stiffness" in text else ""
    [found] = [each for each in read(text + stiffness).notes if each.startswith("constraints.loop")]
    assert found.startswith(f"constraints.loop{note}")


def test_the_height_of_a_surface_depends_on_its_place_alone() -> None:
    [problem] = problems(f'{rolling("base", "rod", SPHERE)}surface = "q.second"')
    expected = "q.second cannot be used here: the height of a surface depends on x and y (column 1); try: a moving body"
    assert expected in problem


def test_branches_of_a_formula_have_to_meet() -> None:
    """A choice is noted; corners are allowed in factors of velocities, whose rates then jump as forces may."""
    scene = read('equation = "q.z if q.x > 0 else q.z - q.x**3"\nunit = "m"', SLIDERS)
    note = "constraints.wire.equation: the formula has an if, whose branches have to meet with equal values, slopes and"
    assert f"{note} curvatures" in scene.notes
    scene = read('velocity_equation = "v.z - abs(q.x) * v.x"\nunit = "m/s"', SLIDERS)
    assert scene.constraints[0].at_velocity and not any("branches" in note for note in scene.notes)
