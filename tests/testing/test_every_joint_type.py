"""Each row of the table of joint types in all its uses: as written, in joint coordinates, and as a constraint.

Nothing here names a type: what is expected follows from the chain of elementary motions by other means (exponentials of
twists, ranks of matrices), so a new row is tested as it stands.
"""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from eomgen.errors import DescriptionError
from eomgen.mechanics.derive import derive
from eomgen.mechanics.describe import describe
from eomgen.products.pictures.scenery import scenery
from eomgen.products.testing.demands import ContractError
from eomgen.products.testing.joint_types import OWN, check_joint_type, check_poses, exponentials, placed, text
from eomgen.scene.joint_types import CONSTRAINTS, JOINTS, TYPES, ConstraintType, JointType
from eomgen.scene.joints.model import Joint
from eomgen.scene.load import load_toml
from eomgen.scene.scene import Scene
from tests.oracles.evaluation import Array, tape_evaluator
from tests.oracles.states import random_states


def test_a_type_that_does_not_move_is_told() -> None:
    with pytest.raises(ContractError, match="fixed: the type does not move"):
        check_joint_type("fixed")


MOVING = [name for name, row in JOINTS.items() if row.moves]


def joint(kind: str, more: str = "") -> Joint:
    return load_toml(text(kind, more)).joints[-1]


def faults(kind: str, more: str = "", **options: object) -> list[str]:
    with pytest.raises(DescriptionError) as caught:
        load_toml(text(kind, more, **options))  # type: ignore[arg-type]
    return [str(problem) for problem in caught.value.problems]


# -- the table itself --------------------------------------------------------------------------------------------------


def test_every_row_has_its_name_in_the_types_that_users_may_write() -> None:
    assert list(JOINTS) == list(get_args(JointType)) and list(CONSTRAINTS) == list(get_args(ConstraintType))
    assert set(TYPES) == {*JOINTS, *CONSTRAINTS}
    assert {name for name, row in JOINTS.items() if row.rows[0]} == set(JOINTS) & set(CONSTRAINTS)


# -- as written --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", MOVING)
def test_what_has_to_be_written_is_asked_for(kind: str) -> None:
    for key in ("axis",) * bool(JOINTS[kind].coordinates) + JOINTS[kind].needed:
        assert any("needs" in found and kind in found and key in found for found in faults(kind, without=key)), key
    for key in {*OWN} - {"axis", JOINTS[kind].second_key, *JOINTS[kind].needed}:
        assert f"{key} has no meaning for {kind}; try: type = " in faults(kind, f"{key} = {OWN[key]}\n")[0]


@pytest.mark.parametrize("kind", list(JOINTS))
def test_initial_states(kind: str) -> None:
    row = JOINTS[kind]
    given = {"position": [0.1] * row.q_size, "orientation": [1.0, 0.0, 0.0, 0.0], "rotation": []}
    if row.group in ("SO3", "SE3"):
        given["position"] = [0.6, 0.0, 0.8, 0.0] if row.group == "SO3" else [0.1, 0.2, 0.3]
    for key, value in given.items():
        if key in row.starts:
            assert len(joint(kind, f"initial = {{ {key} = {value} }}").initial_position) == row.q_size, key
        else:
            [found, *_] = faults(kind, f"initial = {{ {key} = {value} }}\n" + MOVED)
            assert f"a {kind} joint has no initial {key}" in found
    if not row.moves:
        return
    assert len(joint(kind).initial_position) == row.q_size
    units = [f"{'deg' if unit == 'rad' else 'mm'}/s" for unit in row.units]
    moving = joint(kind, "initial = { velocity = " + str([f"2 {unit}" for unit in units]) + " }").initial_velocity
    assert moving == pytest.approx([2.0 * (np.pi / 180 if unit == "rad" else 1e-3) for unit in row.units])


