"""``eomgen schema``: the JSON Schema of scenes and other kinds of files; ``eomgen migrate``: files brought to the
present words of their format."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from eomgen.base.messages import shown
from eomgen.cli.options import completed_files, debug_option, json_option, optional_folder
from eomgen.cli.printing import print_json, say
from eomgen.errors import DescriptionError, Problem, UsageError
from eomgen.pipeline.front_end import file_kinds

_OTHERS = {word: schema for kind in file_kinds() for word, schema in kind.schemas.items()}


def _help() -> str:
    """Return the help text of the option: of scenes, and of each other word."""
    texts = [text for text, _ in _OTHERS.values()]
    return f"Of scenes; {', or '.join(filter(None, (', '.join(texts[:-1]), *texts[-1:])))}." if texts else "Of scenes."


@click.command()
@click.option("--kind", type=click.Choice(["scene", *_OTHERS]), default="scene", help=_help())
@debug_option
def schema(kind: str) -> None:
    """Print the JSON Schema of files, for editors and checkers."""
    if kind in _OTHERS:
        click.echo(_OTHERS[kind][1](), nl=False)
        return
    from eomgen.scene.document.reference import json_schema  # noqa: PLC0415  # pydantic comes with it

    click.echo(json_schema(), nl=False)


@click.command()
@click.argument("files", metavar="FILE...", nargs=-1, required=True, shell_complete=completed_files)
@click.option("--check", is_flag=True, help="Write no file; the exit code is 3 if a file has former names of keys.")
@optional_folder("Write to files of the same names in DIR.")
@json_option
@debug_option
def migrate(files: tuple[str, ...], check: bool, folder: str | None, as_json: bool) -> int:
    """Write the present names of keys into scene files, and say the kind and the format of each file.

    Former names are read for ever, with a note. Names alone are changed: comments, order and layout stay. Without
    --out files with former names are overwritten. Included files are not read: name each as an argument.
    """
    from eomgen.base.files import make_folder, write_text  # noqa: PLC0415  # imported with fine arguments

    paths = [Path(file) for file in files]
    if check and folder is not None:
        raise UsageError(Problem("--check", "no file is written, and --out names a folder [E2171]", "one of them"))
    if folder is not None and len({path.name for path in paths}) < len(paths):
        raise UsageError(Problem("--out", "two files have one name [E2172]", "a call for each folder"))
    renewed = [_renew(path) for path in paths]  # all faults come before the first file is written
    for path, (text, report) in zip(paths, renewed, strict=True):
        target = path if folder is None else make_folder(Path(folder)) / path.name
        if not check and (folder is not None or report["changes"]):
            write_text(target, text)
            report["written"] = str(target)
        if not as_json:
            _say_changes(report)
    if as_json:
        print_json([report for _, report in renewed])
    return DescriptionError.exit_code if check and any(report["changes"] for _, report in renewed) else 0


def _renew(path: Path) -> tuple[str, dict[str, Any]]:
    """Return the text of a scene file with the present names of keys, and a report: ``file, kind, format, changes,
    written``. Raises UsageError, FileError and DescriptionError."""
    from eomgen.scene.sources.renamed_keys import renamed_text  # noqa: PLC0415  # imported with fine arguments
    from eomgen.scene.sources.source import kind_of, read_text, shown_file  # noqa: PLC0415
    from eomgen.scene.sources.toml import toml_data  # noqa: PLC0415

    if path.suffix.lower() != ".toml":
        raise UsageError(
            Problem(str(path), "this is not a file in TOML, whose keys eomgen defines [E2173]", "a .toml file")
        )
    text, file = read_text(path), shown_file(path)
    data, lines = toml_data(text, file)
    file_format = data.get("format")
    if file_format != 1 or isinstance(file_format, bool):
        fault = (
            "the key format is missing [E1596]"
            if file_format is None
            else f"this eomgen reads format 1, not {shown(file_format)} [E1479]"
        )
        raise DescriptionError(Problem(f"{file}:{lines.get('format', 1)}", fault, "format = 1"))
    text, changes = renamed_text(text, file)
    rows = [{"line": line, "key": key, **change._asdict()} for line, key, change in changes]
    return text, {"file": str(path), "kind": kind_of(data), "format": 1, "changes": rows, "written": None}


def _say_changes(report: dict[str, Any]) -> None:
    """Say the format of a file, and each former name."""
    for row in report["changes"]:
        since = f"since eomgen {row['version']} of {row['date']}"
        say(f"{report['file']}:{row['line']} ({row['key']}): {row['name']} {since}")
    state = "former names of keys" if report["changes"] else "all keys have their present names"
    written = f"; written to {report['written']}" if report["written"] else ""
    say(f"{report['file']}: {report['kind']}, format {report['format']}, {state}{written}")
