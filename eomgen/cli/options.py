"""Options that several verbs share: the parser of ``name=value``, and the parameters, inputs, states and joints of
a scene that ``--set``, ``--input`` and ``--initial`` name.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import click

from eomgen.base.messages import shown
from eomgen.base.products import import_target
from eomgen.errors import Problem, UsageError
from eomgen.formula.units.labels import in_label
from eomgen.formula.units.parser import is_quantity
from eomgen.scene.sources.register import all_options, formats_with, own_sources
from eomgen.scene.sources.source import Option, Source
from eomgen.toolchain.profiles import PROFILES, STANDARD_PROFILE

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

    from eomgen.scene.scene import Scene
    from eomgen.system.signals import Input, Output, Parameter, State


Command = TypeVar("Command", bound=Callable[..., Any])
#: A further name and value after a comma; a call in place of a number.
_ASSIGNED = re.compile(r",\s*[A-Za-z_][\w.]*\s*=")
_FORMULA = re.compile(r"[a-z]\w*\(")
#: Names and text of arguments in a docstring; the end of a sentence.
_DOCUMENTED = re.compile(r"^(\w+(?:, \w+)*) : .*\n((?:    .*\n)+)", re.MULTILINE)
_SENTENCE = re.compile(r"(?<=\.)\s")


class FunctionOption(click.Option):
    """Option that hands on an argument of a function, with the default of the function's signature and the help of the
    function's docstring.

    The function is imported for the help page and for a default that is not None.

    Parameters
    ----------
    function : str
        ``module:function``.
    default : optional
        Value if the option is not given, in place of the function's default.
    """

    def __init__(self, *declarations: Any, function: str, **attributes: Any) -> None:
        self.function = function
        self.handed_on = not attributes.keys() & {"default", "multiple", "is_flag"}
        super().__init__(*declarations, **attributes)

    @property
    def argument(self) -> Argument:
        """Argument of the function."""
        return argument_of(self.function, str(self.name))

    def get_default(self, ctx: click.Context, call: bool = True) -> Any:
        """Return the value if the option is not given."""
        return self.argument.default if self.handed_on else super().get_default(ctx, call=call)

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        """Return the option and the option's text on the help page."""
        self.help = f"{self.argument.text} May be repeated." if self.multiple else self.argument.text
        if self.handed_on:
            self.show_default = self.argument.default not in (None, "")
        return super().get_help_record(ctx)


class Argument(NamedTuple):
    """Default of an argument of a function, and the first sentence of the argument's text."""

    default: Any
    text: str


@cache
def argument_of(target: str, name: str) -> Argument:
    """Return an argument of the function ``module:function`` by signature and docstring of the function."""
    taker: Any = import_target(target)
    default = inspect.signature(taker).parameters[name].default
    for names, text in _DOCUMENTED.findall(inspect.getdoc(taker) or ""):
        if name in names.split(", "):
            return Argument(default, _SENTENCE.split(" ".join(text.replace("``", "").split()), maxsplit=1)[0])
    return Argument(default, "")


def arguments_of(target: str) -> Callable[..., Callable[[Command], Command]]:
    """Return ``click.option`` for arguments of the function ``module:function``, without defaults and texts."""
    return partial(click.option, cls=FunctionOption, function=target)


#: Options of runs.
_of_runs = arguments_of("eomgen.simulation.simulate:simulate")
json_option = click.option("--json", "as_json", is_flag=True, help="Print JSON instead of a table.")
input_option = click.option(
    "--input", "inputs", multiple=True, metavar="NAME=VALUE", help="A constant input; may be repeated."
)
set_option = click.option(
    "--set", "parameters", multiple=True, metavar="NAME=VALUE", help="A tunable parameter; may be repeated."
)
initial_option = click.option(
    "--initial", multiple=True, metavar="NAME=VALUE", help="Initial value of a state or a joint; may be repeated."
)


def _seconds(_: click.Context, param: click.Parameter, text: str | None) -> float | None:
    """Return a time in s, given as a number of s or with a unit."""
    if text is None:
        return None
    option = param.opts[0]
    if is_quantity(text):
        return in_label(option, text, "s")
    try:
        return float(text)
    except ValueError:
        raise UsageError(Problem(option, f"{shown(text)} is not a time [E0190]", '2, or "2 s"')) from None


