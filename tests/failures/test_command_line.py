"""The command line with unusual streams, folders and warnings: one line on stderr, and the exit code of its kind."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import eomgen
from eomgen.cli import main
from tests.messages.answers import plain
from tests.models.scenes import PENDULUM_TOML

ROOT = Path(eomgen.__file__).parents[1]


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    file = tmp_path / "shaken.toml"
    file.write_text(PENDULUM_TOML)
    return file


@pytest.mark.parametrize("verb", ["simulate", "generate"])
def test_an_empty_folder_name_is_refused(scene: Path, capsys: pytest.CaptureFixture[str], verb: str) -> None:
    assert main([verb, str(scene), "--out", ""]) == 2
    message = "usage error: --out: the name of the folder is empty; try: --out . for this folder\n"
    assert plain(capsys.readouterr().err) == message


def test_a_folder_that_cannot_be_written_is_named(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["generate", str(scene), "--out", str(scene / "c")]) == 7
    fault = f"input/output error: {scene}: this is a file, and a folder is needed; try: another folder"
    assert plain(capsys.readouterr().err) == f"{fault}\n"


@pytest.mark.slow
@pytest.mark.long_except("words0")
@pytest.mark.parametrize("words", [["schema"], ["info", "SCENE", "--json"], ["info", "SCENE"]])
def test_a_full_disk_behind_stdout_is_an_error_of_output(scene: Path, words: list[str]) -> None:
    command = [sys.executable, "-m", "eomgen", *(str(scene) if word == "SCENE" else word for word in words)]
    with Path("/dev/full").open("w") as full:
        result = subprocess.run(
            command, stdout=full, stderr=subprocess.PIPE, text=True, cwd=ROOT, check=False, timeout=60
        )
    assert (result.returncode, result.stderr) == (
        7,
        "input/output error: No space left on device; try: free space on the disk, or another path of the output"
        " [E0024]\n",
    )


def test_closed_streams_are_no_error(scene: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdout", None)
    monkeypatch.setattr(sys, "stderr", None)
    assert main(["info", str(scene), "--json"]) == 0
    assert main(["info", str(scene.with_name("none.toml"))]) == 7


@pytest.mark.slow
def test_a_warning_is_one_line_without_python(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("EOMGEN_CACHE", str(scene))
    out = tmp_path / "out"
    assert main(["simulate", str(scene), "--out", str(out), "--t-end", "0.01", "--no-plots"]) == 0
    first, *rest = capsys.readouterr().err.splitlines()
    assert first.startswith(f"warning: the cache {scene} cannot be written (Not a directory); building in ")
    assert len(rest) == 2
