"""Start values of FMUs by ``initial``, starts that are moved, author and licence of a model, options of the command."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import fmpy
import numpy as np
import pytest

import eomgen
from eomgen.cli import main
from eomgen.products.fmu.export import fmu_files
from tests.fmu.test_calls import ranged_ball, unit_of
from tests.models.library import scene, scene_file

EXAMPLES = Path(__file__).parents[2] / "examples"
FOUR_BAR = EXAMPLES / "four_bar" / "scene.toml"


def starts_of(text: str) -> dict[str, float]:
    """Return the start values of a model description of FMI 3.0."""
    variables = ET.fromstring(text).find("ModelVariables")
    assert variables is not None
    return {item.get("name", ""): float(item.get("start", "nan")) for item in variables}


@pytest.mark.slow
def test_initial_values_in_loops_are_those_of_a_run() -> None:
    files = fmu_files(FOUR_BAR, binary=False, reference=False, initial={"crank_pin": 0.9})
    starts = starts_of(str(files.files["modelDescription.xml"]))
    model = eomgen.build(FOUR_BAR, profile="reproducible")
    run = model.start(initial={"crank_pin": 0.9})
    assert [starts[name] for name in (*model.q_names, *model.v_names)] == [*run.q, *run.v]
    assert not np.allclose(run.q, model.initial_q, atol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("version", [2, 3])
def test_a_start_that_is_moved_is_in_the_log(version: int) -> None:
    unit = unit_of("four_bar", version, "cs")
    assert unit.messages == []
    unit = unit_of("four_bar", version, "cs", start=False)
    unit.set({"q.crank_pin": 0.9})
    unit.fmu.enterInitializationMode()
    unit.fmu.exitInitializationMode()
    moved = [message for message in unit.messages if message.startswith("the start moves q.crank_pin from 0.9 to ")]
    assert len(moved) == 1
    assert float(moved[0].rsplit(" ", 1)[1]) == pytest.approx(unit.get("q.crank_pin")[0], rel=1e-8)
    model = eomgen.build(FOUR_BAR)
    q = np.array(unit.get(*model.q_names))
    assert np.max(np.abs(model.consistent(q, np.zeros(model.nv)).q - q)) < 1e-12


@pytest.mark.parametrize("version", [2, 3])
def test_author_and_licence_are_those_of_the_model(version: int, tmp_path: Path) -> None:
    text = tmp_path / "licence.txt"
    text.write_text("Do as you like.", encoding="utf-8")
    options: dict[str, Any] = {
        "author": "Ada L.",
        "model_version": "1.4",
        "copyright": "(c) 2026 Ada L.",
        "license": "proprietary",
        "license_file": text,
        "description": "a ball & its ground",
    }
    files = fmu_files(ranged_ball(), version=version, binary=False, reference=False, **options).files
    (tmp_path / "modelDescription.xml").write_text(str(files["modelDescription.xml"]), encoding="utf-8")
    read = fmpy.read_model_description(str(tmp_path))
    assert (read.author, read.version, read.copyright) == ("Ada L.", "1.4", "(c) 2026 Ada L.")
    assert (read.license, read.description) == ("proprietary", "a ball & its ground")
    licence = str(files["documentation/licenses/license.txt"])
    assert "licence: proprietary" in licence and "author: Ada L." in licence and "text: model.txt" in licence
    assert files["documentation/licenses/model.txt"] == "Do as you like."
    assert "Copyright (c) 2026 the eomgen authors" in str(files["documentation/licenses/eomgen.txt"])


def test_licences_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(eomgen.FileError, match="cannot be read: No such file or directory"):
        fmu_files(ranged_ball(), binary=False, license_file=tmp_path / "none.txt")
    (tmp_path / "binary.txt").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(eomgen.FileError, match="the licence is not a text in UTF-8"):
        fmu_files(ranged_ball(), binary=False, license_file=tmp_path / "binary.txt")


@pytest.mark.slow
def test_the_command_takes_versions_and_types_as_people_write_them(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "balls.fmu"
    data = scene_file(tmp_path, "balls")
    words = ["fmu", str(data), "-o", str(file), "--no-binary", "--version", "2.0", "--type", "CS, me"]
    assert main([*words, "--initial", "left=0.25", "--author", "Ada", "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    with zipfile.ZipFile(file) as archive:
        text = archive.read("modelDescription.xml").decode()
    token = facts.pop("token")
    assert f'guid="{token}"' in text and 'author="Ada"' in text and 'start="0.25"' in text
    counts = [facts[key] for key in ("version", "states", "inputs", "event_indicators", "variables", "bytes")]
    assert facts["types"] == ["me", "cs"] and counts == [2, 4, 0, 2, 9, file.stat().st_size]


def test_inputs_of_scenes_without_inputs() -> None:
    with pytest.raises(eomgen.UsageError, match="no input 'push'; try: no --input, since the scene has no inputs"):
        fmu_files(scene("balls"), binary=False, inputs=["push"])


@pytest.mark.parametrize(("name", "identifier"), [("_Bool", "_Bool_model"), ("math", "math_model"), ("Int", "Int")])
def test_names_of_scenes_that_are_words_of_c(name: str, identifier: str) -> None:
    made = fmu_files(scene("balls", name=name), binary=False, reference=False)
    text = str(made.files["modelDescription.xml"])
    assert f'modelName="{name}"' in text and text.count(f'modelIdentifier="{identifier}"') == 2
    assert f"sources/{identifier}_fmi3.c" in made.files
