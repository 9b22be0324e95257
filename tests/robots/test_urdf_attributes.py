"""Every attribute and element of a URDF is read, noted or refused: attributes of files are perturbed, one by one."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from eomgen.errors import DescriptionError
from eomgen.scene.load import load
from eomgen.scene.rotations import about_axis
from eomgen.scene.scene import Scene
from tests.models.urdf import ROBOTS, load_urdf
from tests.robots.tables import table

#: All that URDF 1.2 has: every element with every attribute, on joints of all types.
FULL = Path(__file__).with_name("full.urdf").read_text(encoding="utf-8")
#: What is there for whatever the file holds: the notes that stand for it, by a part of the path.
_LIMITS = "not modelled: limits of position, velocity and effort (2: a, b)"
_IDLE = (
    "without a part in the equations of motion: 1 collision, 1 axis of fixed joints, 1 dynamics of fixed joints,"
    " 1 limit of fixed joints, 1 mimic of fixed joints, 1 axis of floating joints"
)
NOTED = {
    "foot/": "the root link foot is fixed to the base, and so are the links fixed to it",
    "/safety_controller": "not modelled: <safety_controller> (2: a, c)",
    "/calibration": "not modelled: <calibration> (2: a, c)",
    **dict.fromkeys(("a/limit", "b/limit"), _LIMITS),
    "/friction": "not modelled: dry friction (1: a)",
    **dict.fromkeys(("/collision", "c/", "e/axis"), _IDLE),
    "/transmission": "not modelled: <transmission> (1: t)",
    "/gazebo": "not modelled: <gazebo> (1)",
}


def elements(root: ElementTree.Element) -> list[tuple[str, ElementTree.Element]]:
    """Return every element of a file, with a path of names of links and joints, and of tags."""
    found = []

    def walk(element: ElementTree.Element, path: str) -> None:
        found.append((path, element))
        for child in element:
            walk(child, f"{path}/{child.get('name') if child.tag in ('link', 'joint') else child.tag}")

    walk(root, "robot")
    return found


def outcome(text: str, **options: object) -> tuple[tuple[bytes, str], set[str]] | str:
    """Return what became of a file: content, shapes and notes of the scene, or what it was refused for."""
    try:
        scene = load_urdf(text, file="full.urdf", **options)  # type: ignore[arg-type]
    except DescriptionError as error:
        return str(error)
    return (scene.digest, repr(scene.shapes)), set(scene.notes)


def perturbed(value: str) -> list[str]:
    """Return other values of an attribute: another name, and where there are numbers, each of them a little larger."""
    words = value.split()
    if not all(re.fullmatch(r"[-+0-9.]+", word) for word in words):
        return [f"{value}_other"]
    return [" ".join([*words[:k], f"{float(word) + 0.01:.6g}", *words[k + 1 :]]) for k, word in enumerate(words)]


@pytest.mark.slow
@pytest.mark.parametrize("options", [{}, {"limits": True, "friction": True, "root": "free"}], ids=str)
def test_every_attribute_that_is_changed_is_felt_or_noted(options: dict[str, object]) -> None:
    """A change shows in the scene or its notes, or is refused; what it leaves alike has a note that says so."""
    before = outcome(FULL, **options)
    root = ElementTree.fromstring(FULL)
    unfelt = set()
    for path, element in elements(root):
        for name, value in list(element.attrib.items()):
            for other in perturbed(value):
                element.set(name, other)
                after = outcome(ElementTree.tostring(root, encoding="unicode"), **options)
                element.set(name, value)
                nothing = f"{path}/{name}".endswith(("/visual/name", "/axis/xyz"))  # a name, and the length of an axis
                if after == before and not nothing:
                    unfelt.add(f"{path}/{name}")
                    notes = [note for part, note in NOTED.items() if part in f"{path}/{name}"]
                    notes += ["limits of velocity and effort"] if path.endswith(("/a/limit", "/b/limit")) else []
                    assert any(note in told for note in notes for told in before[1]), f"{path}/{name} = {other}"
    assert not [path for path in unfelt if re.search(r"/[abd]/(origin|axis|mimic|parent|child|type)", path)]
    assert not [path for path in unfelt if re.search(r"/[ABDE]/inertial", path)]


@pytest.mark.slow
def test_every_attribute_that_is_not_known_is_noted_and_refused_when_strict() -> None:
    """Added to any element that is not left out as a whole; misspelt, an attribute is missed, and its name is hinted
    at."""
    root = ElementTree.fromstring(FULL)
    before = outcome(FULL)
    for path, element in elements(root):
        whole = re.search(r"/(visual|collision|material|transmission|gazebo|safety_controller|calibration)", path)
        element.set("foo", "1")
        text = ElementTree.tostring(root, encoding="unicode")
        del element.attrib["foo"]
        after = outcome(text)
        if whole:
            assert after == before
            continue
        (note,) = after[1] - before[1]
        owner = path.split("/")[1] if "/" in path else ""
        assert note == f"not read: the attribute 'foo' of <{element.tag}> (1{f': {owner}' if owner else ''})"
        assert f"{note}; try: no --strict (strict=False), to go on without" in outcome(text, strict=True)


@pytest.mark.parametrize(
    ("old", "new", "note"),
    [
        ('rpy="0.3 0.2 0.1"', 'rpz="0.3 0.2 0.1"', "the attribute 'rpz' of <origin> (is rpy meant?) (1: a)"),
        ('damping="0.5"', 'dampng="0.5"', "the attribute 'dampng' of <dynamics> (is damping meant?) (1: a)"),
        ('<axis xyz="1 2 2"/>', '<axis xyz="1 2 2">0 0 1</axis>', "the text in <axis> (1: a)"),
        ('<axis xyz="1 2 2"/>', '<axis xyz="1 2 2"/><axis xyz="0 0 1"/>', "a second <axis> (1: a)"),
        ("</robot>", "one more</robot>", "the text in <robot> (1)"),
    ],
)
def test_what_is_not_read_is_noted(old: str, new: str, note: str) -> None:
    assert old in FULL
    text = FULL.replace(old, new, 1)
    assert f"not read: {note}" in load_urdf(text).notes
    strict = outcome(text, strict=True)
    assert f"not read: {note}; try: no --strict" in strict
    assert not re.search(r"full.urdf:\d+: not read: .*\n.*not read", strict)


@pytest.mark.parametrize(("old", "new", "message"), table("faults_of_full_urdf"))
def test_refusals(old: str, new: str, message: str) -> None:
    assert old in FULL
    refusal = outcome(FULL.replace(old, new, 1))
    assert isinstance(refusal, str) and message in refusal


def test_newer_versions_are_doubts_and_quaternions_of_older_ones_are_read() -> None:
    newer = FULL.replace('version="1.2"', 'version="1.3"')
    assert "version 1.3 of URDF is newer than 1.2: its new elements are not known" in load_urdf(newer).notes
    assert "version 1.3 of URDF is newer" in outcome(newer, strict=True)
    older = FULL.replace(' version="1.2"', "")
    assert load_urdf(older).digest == load_urdf(FULL).digest


def quaternion(rpy: str) -> str:
    """Return ``quat_xyzw`` of angles, by half angles."""
    w, v = 1.0, np.zeros(3)
    for axis, angle in zip(np.eye(3)[::-1], [float(word) for word in rpy.split()][::-1], strict=True):
        c, s = np.cos(angle / 2), np.sin(angle / 2) * axis
        w, v = w * c - v @ s, w * s + c * v + np.cross(v, s)
    return " ".join(f"{number:.17g}" for number in (*v, w))


def agree(scene: Scene, other: Scene) -> None:
    """Hold two scenes to the same placements and inertias but for rounding."""
    assert [joint.name for joint in scene.joints] == [joint.name for joint in other.joints]
    for mine, theirs in zip(scene.joints, other.joints, strict=True):
        np.testing.assert_allclose(mine.orientation, theirs.orientation, atol=1e-10)  # the two snap a little apart
    for mine, theirs in zip(scene.bodies, other.bodies, strict=True):
        for field in ("inertia", "center_of_mass"):
            left, right = ([entry.value for entry in getattr(body, field)] for body in (mine, theirs))
            np.testing.assert_allclose(left, right, atol=1e-10 * max(1.0, *map(abs, right)))


@pytest.mark.parametrize("name", ["panda_description/urdf/panda.urdf", "talos_data/robots/talos_full_v2.urdf"])
def test_robots_written_with_quaternions(name: str) -> None:
    path = ROBOTS / name
    text = re.sub(r'rpy\s*=\s*"([-+.eE\d\s]*)"', lambda found: f'quat_xyzw="{quaternion(found[1])}"', path.read_text())
    text = re.sub(r"<robot\b", '<robot version="1.1"', text, count=1)
    agree(load_urdf(text, file=path.name), load(path))


def test_a_quarter_turn_by_quaternion() -> None:
    """Four digits are enough for a right angle, which is exact: scaled to unit length, 0.7071 is the root of a half."""
    text = FULL.replace('"0.5 0.5 -0.5 0.5"', '"0.7071 0 0 0.7071"')
    joint = next(joint for joint in load_urdf(text).joints if joint.name == "b")
    assert joint.orientation == ((1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0))
    joint = next(joint for joint in load_urdf(FULL).joints if joint.name == "b")
    axis = np.array([1.0, 1.0, -1.0]) / np.sqrt(3.0)
    np.testing.assert_allclose(joint.orientation, about_axis(axis, 2.0 * np.pi / 3.0), atol=1e-15)


@pytest.mark.parametrize("before", ["\n", " \t\r\n\n", "<!-- made by\na script -->\n", "\ufeff\n  <!-- a -->\n"])
def test_what_stands_before_the_declaration(before: str) -> None:
    """A file loads as it does without; lines and columns of messages are those of the file."""
    declared = FULL.replace('<?xml version="1.0"?>', "<?xml version='1.0' encoding='utf-8'\n ?>")
    scene, plain = load_urdf(before + declared), load_urdf(declared)
    assert (scene.digest, scene.notes) == (plain.digest, plain.notes)
    lines = before.count("\n")
    assert scene.source["joints.a"] == f"robot.urdf:{17 + lines}"
    places = []
    for text in (before + declared, declared):
        refusal = str(outcome(text.replace('<axis xyz="0 1 0"/>', '<axis xyz="0 1 0>')))
        found = re.search(r"full.urdf:(\d+): this is not XML: .*\(column (\d+)\)", refusal)
        assert found
        places.append((int(found[1]), found[2]))
    assert places[0] == (places[1][0] + lines, places[1][1])


def test_a_late_declaration_is_still_looked_at() -> None:
    assert outcome('\n\n<?xml encoding="utf-8"?><robot/>').endswith(
        "full.urdf:3: this is not XML: XML declaration not well-formed (column 7)"
    )
    assert "this is not XML" in str(outcome('one<?xml version="1.0"?><robot/>'))
    assert "this is not XML: no element found" in str(outcome(" " * 1_000_000))
