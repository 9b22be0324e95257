"""Notes that reading a scene has made: every verb that loads a scene prints each of them once, to stderr."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from eomgen.cli import main
from tests.models.scenes import PENDULUM_TOML

#: Nothing depends on it, which is a note.
_UNUSED = "\n[parameters.unused]\nvalue = 1.0\n"
_RUN = ("--t-end", "0.01", "--step", "1e-3")


@pytest.mark.slow_cases("ensemble")
@pytest.mark.parametrize(
    "arguments",
    [
        ("equilibrium",),
        ("linearize",),
        ("simulate", *_RUN, "--no-plots", "--out", "run"),
        ("ensemble", *_RUN, "--vary", "q.hinge=normal(0, 0.1)", "--samples", "2", "--no-plots", "--out", "many"),
        ("generate", "--out", "code"),
    ],
    ids=lambda arguments: arguments[0],
)
def test_every_verb_prints_the_notes_of_its_scene(
    arguments: tuple[str, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("scene.toml").write_text(PENDULUM_TOML + _UNUSED, encoding="utf-8")
    verb, *options = arguments
    code = main([verb, "scene.toml", *options])
    told = capsys.readouterr()
    assert code == 0, told.err
    assert told.err.count("note: the parameter unused changes nothing: no formula mentions it") == 1


def test_generate_says_which_method_it_takes_for_auto(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("scene.toml").write_text(PENDULUM_TOML, encoding="utf-8")
    assert main(["generate", "scene.toml", "--method", "auto", "--out", "code"]) == 0
    assert "files with steps of generalized_alpha, as auto chooses before runs alone; README" in capsys.readouterr().err
    readme = Path("code/README.md").read_text(encoding="utf-8")
    assert "Method: generalized-alpha on Lie groups: the scene asks for `auto`, which chooses" in readme
    assert json.loads(Path("code/manifest.json").read_text())["method"] == "generalized-alpha on Lie groups"
    Path("scene.toml").write_text(PENDULUM_TOML + 'method = "auto"\n', encoding="utf-8")
    assert main(["info", "scene.toml"]) == 0
    assert "note" not in capsys.readouterr().err


def test_info_has_notes_on_shapes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Compiled libraries are without these, since shapes are of pictures alone."""
    file = tmp_path / "scene.toml"
    file.write_text(
        """
        format = 1
        name = "arm"
        bodies.arm = { mass = 1, inertia = [0.01, 0.01, 0.001], center_of_mass = [0.2, 0, 0] }
        joints.hinge = { type = "revolute", parent = "base", child = "arm", axis = [0, 1, 0] }
        points.tip = { body = "arm", position = [0.4, 0, 0] }
        outputs.tip = { position = "tip" }
        shapes.wheel = { body = "arm", type = "sphere", radius = 310 }
        """,
        encoding="utf-8",
    )
    note = "shapes.wheel: the size of the shape is 310 m, and the scene is no larger than 0.4 m"
    assert main(["info", str(file), "--json"]) == 0
    (found,) = json.loads(capsys.readouterr().out)["notes"]
    assert found.startswith(note)
    assert main(["info", str(file)]) == 0
    assert "the size of the shape is 310 m" in " ".join(capsys.readouterr().out.split())
