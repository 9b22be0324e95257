"""The option ``--quiet`` of verbs whose output names doubts."""

from __future__ import annotations

import click

from eomgen.cli.parts import AddedOption, RestPart, RunPart
from eomgen.errors import Problem, UsageError
from eomgen.products.doubts.silence import doubts_of_results, fault_of_name, silenced


def _silence(context: click.Context, _: click.Parameter, names: tuple[str, ...]) -> None:
    """Leave out doubts as long as the verb runs."""
    for name in names:
        if unknown := fault_of_name(name, doubts_of_results()):
            raise UsageError(Problem(f"--quiet {name}", *unknown))
    context.with_resource(silenced(names))


def _option(behind: str) -> AddedOption:
    text = "Leave out a doubt by the name of its finding; may be repeated."
    return AddedOption(
        "--quiet", behind=behind, multiple=True, metavar="NAME", help=text, callback=_silence, expose_value=False
    )


class QuietRun(RunPart):
    """``--quiet`` of ``eomgen simulate``."""

    OPTIONS = (_option("--over"),)


class QuietRest(RestPart):
    """``--quiet`` of ``eomgen equilibrium``."""

    OPTIONS = (_option("--all"),)
