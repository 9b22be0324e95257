"""The axis of fidelity: scenes with less of a beam are those that a file would say, and their errors are against the
full one."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.products.studies.work_precision.formulations import simplify

BEAM = Path(__file__).parents[2] / "examples" / "spin_up_beam" / "scene.toml"
END = 0.4


def _data() -> dict[str, Any]:
    return tomllib.loads(BEAM.read_text())


def _tip(model: eomgen.Model, end: float = END, step: float = 0.01) -> Any:
    return model.simulate(end, step, method="taylor", tolerance=1e-13, error_estimate=False).outputs["tip_deflection"]


@pytest.mark.slow
@pytest.mark.parametrize("what", ["at most 1 mode", "no stiffening"])
def test_a_simplified_scene_is_the_one_that_a_file_would_say(what: str) -> None:
    data = _data()
    if what == "no stiffening":
        data["beams"]["blade"]["stiffening"] = False
    else:
        data["beams"]["blade"]["bending_y"]["modes"] = 1
        data["outputs"]["tip_deflection"]["formula"] = "q.blade[0]"
    less = dict(simplify(eomgen.load(BEAM)))[what]
    np.testing.assert_array_equal(_tip(eomgen.build(less)), _tip(eomgen.build(data)))


@pytest.fixture(scope="module")
def study() -> eomgen.Tradeoff:
    axes = ["fidelity", "resolution"]
    return eomgen.tradeoff(BEAM, outputs=["tip_deflection"], axes=axes, methods=["taylor"], t_end=END, budget=60.0)


@pytest.mark.slow
def test_errors_are_against_the_full_scene(study: eomgen.Tradeoff) -> None:
    _, end, rows = study.span
    full = _tip(eomgen.build(BEAM), end, end / rows)
    floors = {}
    for what, scene in simplify(eomgen.load(BEAM)):
        points = [p for p in study.usable if p.configuration.formulation == f"joint, {what}"]
        if what == "rigid":
            assert not points
            continue
        true = np.abs(_tip(eomgen.build(scene), end, end / rows) - full).max() / np.abs(full).max()
        floors[what] = study.error(min(points, key=lambda p: p.value))
        assert floors[what] == pytest.approx(true, rel=0.02)
    assert 0.0 < floors["at most 2 modes"] < floors["at most 1 mode"]
    assert any("rigid" in name for name in study.left_out)
    assert "2 modes" not in study.reference["by"] + study.reference["held against"]