@pytest.mark.parametrize("kind", list(JOINTS))
def test_springs_limits_and_friction(kind: str) -> None:
    """Of joints whose coordinates are plain numbers, one value for each in its own unit; others have none."""
    row = JOINTS[kind]
    size = max(len(row.coordinates), 1)
    units = ["rad" if unit == "rad" else "m" for unit in row.coordinates.values()]
    stiffness = [f"5 {'N m/deg' if unit == 'rad' else 'N/mm'}" for unit in units] or 5.0
    lower, upper, slow = [f"-7 {unit}" for unit in units] or -7.0, [f"7 {unit}" for unit in units] or 7.0, [0.1] * size
    level = [f"2 {'N m' if unit == 'rad' else 'N'}" for unit in units] or 2.0
    limits = f"limits = {{ lower = {lower}, upper = {upper}, stiffness = {stiffness} }}\n"
    more = f"stiffness = {stiffness}\n{limits}friction = {{ coulomb = {level}, velocity = {slow} }}\n"
    if not row.coordinates:
        assert (
            sum(f"a {kind} joint has no {what}" in found for found in faults(kind, more) for what in ("st", "li", "fr"))
            == 3
        )
        return
    found = joint(kind, more)
    assert [stop.index for stop in found.stops] == [item.index for item in found.friction] == list(range(size))
    expected = [5.0 * 180 / np.pi if unit == "rad" else 5000.0 for unit in units]
    assert [item.value for item in found.each(found.stiffness)] == pytest.approx(expected)  # type: ignore[union-attr]
    assert len(found.lengths()) == 3 * units.count("m")


@pytest.mark.parametrize("kind", MOVING)
def test_followers_and_leaders_have_one_coordinate(kind: str) -> None:
    other = (
        '[joints.next2]\ntype = "prismatic"\nparent = "a"\nchild = "c"\naxis = [1, 0, 0]\nmimic = { joint = "moved" }\n'
    )
    other += "[bodies.c]\nmass = 1.0\n"
    if JOINTS[kind].v_size == 1:
        assert load_toml(text(kind, other)).joints[-1].mimic is not None
    else:
        assert f"the {kind} joint moved has {JOINTS[kind].v_size} coordinates" in faults(kind, other)[0]


@pytest.mark.parametrize("kind", MOVING)
def test_a_joint_that_carries_nothing_is_refused(kind: str) -> None:
    [found] = faults(kind, mass=0.0)
    assert "the joint moved cannot be moved by a force: it carries neither mass nor inertia" in found
    assert found.endswith(JOINTS[kind].light.format("a"))


# -- in joint coordinates ----------------------------------------------------------------------------------------------


@pytest.mark.slow_except("universal")
@pytest.mark.parametrize("kind", MOVING)
def test_sizes_units_and_poses_of_the_model(kind: str, rng: np.random.Generator) -> None:
    check_poses(kind, rng)


@pytest.mark.parametrize("kind", list(JOINTS))
def test_drawings(kind: str) -> None:
    shown = scenery(describe(load_toml(text(kind, "" if JOINTS[kind].moves else MOVED))), {})["joints"][1]
    axes = {axis for motion in JOINTS[kind].chain for axis in motion.axes}
    assert (shown["turns"], shown["slides"]) == JOINTS[kind].drawn
    assert axes == {0} or not (shown["turns"] or shown["slides"])


MOVED = '[joints.last]\ntype = "prismatic"\nparent = "a"\nchild = "c"\naxis = [1, 0, 0]\n[bodies.c]\nmass = 1.0\n'


# -- as a constraint ---------------------------------------------------------------------------------------------------


def absolute(kind: str, rng: np.random.Generator) -> tuple[Scene, object, dict[str, Array], Array]:
    """Return scene, system, a state that meets the joint's rows, and the motions that the joint allows, in body
    axes."""
    scene = load_toml(text(kind, coordinates="absolute"))
    terms = ["constraint", "constraint_jacobian", "joint_velocities"] if JOINTS[kind].rows[0] else ["joint_velocities"]
    system, at_joint = derive(scene, terms), derive(load_toml(text(kind)), ["mass"])
    q = random_states(at_joint, 1, rng)["q"][0]
    here, S = exponentials(scene, q)
    R, p = placed(scene, here)
    center = np.array([0.1, -0.2, 0.15])  # where the body's frame is in absolute coordinates
    state = random_states(system, 1, rng)
    turn = Rotation.from_matrix(R).as_quat()
    state["q"][0, :7] = [turn[3], *turn[:3], *(p + R @ center)]
    moved = S.copy()
    moved[3:] += np.cross(S[:3].T, center).T
    return scene, system, state, moved


