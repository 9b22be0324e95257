"""Notes on doubtful values of scenes, on both sides of their limits: lengths beyond the scene, heavy bodies, delays of
many samples, beams, springs, tyres."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

import eomgen
from eomgen.formula.nodes import Number
from eomgen.lie.numeric import rotation_matrix
from eomgen.products.doubts import out_of_scale as scale
from eomgen.products.doubts.out_of_scale import _Arm
from eomgen.scene.document.notes import initial_places
from eomgen.scene.joint_types import JOINTS
from tests.models.library import scene

VALUES = cast(Any, SimpleNamespace(value=lambda formula: formula.value, parameters={}))


def arms(*lengths: float) -> list[_Arm]:
    return [_Arm(f"points.p{k}.position", "the point", length, k != 3) for k, length in enumerate(lengths)]


def test_few_lengths_a_hundred_times_as_long_as_the_others_are_told_with_the_size_of_the_rest() -> None:
    for lengths, far in (
        ((100.0, 1.0, 0.5), 1),
        ((500.0, 300.0, 1.0, 0.5), 2),
        ((500.0, 300.0, 1.0), 0),  # two of three are not few
        ((100.0, 1.0), 0),  # one length is no scale
        ((100.0, 1.0, 0.9e-3), 0),  # nor are lengths below a millimetre
        ((), 0),
    ):
        given = arms(*lengths)
        assert scale._far(given) == given[:far] and scale._far(given[::-1]) == given[:far]
    given = arms(500.0, 1.0, 2.0, 300.0)  # the last one does not move
    (told,) = scale._far_places([given[0], given[3]], given)
    assert told.startswith("points.p0.position: the point is 500 m from the body's origin, and all else is within 2 m")


@pytest.mark.parametrize(
    ("key", "length", "well_known", "told"),
    [
        ("springs.s.length", 200.0, True, True),
        ("bodies.b.inertia", 20.0, True, True),
        ("bodies.b.inertia", 20.0, False, False),
        ("beams.b.rotary_inertia", 2.0, False, True),
        ("springs.s.length", math.inf, True, False),
    ],
)
def test_lengths_beyond_the_scene_are_told(key: str, length: float, well_known: bool, told: bool) -> None:
    notes = scale._too_long([(key, "the length", length, "m")], 2.0, well_known=well_known)
    said = f"{key}: the length is {length:.3g} m, and the scene is no larger than 2 m"
    assert [note.startswith(said) for note in notes] == [True] * told


@pytest.mark.parametrize(("inertia", "told"), [(0.01, "0.4 m"), (54.0, "0.402 m"), (64.0, ""), (0.0, "")])
def test_bodies_denser_than_any_material_are_told_by_their_largest_cube(inertia: float, told: str) -> None:
    """By reach, 2 * 0.2 m, or by the box of the inertia: of a cube of mass m and side a it is m a^2 / 6."""
    data = scene("pendulum", bodies__rod={"mass": 2e3, "inertia": [inertia] * 3, "center_of_mass": [0.2, 0, 0]})
    said = f"bodies.rod.mass: the mass is 2000 kg, and a cube of {told}, the size of the body, has less of any"
    notes = [note for note in eomgen.load(data).notes if note.startswith("bodies.rod.mass")]
    assert [note.startswith(said) for note in notes] == [True] * bool(told)


def body(name: str, mass: float, largest: float, node_of: str = "") -> Any:
    inertia = tuple(Number(part) for part in (0.5 * largest, largest, 0.1, 0.0, 0.0, 0.0))
    return SimpleNamespace(name=name, mass=Number(mass), inertia=inertia, beam=None, node_of=node_of)


def test_lengths_are_radii_of_gyration_springs_and_tyres() -> None:
    bodies = [body("a", 2.0, 8.0), body("b", 0.0, 8.0)]
    bodies += [body("rope", 4.0, 4.0, "rope"), body("rope.1", 4.0, 4.0, "rope")]
    found = [*scale._lengths(bodies, (), (), VALUES)]
    assert found == [
        ("bodies.a.inertia", "the radius of gyration", 2.0, "kg m^2"),
        ("beams.rope.rotary_inertia", "the radius of gyration of the sections", 1.0, "kg m"),
    ]
    assert len([*scale._lengths(bodies, (), ("rope",), VALUES)]) == 1


@pytest.mark.parametrize(
    ("delay", "sample", "period", "told"),
    [
        (5, 0.1, 0.1, ["controllers.servo.delay: the delay 5 is 5 s, 50 samples"]),
        (5.5, 0.1, 0.1, []),  # no whole number
        ("5 s", 0.1, 0.1, []),
        (0.1, 10, 10.0, ["controllers.servo.sample: the time between two samples is 10 s"]),
        (0.1, "20 s", 20.0, []),
    ],
)
def test_delays_of_many_samples_and_rare_samples_are_told(
    delay: Any, sample: Any, period: float, told: list[str]
) -> None:
    document = SimpleNamespace(section=lambda name: {"servo": SimpleNamespace(sample=period)} if "con" in name else {})
    data = {"controllers": {"servo": {"delay": delay, "sample": sample}}}
    notes = scale.doubtful_times(cast(Any, SimpleNamespace(data=data, document=document)))
    assert [note.partition(";")[0].partition(": times")[0] for note in notes] == told


def joint(kind: str, q: tuple[float, ...], parent: str = "base", child: str = "arm", **more: Any) -> Any:
    fields = {"type": kind, "initial_position": q, "axis": (0.0, 0.0, 1.0), "parent": parent, "child": child}
    fields |= {"kind": JOINTS[kind], "second_axis": (1.0, 0.0, 0.0), "pitch": Number(0.0)}
    fields |= {"mimic": None, "drive": (), "position": tuple(map(Number, (1.0, 2.0, 3.0))), "orientation": np.eye(3)}
    return SimpleNamespace(**{**fields, **more})


def test_places_at_the_start_follow_from_joints() -> None:
    half = (math.cos(0.3), 0.0, math.sin(0.3), 0.0)
    tilted = rotation_matrix(np.array(half))
    chain = [
        joint("revolute", (0.5,)),
        joint("prismatic", (0.25,), "arm", "slide", axis=(1.0, 0.0, 0.0), orientation=tilted),
        joint("free", (*half, 4.0, 5.0, 6.0), "base", "bird"),
        joint("spherical", (1.0, 0.0, 0.0, 0.0), "base", "ball"),
        joint("planar", (0.0, 0.0, 0.0), "base", "puck"),
        joint("revolute", (0.0,), "base", "led", mimic="hinge"),
        joint("revolute", (0.0,), "base", "driven", drive=("t",)),
        joint("revolute", (0.0,), "ball", "beyond"),
    ]
    found = initial_places(cast(Any, chain), VALUES)
    assert set(found) == {"arm", "slide", "bird", "ball", "puck", "beyond"}
    turn = np.array([[math.cos(0.5), -math.sin(0.5), 0.0], [math.sin(0.5), math.cos(0.5), 0.0], [0.0, 0.0, 1.0]])
    np.testing.assert_allclose(found["arm"][0], turn, atol=1e-15)
    np.testing.assert_allclose(found["arm"][1], [1.0, 2.0, 3.0])
    along = turn @ tilted @ np.array([0.25, 0.0, 0.0])
    np.testing.assert_allclose(found["slide"][1], [1.0, 2.0, 3.0] + turn @ [1.0, 2.0, 3.0] + along)
    np.testing.assert_allclose(found["slide"][0], turn @ tilted)
    np.testing.assert_allclose(found["bird"][0], tilted)
    np.testing.assert_allclose(found["bird"][1], [5.0, 7.0, 9.0])


def test_negative_springs_and_dampers_are_told_with_their_sign_turned() -> None:
    given = {"joints__hinge__damping": -0.5, "joints__hinge__stiffness": -2}
    assert list(eomgen.load(scene("pendulum", **given)).notes) == [
        "joints.hinge.damping: the damping -0.5 is negative, and adds energy to every motion; 0.5 takes it away",
        "joints.hinge.stiffness: the stiffness -2 is negative, and pushes away from where the spring is slack; 2"
        " pulls back",
    ]
    assert not eomgen.load(scene("pendulum", **dict.fromkeys(given, 0))).notes


@pytest.mark.parametrize(
    ("formula", "number"),
    [("q.hinge > 30", 30), ("-200 * (q.hinge - 30)", 30), ("-90 < q.hinge", -90), ("v.hinge > 30", 0), ("30 > 6", 0)],
)
def test_angles_against_numbers_of_more_than_a_turn_are_told(formula: str, number: float) -> None:
    notes = eomgen.load(scene("pendulum", definitions={"hit": formula})).notes
    said = f"definitions.hit: q.hinge stands against {number} rad, {abs(number) / (2 * math.pi):.3g} turns"
    assert [note.startswith(said) for note in notes if "stands against" in note] == [True] * bool(number)


@pytest.mark.parametrize(("value", "unit", "told"), [(400.0, "m", True), (4.0, "m", False), (400.0, "N", False)])
def test_parameters_in_m_beyond_the_scene_are_told(value: float, unit: str, told: bool) -> None:
    drive = {"joint": "hinge", "effort": "r * t"}
    data = scene("pendulum", parameters={"r": {"value": value, "unit": unit}}, efforts={"drive": drive})
    assert any(note.startswith("parameters.r: the length is 400 m") for note in eomgen.load(data).notes) == told
