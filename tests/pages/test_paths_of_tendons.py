"""Pictures draw tendons around their obstacles: paths of the page in node are as long as the model's."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.products.pictures.animation import packed

GEOMETRY = Path(__file__).parents[2] / "templates" / "pictures" / "geometry.js"
#: A ball on a joint, with tendons around a sphere on it, and around a cylinder and through a ring on the base.
SCENE: dict[str, Any] = {
    "format": 1,
    "name": "paths",
    "bodies": {"ball": {"mass": 1.0, "inertia": [0.1, 0.12, 0.15], "center_of_mass": [0.1, 0.02, -0.2]}},
    "joints": {
        "ball": {"type": "spherical", "parent": "base", "child": "ball", "initial": {"velocity": [3.0, 4.0, -2.0]}}
    },
    "points": {
        "high": {"body": "base", "position": [0.3, 0.1, 1.0]},
        "low": {"body": "ball", "position": [0.2, 0.4, -0.7]},
        "away": {"body": "base", "position": [-0.9, 0.8, 0.1]},
        "side": {"body": "ball", "position": [0.5, 0.5, 0.5]},
    },
    "tendons": {
        "around": {
            "points": ["high", "low", "away"],
            "wraps": [
                {"after": "high", "center": {"body": "ball", "position": [0.05, 0.05, 0.05]}, "radius": 0.2},
                {
                    **{"after": "low", "shape": "cylinder", "radius": 0.25, "side": "side"},
                    "center": {"body": "base", "axis": [0.2, 0.1, 1.0]},
                },
            ],
            "stiffness": 2.0,
        },
        "through": {
            "points": ["high", "low"],
            "wraps": [
                {
                    **{"after": "high", "shape": "cylinder", "radius": 0.1, "inside": True},
                    "center": {"body": "base", "axis": [0.3, 1.0, 0.2]},
                }
            ],
            "stiffness": 1.0,
        },
    },
    "outputs": {name: {"formula": f"path_length.{name}"} for name in ("around", "through")},
}
PROGRAM = """
const { lines, poses } = JSON.parse(require("fs").readFileSync(0, "utf8"));
const length = (places) => places.slice(1).reduce((sum, place, k) => sum + norm(minus(place, places[k])), 0);
const pose = (row) => (carrier) => carrier < 0 ? { R: matrixOf([1, 0, 0, 0]), p: [0, 0, 0] }
  : { R: matrixOf(row[carrier].slice(0, 4)), p: row[carrier].slice(4) };
const drawn = (line, row) => { const path = pathOf(line, pose(row)); return [length(path), path.length]; };
console.log(JSON.stringify(poses.map((row) => lines.map((line) => drawn(line, row)))));
"""


@pytest.mark.slow
def test_paths_are_as_long_as_the_model_s() -> None:
    node = shutil.which("node")
    if node is None:
        pytest.fail("this test runs the scripts of pages in node, which is not installed")
    model = eomgen.build(SCENE)
    run = model.simulate(3.0, 0.01, record_every=5, error_estimate=False)
    seen = run.poses_and_scenery
    lines = packed(run, seen)["springs"]
    poses = np.stack(list(seen.poses.values()), axis=1)
    program = GEOMETRY.read_text(encoding="utf-8") + PROGRAM
    data = json.dumps({"lines": lines, "poses": poses.tolist()})
    done = subprocess.run([node, "-e", program], input=data, capture_output=True, text=True, timeout=60, check=True)
    drawn = np.array(json.loads(done.stdout))
    names = [line["name"] for line in lines]
    lengths = np.stack([run.outputs[name] for name in names], axis=1)
    np.testing.assert_allclose(drawn[:, :, 0], lengths, rtol=5e-4)
    touched = drawn[:, :, 1] > [3, 2]
    assert np.all(np.count_nonzero(touched, axis=0) > 10)
    assert not np.all(touched[:, 1])  # the path leaves the ring
