"""``eomgen schema``: the JSON Schema of scene files, and of other kinds of files."""

from __future__ import annotations

import click

from eomgen.cli.options import debug_option
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
    from eomgen.scene.document.reference import json_schema  # noqa: PLC0415  # the other kinds need no schema of scenes

    click.echo(json_schema(), nl=False)
