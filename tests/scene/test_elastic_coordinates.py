"""Elastic coordinates of beams in formulas: named like those of joints, counted, and followed into included files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.errors import DescriptionError
from eomgen.formula.nodes import Symbol

BLADE = """
format = 1
name = "blade"
joints.hub = { type = "revolute", parent = "base", child = "blade", axis = [0, 0, 1] }
[beams.blade]
length = 2.0
mass_per_length = 1.0
bending_y = { modes = 2, stiffness = 10.0 }
stretch = { modes = 1, stiffness = 1e4 }
[outputs]
tip = { formula = "FORMULA", unit = "m" }
"""


def loaded(folder: Path, formula: str, text: str = BLADE) -> eomgen.Scene:
    path = folder / "scene.toml"
    path.write_text(text.replace("FORMULA", formula))
    return eomgen.load(path)


@pytest.mark.parametrize("kind", ["q", "v", "a"])
def test_components_are_counted_over_all_ways_to_deform(tmp_path: Path, kind: str) -> None:
    scene = loaded(tmp_path, f"{kind}.blade[2]")
    assert scene.outputs[0].values == (Symbol(kind, "blade", 2),)


def test_a_single_coordinate_needs_no_index(tmp_path: Path) -> None:
    text = BLADE.replace("stretch = { modes = 1, stiffness = 1e4 }\n", "").replace("modes = 2", "modes = 1")
    assert loaded(tmp_path, "q.blade", text).outputs[0].values == (Symbol("q", "blade", 0),)


def test_a_joint_and_a_beam_of_one_name_are_refused(tmp_path: Path) -> None:
    with pytest.raises(DescriptionError) as caught:
        loaded(tmp_path, "q.hub", BLADE.replace("joints.hub", "joints.blade"))
    said = (
        "(beams.blade): the name blade is both a joint and a beam, and q.blade would be both; try: another name for"
        " one of"
    )
    assert said in str(caught.value)


def test_a_fixed_joint_may_have_the_name_of_its_beam(tmp_path: Path) -> None:
    """A fixed joint has no coordinates: q.blade is the beam's, here and in the included file."""
    text = (
        BLADE.replace("joints.hub", "joints.blade").replace('"revolute"', '"fixed"').replace(", axis = [0, 0, 1]", "")
    )
    scene = loaded(tmp_path, "q.blade[2]", text)
    assert scene.outputs[0].values == (Symbol("q", "blade", 2),)
    model = eomgen.build(scene, terms=["outputs"], profile="instant")
    q = [0.1, 0.2, 0.3]
    assert model.outputs(q, np.zeros(3))["tip"] == pytest.approx(0.3)
    (tmp_path / "two.toml").write_text(
        'format = 1\nname = "two"\n[include.left]\nfile = "scene.toml"\n'
        '[outputs]\nx = { formula = "q.left_blade[1]" }\n'
    )
    two = eomgen.build(tmp_path / "two.toml", terms=["outputs"], profile="instant")
    assert two.outputs(q, np.zeros(3))["x"] == pytest.approx(0.2)
