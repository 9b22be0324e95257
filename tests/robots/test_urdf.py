"""URDF: placements and merged inertias as Pinocchio has them, and a note for everything that is changed or left out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

import eomgen
from eomgen.errors import DescriptionError, UsageError
from eomgen.formula.evaluate import evaluate
from eomgen.formula.nodes import Formula
from eomgen.scene.load import load
from eomgen.scene.scene import Scene
from tests.models.urdf import ARM, FILES, ROBOTS, load_urdf, replaced
from tests.robots.tables import table


def numbers(formulas: tuple[Formula, ...]) -> np.ndarray:
    def no_symbols(symbol: object) -> float:
        raise AssertionError(symbol)

    return np.array([evaluate(formula, no_symbols) for formula in formulas])


def assert_agrees(scene: Scene, model: pin.Model) -> None:
    """Hold placements, parents and the inertias of merged bodies to Pinocchio's."""
    bodies = {body.name: body for body in scene.bodies}
    carried_by = {joint.child: joint.name for joint in scene.joints}
    assert sorted(carried_by.values()) == sorted(model.names[1:])
    for joint in scene.joints:
        index = model.getJointId(joint.name)
        assert model.names[model.parents[index]] == carried_by.get(joint.parent, "universe")
        placement = model.jointPlacements[index]
        np.testing.assert_allclose(joint.orientation, placement.rotation, atol=1e-9)
        np.testing.assert_allclose(numbers(joint.position), placement.translation, atol=1e-12)
        body, expected = bodies[joint.child], model.inertias[index]
        xx, yy, zz, xy, xz, yz = numbers(body.inertia)
        inertia = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
        assert evaluate(body.mass, lambda _: 0.0) == pytest.approx(expected.mass, rel=1e-12)
        np.testing.assert_allclose(numbers(body.center_of_mass), expected.lever, atol=1e-10)
        np.testing.assert_allclose(inertia, expected.inertia, atol=1e-9 * max(1.0, float(np.max(expected.inertia))))


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("root", ["fixed", "free"])
def test_agrees_with_pinocchio(name: str, root: str) -> None:
    path = ROBOTS / FILES[name]
    model = (
        pin.buildModelFromUrdf(str(path), pin.JointModelFreeFlyer())
        if root == "free"
        else pin.buildModelFromUrdf(str(path))
    )
    assert_agrees(load(path, root=root), model)


def refusals(text: str, **options: object) -> list[str]:
    with pytest.raises(DescriptionError) as caught:
        load_urdf(text, file="arm.urdf", **options)  # type: ignore[arg-type]
    assert str(caught.value).isascii()
    return [str(problem) for problem in caught.value.problems]


def test_merging_by_hand() -> None:
    # lower's inertia in its link: turned by 90 degrees about x; in upper: by 90 degrees about z as well, at height 1 +
    # 1
    scene = load_urdf(ARM, file="arm.urdf")
    (joint,), (body,) = scene.joints, scene.bodies
    assert (joint.type, joint.parent, joint.child, joint.axis) == ("revolute", "base", "upper", (0.0, 1.0, 0.0))
    assert numbers((joint.damping,)) == [0.5]
    assert numbers((body.mass,)) == [3.0]
    np.testing.assert_allclose(numbers(body.center_of_mass), [0.0, 0.0, 1.0], atol=1e-15)
    # about the common centre: masses 2 and 1 at distances 0.5 and 1; lower's xx, yy, zz = 2.5, 1, 2 and yz = -0.25
    # become xz
    steiner = 2 * 0.25 + 1 * 1.0
    np.testing.assert_allclose(
        numbers(body.inertia), [1 + 2.5 + steiner, 1 + 1 + steiner, 0.5 + 2, 0, 0.25, 0], atol=1e-12
    )
    assert scene.source["joints.shoulder"] == "arm.urdf:12"
    assert [(point.name, point.body, *numbers(point.position)) for point in scene.points] == [
        ("foot", "base", 0.0, 0.0, 0.0),
        ("lower", "upper", 0.0, 0.0, 1.0),
    ]
    assert scene.notes == (
        "the root link foot is fixed to the base, and so are the links fixed to it",
        "links merged into the bodies that carry them, as frames: foot, lower",
    )


