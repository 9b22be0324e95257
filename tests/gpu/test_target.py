"""The folder of the target ``cuda``: README and manifest."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import eomgen
from tests.models.library import scene


def test_readme_and_manifest_have_the_arrays_of_kernels_and_the_options(tmp_path: Path) -> None:
    eomgen.generate(scene("arm"), tmp_path, ["mass"], target="cuda", real="float")
    readme = (tmp_path / "README.md").read_text(encoding="utf-8")
    data = json.loads((tmp_path / "manifest.json").read_text(encoding="utf-8"))
    assert "| `arm_mass_kernel` | q 2 | M 4 |" in readme
    assert 'arrays = [cupy.zeros((size, count), "float32") for size in (2, 4)]' in readme
    assert 'kernel = module.get_function("arm_mass_kernel")' in readme and "nvrtc_13" in data
    assert data["nvrtc"] == ["--std=c++20", "-default-device", "-fmad=false", "-DEOMGEN_REAL_FLOAT"]
    assert data["kernels"] == {
        "arm_mass_kernel": {
            "function": "mass",
            "inputs": [{"name": "q", "size": 2}],
            "outputs": [{"name": "M", "size": 4}],
            "threads": 64,
        }
    }
    assert "thread_bytes" not in data


def test_rows_of_tables_in_the_readme_are_lines(tmp_path: Path) -> None:
    eomgen.generate(scene("four_bar/scene"), tmp_path, target="cuda")
    lines = (tmp_path / "README.md").read_text(encoding="utf-8").splitlines()
    rows = [line for line in lines if line.startswith("| `four_bar_")]
    kernels = json.loads((tmp_path / "manifest.json").read_text(encoding="utf-8"))["kernels"]
    assert len(rows) == len(kernels) and all(row.endswith(" |") for row in rows)


def test_a_law_in_python_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "law.py").write_text("def hill(x):\n    return x**2\n", encoding="utf-8")
    law = {"python": "law.py", "function": "hill", "arguments": {"x": "rad"}, "results": {"height": "m"}}
    described = scene("arm", laws={"hill": law}, outputs={"height": {"formula": "law.hill.height(q.elbow)"}})
    with pytest.raises(eomgen.UsageError, match=r"the law is in Python, hill in law\.py: export needs C"):
        eomgen.generate(described, tmp_path / "model", target="cuda")


@pytest.mark.parametrize("target", ["c", "cuda", "casadi"])
def test_terms_that_a_scene_lacks_are_refused(target: str, tmp_path: Path) -> None:
    told = "four_bar has none of the functions that the terms name; try: no terms, for all"
    with pytest.raises(eomgen.UsageError, match=told):
        eomgen.generate(scene("four_bar/scene"), tmp_path / "model", ["forward_dynamics"], target=target)
    assert not (tmp_path / "model").exists()
