"""``eomgen schema``: the JSON Schema of scene files."""

from __future__ import annotations

import click

from eomgen.cli.options import debug_option


@click.command()
@debug_option
def schema() -> None:
    """Print the JSON Schema of scene files, for editors and checkers."""
    from eomgen.scene.document.json_schema import json_schema  # noqa: PLC0415  # pydantic comes with it

    click.echo(json_schema(), nl=False)
