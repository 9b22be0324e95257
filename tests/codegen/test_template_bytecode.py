"""The bytecode of templates is kept, and made anew where it is not whole or of another template."""

from __future__ import annotations

import os
from pathlib import Path

import jinja2
import pytest

from eomgen.codegen.targets.c.templates import TemplateBytecode


class Counting(jinja2.Environment):
    """Counts the templates that it compiles."""

    compiled = 0

    def _generate(self, *arguments: object, **options: object) -> str:
        Counting.compiled += 1
        return super()._generate(*arguments, **options)  # type: ignore[arg-type, no-any-return]


def rendered(*folders: Path, text: str = "{{ 2 * x }}") -> tuple[str, int]:
    """Return what a template gives in a new environment, and how many templates were compiled for it."""
    Counting.compiled = 0
    environment = Counting(loader=jinja2.DictLoader({"a": text}), bytecode_cache=TemplateBytecode(*folders))
    return environment.get_template("a").render(x=21), Counting.compiled


def test_a_template_is_compiled_once(tmp_path: Path) -> None:
    folder = tmp_path / "templates"
    assert [rendered(folder), rendered(folder)] == [("42", 1), ("42", 0)]
    assert rendered(folder, text="{{ 3 * x }}") == ("63", 1)


@pytest.mark.parametrize("size", [0, 10, 40, -1])
def test_bytecode_that_is_not_whole_is_made_anew(size: int, tmp_path: Path) -> None:
    rendered(tmp_path)
    [file] = tmp_path.iterdir()
    file.write_bytes(file.read_bytes()[:size])
    assert [rendered(tmp_path), rendered(tmp_path)] == [("42", 1), ("42", 0)]


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root makes files of others")
@pytest.mark.parametrize("whose", ["folder", "file"])
def test_bytecode_that_another_user_has_put_there_is_not_run(whose: str, tmp_path: Path) -> None:
    tmp_path.chmod(0o777)
    folder = tmp_path / "templates"
    rendered(folder)
    [file] = folder.iterdir()
    os.chown(folder if whose == "folder" else file, 54321, 54321)
    assert rendered(folder) == ("42", 1)


def test_bytecode_is_kept_in_the_next_folder_if_the_first_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    folders = tmp_path / "file" / "templates", tmp_path / "cache"
    assert [rendered(*folders), rendered(*folders), rendered(folders[1])] == [("42", 1), ("42", 0), ("42", 0)]


def test_templates_are_rendered_where_nothing_can_be_kept(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    assert rendered(tmp_path / "file" / "templates") == ("42", 1)
    assert rendered(tmp_path / "nowhere" / "templates") == ("42", 1)
    (tmp_path / "templates").mkdir()
    folder = tmp_path / "templates"
    rendered(folder)
    [kept] = folder.iterdir()
    kept.unlink()
    kept.mkdir()  # what is written cannot take this name
    assert rendered(folder) == ("42", 1)
    assert list(folder.iterdir()) == [kept]
