"""The public contract, used as a reader of the README would: names, roads from TOML and from Python, and equal
results."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest

import eomgen
from tests.models.scenes import PENDULUM_TOML, pendulum


@pytest.fixture
def scene_file(tmp_path: Path) -> Path:
    path = tmp_path / "scene.toml"
    path.write_text(PENDULUM_TOML, encoding="utf-8")
    return path


def test_public_names_are_there() -> None:
    for name in eomgen.__all__:
        assert getattr(eomgen, name) is not None
    assert {"load", "derive", "generate", "build", "SceneBuilder", "Scene", "System", "Model", "Solution"} <= set(
        dir(eomgen)
    )
    with pytest.raises(AttributeError, match="module 'eomgen' has no attribute 'simulate'"):
        eomgen.simulate  # type: ignore[attr-defined]  # noqa: B018


def test_a_text_of_terms_is_refused_before_files_are_written(scene_file: Path, tmp_path: Path) -> None:
    with pytest.raises(eomgen.UsageError, match="terms are a list of names, not the text 'mass'; try: terms="):
        eomgen.generate(scene_file, tmp_path / "c", terms="mass")
    assert not (tmp_path / "c").exists()


def test_a_missing_scene_suggests_scenes_only(tmp_path: Path) -> None:
    (tmp_path / "gate.fmu").touch()
    with pytest.raises(eomgen.FileError, match="cannot be read: No such file or directory; try: another path"):
        eomgen.build(tmp_path / "gate.toml")
    (tmp_path / "gates.toml").touch()
    with pytest.raises(eomgen.FileError, match=r"try: .*gates\.toml$"):
        eomgen.build(tmp_path / "gate.toml")


def test_the_page_of_generated_code_explains_parameters_where_there_are_some(scene_file: Path, tmp_path: Path) -> None:
    passage = "From C, parameters are members of a struct"
    robot = Path(__file__).parent / "files" / "twin.urdf"
    for scene, terms, told in ((robot, ["inverse_dynamics"], False), (scene_file, None, True)):
        folder = tmp_path / scene.stem
        eomgen.generate(scene, folder, terms=terms)
        text = (folder / "README.md").read_text(encoding="utf-8")
        assert (passage in text) == told and ("_parameters p;" in text) == told


def test_the_generated_folder_gives_the_same_bits_as_python(scene_file: Path, tmp_path: Path) -> None:
    files = eomgen.generate(eomgen.load(scene_file), tmp_path / "c")
    names = {file.name for file in files}
    assert {"shaken.h", "shaken.c", "shaken_step.c", "main.c", "eomgen_real.h", "README.md", "manifest.json"} <= names
    manifest = json.loads((tmp_path / "c" / "manifest.json").read_text(encoding="utf-8"))
    warnings = ["-Wall", "-Wextra", "-Wpedantic", "-Werror"]
    subprocess.run([*manifest["compile"].split(), *warnings], check=True, cwd=tmp_path / "c")
    words = [str(tmp_path / "c" / "shaken"), "0.5", "0.002", "10"]
    printed = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    rows = np.array([line.split(",") for line in printed.splitlines()[1:]], dtype=float)
    run = eomgen.build(scene_file, profile="reproducible").simulate(0.5, 0.002, record_every=10)
    np.testing.assert_array_equal(rows, np.column_stack([run.t, run.q, run.v, run.a]))


def test_a_method_of_the_scene_that_does_not_exist_is_named_with_its_line(scene_file: Path) -> None:
    scene_file.write_text(PENDULUM_TOML + 'method = "newmrk"\n', encoding="utf-8")
    with pytest.raises(
        eomgen.DescriptionError, match=r"scene\.toml:\d+ \(simulation\.method\): there is no method 'newmrk'"
    ):
        eomgen.build(scene_file)


def test_models_are_built_in_other_number_types(scene_file: Path) -> None:
    single = eomgen.build(scene_file, real="float", profile="quick").simulate(0.2, 1e-3)
    double = pendulum().simulate(0.2, 1e-3)
    assert single.success
    error = np.abs(single.q - double.q).max()
    assert 1e-9 < error < 1e-4
    with pytest.raises(eomgen.UsageError, match="a model cannot be built with real = 'half'; try: double or float"):
        eomgen.build(scene_file, real="half")


def test_the_same_inputs_give_the_same_bits(scene_file: Path) -> None:
    runs = [eomgen.build(scene_file, profile="quick").simulate(0.5, 1e-3) for _ in range(2)]
    np.testing.assert_array_equal(runs[0].q, runs[1].q)
    assert runs[0].metadata == runs[1].metadata
