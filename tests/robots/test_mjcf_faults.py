"""MJCF files with faults: one message each, with file, line, cause and remedy, and no warnings of NumPy or MuJoCo."""

from __future__ import annotations

import warnings
from pathlib import Path

import pytest

import eomgen
from eomgen.scene.load import load


def arm(*, joint: str = "", geom: str = "", inside: str = "", rest: str = "") -> str:
    """Return one body on a hinge; the geom is in line 5, ``inside`` in line 6, ``rest`` from line 8 on."""
    return f"""<mujoco>
  <worldbody>
    <body name="a">
      <joint name="j" axis="0 1 0" {joint}/>
      <geom size="0.1" {geom}/>
      {inside}</body>
  </worldbody>
  {rest}
</mujoco>"""


_NO_NUMBER = "a finite number is needed here, not "
_OUT = "is too large or too small to calculate with; try: masses, inertias and lengths between 1e-100 and 1e100"
_PATH = "try: a path from the folder of the file, or assetdir, meshdir and texturedir of <compiler>"
_ONCE = "try: one <include> of each file, and none of a file that includes it"
#: Text of a.xml and the message about it; b.xml is included by some.
FAULTS = {
    "no moving body": (
        "<mujoco><worldbody/></mujoco>",
        "a.xml (joints): no joint can move; try: a revolute, prismatic",
    ),
    "a part": (
        "<mujocoinclude/>",
        "a.xml:1: the outermost element is 'mujocoinclude', not 'mujoco'; try: the file that",
    ),
    "not closed": ("<mujoco>\n<worldbody>", "a.xml:2: this is not XML: no element found (column 12)"),
    "infinite stiffness": (arm(joint='stiffness="inf"'), f"a.xml:4 (joints.j.stiffness[0]): {_NO_NUMBER}inf"),
    "gravity": (arm(rest='<option gravity="nan 0 0"/>'), f"a.xml:8 (gravity[0]): {_NO_NUMBER}nan"),
    "mass": (arm(geom='mass="1e308"'), f"a.xml:5: the number '1e308' {_OUT}"),
    "gravcomp": (
        arm().replace('"a"', '"a" gravcomp="1e308"'),
        f"a.xml:3 (forces.gravity_compensation_a.force[0]): {_NO_NUMBER}nan",
    ),
    "gear": (arm(rest='<actuator><motor joint="j" gear="1e300"/></actuator>'), f"a.xml:8: the number '1e300' {_OUT}"),
    "negative mass": (
        arm(geom='mass="-1"'),
        "a.xml:5: MuJoCo refuses the file: mass, inertia or density are negative in geom",
    ),
    "no mass": (
        arm(geom='mass="0"'),
        "a.xml:3: MuJoCo refuses the file: mass and inertia of moving bodies must be larger than mjMINVAL ('a'); try: "
        "a geom with mass in the body, or <inertial>",
    ),
    "attribute": (
        arm(geom='mas="1"'),
        "a.xml:5: MuJoCo refuses the file: unrecognized attribute: 'mas'; try: pip install -U mujoco",
    ),
    "repeated name": (
        arm(inside='<body name="a"/>'),
        "a.xml:6: MuJoCo refuses the file: repeated name 'a' in body; try: another name for one of them",
    ),
    "unknown name": (
        arm(rest='<actuator><motor joint="k"/></actuator>'),
        "a.xml:8: MuJoCo refuses the file: unknown transmission target 'k' for actuator id = 0",
    ),
    "unknown sensor": (
        arm(rest='<sensor><jointpos joint="k"/></sensor>'),
        "a.xml:8: MuJoCo refuses the file: unrecognized name 'k' of sensorized object; try: one of a, j",
    ),
    "missing mesh": (
        arm(rest='<asset><mesh name="m" file="no.stl"/></asset>', inside='<geom type="mesh" mesh="m"/>'),
        f"a.xml:8: MuJoCo refuses the file: Error opening file 'no.stl'; {_PATH}",
    ),
    "missing include": (
        '<mujoco>\n<include file="no.xml"/></mujoco>',
        f"a.xml:2: MuJoCo refuses the file: Error opening file 'no.xml'; {_PATH}",
    ),
    "include of itself": (
        '<mujoco>\n<include file="a.xml"/><include file="a.xml"/></mujoco>',
        f"a.xml:2: MuJoCo refuses the file: File 'a.xml' already included; {_ONCE}",
    ),
    "circle of includes": (
        '<mujoco>\n\n<include file="b.xml"/></mujoco>',
        f"b.xml:2: MuJoCo refuses the file: File 'a.xml' already included; {_ONCE}",
        '<mujoco>\n<include file="a.xml"/></mujoco>',
    ),
    "included text": (
        '<mujoco>\n<include file="b.xml"/></mujoco>',
        "b.xml:3: this is not XML: mismatched tag (column 9); try: an end for each element",
        "<mujoco>\n<worldbody>\n<body></worldbody></mujoco>",
    ),
    "included attribute": (
        '<mujoco>\n<include file="b.xml"/></mujoco>',
        "b.xml:5: MuJoCo refuses the file: unrecognized attribute: 'mas'; try: pip install -U mujoco",
        arm(geom='mas="1"'),
    ),
    "included geom without a name": (
        '<mujoco>\n<include file="b.xml"/></mujoco>',
        "a.xml: MuJoCo refuses the file: mass, inertia or density are negative in geom (in an included file)",
        arm(geom='mass="-1"'),
    ),
    "keyframe": (
        arm(rest='<keyframe><key name="k" qpos="1 2"/></keyframe>'),
        "a.xml:8: MuJoCo refuses the file: keyframe 'k': invalid qpos size, expected 1, got 2",
    ),
    "range of a muscle": (
        arm(rest='<actuator><muscle joint="j"/></actuator>'),
        "a.xml:8: MuJoCo refuses the file: Lengthrange computation did not converge in actuator 0: eval",
    ),
    "equality of spatial tendons": (
        arm(
            inside='<site name="s" pos="1 0 0"/>',
            rest='<worldbody><site name="w"/></worldbody><tendon><spatial name="r"><site site="s"/><site site="w"/>'
            '</spatial></tendon>\n<equality><tendon tendon1="r"/></equality>',
        ),
        "a.xml:9 (constraints.tendon_1): an equality of a spatial tendon is not supported; try: connect, weld or joint",
    ),
    "depth": ("<mujoco>" + "<body>" * 600, "a.xml:1: elements are nested more than 500 deep"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_has_one_message(fault: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    text, message, *included = FAULTS[fault]
    Path("a.xml").write_text(text, encoding="utf-8")
    for part in included:
        Path("b.xml").write_text(part, encoding="utf-8")
    with warnings.catch_warnings(record=True) as caught, pytest.raises(eomgen.DescriptionError) as error:
        warnings.simplefilter("always")
        load("a.xml")
    assert message in str(error.value)
    assert caught == []


def test_warnings_of_mujoco_are_notes_and_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.xml").write_text(arm(geom='user="nan"', rest='<size nuser_geom="1"/>'), encoding="utf-8")
    assert "MuJoCo: XML contains a 'NaN'. Please check it carefully." in load("a.xml").notes
    assert [path.name for path in tmp_path.iterdir()] == ["a.xml"]
    assert capfd.readouterr() == ("", "")


def test_names_of_any_text_are_taken(tmp_path: Path) -> None:
    file = tmp_path / "a.xml"
    text = arm(inside='<body name="ärm 日"><joint name="☃"/><geom size="1" name=""/></body>')
    file.write_text(text.replace('"j"', '" j-*/"'), encoding="utf-8")
    assert [joint.name for joint in load(file).joints] == ["_j___", "_"]


@pytest.mark.slow
def test_a_chain_of_many_bodies_is_read(tmp_path: Path) -> None:
    file, count = tmp_path / "a.xml", 150
    body = '<body pos="0.1 0 0"><joint axis="0 1 0"/><geom size="0.05"/>'
    file.write_text(f"<mujoco><worldbody>{body * count}{'</body>' * count}</worldbody></mujoco>", encoding="utf-8")
    assert len(load(file).joints) == count


def test_a_path_may_pass_a_site_twice(tmp_path: Path) -> None:
    file = tmp_path / "a.xml"
    path = '<site site="s"/><geom geom="g"/><site site="u"/><geom geom="g"/><site site="s"/>'
    rest = f'<tendon><spatial name="r" stiffness="1">{path}</spatial></tendon>'
    inside = '<geom name="g" size="0.1"/><site name="s" pos="-1 0 0"/><site name="u" pos="1 0 0"/>'
    file.write_text(arm(inside=inside, rest=rest), encoding="utf-8")
    assert load(file).elements[0].points == ("at_s", "at_u", "at_s_2")
