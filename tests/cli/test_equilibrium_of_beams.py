"""``eomgen equilibrium`` of scenes with exact beams: outputs, displacements, section loads by closed forms, figure."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from matplotlib.image import imread

from eomgen.cli import main

LENGTH, LOAD, BENDING = 2.0, 3.0, 5e3
SCENE = f"""
format = 1
name = "cantilever"
gravity = [0, 0, 0]
[beams.arm]
model = "cosserat"
length = {LENGTH}
elements = 4
mass_per_length = 1.0
rotary_inertia = [1e-3, 1e-3, 1e-3]
stiffness.stretch = 1e9
stiffness.shear_y = 1e9
stiffness.shear_z = 1e9
stiffness.torsion = {BENDING}
stiffness.bending_y = {BENDING}
stiffness.bending_z = {BENDING}
[joints]
clamp = {{ type = "fixed", parent = "base", child = "arm" }}
[distributed_loads]
snow = {{ beam = "arm", force = [0, 0, -{LOAD}] }}
[forces]
tip = {{ body = "arm", point = [{LENGTH}, 0, 0], force = [0, 0, -1.0] }}
[outputs]
shear = {{ section_force = "arm", at = 0.0 }}
foot = {{ reaction_force = "clamp" }}
"""


def test_equilibrium_tells_what_an_engineer_looks_for(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Deflection q l^4 / 8 EI + P l^3 / 3 EI, moment q l^2 / 2 + P l and shear q l + P at the clamp."""
    scene, figure, rest = tmp_path / "scene.toml", tmp_path / "rest.png", tmp_path / "rest.json"
    scene.write_text(SCENE, encoding="utf-8")
    arguments = ["equilibrium", str(scene), "--profile", "quick", "--plot", str(figure), "--out", str(rest)]
    assert main(arguments) == 0
    told = capsys.readouterr()
    text = told.out + told.err
    assert "q.arm.1" not in text and "28 coordinates of nodes of beams are left out; --all shows them" in text
    for words in ("shear", "foot", "displacement at x = 2 m", "section moment at x = 0 m", "largest section force"):
        assert words in text
    assert imread(figure).shape[0] > 300
    found = json.loads(rest.read_text(encoding="utf-8"))
    beam, shear = found["beams"]["arm"], LOAD * LENGTH + 1.0
    deflection = LOAD * LENGTH**4 / (8.0 * BENDING) + LENGTH**3 / (3.0 * BENDING)
    assert beam["end"]["displacement"][2] == pytest.approx(-deflection, rel=2e-2)  # of second order in the elements
    assert beam["first_section"]["moment"][1] == pytest.approx(0.5 * LOAD * LENGTH**2 + LENGTH, rel=1e-5)
    assert beam["first_section"]["force"][2] == pytest.approx(-shear, rel=1e-5)
    assert beam["last_section"]["force"][2] == pytest.approx(-1.0, rel=1e-5)
    assert found["outputs"]["foot"] == pytest.approx([0.0, 0.0, shear], abs=1e-5)
    assert found["outputs"]["shear"] == beam["first_section"]["force"]
    assert len(found["q"]) == 28 and found["units"]["foot"] == "N"


@pytest.mark.slow
def test_all_prints_every_coordinate(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE, encoding="utf-8")
    assert main(["equilibrium", str(scene), "--profile", "quick", "--all"]) == 0
    assert "q.arm.4[6]" in capsys.readouterr().out
