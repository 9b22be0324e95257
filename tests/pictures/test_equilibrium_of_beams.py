"""``eomgen equilibrium`` of scenes with exact beams: outputs, displacements, section loads by closed forms, figure."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from matplotlib.image import imread

from eomgen.base import figures
from eomgen.cli import main
from eomgen.products.pictures import shapes

LENGTH, LOAD, BENDING = 2.0, 3.0, 5e3  # of the file
SCENE = Path(__file__).with_name("cantilever.toml")


def test_equilibrium_tells_what_an_engineer_looks_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Deflection q l^4 / 8 EI + P l^3 / 3 EI, moment q l^2 / 2 + P l and shear q l + P at the clamp."""
    figure, rest = tmp_path / "rest.png", tmp_path / "rest.json"
    arguments = ["equilibrium", str(SCENE), "--profile", "quick", "--plot", str(figure), "--out", str(rest)]
    drawn: list[Any] = []
    monkeypatch.setattr(
        shapes, "save_figure", lambda figure, path: drawn.append(figure) or figures.save_figure(figure, path)
    )
    assert main(arguments) == 0
    legend = drawn[0].legends[0].get_window_extent()
    assert not any(legend.overlaps(axis.get_window_extent()) for axis in drawn[0].axes)
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
def test_all_prints_every_coordinate(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["equilibrium", str(SCENE), "--profile", "quick", "--all"]) == 0
    assert "q.arm.4[6]" in capsys.readouterr().out


@pytest.mark.long
def test_runs_and_modes_show_displacements_and_shapes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    options = ["--profile", "quick", "--out", str(out)]
    assert main(["simulate", str(SCENE), "--t-end", "0.02", "--step", "0.002", *options]) == 0
    text = capsys.readouterr().out
    assert "q.arm" not in text and "28 coordinates in solution.csv" in text
    assert "output foot at the end" in text
    assert imread(out / "coordinates.png").shape[0] < 800  # two panels in place of poses of four nodes
    assert main(["linearize", str(SCENE), "--at", "equilibrium", *options]) == 0
    assert imread(out / "mode_shapes.png").shape[0] > 400


@pytest.mark.long
def test_the_frame_of_the_page_on_statics_runs_as_printed(tmp_path: Path) -> None:
    """Moments of the loads about the foot by hand, in the shape at rest, and the force that carries them."""
    page = Path(__file__).parents[2] / "docs" / "statics.md"
    text = page.read_text(encoding="utf-8").partition("## A frame from section to mode shapes")[2]
    scene, rest = tmp_path / "frame.toml", tmp_path / "rest.json"
    scene.write_text(text.partition("```toml\n")[2].partition("```")[0], encoding="utf-8")
    assert main(["equilibrium", str(scene), "--profile", "quick", "--out", str(rest), "--json"]) == 0
    found = json.loads(rest.read_text(encoding="utf-8"))
    arm_mass = 7850 * 0.06 * 0.09 * 2.0
    column_mass = 7850 * 3.141592653589793 * (0.057**2 - 0.052**2) * 3.0
    weight = 2000.0 + 1000.0 + 9.81 * (arm_mass + column_mass)
    assert found["outputs"]["foundation"][2] == pytest.approx(weight, rel=1e-3)
    straight = 2000.0 * 2.0 + 1000.0 * 1.0 + 9.81 * arm_mass * 2.0 * (0.5 * 0.12 - 0.06 / 3.0) / 0.09
    moment = found["outputs"]["root_moment"][1]
    assert moment == pytest.approx(5933.8, rel=1e-3) and 1.02 < moment / straight < 1.06