def _bound(context: click.Context, param: click.Parameter, text: str | None) -> dict[str, float] | None:
    """Return ``{"largest_step": seconds}`` for the text of an option, a number of s or with a unit; None for no text.
    Raises UsageError unless the step is positive."""
    seconds = _seconds(context, param, text)
    if seconds is not None and not seconds > 0.0:
        raise UsageError(Problem(param.opts[0], f"{shown(text)} is not a step [E0188]", '0.003, or "3 ms"'))
    return None if seconds is None else {"largest_step": seconds}


profile_option = click.option(
    "--profile",
    type=click.Choice(list(PROFILES)),
    default=STANDARD_PROFILE,
    show_default=True,
    help="How C is compiled: for this processor, to the same bits everywhere, or in the least time.",
)
time_option = click.option(
    "--t", "time", type=float, default=0.0, show_default=True, metavar="S", help="Time of inputs and of the base."
)
any_kind_option = click.option("--any-kind", is_flag=True, help="An unstable equilibrium will do: the nearest.")


def debug_option(command: Command) -> Command:
    """Add ``--debug`` and ``--verbose``, which ``main`` looks for."""
    for names, text in (
        (("-v", "--verbose"), "Report derivations, compilations and runs on stderr, with their times."),
        (("--debug",), "Show tracebacks of errors."),
    ):
        command = click.option(*names, is_flag=True, expose_value=False, help=text)(command)
    return command


def completed_files(context: click.Context, parameter: click.Parameter, start: str) -> list[CompletionItem]:
    """Return the mark by which a shell completes names of files."""
    from click.shell_completion import CompletionItem  # noqa: PLC0415  # in a shell's completion only

    return [CompletionItem(start, type="file")]


def completed_methods(context: click.Context, parameter: click.Parameter, start: str) -> list[CompletionItem]:
    """Return the names of methods that begin with letters; for other letters names of files are completed."""
    from click.shell_completion import CompletionItem  # noqa: PLC0415  # in a shell's completion only

    from eomgen.pipeline.citations import names_of_methods  # noqa: PLC0415

    names = [CompletionItem(name) for name in names_of_methods(start)]
    return names or completed_files(context, parameter, start)


def reading_options(without: Sequence[str] = ()) -> Callable[[Command], Command]:
    """Return the decorator that adds ``--strict``, ``--help-files`` and options of sources except ``without``."""

    def decorate(command: Command) -> Command:
        for source, option in all_options().values():
            if option.name not in without:
                command = _source_option(source, option)(command)
        text = "Refuse elements that an importer would leave out with a note."
        command = click.option("--strict", is_flag=True, help=text)(command)
        others = ", ".join(source.name for source in own_sources() if not source.scenes)
        text = f"Show the options for files of other tools ({others} ...), and exit."
        return click.option(
            "--help-files", is_flag=True, is_eager=True, expose_value=False, help=text, callback=_show_file_options
        )(command)

    return decorate


def _show_file_options(context: click.Context, _: click.Parameter, wanted: bool) -> None:
    """Print the hidden options for files of other tools of a command and exit; return at once unless ``wanted``."""
    if not wanted:
        return
    names, formatter = {f"--{name}" for name in all_options()}, context.make_formatter()
    with formatter.section("Options for files of other tools"):
        rows = []
        for option in context.command.params:
            if isinstance(option, click.Option) and names & {*option.opts}:
                option.hidden = False
                rows.append(option.get_help_record(context))
                option.hidden = True
        formatter.write_dl([row for row in rows if row])
    click.echo(formatter.getvalue().rstrip("\n"))
    context.exit()


def scene_options(command: Command) -> Command:
    """Add the scene's path and the options for reading the scene."""
    command = click.option(
        "--coordinates",
        type=click.Choice(["joint", "absolute"]),
        default=None,
        help="Joint or absolute coordinates; the scene's by default.",
    )(command)
    command = reading_options()(command)
    return click.argument("scene", metavar="SCENE", shell_complete=completed_files)(command)


