"""``eomgen doctor``: checks of the build requirements."""

from __future__ import annotations

import dataclasses

import click

from eomgen.cli.options import debug_option, json_option
from eomgen.cli.printing import print_json, print_table, say
from eomgen.errors import ToolchainError


@click.command()
@click.option("--quiet", is_flag=True, help="Print failed checks only.")
@json_option
@debug_option
def doctor(quiet: bool, as_json: bool) -> int:
    """Examine the tools for building models, and name the remedy of each fault."""
    from eomgen.toolchain.doctor import examine  # noqa: PLC0415  # looks for the compiler

    checks = [check for check in examine() if not (quiet and check.ok)]
    if as_json:
        print_json([dataclasses.asdict(check) for check in checks])
    elif checks:
        marks = {(True, True): "fine", (True, False): "fine", (False, True): "BROKEN", (False, False): "worse"}
        rows = [(check.name, marks[check.ok, check.needed], check.found, check.remedy) for check in checks]
        print_table("", ("item", "", "found", "try"), rows)
    broken = [check.name for check in checks if check.needed and not check.ok]
    if broken:
        say(f"models cannot be built: {', '.join(broken)}")
    return ToolchainError.exit_code if broken else 0
