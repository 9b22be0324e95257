"""Texts of refused scenes, each from one change of a small scene that is in order."""

from __future__ import annotations

import copy
from typing import Any

import pytest

from eomgen.errors import DescriptionError
from eomgen.scene.load import from_data

RIG: dict[str, Any] = {
    "format": 1,
    "name": "rig",
    "bodies": {"arm": {"mass": 1, "inertia": [1, 1, 1]}, "box": {"mass": 1, "inertia": [1, 1, 1]}},
    "joints": {
        "hinge": {"type": "revolute", "parent": "base", "child": "arm", "axis": [0, 1, 0]},
        "slide": {"type": "prismatic", "parent": "arm", "child": "box", "axis": [1, 0, 0]},
    },
    "points": {"tip": {"body": "arm", "position": [1, 0, 0]}},
}
Changes = tuple[tuple[str, Any], ...]


def changed(changes: Changes) -> dict[str, Any]:
    """Return the rig with other values at places such as ``joints/hinge/axis``; None removes a key."""
    data = copy.deepcopy(RIG)
    for place, value in changes:
        *way, last = place.split("/")
        at = data
        for key in way:
            at = at.setdefault(key, {})
        if value is None:
            del at[last]
        else:
            at[last] = value
    return data


REFUSED: dict[str, tuple[Changes, list[str]]] = {
    "alpha and rho": (
        (("simulation", {"method": "hht", "rho_inf": 0.5, "alpha": 0.1}),),
        ["(simulation.alpha): alpha and rho_inf say the same: rho_inf = (1 - alpha)/(1 + alpha); try: one of them"],
    ),
    "rho above": (
        (("simulation", {"rho_inf": 1.01}),),
        ["(simulation.rho_inf): rho_inf 1.01 is not between 0 and 1; try: 0.8"],
    ),
    "duration": (
        (("simulation", {"duration": -0.1}),),
        ["(simulation.duration): the duration -0.1 is negative; try: 0 or more"],
    ),
    "effort event": (
        (("events/stop", {"when": "drive_effort.hinge - 3"}),),
        ['(events.stop): drive_effort.hinge: hinge has no drive; try: drive = "0.5 * t"'],
    ),
    "effort event near": (
        (("joints/hinge/drive", "0.5*t"), ("events/stop", {"when": "drive_effort.hing - 3"})),
        ["(events.stop.when): drive_effort.hing: there is no drive 'hing' (column 1); try: hinge"],
    ),
    "friction": (
        (("joints/hinge/friction", {"coulomb": 0.1, "velocity": 0.01, "static": 0.2}),),
        ["(joints.hinge.friction): static also needs stribeck; try: stribeck = 0.05"],
    ),
    "friction2": (
        (("joints/hinge/friction", {"coulomb": 0.1, "velocity": 0.01, "stribeck": 0.2}),),
        ["(joints.hinge.friction): stribeck also needs static; try: static = the effort that breaks it loose"],
    ),
    "no axis": (
        (("joints/hinge/axis", None),),
        ["(joints.hinge): a revolute joint needs an axis; try: axis = [0, 0, 1]"],
    ),
    "fixed axis": (
        (("joints/slide/type", "fixed"),),
        ["(joints.slide.axis): a fixed joint has no axis; try: rotation, for its placement"],
    ),
    "second": (
        (("joints/hinge/second_axis", [1, 0, 0]),),
        ["(joints.hinge.second_axis): second_axis has no meaning for revolute; try: type = universal"],
    ),
    "pitch": (
        (("joints/slide/type", "helical"),),
        ["(joints.slide): the type helical needs the key pitch; try: pitch = 0.01"],
    ),
    "damping of fixed": (
        (("joints/slide/type", "fixed"), ("joints/slide/axis", None), ("joints/slide/damping", 1)),
        ["(joints.slide.damping): a fixed joint has no damping; try: an effort or a force"],
    ),
    "damping of two": (
        (("joints/hinge/damping", [1, 2]),),
        ["(joints.hinge.damping): the damping of a revolute joint needs one value, not 2"],
    ),
    "damping of universal": (
        (
            ("joints/hinge/type", "universal"),
            ("joints/hinge/second_axis", [1, 0, 0]),
            ("joints/hinge/damping", [1, 2, 3]),
        ),
        ["(joints.hinge.damping): the damping of a universal joint needs 2 values (first angle, second angle), not 3"],
    ),
    "drive of fixed": (
        (("joints/slide/type", "fixed"), ("joints/slide/axis", None), ("joints/slide/drive", "t")),
        ["(joints.slide.drive): a fixed joint has no coordinates that a drive could prescribe; try: a revolute joint"],
    ),
    "drive of two": (
        (("joints/hinge/drive", ["t", "t"]),),
        ["(joints.hinge.drive): the drive of a revolute joint needs one value, not 2"],
    ),
    "drive mimic": (
        (("joints/slide/mimic", {"joint": "hinge"}), ("joints/slide/drive", "t")),
        ["(joints.slide.drive): a joint that follows another cannot be driven; try: the drive of hinge"],
    ),
    "quaternion": (
        (
            ("joints/hinge/type", "spherical"),
            ("joints/hinge/axis", None),
            ("joints/hinge/initial", {"position": [1, 0, 0, 0], "rotation": [{"axis": [1, 0, 0], "angle": 0.1}]}),
        ),
        ["(joints.hinge.initial.rotation): position and rotation both give the orientation; try: one of them"],
    ),
    "orientation": (
        (
            ("joints/hinge/orientation", [[1, 0, 0], [0, 1, 0], [0, 0, 1]]),
            ("joints/hinge/rotation", [{"axis": [1, 0, 0], "angle": 0.1}]),
        ),
        ["(joints.hinge.orientation): orientation and rotation are both given; try: one of them"],
    ),
    "matrix": (
        (("joints/hinge/orientation", [[1, 0, 0], [0, 1, 0], [0, 0, -1]]),),
        [
            "(joints.hinge.orientation): the axes are left-handed, as of a mirror: the determinant is -1;"
            " try: one of the axes reversed"
        ],
    ),
    "matrix2": (
        (("joints/hinge/orientation", [[1, 0, 0], [0, 1, 2e-06], [0, 0, 1]]),),
        [
            "(joints.hinge.orientation): the matrix is not a rotation: orthonormal and right-handed to 1e-6;"
            " try: rotation"
        ],
    ),
    "x_axis": (
        (
            (
                "constraints/c",
                {"type": "prismatic", "first": {"body": "box", "x_axis": [1, 0, 0]}, "second": {"body": "base"}},
            ),
        ),
        [
            "(constraints.c.first.x_axis): x_axis has no meaning without axis, the z axis of the frame; try:"
            " axis = [0, 0, 1]",
            "(constraints.c.second): a prismatic constraint needs the axes of this frame; try: axis = [0, 0,"
            " 1], x_axis = [1, 0, 0], or rotation",
        ],
    ),
    "torsion": (
        (("torsion_springs/t", {"first": "slide", "second": "hinge", "stiffness": 1}),),
        ["(torsion_springs.t.first): the joint slide is prismatic and has no angle; try: a revolute joint"],
    ),
    "torsion index": (
        (("torsion_springs/t", {"first": "hinge", "first_index": 1, "second": "hinge", "stiffness": 1}),),
        ["(torsion_springs.t.first_index): the revolute joint hinge has no angle 1; try: 0"],
    ),
    "force on point": (
        (("forces/f", {"body": "tip", "force": [1, 0, 0]}),),
        ['(forces.f.body): tip is a point of arm, not a body; try: body = "arm", and the position of tip as point'],
    ),
    "force on base": (
        (("forces/f", {"body": "base", "force": [1, 0, 0]}),),
        ["(forces.f.body): a force on the base has no effect: its motion is prescribed; try: a body"],
    ),
    "force on world": (
        (("forces/f", {"body": "world", "force": [1, 0, 0]}),),
        ["(forces.f.body): a force on the world has no effect: it rests; try: a body"],
    ),
    "road speed": (
        (("inputs/u", {"road": {"class": "C", "speed": 0, "seed": 1}}),),
        ["(inputs.u.road.speed): the speed 0 m/s is not between 0 and 10000; try: a speed such as 20"],
    ),
    "road offset": (
        (("inputs/u", {"road": {"class": "C", "speed": 10, "seed": 1, "offset": 1100000.0}}),),
        [
            "(inputs.u.road.offset): the offset 1.1e+06 m is beyond 1000000 m, where phases lose their digits;"
            " try: the distance in m by which this wheel follows the first"
        ],
    ),
    "feedback outputs": (
        (
            (
                "controllers/f",
                {"type": "state_feedback", "coordinates": ["hinge"], "outputs": [], "position_gains": {"hinge": [1]}},
            ),
        ),
        ["(controllers.f.outputs): the list of outputs is empty; try: no outputs: then there is one, called f"],
    ),
    "feedback outputs2": (
        (
            (
                "controllers/f",
                {
                    "type": "state_feedback",
                    "coordinates": ["hinge"],
                    "outputs": ["a", "a"],
                    "position_gains": {"hinge": [1, 2]},
                },
            ),
        ),
        ["(controllers.f.outputs[1]): the output a is named twice; try: each output once"],
    ),
    "feedback count": (
        (
            (
                "controllers/f",
                {
                    "type": "state_feedback",
                    "coordinates": ["hinge"],
                    "outputs": ["a", "b"],
                    "position_gains": {"hinge": [1]},
                },
            ),
        ),
        ["(controllers.f.position_gains.hinge): 1 gain given for 2 outputs; try: one gain for each output"],
    ),
    "weight": (
        (
            (
                "controllers/f",
                {
                    "type": "state_feedback",
                    "coordinates": ["hinge", "slide"],
                    "calibration": {"method": "lqr", "position_weights": {"hinge": -1}},
                },
            ),
        ),
        ["(controllers.f.calibration.position_weights.hinge): the weight -1 is negative; try: 0 or more"],
    ),
    "efforts": (
        (
            (
                "controllers/f",
                {
                    "type": "state_feedback",
                    "coordinates": ["hinge", "slide"],
                    "calibration": {"method": "lqr", "position_weights": {"hinge": 1}, "effort_weights": [1, 2]},
                },
            ),
        ),
        ["(controllers.f.calibration.effort_weights): 2 numbers given for 1 output; try: a list of 1"],
    ),
    "efforts0": (
        (
            (
                "controllers/f",
                {
                    "type": "state_feedback",
                    "coordinates": ["hinge", "slide"],
                    "calibration": {"method": "imsc", "modes": [1], "frequencies": [0.0], "damping_ratios": [0.5]},
                },
            ),
        ),
        [
            "(controllers.f.calibration): the method imsc needs the key effort_weights; try: effort_weights = 1e-3",
            "(controllers.f.calibration.frequencies): frequencies has no meaning for imsc; try: method ="
            " pole_placement",
            "(controllers.f.calibration.damping_ratios): damping_ratios has no meaning for imsc; try: method ="
            " pole_placement",
            "(controllers.f.calibration.frequencies[0]): frequencies of 0 is not allowed; try: a number above 0",
        ],
    ),
    "weights of none": (
        (
            (
                "controllers/f",
                {
                    "type": "state_feedback",
                    "coordinates": ["hinge", "slide"],
                    "calibration": {"method": "lqr", "output_weights": {"y": 1}},
                },
            ),
        ),
        ["(controllers.f.calibration.output_weights.y): there is no output 'y'; try: without output_weights"],
    ),
    "repeat": (
        (("repeat/r", {"indices": {"i": "a"}, "bodies": {"b{i}": {"mass": 1, "inertia": [1, 1, 1]}}}),),
        [
            "(repeat.r.indices.i): an index counts by whole numbers, and here is 'a'; try: indices = { i = 10 }"
            " for i from 0 to 9, or { i = [1, 9] } for 1 to 9"
        ],
    ),
    "repeat empty": (
        (("repeat/r", {"indices": {"i": [3, 1]}, "bodies": {"b{i}": {"mass": 1, "inertia": [1, 1, 1]}}}),),
        [
            "(repeat.r.indices.i): the index i takes no number from 3 to 1; try: indices = { i = 10 } for i"
            " from 0 to 9, or { i = [1, 9] } for 1 to 9"
        ],
    ),
    "repeat name": (
        (("repeat/r", {"indices": {"1i": 3}, "bodies": {"b": {"mass": 1, "inertia": [1, 1, 1]}}}),),
        [
            "(repeat.r.indices): the index '1i' is not a name; try: up to 64 ASCII letters, digits and"
            " underscores, no digit first"
        ],
    ),
    "repeat none": (
        (("repeat/r", {"bodies": {"b": {"mass": 1, "inertia": [1, 1, 1]}}}),),
        [
            "(repeat.r.indices): the key indices is missing; try: indices = { i = 10 } for i from 0 to 9, or {"
            " i = [1, 9] } for 1 to 9"
        ],
    ),
    "formula with unit": (
        (("joints/hinge/drive", "3 deg * t"),),
        [
            "(joints.hinge.drive): '3 deg * t' is a formula, and formulas take numbers in SI, without units;"
            ' try: "0.0523599 * t"'
        ],
    ),
    "beam area": (
        (
            (
                "beams/b",
                {
                    "length": 1,
                    "section": {"density": 1000.0, "elastic_modulus": 1000000000.0},
                    "bending_z": {"modes": 1},
                },
            ),
            ("joints/w", {"type": "fixed", "parent": "base", "child": "b"}),
        ),
        ["(beams.b.section): the key area is missing; try: area = ..., or a shape"],
    ),
    "shape size": (
        (
            (
                "beams/b",
                {
                    "length": 1,
                    "section": {
                        "shape": "rectangle",
                        "width": 0.1,
                        "diameter": 2,
                        "density": 1000.0,
                        "elastic_modulus": 1000000000.0,
                    },
                    "bending_z": {"modes": 1},
                },
            ),
            ("joints/w", {"type": "fixed", "parent": "base", "child": "b"}),
        ),
        [
            "(beams.b.section.diameter): a rectangle has no diameter; try: width, height",
            "(beams.b.section): a rectangle needs its height; try: height = 0.02",
        ],
    ),
    "reference": (
        (
            ("references/r", {"position": {"ball": "0"}}),
            ("joints/ball", {"type": "spherical", "parent": "base", "child": "arm"}),
            ("joints/hinge", None),
        ),
        ["(references.r.position.ball): a spherical joint has not one coordinate; try: a joint of one coordinate"],
    ),
    "group": (
        (("joints/slide/type", "fixed"), ("joints/slide/axis", None), ("bodies/box/group", "SE3")),
        [
            "(bodies.box.group): the body box has no motion of its own: a fixed joint carries it; try: the"
            " group of the body that carries it"
        ],
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_change_is_refused_in_these_words(name: str) -> None:
    changes, texts = REFUSED[name]
    with pytest.raises(DescriptionError) as caught:
        from_data(changed(changes))
    assert [str(problem).removeprefix("scene ") for problem in caught.value.problems] == texts


TAKEN: dict[str, tuple[Changes, list[str]]] = {
    "rho at": ((("simulation", {"rho_inf": 1.0}),), []),
    "duration 0": ((("simulation", {"duration": 0}),), []),
    "effort event driven": ((("joints/hinge/drive", "0.5*t"), ("events/stop", {"when": "drive_effort.hinge - 3"})), []),
    "smooth": (
        (("joints/hinge/drive", "0.1*t"), ("joints/hinge/smooth", 0.1)),
        ["joints.hinge.drive: smooth has no effect, since the law has no jumps and no kinks"],
    ),
    "far points": (
        (("points/tip/position", [1e200, 0, 0]), ("points/end", {"body": "box", "position": [1e200, 0, 0]})),
        [],
    ),
}


@pytest.mark.parametrize("name", TAKEN)
def test_a_change_within_the_bounds_is_taken_with_these_notes(name: str) -> None:
    changes, notes = TAKEN[name]
    assert list(from_data(changed(changes)).notes) == notes


@pytest.mark.parametrize(
    ("data", "problem"),
    [
        ({1: 2}, "scene ('1'): the key '1' is unknown here [E0722]"),
        ({"bodies": {"rod": {2: 1.0}}}, "scene (bodies.rod[2]): a text is needed here, not 2 [E1475]"),
    ],
)
def test_numbers_as_keys_of_a_mapping_are_refused(data: dict[Any, Any], problem: str) -> None:
    with pytest.raises(DescriptionError) as refused:
        from_data({"format": 1, "name": "one", **data})
    one = refused.value.problems[0]
    assert f"{one.where}: {one.what} [{one.code}]" == problem
