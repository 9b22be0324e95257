"""Comparisons of machines as numbers: frames of bodies change no answer, and each planted number is named with both
values in the frames of the first."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from eomgen.base.data import replace
from eomgen.products.comparison.differences import Pairing, differences, of_solids
from eomgen.products.comparison.machine import (
    AT_ORIGIN,
    Forces,
    Machine,
    MachineBody,
    MachineLink,
    MachineLoop,
    Placement,
)
from eomgen.products.comparison.states import errors_of, motions
from eomgen.scene.inertia import Inertia


def placed(turn: tuple[float, ...] = (), at: tuple[float, ...] = (0.0, 0.0, 0.0)) -> Placement:
    """Return the place of a frame that is turned by a rotation vector, rad, at a position, m."""
    return Placement(Rotation.from_rotvec(turn or (0.0, 0.0, 0.0)).as_matrix(), np.array(at))


def body(
    mass: float, center: tuple[float, ...], moments: tuple[float, ...], place: Placement = AT_ORIGIN
) -> MachineBody:
    return MachineBody(Inertia(mass, np.array(center), np.diag(moments)), place, "" if place is AT_ORIGIN else "glue")


HINGED = {"stiffness": 2.0, "damping": 0.5, "rotor_inertia": 0.1, "coulomb": 0.2, "lower": -1.0, "upper": 2.0}
AXIS = np.array([0.6, 0.0, 0.8])
TOOL = placed((0.1, 0.0, -0.4), (0.0, 0.2, 0.1))
#: An arm on a hinge with a glued tool; on it a slide, on this a ball; a free body beside.
LINKS = (
    MachineLink("hinge", "revolute", "arm", -1, placed((0.3, -0.2, 0.5), (0.1, 0.2, 0.3)), AXIS, None,
                {"arm": body(3.0, (0.1, 0.0, 0.2), (0.3, 0.4, 0.5)),
                 "tool": body(0.5, (0.0, 0.1, 0.0), (0.01, 0.02, 0.025), TOOL)}, HINGED),
    MachineLink("slide", "prismatic", "sled", 0, placed((0.0, 0.7, 0.2), (0.5, 0.0, 0.1)), np.eye(3)[1], None,
                {"sled": body(2.0, (0.0, 0.0, -0.1), (0.1, 0.2, 0.25))}, {"damping": 0.7, "mimic": ""}),
    MachineLink("ball", "spherical", "head", 1, placed((0.4, 0.1, 0.0), (0.0, 0.3, 0.2)), None, None,
                {"head": body(1.0, (0.05, 0.0, 0.1), (0.02, 0.03, 0.04))}, {}),
    MachineLink("fly", "free", "bee", -1, AT_ORIGIN, None, None,
                {"bee": body(0.2, (0.0, 0.0, 0.01), (0.001, 0.002, 0.0025))}, {}),
)  # fmt: skip  # a table
LOOPS = (
    MachineLoop("pin", "revolute", [(1, placed((0.2, 0.0, 0.0), (0.1, 0.0, 0.0))),
                                    (2, placed((0.0, 0.3, 0.0), (0.0, 0.0, 0.2)))], ("z", "x and z"), {"pitch": 0.25}),
    MachineLoop("weld", "fixed", [(2, placed((), (0.0, 0.1, 0.0))), (3, placed((0.0, 0.0, 0.5)))], ("", ""), {}),
)  # fmt: skip  # a table


def nowhere(motion: Any) -> Forces:
    raise AssertionError(motion)


MACHINE = Machine("first", np.array([0.0, 0.0, -9.81]), LINKS, LOOPS, (), lambda key: f"first:{key}", nowhere)
#: Frames of the links in the ones of MACHINE: along and about an axis, and anywhere, if the joint allows this.
FRAMES = {
    0: Placement(Rotation.from_rotvec(0.9 * AXIS).as_matrix(), 0.3 * AXIS),
    1: placed((0.5, -0.3, 0.2), (0.1, 0.2, -0.3)),
    2: placed((-0.4, 0.2, 0.6)),
    3: placed((0.2, 0.8, -0.1), (0.3, -0.2, 0.1)),
}


def reframed(machine: Machine, frames: Mapping[int, Placement] = FRAMES) -> Machine:
    """Return the same machine with other frames of links."""
    links = []
    for number, link in enumerate(machine.links):
        frame, carrier = frames[number], frames.get(link.parent, AT_ORIGIN)
        bodies = {name: item._replace(place=frame.inverse().then(item.place)) for name, item in link.bodies.items()}
        axis = None if link.axis is None else frame.axes.T @ link.axis
        links.append(replace(link, pose=carrier.inverse().then(link.pose).then(frame), axis=axis, bodies=bodies))
    loops = [
        replace(loop, ends=[(number, frames[number].inverse().then(end)) for number, end in loop.ends])
        for loop in machine.loops or ()
    ]
    return replace(machine, name="second", links=tuple(links), loops=tuple(loops), place=lambda key: f"second:{key}")


def found(second: Machine) -> list[Any]:
    return differences(Pairing(MACHINE, second, 1e-9))


def test_frames_of_links_change_no_answer() -> None:
    pairing = Pairing(MACHINE, reframed(MACHINE), 1e-12)
    assert differences(pairing) == []
    assert not pairing.same_frames and pairing.comparable
    assert pairing.length == pytest.approx(0.26**0.5)  # of the slide from the hinge
    for number, frame in FRAMES.items():
        np.testing.assert_allclose(pairing.aligned[number].axes, frame.axes, atol=1e-14)
        np.testing.assert_allclose(pairing.aligned[number].origin, frame.origin, atol=1e-14)
    assert found(replace(MACHINE, links=LINKS)) == []


def link(number: int, **changes: Any) -> Callable[[Machine], Machine]:
    """Return the function that changes a link of a machine."""

    def change(machine: Machine) -> Machine:
        links = list(machine.links)
        links[number] = replace(links[number], **changes)
        return replace(machine, links=tuple(links))

    return change


def loop(number: int, **changes: Any) -> Callable[[Machine], Machine]:
    def change(machine: Machine) -> Machine:
        loops = list(machine.loops or ())
        loops[number] = replace(loops[number], **changes)
        return replace(machine, loops=tuple(loops))

    return change


def arm(**changes: Any) -> Callable[[Machine], Machine]:
    """Return the function that changes the mass properties of the arm."""
    bodies = LINKS[0].bodies
    return link(0, bodies={**bodies, "arm": bodies["arm"]._replace(inertia=replace(bodies["arm"].inertia, **changes))})


MOVED = placed((0.3, -0.2, 0.5), (0.1, 0.2, 0.4))
TILTED = np.array([0.0, 0.6, 0.8])
#: Changes of the machine, and element, quantity, both values and unit of what is named first.
PLANTED: Mapping[str, tuple[Callable[[Machine], Machine], str, str, Any, Any, str]] = {
    "mass": (arm(mass=3.5), "bodies.arm", "mass", 3.0, 3.5, "kg"),
    "center": (arm(center=np.array([0.1, 0.0, 0.25])), "bodies.arm", "center_of_mass",
               (0.1, 0.0, 0.2), (0.1, 0.0, 0.25), "m"),
    "inertia": (arm(about_center=np.diag([0.3, 0.4, 0.6])), "bodies.arm", "inertia",
                (0.3, 0.4, 0.5, 0.0, 0.0, 0.0), (0.3, 0.4, 0.6, 0.0, 0.0, 0.0), "kg m^2"),
    "damping": (link(0, numbers=HINGED | {"damping": 0.6}), "joints.hinge", "damping", 0.5, 0.6, "N m s/rad"),
    "damper of a slide": (link(1, numbers={"damping": 0.6, "mimic": ""}), "joints.slide", "damping", 0.7, 0.6, "N s/m"),
    "mimic": (link(1, numbers={"damping": 0.7, "mimic": "hinge"}), "joints.slide", "mimic", "", "hinge", ""),
    "friction": (link(0, numbers=HINGED | {"coulomb": 0.0}), "joints.hinge", "coulomb", 0.2, 0.0, "N m"),
    "no limit": (link(0, numbers=HINGED | {"upper": np.inf}), "joints.hinge", "upper", 2.0, None, "rad"),
    "type": (link(1, type="cylindrical"), "joints.slide", "type", "prismatic", "cylindrical", ""),
    "parent": (link(2, parent=0), "joints.ball", "parent", "sled", "arm", ""),
    "gravity": (lambda machine: replace(machine, gravity=np.array([0.0, 0.0, 9.81])), "gravity", "gravity",
                (0.0, 0.0, -9.81), (0.0, 0.0, 9.81), "m/s^2"),
    "type of a loop": (loop(0, type="cylindrical"), "constraints.pin", "type", "revolute", "cylindrical", ""),
    "number of a loop": (loop(0, numbers={"pitch": 0.5}), "constraints.pin", "pitch", 0.25, 0.5, ""),
    "no loop": (lambda machine: replace(machine, loops=machine.loops[:1]), "constraints.weld", "constraint",
                "fixed", None, ""),
    "body of a loop": (loop(1, ends=[LOOPS[1].ends[0], (1, LOOPS[1].ends[1][1])]), "constraints.weld", "second body",
                       "bee", "sled", ""),
    "no joint": (lambda machine: replace(machine, links=machine.links[:3], loops=machine.loops[:1]), "joints.fly",
                 "joint", "free", None, ""),
}  # fmt: skip  # a table


@pytest.mark.parametrize("frames", ["equal", "other"])
@pytest.mark.parametrize("name", PLANTED)
def test_a_planted_number_is_named_first_with_both_values(name: str, frames: str) -> None:
    change, element, quantity, first, second, unit = PLANTED[name]
    named = found(reframed(change(MACHINE)) if frames == "other" else change(MACHINE))
    if frames == "other" and name == "parent":  # a joint on another link has no frame to be compared in
        named = [item for item in named if item.quantity == "parent"]
    one = named[0]
    assert (one.element, one.quantity, one.unit) == (element, quantity, unit)
    for value, expected in ((one.first, first), (one.second, second)):
        if isinstance(expected, tuple | float):
            np.testing.assert_allclose(value, expected, atol=1e-12)
        else:
            assert value == expected
    if name not in ("type", "parent", "no joint"):
        assert len(named) == 1 or name == "body of a loop"


def test_limits_and_friction_are_named_last() -> None:
    second = replace(link(0, numbers=HINGED | {"coulomb": 1.0, "lower": 0.0})(MACHINE), gravity=np.zeros(3))
    second = replace(second, loops=LOOPS[:1])
    names = [f"{item.element} {item.quantity}" for item in found(second)]
    assert names == ["gravity gravity", "constraints.weld constraint", "joints.hinge coulomb", "joints.hinge lower"]


GLUED = LINKS[0].bodies | {"tool": LINKS[0].bodies["tool"]._replace(place=placed((0.1, 0.0, -0.4), (0.0, 0.2, 0.2)))}
TURNED = placed((0.3, -0.2, 0.9), (0.1, 0.2, 0.3))


@pytest.mark.parametrize(
    ("change", "element", "quantity", "first", "second"),
    [
        (link(0, axis=TILTED), "joints.hinge", "axis", AXIS, TILTED),
        (link(0, pose=MOVED), "joints.hinge", "position", (0.1, 0.2, 0.3), (0.1, 0.2, 0.4)),
        (link(0, pose=TURNED), "joints.hinge", "orientation", LINKS[0].pose.axes.ravel(), TURNED.axes.ravel()),
        (link(0, bodies=GLUED), "joints.glue", "position", (0.0, 0.2, 0.1), (0.0, 0.2, 0.2)),
        (link(1, pose=LINKS[1].pose._replace(origin=np.array([0.5, 0.0, 0.3]))), "joints.slide", "position",
         (0.5, 0.0, 0.1), (0.5, 0.0, 0.3)),
        (link(2, pose=LINKS[2].pose._replace(origin=np.array([0.0, 0.3, 0.5]))), "joints.ball", "position",
         (0.0, 0.3, 0.2), (0.0, 0.3, 0.5)),
        (loop(0, ends=[LOOPS[0].ends[0], (2, placed((0.0, 0.3, 0.0), (0.0, 0.0, 0.4)))]), "constraints.pin",
         "second position", (0.0, 0.0, 0.2), (0.0, 0.0, 0.4)),
        (loop(0, ends=[(1, placed((0.0, 0.0, 0.0), (0.1, 0.0, 0.0))), LOOPS[0].ends[1]]), "constraints.pin",
         "first axis", (0.0, -np.sin(0.2), np.cos(0.2)), (0.0, 0.0, 1.0)),
        (loop(1, ends=[LOOPS[1].ends[0], (3, placed((0.0, 0.0, -0.5)))]), "constraints.weld", "orientation",
         *(placed((0.0, 0.0, angle)).axes.ravel() for angle in (-0.5, 0.5))),
    ],
)  # fmt: skip  # a table
def test_a_moved_place_is_the_only_difference(
    change: Callable[[Machine], Machine], element: str, quantity: str, first: Any, second: Any
) -> None:
    (one,) = found(change(MACHINE))
    assert (one.element, one.quantity) == (element, quantity)
    np.testing.assert_allclose(one.first, first, atol=1e-12)
    np.testing.assert_allclose(one.second, second, atol=1e-12)


def test_a_free_body_may_begin_anywhere() -> None:
    assert found(link(3, pose=placed((0.1, 0.2, 0.3), (1.0, 2.0, 3.0)))(MACHINE)) == []


def test_bodies_that_are_known_by_mass_and_moments() -> None:
    """Moments in any order of axes; a moment of zero, as in a plane, says nothing of the others."""
    solids = {"arm": (3.0, np.array([0.3, 0.4, 0.5])), "bee": (0.2, np.array([0.0, 0.0, 0.1]))}
    assert of_solids(Pairing(MACHINE, replace(MACHINE, solids=solids), 1e-9)) == []
    wrong = {"arm": (3.1, np.array([0.3, 0.4, 0.6])), "head": (1.0, np.array([0.02, 0.03, 0.05]))}
    named = of_solids(Pairing(MACHINE, replace(MACHINE, solids=wrong), 1e-9))
    assert [(item.element, item.quantity) for item in named] == [
        ("bodies.arm", "mass"), ("bodies.arm", "principal moments"), ("bodies.head", "principal moments"),
    ]  # fmt: skip  # pairs
    np.testing.assert_allclose([named[2].first, named[2].second], [[0.02, 0.03, 0.04], [0.02, 0.03, 0.05]])


def test_joints_are_paired_by_their_names_and_then_by_bodies() -> None:
    links = (replace(LINKS[3], joint="a"), replace(LINKS[0], joint="b"))
    pairing = Pairing(MACHINE, replace(MACHINE, links=links), 1e-9)
    assert pairing.pairs == [(0, 1), (3, 0)] and not pairing.comparable
    assert [pairing.partner_of(number) for number in (-1, 0, 1)] == [-1, 1, -2]


#: Places of the links of MACHINE in the second machine, and the columns of the velocities of its links.
ORDER = (1, 2, 3, 0)
COLUMNS = (slice(6, 7), slice(7, 8), slice(8, 11), slice(0, 6))


def second_machine() -> Machine:
    """Return the machine with other frames and another order of links."""
    links = reframed(MACHINE).links
    links = (links[3], links[0], replace(links[1], parent=1), replace(links[2], parent=2))
    return replace(MACHINE, links=links, loops=None, inputs=("b", "c"))


def transform() -> np.ndarray:
    """Return the matrix from velocities of MACHINE, link by link, to the ones of the second machine: an angular
    velocity in other axes, and the velocity of another point in these."""
    result = np.zeros((11, 11))
    result[6, 0] = result[7, 1] = 1.0
    result[8:11, 2:5] = FRAMES[2].axes.T
    x, y, z = FRAMES[3].origin
    R, arm = FRAMES[3].axes, np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    result[:6, 5:] = np.block([[R.T, np.zeros((3, 3))], [-R.T @ arm, R.T]])
    return result


def aligned_pairing() -> Pairing:
    pairing = Pairing(replace(MACHINE, loops=None, inputs=("a", "b")), second_machine(), 1e-9)
    assert differences(pairing) == []
    return pairing


def moved(pose: Placement, q: np.ndarray) -> Placement:
    """Return the place of the link of a ball or a free body."""
    turn = Rotation.from_quat(q[:4], scalar_first=True).as_matrix()
    return pose.then(Placement(turn, q[4:] if len(q) == 7 else np.zeros(3)))


def test_random_states_are_the_same_in_both_machines() -> None:
    pairing = aligned_pairing()
    first, second = motions(pairing, 200, np.random.default_rng(3))
    assert first.inputs.keys() == second.inputs.keys() == {"b"} and first.inputs["b"] is second.inputs["b"]
    for number, carrier in ((2, FRAMES[1]), (3, AT_ORIGIN)):
        other, frame = ORDER[number], FRAMES[number]
        for q, theirs in zip(first.q[number][:5], second.q[other], strict=False):
            mine = moved(MACHINE.links[number].pose, q).then(frame)
            same = carrier.then(moved(pairing.second.links[other].pose, theirs))
            np.testing.assert_allclose(mine.axes, same.axes, atol=1e-13)
            np.testing.assert_allclose(mine.origin, same.origin, atol=1e-13)
    v = np.concatenate([np.atleast_2d(each) for each in first.v], axis=1)
    np.testing.assert_allclose(np.concatenate(second.v, axis=1), v @ transform().T, atol=1e-13)
    for number, low, high in ((0, -1.0, 1.5), (1, -0.5, 0.5)):
        q = first.q[number]
        assert low <= q.min() < low + 0.1 and high - 0.1 < q.max() <= high
        np.testing.assert_array_equal(q, second.q[ORDER[number]])
    pairing.second = link(1, numbers=HINGED | {"upper": 0.5})(pairing.second)
    q = motions(pairing, 200, np.random.default_rng(3))[0].q[0]
    assert q.min() >= -1.0 and 0.4 < q.max() <= 0.5
    held = link(1, held=True)
    pairing = Pairing(held(MACHINE), held(MACHINE), 1e-9)
    assert differences(pairing) == []
    first, _ = motions(pairing, 2, np.random.default_rng(3))
    assert [each.shape for each in first.v] == [(2, 1), (2, 0), (2, 3), (2, 6)]


def terms(transformed: np.ndarray | None = None) -> Forces:
    """Return terms at five states, in other velocities if a matrix to the present ones is given."""
    random = np.random.default_rng(7)
    root = random.normal(size=(5, 11, 11))
    bias, force = random.normal(size=(2, 5, 11))
    T = np.eye(11) if transformed is None else transformed
    bias, force = bias @ T, force @ T
    return Forces(T.T @ root @ root.transpose(0, 2, 1) @ T, bias, force, bias - force)


def test_terms_in_other_frames_and_orders_are_equal() -> None:
    pairing, mine, theirs = aligned_pairing(), terms(transform()), terms()
    errors, worst = errors_of(pairing, mine, theirs)
    assert errors.keys() == {"mass matrix", "bias", "force"} and max(errors.values()) < 1e-13
    sums, _ = errors_of(pairing, mine, theirs._replace(bias=None, force=None))
    assert sums.keys() == {"mass matrix", "sum"} and max(sums.values()) < 1e-13
    assert [item.quantity for item in worst] == ["mass matrix", "bias", "force"]


def test_an_entry_that_differs_is_named_with_its_part_of_the_size() -> None:
    """Of the mass matrix by the roots of the diagonal, of forces by the largest ones of all states."""
    pairing, theirs = aligned_pairing(), terms()
    mine = terms(transform())
    assert mine.bias is not None and mine.force is not None
    mass, bias = mine.mass.copy(), mine.bias.copy()
    mass[2, 0, 1] += 0.01 * np.sqrt(mass[2, 0, 0] * mass[2, 1, 1])
    bias[3, 1] += 0.02
    errors, worst = errors_of(pairing, mine._replace(mass=mass, bias=bias), theirs)
    assert errors["mass matrix"] == pytest.approx(0.01, rel=1e-9)
    size = np.abs(mine.total[:, 1]).max() + np.abs(bias[:, 1]).max()
    assert errors["bias"] == pytest.approx(0.02 / size, rel=1e-9) and errors["force"] < 1e-13
    assert [(item.element, item.quantity) for item in worst[:2]] == [
        ("M[hinge, slide]", "mass matrix"),
        ("v.slide", "bias"),
    ]
    np.testing.assert_allclose([worst[0].first, worst[0].second], [mass[2, 0, 1], mine.mass[2, 0, 1]])
    np.testing.assert_allclose([worst[1].first, worst[1].second], [bias[3, 1], mine.bias[3, 1]])
