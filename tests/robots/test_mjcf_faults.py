"""MJCF files with faults: one message each, with file, line, cause and remedy, and no warnings of NumPy or MuJoCo."""

from __future__ import annotations

import tomllib
import warnings
from pathlib import Path

import pytest

import eomgen
from eomgen.scene.load import load


def arm(*, body: str = "", joint: str = "", geom: str = "", inside: str = "", rest: str = "") -> str:
    """Return one body on a hinge; the geom is in line 5, ``inside`` in line 6, ``rest`` from line 8 on."""
    return f"""<mujoco>
  <worldbody>
    <body name="a" {body}>
      <joint name="j" axis="0 1 0" {joint}/>
      <geom size="0.1" {geom}/>
      {inside}</body>
  </worldbody>
  {rest}
</mujoco>"""


FAULTS = tomllib.loads(Path(__file__).with_name("faults_of_mjcf.toml").read_text(encoding="utf-8"))
FAULTS["depth"] = {
    "text": "<mujoco>" + "<body>" * 600,
    "message": "a.xml:1: elements are nested more than 500 deep",
}


def written(file: str, content: dict[str, str]) -> None:
    Path(file).write_text(content.get("text") or arm(**content), encoding="utf-8")


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_has_one_message(fault: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    content = dict(FAULTS[fault])
    message = content.pop("message")
    if included := content.pop("included", None):
        written("b.xml", included)
    written("a.xml", content)
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


def test_a_path_may_pass_a_site_twice(tmp_path: Path) -> None:
    file = tmp_path / "a.xml"
    path = '<site site="s"/><geom geom="g"/><site site="u"/><geom geom="g"/><site site="s"/>'
    rest = f'<tendon><spatial name="r" stiffness="1">{path}</spatial></tendon>'
    inside = '<geom name="g" size="0.1"/><site name="s" pos="-1 0 0"/><site name="u" pos="1 0 0"/>'
    file.write_text(arm(inside=inside, rest=rest), encoding="utf-8")
    assert load(file).elements[0].points == ("at_s", "at_u", "at_s_2")