@pytest.mark.slow_except("spherical")
@pytest.mark.parametrize("kind", [kind for kind in MOVING if JOINTS[kind].rows[0]])
def test_rows_of_the_joint_between_absolute_bodies(kind: str, rng: np.random.Generator) -> None:
    """They vanish where the joint can be, hold exactly what it does not leave free, and are as many as their rank."""
    _, system, state, motions = absolute(kind, rng)
    evaluate = tape_evaluator(system)  # type: ignore[arg-type]
    phi, B = evaluate("constraint", state)["Phi"][0], evaluate("constraint_jacobian", state)["B"][0]
    np.testing.assert_allclose(phi, 0.0, atol=1e-12)
    assert len(phi) == JOINTS[kind].rows[0] == np.linalg.matrix_rank(B)
    np.testing.assert_allclose(B @ motions, 0.0, atol=1e-8)


@pytest.mark.slow_except("spherical")
@pytest.mark.parametrize("kind", MOVING)
def test_velocities_of_the_joint_between_absolute_bodies(kind: str, rng: np.random.Generator) -> None:
    """On motions that the joint allows they are those of joint coordinates."""
    _, system, state, motions = absolute(kind, rng)
    found = tape_evaluator(system)("joint_velocities", state)["Pv"][0]  # type: ignore[arg-type]
    np.testing.assert_allclose(found @ motions, np.eye(JOINTS[kind].v_size), atol=1e-8)


@pytest.mark.slow_except("helical")
@pytest.mark.parametrize("kind", [kind for kind in MOVING if JOINTS[kind].coordinates])
def test_coordinates_of_the_joint_between_absolute_bodies(kind: str, rng: np.random.Generator) -> None:
    """A formula reads the same q.moved and v.moved in both coordinates."""
    row = JOINTS[kind]
    names = ["moved"] if row.v_size == 1 else [f"moved[{k}]" for k in range(row.v_size)]
    outputs = "[outputs]\n" + "".join(
        f'o{k}{x} = {{ formula = "{x}.{name}" }}\n' for x in "qv" for k, name in enumerate(names)
    )
    scene, at_joint = load_toml(text(kind, outputs, coordinates="absolute")), load_toml(text(kind, outputs))
    system = derive(scene, ["outputs"])
    _, _, state, motions = absolute(kind, np.random.default_rng(3))
    known = random_states(derive(at_joint, ["mass"]), 1, np.random.default_rng(3))
    own = random_states(system, 1, rng)
    own["q"][0, :7], own["v"][0] = state["q"][0, :7], motions @ known["v"][0]
    own["q"][0, 7:] = known["q"][0, list(row.counted)] + 0.2  # references of angles that are counted
    found = tape_evaluator(system)("outputs", own)["y"][0]
    np.testing.assert_allclose(found, [*known["q"][0], *known["v"][0]], atol=1e-8)


@pytest.mark.slow
def test_types_of_constraints_say_what_they_use_of_their_frames() -> None:
    """What is written of a frame beyond that is refused nowhere, and what is missing is asked for."""
    body = '[constraints.c]\ntype = "{}"\nfirst = {{ body = "base" }}\nsecond = {{ body = "a" }}\n'
    for kind, row in CONSTRAINTS.items():
        needed = {"length": "length = 1.0\n", "radius": "radius = 1.0\n", "pitch": "pitch = 0.1\n"}
        needed["equation"] = 'equation = "z"\nunit = "m"\n'
        more = body.format(kind) + "".join(line for key, line in needed.items() if key in row.constraint_keys)
        uses = zip(("first", "second"), row.uses, strict=True)
        asked = [side for side, need in uses if need in ("z", "x and z")]
        found = faults("free", more) if asked else [str(load_toml(text("free", more)).constraints[0].type)]
        assert all(any(f"constraints.c.{side}" in line for line in found) for side in asked), kind
