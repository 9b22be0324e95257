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
    arguments: tuple[str, ...],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    caplog: pytest.LogCaptureFixture,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("scene.toml").write_text(PENDULUM_TOML + _UNUSED, encoding="utf-8")
    verb, *options = arguments
    code = main([verb, "scene.toml", *options])
    told = capsys.readouterr()
    assert code == 0, told.err
    assert told.err.count("note: the parameter unused changes nothing: no formula mentions it") == 1
    assert "changes nothing" not in caplog.text  # which goes to stderr in a process without logging


def test_generate_says_which_method_it_takes_for_auto(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("scene.toml").write_text(PENDULUM_TOML, encoding="utf-8")
    assert main(["generate", "scene.toml", "--method", "auto", "--out", "code"]) == 0
    assert "files, with steps by generalized_alpha (auto chooses at runs alone); README" in capsys.readouterr().err
    readme = Path("code/README.md").read_text(encoding="utf-8")
    assert "Method: generalized-alpha on Lie groups: the scene asks for `auto`, which chooses" in readme
    assert json.loads(Path("code/manifest.json").read_text())["method"] == "generalized-alpha on Lie groups"
    Path("scene.toml").write_text(PENDULUM_TOML + 'method = "auto"\n', encoding="utf-8")
    assert main(["info", "scene.toml"]) == 0
    assert "note" not in capsys.readouterr().err
    assert main(["generate", "scene.toml", "--terms", "mass", "--out", "mass"]) == 0
    assert "6 files; README" in capsys.readouterr().err
