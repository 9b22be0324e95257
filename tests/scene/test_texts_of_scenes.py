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


def changed(**changes: Any) -> dict[str, Any]:
    """Return the rig with other values at places such as ``joints__hinge__axis``; None removes a key."""
    data = copy.deepcopy(RIG)
    for place, value in changes.items():
        *way, last = place.split("__")
        at = data
        for key in way:
            at = at.setdefault(key, {})
        if value is None:
            del at[last]
        else:
            at[last] = value
    return data


def feedback(outputs: list[str], gains: list[float]) -> dict[str, Any]:
    return changed(
        controllers__f={
            "type": "state_feedback",
            "coordinates": ["hinge"],
            "outputs": outputs,
            "position_gains": {"hinge": gains},
        }
    )


WELD: dict[str, Any] = {"joints__slide__type": "fixed", "joints__slide__axis": None}
TURN = [{"axis": [1, 0, 0], "angle": 0.1}]
BALL = {"type": "spherical", "parent": "base", "child": "arm"}
SECTION = {"density": 1e3, "elastic_modulus": 1e9}
BEAM = {"length": 1, "section": SECTION, "bending_z": {"modes": 1}}
REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "alpha and rho": (
        changed(simulation={"method": "hht", "rho_inf": 0.5, "alpha": 0.1}),
        "(simulation.alpha): alpha and rho_inf say the same: rho_inf = (1 - alpha)/(1 + alpha); try: one of them",
    ),
    "effort event": (
        changed(events__stop={"when": "drive_effort.hinge - 3"}),
        '(events.stop): drive_effort.hinge: hinge has no drive; try: drive = "0.5 * t"',
    ),
    "drive of fixed": (
        changed(**WELD, joints__slide__drive="t"),
        "(joints.slide.drive): a fixed joint has no drive; try: a bushing, an effort or a force; or a revolute joint",
    ),
    "drive mimic": (
        changed(joints__slide__mimic={"joint": "hinge"}, joints__slide__drive="t"),
        "(joints.slide.drive): a joint that follows another cannot be driven; try: the drive of hinge",
    ),
    "quaternion": (
        changed(joints__hinge={**BALL, "initial": {"position": [1, 0, 0, 0], "rotation": TURN}}),
        "(joints.hinge.initial.rotation): position and rotation both give the orientation; try: one of them",
    ),
    "orientation": (
        changed(joints__hinge__orientation=[[1, 0, 0], [0, 1, 0], [0, 0, 1]], joints__hinge__rotation=TURN),
        "(joints.hinge.orientation): orientation and rotation are both given; try: one of them",
    ),
    "force on point": (
        changed(forces__f={"body": "tip", "force": [1, 0, 0]}),
        '(forces.f.body): tip is a point of arm, not a body; try: body = "arm", and the position of tip as point',
    ),
    "no outputs": (
        feedback([], [1]),
        "(controllers.f.outputs): the list of outputs is empty; try: no outputs: then there is one, called f",
    ),
    "equal outputs": (
        feedback(["a", "a"], [1, 2]),
        "(controllers.f.outputs[1]): the output a is named twice; try: each output once",
    ),
    "name of an index": (
        changed(repeat__r={"indices": {"1i": 3}, "bodies": {"b": {"mass": 1}}}),
        "(repeat.r.indices): the index '1i' is not a name; try: up to 64 ASCII letters, digits and underscores,"
        " no digit first",
    ),
    "formula with unit": (
        changed(joints__hinge__drive="3 deg * t"),
        "(joints.hinge.drive): '3 deg * t' is a formula, and formulas take numbers in SI, without units;"
        ' try: "0.0523599 * t"',
    ),
    "area": (
        changed(beams__b=BEAM, joints__w={"type": "fixed", "parent": "base", "child": "b"}),
        "(beams.b.section): the key area is missing; try: area = ..., or a shape",
    ),
    "reference": (
        changed(references__r={"position": {"ball": "0"}}, joints__ball=BALL, joints__hinge=None),
        "(references.r.position.ball): a spherical joint has not one coordinate; try: a joint of one coordinate",
    ),
}


@pytest.mark.parametrize(("data", "text"), REFUSED.values(), ids=REFUSED)
def test_a_change_is_refused_in_these_words(data: dict[str, Any], text: str) -> None:
    with pytest.raises(DescriptionError) as caught:
        from_data(data)
    assert [str(problem).removeprefix("scene ") for problem in caught.value.problems] == [text]


TAKEN: dict[str, tuple[dict[str, Any], list[str]]] = {
    "rho at": (changed(simulation={"rho_inf": 1.0}), []),
    "duration 0": (changed(simulation={"duration": 0}), []),
    "effort event": (changed(joints__hinge__drive="0.5*t", events__stop={"when": "drive_effort.hinge - 3"}), []),
    "smooth": (
        changed(joints__hinge__drive="0.1*t", joints__hinge__smooth=0.1),
        ["joints.hinge.drive: smooth has no effect, since the law has no jumps and no kinks"],
    ),
    "far points": (
        changed(points__tip__position=[1e200, 0, 0], points__end={"body": "box", "position": [1e200, 0, 0]}),
        [],
    ),
}


@pytest.mark.parametrize(("data", "notes"), TAKEN.values(), ids=TAKEN)
def test_a_change_within_the_bounds_is_taken_with_these_notes(data: dict[str, Any], notes: list[str]) -> None:
    assert list(from_data(data).notes) == notes
