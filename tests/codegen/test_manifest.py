"""The manifest of a folder describes the arrays of the C: every number has a place, a name, a unit and a range."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import eomgen
from tests.golden import GENERATED, SCENES

#: Block of sizes for each block of quantities; the size of outputs is the length of y.
SIZES = {"parameters": "p", "inputs": "u", "coordinates": "q", "velocities": "v", "states": "z"}


def manifest_of(folder: Path) -> dict[str, Any]:
    """Return the manifest of a folder."""
    return dict(json.loads((folder / "manifest.json").read_text(encoding="utf-8")))


def check_places(manifest: dict[str, Any], header: str) -> None:
    """Check that quantities fill arrays without a gap, and that members are in the header."""
    assert manifest["format"] == 1
    for block, quantities in manifest["quantities"].items():
        first = 0
        for item in quantities:
            assert (item["first"], item["name"] != "") == (first, True)
            first += item["size"]
            low, high = item["lower"], item["upper"]
            assert (low is None or low <= item["value"]) and (high is None or item["value"] <= high)
            if block == "parameters":
                assert f"eomgen_real {item['member']};" in header
        outputs = [name for name, function in manifest["functions"].items() if "y" in function["outputs"]]
        if block in SIZES:
            assert first == manifest["sizes"][SIZES[block]], block
        else:
            assert bool(first) == bool(outputs)


@pytest.mark.parametrize("name", SCENES)
def test_goldens_have_every_number_in_the_manifest(name: str) -> None:
    folder = GENERATED / name
    manifest = manifest_of(folder)
    check_places(manifest, (folder / f"{manifest['model']}.h").read_text(encoding="utf-8"))
    starts = [item["value"] for item in manifest["quantities"]["coordinates"]]
    scene = eomgen.load(Path(__file__).parents[2] / "examples" / SCENES[name])
    assert len(starts) == manifest["sizes"]["q"] and manifest["model"] == scene.name
    factors = manifest["factors"]
    assert sum(item["v_size"] for item in factors) == manifest["sizes"]["v"]


def bounded() -> dict[str, Any]:
    """Return nested data of a slider whose parameters have ranges: a mass, a damper, the ends of stops."""
    joint = {"type": "prismatic", "parent": "base", "child": "b", "axis": [1, 0, 0], "damping": "d"}
    stops = {"lower": "-reach", "upper": 0.4, "stiffness": "hardness"}
    return {
        "format": 1,
        "name": "bounded",
        "parameters": {
            "m": {"value": 2.0, "tunable": True, "unit": "kg", "description": "of the carriage"},
            "d": {"value": 0.5, "tunable": True},
            "reach": {"value": 0.3, "tunable": True, "unit": "m"},
            "hardness": {"value": 500.0, "tunable": True},
            "share": {"value": 2.0, "tunable": True},
        },
        "bodies": {"b": {"mass": "m + 0 * sqrt(3 - share)"}},
        "joints": {"x": {**joint, "limits": stops, "initial": {"position": 0.1, "velocity": -1.0}}},
        "inputs": {"push": {"unit": "N", "description": "of a motor"}},
        "efforts": {"motor": {"joint": "x", "effort": "push"}},
        "outputs": {"place": {"formula": "q.x", "unit": "m", "description": "of the carriage"}},
    }


@pytest.mark.slow
def test_ranges_are_the_ones_that_runs_accept(tmp_path: Path) -> None:
    eomgen.generate(bounded(), tmp_path / "c")
    quantities = manifest_of(tmp_path / "c")["quantities"]
    ranges = {item["name"]: (item["lower"], item["upper"]) for item in quantities["parameters"]}
    assert ranges["m"] == (0.0, None)
    assert ranges["d"] == (None, None)  # a damper may push
    assert ranges["reach"] == (-0.4, None)  # the lower stop is below the upper one
    assert ranges["hardness"] == (0.0, None)
    assert ranges["share"] == (None, 3.0)
    (coordinate,), (velocity,) = quantities["coordinates"], quantities["velocities"]
    assert (coordinate["name"], coordinate["unit"], coordinate["value"]) == ("q.x", "m", 0.1)
    assert (coordinate["lower"], coordinate["upper"]) == (-0.3, 0.4)
    assert (velocity["name"], velocity["unit"], velocity["value"]) == ("v.x", "m/s", -1.0)
    assert quantities["inputs"][0]["description"] == "of a motor"
    scene = eomgen.load(bounded())
    for name, (low, high) in ranges.items():
        for end, beyond in ((low, -1e-6), (high, 1e-6)):
            if end is not None:
                with pytest.raises(eomgen.UsageError):
                    eomgen.generate(scene, tmp_path / "refused", parameters={name: end + beyond})
                eomgen.generate(scene, tmp_path / "c", parameters={name: end - beyond})
    eomgen.generate(scene, tmp_path / "c", parameters={"reach": 0.25})
    (coordinate,) = manifest_of(tmp_path / "c")["quantities"]["coordinates"]
    assert coordinate["lower"] == -0.25


def test_coordinates_are_named_as_results_of_runs_are(tmp_path: Path) -> None:
    data = bounded()
    data["bodies"]["top"] = {"mass": 1.0, "inertia": [0.1, 0.1, 0.1]}
    data["joints"]["ball"] = {"type": "spherical", "parent": "b", "child": "top"}
    data["joints"]["free"] = {"type": "free", "parent": "base", "child": "bird"}
    data["bodies"]["bird"] = {"mass": 1.0, "inertia": [0.1, 0.1, 0.1]}
    eomgen.generate(data, tmp_path / "c", terms=["mass", "outputs"])
    manifest = manifest_of(tmp_path / "c")
    model = eomgen.build(data, ["mass"], profile="quick")
    for block, names, units in (
        ("coordinates", model.q_names, model.q_units),
        ("velocities", model.v_names, model.v_units),
    ):
        items = manifest["quantities"][block]
        assert [(item["name"], item["unit"]) for item in items] == list(zip(names, units, strict=True))
    check_places(manifest, (tmp_path / "c" / "bounded.h").read_text(encoding="utf-8"))