def _source_option(source: Source, option: Option) -> Callable[[Command], Command]:
    """Return the decorator that adds a hidden option of a source, by type of the default: flag, repeated, text."""
    name, text = f"--{option.name}", f"{formats_with(source, option)}: {option.description}."
    if isinstance(option.default, bool):
        return click.option(name, hidden=True, is_flag=True, help=text)
    if isinstance(option.default, tuple):
        return click.option(name, hidden=True, multiple=True, metavar=option.metavar, help=text)
    if not option.choices:
        return click.option(name, hidden=True, default=option.default, metavar=option.metavar, help=text)
    return click.option(
        name, hidden=True, type=click.Choice(option.choices), default=option.default, show_default=True, help=text
    )


end_option = click.option(
    "--t-end", default=None, callback=_seconds, metavar="S", help="End of the run; the scene's by default."
)


def stepper_options(command: Command, methods: str = "generalized_alpha, rk4, taylor, auto ...") -> Command:
    """Add the method of runs with the parameters of the method, and the step; ``methods`` are named in the help."""
    for decorate in (
        *(_of_runs(name, type=float, default=None) for name in ("--gamma", "--beta", "--alpha", "--rho-inf")),
        click.option(
            "--method", default=None, shell_complete=completed_methods, help=f"{methods}; the scene's by default."
        ),
        click.option("--step", default=None, callback=_seconds, metavar="S", help="Step size; the scene's by default."),
    ):
        command = decorate(command)
    return command


#: Adds the same for runs that have derivatives.
derivable_stepper_options = partial(
    stepper_options, methods="generalized_alpha, hht, wbz, newmark, trapezoidal, tdg1 ..."
)


def run_options(command: Command) -> Command:
    """Add the options of a run."""
    for decorate in (
        input_option,
        set_option,
        initial_option,
        profile_option,
        click.option(
            "--start", type=click.Choice(["initial", "equilibrium"]), default=None, help="The scene's by default."
        ),
        _of_runs("--error-estimate/--no-error-estimate", default=True, show_default=True),
        _of_runs("--record-every", type=int, default=None, metavar="N"),
        _of_runs("--order", type=int, default=None, metavar="P"),
        click.option(
            "--tolerance",
            type=float,
            default=None,
            help="Of local errors: generalized-alpha chooses its steps by it, as rk45 and taylor do.",
        ),
        click.option(
            "--largest-step",
            "settings",
            default=None,
            callback=_bound,
            metavar="S",
            help="Of methods that choose their steps; 64 (taylor: 256) steps of the grid by default.",
        ),
        stepper_options,
        end_option,
    ):
        command = decorate(command)
    return command


def folder_option(command: Command) -> Command:
    """Add ``--out DIR``."""
    text = "Folder to write to; it is made if it is missing."
    return click.option("--out", "folder", required=True, metavar="DIR", callback=folder_to_write, help=text)(command)


def terms_option(command: Command) -> Command:
    """Add ``--terms``."""
    return click.option(
        "--terms",
        default=None,
        metavar="NAME,NAME",
        help="Functions wanted; all that the scene can use by default.",
        callback=names_of,
    )(command)


def assignments(option: str, texts: Sequence[str]) -> dict[str, float | str]:
    """Return the values of ``name=value`` texts by name: numbers, or texts for numbers with a unit. Raises UsageError,
    with ``option`` in the message, for any other text."""
    values: dict[str, float | str] = {}
    for text in texts:
        name, equals, number = text.partition("=")
        if _ASSIGNED.search(number):
            every = " ".join(f"{option} {part.strip()}" for part in text.split(","))
            raise UsageError(Problem(f"{option} {text}", "this option takes one name and one value [E0192]", every))
        if not equals or not name.strip():
            example = f"{option} JOINT=0.5" if option == "--initial" else f"{option} length=0.5"
            raise UsageError(Problem(f"{option} {text}", "a name and a number are needed [E0193]", example))
        try:
            values[name.strip()] = float(number)
        except ValueError:
            if not is_quantity(number):
                if option == "--input" and _FORMULA.search(number):
                    fault = f"{shown(number.strip())} is a formula, and this option takes a number [E0194]"
                    hint = f"[inputs] {name.strip()} = {{ formula = {shown(number.strip())} }} in the scene"
                    raise UsageError(Problem(f"{option} {text}", fault, hint.replace("'", '"'))) from None
                fault = f"{number.strip()!r} is not a number [E0123]"
                raise UsageError(Problem(f"{option} {text}", fault, f"{option} {name.strip()}=0.5")) from None
            values[name.strip()] = number
    return values


