"""The options ``--quiet`` and ``--strict`` of verbs whose output names doubts."""

from __future__ import annotations

import click

from eomgen.cli.parts import AddedOption, RestPart, RunPart
from eomgen.errors import Problem, UsageError
from eomgen.products.doubts.settings import add_settings, fault_of_name


def _silence(_context: click.Context, _: click.Parameter, names: tuple[str, ...]) -> None:
    """Leave out the doubts with these names as long as the verb runs. Raises UsageError for an unknown name."""
    for name in names:
        if unknown := fault_of_name(name):
            raise UsageError(Problem(f"--quiet {name}", *unknown))
    add_settings(names)


def _refuse(_context: click.Context, _: click.Parameter, strict: bool) -> bool:
    """Make errors of doubts as long as the verb runs, if ``strict``, which is returned."""
    add_settings(strict=strict)
    return strict


def _options(behind: str) -> tuple[AddedOption, ...]:
    quiet = "Leave out a doubt by its name; may be repeated."
    strict = "Make errors of doubts, and refuse elements that an importer would leave out with a note."
    return (
        AddedOption(
            "--quiet", behind=behind, multiple=True, metavar="NAME", help=quiet, callback=_silence, expose_value=False
        ),
        AddedOption("--strict", behind="--quiet", is_flag=True, help=strict, callback=_refuse),
    )


class DoubtsOfRuns(RunPart):
    """Options of ``eomgen simulate``."""

    OPTIONS = _options("--over")


class DoubtsOfRests(RestPart):
    """Options of ``eomgen equilibrium``."""

    OPTIONS = _options("--all")
