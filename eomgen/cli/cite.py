"""``eomgen cite``: BibTeX of eomgen and of the papers of methods."""

from __future__ import annotations

import click

from eomgen.base.version import __version__
from eomgen.cli.options import completed_methods, debug_option, json_option
from eomgen.cli.printing import print_json

_OWN = f"""@software{{eomgen,
  author    = {{{{The eomgen authors}}}},
  title     = {{eomgen: equations of motion in separated form, as readable {{C}}}},
  version   = {{{__version__}}},
  year      = {{2026}},
  license   = {{MIT}},
}}"""


@click.command()
@click.argument("methods", metavar="[METHOD]...", nargs=-1, shell_complete=completed_methods)
@json_option
@debug_option
def cite(methods: tuple[str, ...], as_json: bool) -> None:
    """Print BibTeX of eomgen and of the papers of each METHOD.

    A METHOD is a name as of --method of eomgen simulate, or a scene file, whose method is meant.
    """
    from eomgen.pipeline.citations import papers_of_methods  # noqa: PLC0415  # imported when the arguments are known

    entries = [_OWN, *papers_of_methods(methods)]
    if as_json:
        print_json([entry.partition("{")[2].partition(",")[0] for entry in entries])
    else:
        click.echo("\n\n".join(entries))