def test_a_link_named_base() -> None:
    text = ARM.replace('"foot"', '"base"')
    assert next(point.name for point in load_urdf(text).points) == "base"
    scene = load_urdf(text, root="free")
    assert scene.joints[0].child == "base_link"
    assert scene.joints[1].parent == "base_link"
    assert (
        scene.notes[0]
        == "the link base is the body base_link, because base is the name of the frame that carries the tree"
    )


def test_right_angles_are_exact_only_where_they_are_meant() -> None:
    def orientation(roll: str) -> tuple[tuple[float, ...], ...]:
        text = replaced('<child link="upper"/>', f'<child link="upper"/><origin rpy="{roll} 0 0"/>')
        return load_urdf(text).joints[0].orientation

    assert orientation("1.57079632679") == ((1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0))
    assert orientation("-3.14159265359") == ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0))
    assert 1e-7 < orientation("1.5707962")[1][1] < 1e-6


def test_impossible_inertias_are_noted_by_link() -> None:
    text = replaced('ixx="1" iyy="1" izz="0.5"', 'ixx="1" iyy="1" izz="2.5"')
    fault = "violate the triangle inequality: the largest exceeds the sum of the other two by 25 %"
    note = f"link upper: the principal moments 1, 1, 2.5 {fault}"
    assert note in load_urdf(text).notes
    assert refusals(text, strict=True) == [f"arm.urdf:4: {note}; try: no --strict (strict=False), to go on without"]


def test_names_are_made_legal() -> None:
    text = ARM.replace('"upper"', '"upper-arm"').replace('"lower"', '"upper arm"').replace('"shoulder"', '"1/*{{x}}*/"')
    scene = load_urdf(text.replace('name="arm"', 'name="../my arm"'))
    assert scene.name == "___my_arm"
    assert (scene.joints[0].name, scene.joints[0].child) == ("_1____x____", "upper_arm")
    assert [point.name for point in scene.points] == ["foot", "upper_arm_2"]
    note = "names made legal: 'upper-arm' is upper_arm, 'upper arm' is upper_arm_2, '1/*{{x}}*/' is _1____x____"
    assert note in scene.notes
    assert len(load_urdf(ARM.replace('"upper"', f'"{"x" * 10_000}"')).joints[0].child) <= 64


def test_options() -> None:
    with pytest.raises(UsageError, match="has no joint 'sholder' to lock; try: shoulder"):
        load_urdf(ARM, lock=["sholder"])
    with pytest.raises(UsageError, match="root is 'floating'; try: fixed or free"):
        load_urdf(ARM, root="floating")


DEEP = ("</robot>", "<a>" * 200 + "</a>" * 200 + "</robot>", "arm.urdf:18: elements are nested more than 100 deep")


@pytest.mark.parametrize(("old", "new", "message"), [*table("faults_of_urdf"), DEEP])
def test_refusals(old: str, new: str, message: str) -> None:
    found = refusals(replaced(old, new))
    assert any(message in problem for problem in found), found


def test_other_roots_of_the_document() -> None:
    assert refusals("<mujoco/>") == ["arm.urdf:1: the outermost element is 'mujoco', not 'robot'; try: a URDF file"]
    assert refusals("<robot/>")[0].startswith("arm.urdf:1: the robot has no link")


def test_notes_of_a_model_are_of_the_present_text(tmp_path: Path) -> None:
    """All texts have the same equations, so the library of the first one is in the cache."""
    file, digests = tmp_path / "arm.urdf", set()
    for part, count in (("<gazebo/>", 1), ("", 0), ("<gazebo/>", 1)):
        file.write_text(ARM.replace("</robot>", f"{part}</robot>"), encoding="utf-8")
        digests.add(load(file).digest)
        assert sum("<gazebo>" in note for note in eomgen.build(file, profile="instant").notes) == count
    assert len(digests) == 1
