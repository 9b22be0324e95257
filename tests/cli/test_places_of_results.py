"""Options of files and folders for results: a place that takes none is refused before the work, for every command."""

from __future__ import annotations

from pathlib import Path

import click
import pytest

import eomgen
from eomgen.cli import commands, main


def options() -> list[tuple[str, click.Option]]:
    """Return every option of a place for results, with the name of its command."""
    group = commands
    found = []
    for name in group.list_commands(click.Context(group)):
        command = group.get_command(click.Context(group), name)
        assert command is not None
        found += [(name, option) for option in command.params if {"--out", "--plot"} & set(option.opts)]
    return [(name, option) for name, option in found if isinstance(option, click.Option) and not option.is_flag]


@pytest.mark.parametrize(
    ("name", "option"), options(), ids=lambda part: part if isinstance(part, str) else part.opts[0]
)
def test_a_place_that_takes_no_results_is_refused_as_the_words_are_read(
    name: str, option: click.Option, tmp_path: Path
) -> None:
    assert option.callback is not None
    context = click.Context(click.Command(name))
    ending = "" if option.metavar == "DIR" else (option.metavar or "").removeprefix("FILE") or ".json"
    new = tmp_path / "new" / f"result{ending}"
    assert option.callback(context, option, str(new)) == str(new)
    assert not new.parent.exists()
    assert option.callback(context, option, None) is None
    (tmp_path / "file").write_text("no folder", encoding="utf-8")
    with pytest.raises(eomgen.FileError, match=r"file: this is a file, and a folder is needed"):
        option.callback(context, option, str(tmp_path / "file" / "below" / f"result{ending}"))
    with pytest.raises(eomgen.UsageError, match=r"the name of the (file|folder) is empty"):
        option.callback(context, option, " ")


def test_every_command_with_results_of_long_work_is_among_them() -> None:
    assert {"animate", "equilibrium", "live", "report", "simulate", "tune", "tradeoff"} <= {
        name for name, _ in options()
    }


def test_the_place_is_looked_at_before_the_scene(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").touch()
    for verb in ("live", "report", "animate"):
        place = tmp_path / "file" / "page.html"
        assert main([verb, str(tmp_path / "missing.toml"), "--out", str(place)]) == eomgen.FileError.exit_code
        assert capsys.readouterr().err.startswith(f"input/output error: {place.parent}: this is a file, and a folder")
