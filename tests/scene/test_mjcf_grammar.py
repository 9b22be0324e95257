"""MJCF: no attribute of MuJoCo's grammar is without a status, and none that changes MuJoCo's equations is silent."""

from __future__ import annotations

from pathlib import Path

import mujoco
import pytest

import eomgen
from eomgen.scene.load import load
from eomgen.scene.sources.mjcf import coverage
from tests.mjcf_grammar import COMMAND, PAGE, grammar, page
from tests.oracles.mjcf_oracle import Imported


def test_every_attribute_of_mujoco_has_a_status() -> None:
    attributes = [(key, name) for key, names in grammar().items() for name in names]
    assert len(attributes) > 1200
    assert [(key, name) for key, name in attributes if name not in coverage.STATUSES.get(key, {})] == []


@pytest.mark.skipif(not mujoco.__version__.startswith("4.0"), reason="the page is made from the grammar of MuJoCo 4.0")
def test_the_page_is_the_table() -> None:
    assert page() == PAGE.read_text(encoding="utf-8"), f"docs/mjcf.md is not the table; run: {COMMAND}"


def test_an_attribute_of_a_newer_mujoco_is_noted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    older = {**coverage.STATUSES, "body/joint": {"name": coverage.READ, "axis": coverage.READ}}
    monkeypatch.setattr(coverage, "STATUSES", older)
    (tmp_path / "a.xml").write_text(BASE.format(**dict.fromkeys(PLACES, "")), encoding="utf-8")
    note = "not read: the attribute stiffness of <joint>, which this version does not know"
    assert note in load(tmp_path / "a.xml").notes
    with pytest.raises(eomgen.DescriptionError, match=rf"a\.xml:9: {note}"):
        load(tmp_path / "a.xml", strict=True)


#: A file with a place for one more attribute in each element, whose key in the table is in ``PLACES``.
BASE = """<mujoco>
  <compiler {compiler}/>
  <option {option}><flag contact="disable" {flag}/></option>
  <default>
    <joint {default_joint}/><geom {default_geom}/><motor {default_motor}/><tendon {default_tendon}/>
  </default>
  <worldbody>
    <body name="u" {body}>
      <joint name="a" axis="0 1 0" stiffness="1" damping="0.2" {joint}/><joint name="c" type="slide" axis="1 0 0"/>
      <geom type="box" size="0.1 0.2 0.3" {geom}/>
      <body name="l" pos="0.5 0 0">
        <inertial mass="2" pos="0.1 0.02 0.03" diaginertia="0.1 0.12 0.14" {inertial}/>
        <joint name="b" axis="0 1 0.5"/><site name="s" {site}/>
        <body name="w" pos="0 0.4 0"><joint name="d" type="ball" {ball}/><geom size="0.1"/></body>
      </body>
    </body>
    <body name="f" pos="1 1 1"><freejoint name="free" {freejoint}/><geom size="0.1" pos="0.1 0 0"/>
      <geom name="o" size="0.2" pos="-0.2 0 0"/><site name="e" pos="0.3 0.1 0"/></body><site name="h"/>
  </worldbody>
  <tendon><fixed name="t" stiffness="1" {tendon}><joint joint="a" coef="1"/>
    <joint joint="b" coef="-2"/></fixed>
    <spatial name="r" stiffness="2" {spatial}><site site="s"/><geom geom="o"/><site site="e"/>
    <pulley divisor="2"/><site site="e"/><site site="h"/></spatial></tendon>
  <actuator>
    <motor name="m" joint="a" {motor}/><position name="p" joint="b" {position}/>
    <velocity name="v" joint="c" {velocity}/>
    <general name="g" tendon="t" {general}/><motor name="z" site="s" gear="1 0 0 0 0 1"/>
    <intvelocity name="i" joint="a" actrange="-9 9" {intvelocity}/>
    <muscle name="x" tendon="r" lengthrange="0.3 1.5" {muscle}/>
  </actuator>
</mujoco>"""
PLACES = {
    "compiler": "compiler",
    "option": "option",
    "flag": "option/flag",
    "default_joint": "default/joint",
    "default_geom": "default/geom",
    "default_motor": "default/motor",
    "default_tendon": "default/tendon",
    "body": "body",
    "joint": "body/joint",
    "ball": "body/joint",
    "geom": "body/geom",
    "inertial": "body/inertial",
    "site": "body/site",
    "freejoint": "body/freejoint",
    "tendon": "tendon/fixed",
    "spatial": "tendon/spatial",
    **{name: f"actuator/{name}" for name in ("motor", "position", "velocity", "general", "intvelocity", "muscle")},
}
#: Values to try, the first that MuJoCo takes.
_VALUES = (
    *(
        "0.3",
        "0.3 0.2",
        "0.3 -0.2 0.4",
        "-0.2 0.4",
        "0.9 0.1 0.3 0.2",
        "0.4 0.3 0.2 0.01 0.02 0.03",
        "true",
        "disable",
        "1",
    ),
    *("zyx", "radian", "hinge", "affine", "filter", "linear", "0.3 0.2 0.4 0.1 0.2"),
)


def _with(place: str, attribute: str, value: str) -> str:
    text = BASE.format(**{**dict.fromkeys(PLACES, ""), place: f'{attribute}="{value}"'})
    for line in text.splitlines():  # an attribute that is there already is replaced
        for tag in line.split("<"):
            if tag.count(f" {attribute}=") > 1:
                first = tag.index(f" {attribute}=")
                end = tag.index('"', tag.index('"', first) + 1) + 1
                text = text.replace(tag, tag[:first] + tag[end:])
    return text


def _mutants(place: str) -> list[str]:
    texts = []
    for attribute in coverage.STATUSES[PLACES[place]]:
        if attribute in ("name", "class", "childclass", "joint", "tendon", "site"):
            continue
        for value in _VALUES:
            text = _with(place, attribute, value)
            try:
                mujoco.MjModel.from_xml_string(text)
            except ValueError:
                continue
            texts.append(text)
            break
    return texts


@pytest.mark.slow_except("flag", "joint")
@pytest.mark.parametrize("place", PLACES)
@pytest.mark.filterwarnings("ignore:compiler attribute:UserWarning")
def test_no_attribute_changes_the_equations_in_silence(
    place: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # MuJoCo writes its warnings to a file in the current folder
    file, silent = tmp_path / "a.xml", []
    file.write_text(BASE.format(**dict.fromkeys(PLACES, "")), encoding="utf-8")
    said = set(load(file).notes)
    texts = _mutants(place)
    assert len(texts) >= (1 if place == "freejoint" else 4)
    for text in texts:
        file.write_text(text, encoding="utf-8")
        try:
            imported = Imported.of(file)
        except eomgen.DescriptionError:
            continue
        if max(imported.errors(states=3)) > 1e-10 and set(imported.scene.notes) <= said:
            silent.append(text)
    assert silent == []
