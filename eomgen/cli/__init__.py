"""The command line: one command per verb, which prints the results of the packages below.

Exit codes: 0 fine, 2 usage, 3 description, 4 model, 5 toolchain, 6 numerical, 7 input and output, 130 interrupted.
"""

from __future__ import annotations

import contextlib
import contextvars
import dataclasses
import os
import sys
import traceback
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TextIO

import click

from eomgen.base.extensions import distribution, distribution_of
from eomgen.base.threads import calm_imports
from eomgen.base.verbs import Verb, others, own
from eomgen.base.version import __version__
from eomgen.cli.options import debug_option
from eomgen.errors import EomgenError, FileError, Message, Problem, UsageError

INTERRUPTED = 130

#: eomgen's own verbs with a command, in the order of the list.
VERBS: dict[str, Verb] = {verb.name: verb for verb in own() if verb.command}


class _Verbs(click.Group):
    """A group that imports a command when the command is called; the list of commands needs no command's module.
    Settings that options make for a command end with the command, however it ends and whoever calls the group."""

    def invoke(self, ctx: click.Context) -> object:
        return contextvars.copy_context().run(super().invoke, ctx)

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(_every_verb())

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        verb = _verb_named(cmd_name)
        if verb is None:
            return None
        with calm_imports():
            command: click.Command = verb.imported(
                verb.command, lambda it: isinstance(it, click.Command), "click.Command"
            )
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and not args[0].startswith("-") and _verb_named(args[0]) is None:
            from eomgen.base.messages import shown  # noqa: PLC0415
            from eomgen.base.products import fault_of_absent  # noqa: PLC0415
            from eomgen.cli.mistakes import verb_remedy  # noqa: PLC0415  # for a mistake only

            because, hint = fault_of_absent(args[0]) or ("", verb_remedy(args[0], _every_verb()))
            raise UsageError(
                Problem("eomgen", f"there is no verb {shown(args[0])}{because and ': '}{because} [E0147]", hint)
            )
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        every = _every_verb()
        width = max(map(len, every))
        for heading in dict.fromkeys(verb.heading for verb in every.values()):
            with formatter.section(heading):
                rows = [(name.ljust(width), verb.summary) for name, verb in every.items() if verb.heading == heading]
                formatter.write_dl(rows)
        for fault in others().faults.values():
            click.echo(f"left out: {fault.report()}", err=True)


def _every_verb() -> dict[str, Verb]:
    return VERBS | {name: verb for name, verb in others().verbs.items() if verb.command}


def _verb_named(name: str) -> Verb | None:
    """Return the verb of this name with a command, None if unknown. Raises the error of a faulty distribution."""
    if name in VERBS:
        return VERBS[name]
    if name in others().faults:
        raise others().faults[name]
    return _every_verb().get(name)


_ADDED = [f", eomgen {verb.first_step}" for verb in VERBS.values() if verb.first_step]
_FIRST_STEPS = f"""First steps: eomgen new pendulum, eomgen info pendulum/scene.toml,
eomgen simulate pendulum/scene.toml --out pendulum/out{"".join(_ADDED)}. Options of a verb: eomgen simulate --help."""


@click.group(
    cls=_Verbs,
    epilog=_FIRST_STEPS,
    context_settings={"help_option_names": ["-h", "--help"]},
    invoke_without_command=True,
)
@click.version_option(__version__, "--version", message="%(prog)s %(version)s")
@debug_option
@click.pass_context
def commands(context: click.Context) -> None:
    """Equations of motion in separated form, as readable C, from the description of a mechanical scene.

    Exit codes: 0 fine, 2 usage, 3 description, 4 model, 5 toolchain, 6 numerical, 7 input and output, 130 interrupted.
    """
    if context.invoked_subcommand is None:
        from eomgen.cli.first_steps import welcome  # noqa: PLC0415  # without a verb only

        click.echo(welcome())


def _run_command(words: Sequence[str]) -> object:
    """Return the result of a command. Raises BrokenPipeError in place of the exit with 1, which is click's answer: any
    other error is raised."""
    try:
        return commands.main(list(words), prog_name="eomgen", standalone_mode=False)
    except SystemExit as error:
        raise (BrokenPipeError() if error.code == 1 else error) from None