def in_units(
    option: str, values: Mapping[str, float | str], owners: Iterable[Parameter | Input | Output | State]
) -> dict[str, float]:
    """Return numbers; texts with a unit are converted to the unit of the owner. Raises UsageError."""
    labels = {owner.name: owner.unit for owner in owners}
    return {
        name: in_label(f"{option} {name}={value}", value, labels.get(name, "")) if isinstance(value, str) else value
        for name, value in values.items()
    }


def folder_to_write(context: click.Context, parameter: click.Parameter, value: str | None) -> str | None:
    """Return the folder of an option for results. Raises FileError before the work if the folder cannot take any."""
    if value is not None:
        from eomgen.base.files import check_folder  # noqa: PLC0415  # if files are written

        if not value.strip():
            raise UsageError(Problem("--out", "the name of the folder is empty [E0195]", "--out . for this folder"))
        check_folder(Path(value))
    return value


def optional_folder(text: str) -> Callable[[Command], Command]:
    """Return the option ``--out DIR`` of a command that needs no folder, with its text of help."""
    return click.option("--out", "folder", default=None, metavar="DIR", callback=folder_to_write, help=text)


def file_to_write(context: click.Context, parameter: click.Parameter, value: str | None) -> str | None:
    """Return the file of an option for a result. Raises FileError before the work if the file cannot be written."""
    if value is not None:
        from eomgen.base.files import check_writable  # noqa: PLC0415  # if files are written

        if not value.strip():
            raise UsageError(
                Problem(parameter.opts[0], "the name of the file is empty [E2200]", "the name of a new file")
            )
        check_writable(Path(value), folder_is_made=True)
    return value


def names_of(context: click.Context, parameter: click.Parameter, value: str | None) -> list[str] | None:
    """Return names that commas separate."""
    return None if value is None else [name.strip() for name in value.split(",") if name.strip()]


def check_assigned(scene: Scene, changes: Mapping[str, object], signals: Mapping[str, object], *, robot: bool) -> None:
    """Raise UsageError for a name that belongs to another option: states and inputs in ``--set``, parameters in
    ``--input``.

    Fixed inertias of links and joints without an input are refused, too, for scenes of a URDF.

    Parameters
    ----------
    scene : Scene
    changes, signals : of ``--set`` and of ``--input``, by name
    robot : whether the scene was read from a URDF, whose options make inputs and tunable parameters
    """
    inputs, tunable = [item.name for item in scene.inputs], [item.name for item in scene.parameters if item.tunable]
    links, joints = ([item.name for item in part] if robot else [] for part in (scene.bodies, scene.joints))
    for name, value in changes.items():
        if name in tunable:
            continue
        link = max((link for link in links if name == link or name.startswith(f"{link}_")), key=len, default="")
        if name in [item.name for item in scene.states]:
            hint = f"[states.{name}] initial = {_text(value)} in the scene"
            raise UsageError(Problem(f"--set {name}", f"{name} is a state, not a parameter [E0196]", hint))
        if name in inputs:
            raise UsageError(Problem(f"--set {name}", f"{name} is an input [E0199]", f"--input {name}={_text(value)}"))
        if link:
            fault = f"the mass, the centre of mass and the inertia of {link} are fixed in the code [E0200]"
            raise UsageError(Problem(f"--set {name}", fault, f"--tunable {link}, which makes them parameters"))
    for name, value in signals.items():
        if name in inputs:
            continue
        if name in tunable:
            hint = f"--set {name}={_text(value)}"
            raise UsageError(Problem(f"--input {name}", f"{name} is a parameter [E0197]", hint))
        if name in joints:
            fault = f"{name} is a joint, which no input drives [E0198]"
            raise UsageError(Problem(f"--input {name}", fault, "--actuated, for an effort of every joint"))


def _text(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
