"""Compiled models in files: the same bits on a machine without a compiler; other machines and versions are refused."""

from __future__ import annotations

import json
import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.base.files import read_arrays, write_arrays
from eomgen.compiled import saving
from eomgen.pipeline import saved_models
from tests.models.library import scene_text

ROOT = Path(__file__).parents[2]
SCENE = scene_text(
    "pendulum",
    name="saved_pendulum",
    parameters={"length": {"value": 0.7, "tunable": True}},
    bodies__rod__center_of_mass=[0, 0, "-length"],
    outputs={"height": {"formula": "cos(q.hinge)"}},
    simulation={"duration": 0.2, "step": 1e-3, "method": "rk4"},
)
RUN = """
import json, sys
sys.modules["ziglang"] = None
import eomgen
model = eomgen.load_model(sys.argv[1])
runs = [model.simulate(parameters={"length": 0.9}, method=method) for method in (None, "generalized_alpha")]
print(json.dumps({
    "q": [run.q[-1].tolist() for run in runs],
    "M": model.mass([0.3]).tolist(),
    "slow": sorted({"sympy", "jinja2"} & set(sys.modules)),
}))
try:
    model.simulate(method="rk45")
except eomgen.ToolchainError as error:
    print(error)
"""


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a scene, and the scene's compiled model in a file."""
    folder = tmp_path_factory.mktemp("saved")
    (folder / "scene.toml").write_text(SCENE, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("EOMGEN_CACHE", str(folder / "cache"))
        model = eomgen.build(folder / "scene.toml", profile="reproducible")
        assert model.save(folder / "pendulum.eomgen", methods=["generalized_alpha"]) == folder / "pendulum.eomgen"
    return folder


@pytest.fixture
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache, as of another machine."""
    monkeypatch.setenv("EOMGEN_CACHE", str(tmp_path / "cache"))
    return tmp_path


def changed(saved: Path, folder: Path, change: Callable[[dict[str, Any]], object]) -> Path:
    """Return a copy of the file with changed metadata."""
    arrays, metadata = read_arrays(saved / "pendulum.eomgen")
    change(metadata)
    write_arrays(folder / "changed.eomgen", arrays, metadata)
    return folder / "changed.eomgen"


@pytest.mark.slow
def test_a_model_from_a_file_has_the_same_bits_without_a_compiler(saved: Path, tmp_path: Path) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("EOMGEN_CACHE", str(saved / "cache"))
        model = eomgen.build(saved / "scene.toml", profile="reproducible")
        methods = (None, "generalized_alpha")
        runs = [model.simulate(parameters={"length": 0.9}, method=method) for method in methods]
        mass = model.mass([0.3])
    empty = tmp_path / "bin"
    empty.mkdir()
    environment = {name: text for name, text in os.environ.items() if name != "CC"}
    environment |= {"PATH": str(empty), "EOMGEN_CACHE": str(tmp_path / "cache"), "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-c", RUN, str(saved / "pendulum.eomgen")]
    done = subprocess.run(command, env=environment, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    first, error = done.stdout.splitlines()
    assert json.loads(first) == {"q": [run.q[-1].tolist() for run in runs], "M": mass.tolist(), "slow": []}
    assert error.startswith("toolchain error: no C compiler found: looked for cc, gcc, clang on the path, in CC, and")


@pytest.mark.slow
def test_a_loaded_model_is_a_model(saved: Path, elsewhere: Path) -> None:
    model = eomgen.load_model(saved / "pendulum.eomgen")
    assert (model.name, model.parameters["length"], model.scene.name) == ("saved_pendulum", 0.7, "saved_pendulum")
    run = model.simulate(0.05)
    assert run.success and run.outputs["height"].shape == (51,)
    again = pickle.loads(pickle.dumps(model))
    np.testing.assert_array_equal(again.simulate(0.05).q, run.q)
    model.save(elsewhere / "again.eomgen")
    assert eomgen.load_model(elsewhere / "again.eomgen").nq == 1


@pytest.mark.slow
def test_another_python_opens_the_library_without_its_module(
    saved: Path, elsewhere: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = eomgen.load_model(saved / "pendulum.eomgen")
    monkeypatch.setattr(saved_models, "library_suffix", lambda: ".cpython-399.so")
    other = eomgen.load_model(saved / "pendulum.eomgen")
    assert (own.library.mode, other.library.mode) == ("api", "abi")
    np.testing.assert_array_equal(own.mass([0.3]), other.mass([0.3]))


@pytest.mark.slow_except("architecture-pdp11-architecture pdp11, here ")
@pytest.mark.parametrize(
    ("name", "value", "text"),
    [
        ("version of eomgen", "0.0.1", "version of eomgen 0.0.1, here "),
        ("operating system", "Plan9", "operating system Plan9, here "),
        ("architecture", "pdp11", "architecture pdp11, here "),
        ("C library", "musl", "C library musl, here "),
        ("code of eomgen in a checkout", "", "code of eomgen in a checkout none, here "),
    ],
)
def test_a_model_of_another_machine_is_refused(name: str, value: str, text: str, saved: Path, elsewhere: Path) -> None:
    file = changed(saved, elsewhere, lambda metadata: metadata["made for"].update({name: value}))
    with pytest.raises(eomgen.ToolchainError) as caught:
        eomgen.load_model(file)
    assert f"{file}: this model was compiled for another machine or version: {text}" in str(caught.value)
    assert str(caught.value).endswith(
        'try: eomgen.build(scene, profile="reproducible").save(path) on a machine like this one'
    )


def test_a_model_of_another_processor_is_refused_if_its_profile_needs_one(
    saved: Path, elsewhere: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(saving, "processor_digest", lambda: "0" * 16)
    assert eomgen.load_model(saved / "pendulum.eomgen").nq == 1
    file = changed(saved, elsewhere, lambda metadata: metadata.update(profile="fast"))
    with pytest.raises(eomgen.ToolchainError, match="processor, for which profile fast compiles none, here 0000"):
        eomgen.load_model(file)


def test_files_that_are_damaged_or_none_say_so(saved: Path, elsewhere: Path) -> None:
    with pytest.raises(eomgen.FileError, match=r"no\.eomgen: cannot be read: No such file"):
        eomgen.load_model(elsewhere / "no.eomgen")
    part = elsewhere / "part.eomgen"
    part.write_bytes((saved / "pendulum.eomgen").read_bytes()[:-100])
    with pytest.raises(eomgen.FileError, match="this is not a compiled model written by eomgen"):
        eomgen.load_model(part)
    with pytest.raises(
        eomgen.FileError, match=r"not a compiled model written by eomgen: record is missing; try: a file of"
    ):
        eomgen.load_model(changed(saved, elsewhere, lambda metadata: metadata.pop("record")))


@pytest.mark.slow_cases("rule_with_data", "method_of_an_entry", "law_in_c")
@pytest.mark.parametrize(
    "path",
    [
        "bouncing_ball/scene.toml",
        "duffing_random_excitation/system/oscillator.toml",
        "car_in_side_wind/system/car.toml",
    ],
    ids=["rule_with_data", "method_of_an_entry", "law_in_c"],
)
def test_functions_of_rules_and_entries_are_kept(path: str, tmp_path: Path) -> None:
    model = eomgen.build(f"examples/{path}", profile="quick")
    again = eomgen.load_model(model.save(tmp_path / "model.eomgen"))
    runs = [item.simulate(0.02, 1e-3, error_estimate=False) for item in (model, again)]
    assert np.array_equal(runs[0].q, runs[1].q)
