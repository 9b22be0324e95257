"""The command line with unusual streams, folders and warnings: one line on stderr, and the exit code of its kind."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import eomgen
from eomgen.cli import main
from tests.models.scenes import PENDULUM_TOML

ROOT = Path(eomgen.__file__).parents[1]


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    file = tmp_path / "shaken.toml"
    file.write_text(PENDULUM_TOML)
    return file


@pytest.mark.slow
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