def _notes(error: BaseException) -> list[str]:
    """Return the notes of interrupted work, each with the progress of the work."""
    return list(getattr(error.__cause__ or error, "__notes__", []))  # click.Abort is raised from Ctrl-C's


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command line and return its exit code; messages go to stderr, without a traceback unless ``--debug`` is
    given."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    try:
        _check_streams()
        with contextlib.ExitStack() as ended, warnings.catch_warnings():
            if {"-v", "--verbose"} & set(words):
                _talk(ended)
            warnings.showwarning = _show_warning
            result = _run_command(words)
        return result if isinstance(result, int) else 0
    except click.UsageError as error:
        from eomgen.cli.mistakes import usage_code, usage_remedy, what_of_usage  # noqa: PLC0415  # for a mistake only

        path = error.ctx.command_path if error.ctx is not None else "eomgen"
        text = what_of_usage(error)
        text = text[:1].lower() + text[1:]
        _show_error(UsageError(Problem(path, text, usage_remedy(error, path, words), usage_code(text))), words)
        return error.exit_code
    except (click.Abort, KeyboardInterrupt) as stop:
        click.echo(": ".join(["interrupted", *_notes(stop)[:1]]), err=True)
        return INTERRUPTED
    except BrokenPipeError:  # the reader of our output has gone, which is not an error of eomgen
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except Exception as error:
        if "--debug" in words:
            traceback.print_exc()
        if isinstance(error, EomgenError):
            _show_error(error, words)
            return error.exit_code
        if isinstance(error, OSError):
            from eomgen.base.files import system_code  # noqa: PLC0415  # for a mistake only

            file, remedy = str(error.filename or ""), "free space on the disk, or another path of the output"
            _show_error(FileError(Problem(file, error.strerror or str(error), remedy, system_code(error))), words)
            _drop_what_cannot_be_written()
            return FileError.exit_code
        if isinstance(error.__cause__, KeyboardInterrupt):  # Python 3.11 wraps a Ctrl-C while a class is made
            click.echo("interrupted", err=True)
            return INTERRUPTED
        click.echo(
            f"internal error: {type(error).__name__}: {error}; this is a fault of {_author(words, error)}; try: the"
            " same with --debug [E0001]",
            err=True,
        )
        return 1


def _show_error(error: EomgenError, words: Sequence[str]) -> None:
    """Print an error with its codes to stderr, and with ``--json`` as JSON to stdout, too."""
    click.echo(error.report(codes=True), err=True)
    if "--json" in words:
        from eomgen.cli.printing import print_json  # noqa: PLC0415

        problems = [{"code": error.code_of(problem), **dataclasses.asdict(problem)} for problem in error.problems]
        data = {"error": {"code": error.code, "kind": error.title, "exit_code": error.exit_code, "problems": problems}}
        with contextlib.suppress(OSError):  # the disk may be full, and stderr has the message
            print_json(data)


def _author(words: Sequence[str], error: BaseException) -> str:
    """Return the distribution of the verb in a command line, or else of the last code of a plug-in on the way to an
    error."""
    verb = others().verbs.get(next((word for word in words if not word.startswith("-")), ""))
    if verb is not None and verb.entry is not None:
        return distribution(verb.entry)
    on_the_way = [str(frame.f_globals.get("__name__", "")) for frame, _ in traceback.walk_tb(error.__traceback__)]
    return next((name for module in reversed(on_the_way) if (name := distribution_of(module))), "eomgen")


def _drop_what_cannot_be_written() -> None:
    """Empty the buffer of stdout, which Python would try to write once more at its end, with an exit code of Python's
    own."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _talk(ended: contextlib.ExitStack) -> None:
    """Write the messages of the package's loggers to stderr until ``ended`` is closed."""
    import logging  # noqa: PLC0415  # most runs are silent

    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(logging.Formatter("%(name)s: %(message)s"))
    logger = logging.getLogger("eomgen")
    ended.callback(setattr, logger, "handlers", logger.handlers)
    ended.callback(logger.setLevel, logger.level)
    logger.handlers = [handler]
    logger.setLevel(logging.DEBUG)


def _check_streams() -> None:
    """Give closed standard streams, as under some daemons, an open file: libraries expect open streams."""
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
    click.echo(f"warning: {Message(str(message)).line}", err=True)


__all__ = ["info", "options", "parts", "printing", "running"]
