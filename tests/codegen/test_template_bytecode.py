"""The bytecode of templates is kept in a folder that can be written, and made anew where it is not whole."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import jinja2
import pytest

from eomgen.codegen.targets.c.templates import kept_bytecode


class Counting(jinja2.Environment):
    """Counts the templates that it compiles."""

    compiled = 0

    def _generate(self, *arguments: object, **options: object) -> str:
        Counting.compiled += 1
        return super()._generate(*arguments, **options)  # type: ignore[arg-type, no-any-return]


@pytest.fixture(autouse=True)
def _no_own_bytecode(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "dont_write_bytecode", True)


def rendered(*folders: Path, text: str = "{{ 2 * x }}") -> tuple[str, int]:
    """Return what a template gives in a new environment, and how many templates were compiled for it."""
    Counting.compiled = 0
    environment = Counting(loader=jinja2.DictLoader({"a": text}), bytecode_cache=kept_bytecode(*folders))
    return environment.get_template("a").render(x=21), Counting.compiled


@pytest.mark.parametrize("size", [0, 10, 40, -1])
def test_bytecode_that_is_not_whole_or_of_another_text_is_made_anew(size: int, tmp_path: Path) -> None:
    assert [rendered(tmp_path), rendered(tmp_path)] == [("42", 1), ("42", 0)]
    [file] = tmp_path.iterdir()
    file.write_bytes(file.read_bytes()[:size])
    assert [rendered(tmp_path), rendered(tmp_path)] == [("42", 1), ("42", 0)]
    assert rendered(tmp_path, text="{{ 3 * x }}") == ("63", 1)


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root makes files of others")
def test_bytecode_in_a_folder_of_another_user_is_not_run(tmp_path: Path) -> None:
    tmp_path.chmod(0o777)
    folder = tmp_path / "templates"
    rendered(folder)
    os.chown(folder, 54321, 54321)
    assert rendered(folder) == ("42", 1)


def test_bytecode_is_kept_in_the_next_folder_if_the_first_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    first, second = tmp_path / "file" / "templates", tmp_path / "cache"
    assert [rendered(first, second), rendered(first, second), rendered(second)] == [("42", 1), ("42", 0), ("42", 0)]
    assert rendered(first) == ("42", 1)
    [kept] = second.iterdir()
    kept.unlink()
    kept.mkdir()  # what is written cannot take this name
    assert rendered(second) == ("42", 1)
    assert list(second.iterdir()) == [kept]
