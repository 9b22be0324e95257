"""The file of an FMU: its folder is made, devices and folders are refused, and sources alone need no compiler."""

from __future__ import annotations

import zipfile
from pathlib import Path

import pytest

import eomgen
from eomgen.cli import main
from eomgen.errors import FileError
from eomgen.products.fmu import export
from tests.models.scenes import PENDULUM_TOML


def scene_file(folder: Path) -> Path:
    file = folder / "scene.toml"
    file.write_text(PENDULUM_TOML, encoding="utf-8")
    return file


def test_sources_alone_need_no_compiler_and_the_folder_is_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("CC", "/nowhere/cc")
    monkeypatch.setenv("EOMGEN_CACHE", str(tmp_path / "cache"))
    file = tmp_path / "new" / "folder" / "pendulum.fmu"
    assert main(["fmu", str(scene_file(tmp_path)), "--out", str(file), "--no-binary"]) == 0, capsys.readouterr().err
    with zipfile.ZipFile(file) as archive:
        names = archive.namelist()
    assert "modelDescription.xml" in names
    assert not [name for name in names if name.startswith("binaries/") or name.endswith(".csv")]


@pytest.mark.parametrize(("target", "kind"), [("/dev/null", "no regular file"), ("", "a folder")])
def test_targets_that_are_no_files_are_refused_before_the_work(
    target: str, kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(export, "fmu_files", lambda *_, **__: pytest.fail("the work was done"))
    path = Path(target or tmp_path)
    with pytest.raises(FileError) as caught:
        eomgen.fmu(PENDULUM_TOML, path)
    text = f"input/output error: {path}: this is {kind}, and a file is to be written; try: the name of a new file"
    assert str(caught.value) == text
    assert path.exists() and not path.is_file()
