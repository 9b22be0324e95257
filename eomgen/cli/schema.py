"""``eomgen schema``: the JSON Schema of scene files, and of Hamiltonian systems."""

from __future__ import annotations

import click

from eomgen.cli.options import debug_option


@click.command()
@click.option(
    "--kind",
    type=click.Choice(["scene", "hamiltonian", "fields"]),
    default="scene",
    help="Of scenes; of Hamiltonian systems of coordinates, or of fields on a mesh.",
)
@debug_option
def schema(kind: str) -> None:
    """Print the JSON Schema of files, for editors and checkers."""
    if kind == "scene":
        from eomgen.scene.document.json_schema import json_schema  # noqa: PLC0415  # pydantic comes with it

        click.echo(json_schema(), nl=False)
        return
    from eomgen.products.fields.documents.json_schema import json_schema as of_hamiltonians  # noqa: PLC0415  # for these alone

    click.echo(of_hamiltonians(mesh=kind == "fields"), nl=False)
