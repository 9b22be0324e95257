"""Faults of XML that the readers of simulators pass over: read with a note, as if the file were right."""

from __future__ import annotations

from pathlib import Path

import pytest

import eomgen
from eomgen.scene.reading.xml import read_xml

_INERTIA = '<inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
URDF = (
    '<robot name="r">{}<link name="g"/><link name="a">' + _INERTIA + "</link>"
    '<joint name="j" type="continuous"><parent link="g"/><child link="a"/></joint>{}</robot>{}'
)
SDF = '<sdf version="1.9">{}<model name="m"><link name="a"><inertial><mass>2</mass></inertial></link>{}</model></sdf>{}'
MJCF = '<mujoco>{}<worldbody><body name="a"><joint/><geom size="1"/></body></worldbody>{}</mujoco>{}'
FILES = {"a.urdf": URDF, "a.sdf": SDF, "a.xml": MJCF}
HYPHENS, ENDS = "a comment with two hyphens", "an end </{}> of an element that is not open"


@pytest.mark.parametrize("name", FILES)
def test_hyphens_in_comments_are_read(name: str, tmp_path: Path) -> None:
    file = tmp_path / name
    file.write_text(FILES[name].format("", "", ""), encoding="utf-8")
    right = eomgen.load(file)
    for comment in ("<!-- run: tool --verbose -->", "<!-- rule --->", "<!------>\n<!-- - -->"):
        file.write_text(FILES[name].format(f"\n{comment}", "", ""), encoding="utf-8")
        scene = eomgen.load(file)
        assert scene.bodies == right.bodies and scene.joints == right.joints
        assert f"{name}:2: not XML, but read: {HYPHENS}" in scene.notes
    file.write_text(FILES[name].format("<!-- a - b -->", "", ""), encoding="utf-8")
    assert not any("not XML" in note for note in eomgen.load(file).notes)


@pytest.mark.parametrize("name", ["a.urdf", "a.sdf"])
def test_ends_of_nothing_are_read(name: str, tmp_path: Path) -> None:
    file, root = tmp_path / name, "robot" if name == "a.urdf" else "sdf"
    for inside, behind, tag in (("</gazebo>", "", "gazebo"), ("", f"\n</{root}>", root)):
        file.write_text(FILES[name].format("", inside, behind), encoding="utf-8")
        (note,) = (note for note in eomgen.load(file).notes if "not XML" in note)
        assert note.endswith(ENDS.format(tag))


@pytest.mark.parametrize("encoding", ["iso-8859-1", "windows-1252", "utf-16"])
def test_declared_encodings_are_read(encoding: str, tmp_path: Path) -> None:
    file = tmp_path / "a.urdf"
    text = f'<?xml version="1.0" encoding="{encoding}"?>\n' + URDF.format("<!-- Gelenk für Öl -->", "", "")
    file.write_bytes(text.encode(encoding))
    assert [joint.name for joint in eomgen.load(file).joints] == ["j"]
    file.write_bytes(text.replace(f' encoding="{encoding}"', "").encode("iso-8859-1"))
    with pytest.raises(eomgen.DescriptionError, match=r"a\.urdf:2: byte \d+ is not UTF-8"):
        eomgen.load(file)


def test_other_faults_stay_faults() -> None:
    for text in ("<a><b></a>", "<a", "<a></b></a><c/>", "<a>&x;</a>", "<a b=c/>"):
        with pytest.raises(eomgen.DescriptionError, match="this is not XML"):
            read_xml(text, "a.xml")
    root = read_xml('<a b="1"c="2"><![CDATA[<!-- -- --></b>]]></a>', "a.xml")
    assert root.get("c") == "2" and root.text() == "<!-- -- --></b>"
    assert root.liberties == ["a.xml:1: not XML, but read: attributes without a blank between them [W0285]"]


@pytest.mark.parametrize("text", ["<a '/>", '<a "', "<!--", "<a>", "</b>"])
def test_texts_of_many_faults_take_no_longer_than_they_are(text: str) -> None:
    with pytest.raises(eomgen.DescriptionError):
        read_xml(text * 20_000, "a.xml")
