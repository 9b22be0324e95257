"""MJCF: no attribute of MuJoCo's grammar is without a status, and none that changes MuJoCo's equations is silent."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import mujoco
import numpy as np
import pytest

import eomgen
from eomgen.products.robots.leftovers import READ
from eomgen.products.robots.mjcf import coverage
from eomgen.products.robots.mjcf.coverage import STATUSES
from eomgen.scene.load import load
from eomgen.scene.scene import Scene
from tests.oracles.mjcf_oracle import Imported
from tests.robots.mjcf_grammar import COMMAND, PAGE, grammar, page
from tests.robots.mjcf_mutants import ABSENT, BASE, base, elements, mutants


def test_every_attribute_of_mujoco_has_a_status() -> None:
    attributes = [(key, name) for key, names in grammar().items() for name in names]
    assert len(attributes) > 1200
    assert [(key, name) for key, name in attributes if name not in coverage.STATUSES.get(key, {})] == []


@pytest.mark.skipif(not mujoco.__version__.startswith("4.0"), reason="the page is made from the grammar of MuJoCo 4.0")
def test_the_page_is_the_table() -> None:
    assert page() == PAGE.read_text(encoding="utf-8"), f"docs/mjcf.md is not the table; run: {COMMAND}"


def test_an_attribute_of_a_newer_mujoco_is_noted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    older = {**coverage.STATUSES, "body/joint": {"name": READ, "axis": READ}}
    monkeypatch.setattr(coverage, "STATUSES", older)
    (tmp_path / "a.xml").write_text(BASE, encoding="utf-8")
    note = "not read: the attribute stiffness of <joint>, which this version does not know"
    assert note in load(tmp_path / "a.xml").notes
    with pytest.raises(eomgen.DescriptionError, match=rf"a\.xml:\d+: {note}"):
        load(tmp_path / "a.xml", strict=True)


def test_the_file_of_mutants_has_all_elements() -> None:
    present = elements(ET.fromstring(BASE))
    missing = [key for key, names in grammar().items() if names and key not in present]
    assert [key for key in missing if not any(part in key for part in ABSENT)] == []


#: Attributes that change how soft MuJoCo holds an equality, which is exact here.
_SOFT = ("solimp", "solref", "torquescale")


def _is_silent(file: Path, text: str, unchanged: Scene, *, scene_alone: bool, **options: str) -> bool:
    """Return whether a scene lacks a change of MuJoCo's equations and says nothing about it."""
    file.write_text(text, encoding="utf-8")
    try:
        scene = load(file, **options)
    except eomgen.EomgenError:
        return False
    if not set(scene.notes) <= set(unchanged.notes):
        return False
    if scene_alone:
        return scene == unchanged
    terms = ("mass", "residual", "internal_rate", *(("outputs",) if scene.outputs else ()))
    imported = Imported.of(file, terms, scene)
    if max(imported.errors(states=1)) > 1e-10:
        return True
    rates, theirs = imported.rates(states=1)
    pairs = [(rates, theirs), *(imported.sensors(states=1).values() if scene.outputs else ())]
    return not all(np.allclose(ours, others, rtol=1e-9, atol=1e-10) for ours, others in pairs)


#: Elements with attributes; of sensors, defaults and visuals, which are read alike, a quarter.
KEYS = [
    key
    for number, key in enumerate(key for key in elements(ET.fromstring(BASE)) if STATUSES.get(key))
    if number % 4 == 0 or not key.startswith(("sensor/", "default/", "visual/"))
]


@pytest.mark.slow
@pytest.mark.long_except("tendon/fixed/joint")
@pytest.mark.parametrize("key", KEYS)
@pytest.mark.filterwarnings("ignore:compiler attribute:UserWarning")
def test_no_attribute_changes_the_equations_in_silence(
    key: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # MuJoCo writes its warnings to a file in the current folder
    file = tmp_path / "a.xml"
    file.write_text(base(key), encoding="utf-8")
    options = {"keyframe": "ke"} if key == "keyframe/key" else {}
    scene_alone, unchanged = "equality" in key or key == "keyframe/key", load(file, **options)
    silent = [
        (attribute, value)
        for attribute, value, text in mutants(key)
        if not (scene_alone and attribute in _SOFT)
        and _is_silent(file, text, unchanged, scene_alone=scene_alone, **options)
    ]
    assert silent == []
