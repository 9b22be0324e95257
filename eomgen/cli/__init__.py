"""The command line: one command per verb; it prints, and computes nothing.

Exit codes: 0 fine, 2 usage, 3 description, 4 model, 5 toolchain, 6 numerical, 7 input and output, 130 interrupted.
"""

from __future__ import annotations

import os
import sys
import traceback
import warnings
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import TextIO

import click

from eomgen.cli.options import debug_option
from eomgen.errors import EomgenError, FileError, Problem, UsageError
from eomgen.version import __version__

INTERRUPTED = 130

#: Each verb with its line in the list of commands, and the module that holds it: only the one asked for is imported.
VERBS: dict[str, tuple[str, str]] = {
    "info": ("Degrees of freedom, kept and dropped terms, operation counts.", "eomgen.cli.info"),
    "generate": ("Write the model and its stepper as a folder of C.", "eomgen.cli.generate"),
    "savings": ("Costs as asked, against more than is asked for.", "eomgen.cli.savings"),
    "check": ("Hold every closed form against differences and complex steps.", "eomgen.cli.check"),
    "equilibrium": ("Find where a scene comes to rest.", "eomgen.cli.equilibrium"),
    "linearize": ("Modes, stability and responses of the linear model.", "eomgen.cli.linearize"),
    "simulate": ("Integrate, and save the solution with plots.", "eomgen.cli.simulate"),
    "ensemble": ("Run many samples of what varies: statistics and sensitivities.", "eomgen.cli.ensemble"),
    "random": ("Distribution of an output under random processes, and its tails.", "eomgen.cli.random"),
    "identify": ("Unknown parameters of a scene from measured runs, with intervals.", "eomgen.cli.identify"),
    "sample": ("Sample fields on a mesh from their posterior, by Hamiltonian Monte Carlo.", "eomgen.cli.sample"),
    "animate": ("Write the motion as one HTML page in three dimensions.", "eomgen.cli.animate"),
    "tradeoff": ("Measure speed against accuracy: methods, formulations, steps.", "eomgen.cli.tradeoff"),
    "tune": ("Find the cheapest settings that meet a demand on the error.", "eomgen.cli.tune"),
    "extremes": ("Map what holds, is said and fails under extreme conditions.", "eomgen.cli.extremes"),
    "schema": ("Print the JSON Schema of scene files.", "eomgen.cli.schema"),
    "doctor": ("Examine the machine: compiler, headers, cache, packages.", "eomgen.cli.doctor"),
}


class _Verbs(click.Group):
    """A group that imports a command when it is called; the list of commands needs none of them."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(VERBS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in VERBS:
            return None
        command = getattr(import_module(VERBS[cmd_name][1]), cmd_name)
        return command if isinstance(command, click.Command) else None

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and args[0] not in VERBS and not args[0].startswith("-"):
            from eomgen.cli.mistakes import of_verb  # noqa: PLC0415  # for a mistake only
            from eomgen.text import shown  # noqa: PLC0415

            raise UsageError(Problem("eomgen", f"there is no verb {shown(args[0])}", of_verb(args[0], VERBS)))
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(verb, text) for verb, (text, _) in VERBS.items()])


@click.group(cls=_Verbs, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, "--version", message="%(prog)s %(version)s")
@debug_option
def commands() -> None:
    """Equations of motion in separated form, as readable C, from the description of a mechanical scene.

    Exit codes: 0 fine, 2 usage, 3 description, 4 model, 5 toolchain, 6 numerical, 7 input and output, 130 interrupted.
    """


def _called(words: Sequence[str]) -> object:
    """Return the result of a command. Raises BrokenPipeError in place of the exit with 1, by which click answers
    it: all else that goes wrong is raised."""
    try:
        return commands.main(list(words), prog_name="eomgen", standalone_mode=False)
    except SystemExit as error:
        if error.code == 1:
            raise BrokenPipeError from None
        raise


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command line and return its exit code; messages go to stderr, without a traceback unless ``--debug`` is
    given."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    try:
        _check_streams()
        if {"-v", "--verbose"} & set(words):
            _talk()
        with warnings.catch_warnings():
            warnings.showwarning = _show_warning
            result = _called(words)
        return result if isinstance(result, int) else 0
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message(), err=True)
        return error.exit_code
    except click.UsageError as error:
        from eomgen.cli.mistakes import of_usage, what_of_usage  # noqa: PLC0415  # for a mistake only

        path = error.ctx.command_path if error.ctx is not None else "eomgen"
        text = what_of_usage(error)
        click.echo(
            UsageError(Problem(path, text[:1].lower() + text[1:], of_usage(error, path, words))).report(), err=True
        )
        return error.exit_code
    except (click.Abort, KeyboardInterrupt):
        click.echo("interrupted", err=True)
        return INTERRUPTED
    except BrokenPipeError:  # the reader of our output has gone, which is no error of ours
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except EomgenError as error:
        if "--debug" in words:
            traceback.print_exc()
        click.echo(error.report(), err=True)
        return error.exit_code
    except OSError as error:
        if "--debug" in words:
            traceback.print_exc()
        file = f"{error.filename}: " if error.filename is not None else ""
        reason = error.strerror or error
        click.echo(f"{FileError.title}: {file}{reason}; try: space on the disk, and where the output goes", err=True)
        _drop_what_cannot_be_written()
        return FileError.exit_code
    except Exception as error:
        if "--debug" in words:
            traceback.print_exc()
        click.echo(
            f"internal error: {type(error).__name__}: {error}; this is a fault of eomgen; try: the same with --debug",
            err=True,
        )
        return 1


def _drop_what_cannot_be_written() -> None:
    """Leave nothing in stdout that Python would try to write once more when it ends, with an exit code of its own."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _talk() -> None:
    """Write what the loggers of the package say to stderr."""
    import logging  # noqa: PLC0415  # most runs are silent

    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(logging.Formatter("%(name)s: %(message)s"))
    logger = logging.getLogger("eomgen")
    logger.handlers = [handler]
    logger.setLevel(logging.DEBUG)


def _check_streams() -> None:
    """Give closed standard streams, as under some daemons, somewhere to go: libraries expect them to be open."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            # open as long as the process
            setattr(sys, name, Path(os.devnull).open("w", encoding="utf-8"))  # noqa: SIM115


def _show_warning(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    click.echo(f"warning: {message}", err=True)
