"""``eomgen`` alone, ``eomgen new``, ``eomgen examples`` and ``eomgen completion``: the way to a running scene."""

from __future__ import annotations

import re
import shlex
import unicodedata
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.shell_completion import CompletionItem, get_completion_class

from eomgen.base.files import example_folder, make_folder, write_bytes, write_text
from eomgen.base.messages import NAME_LENGTH, nearest, shown
from eomgen.base.verbs import own
from eomgen.base.version import __version__
from eomgen.cli.options import debug_option, json_option, optional_folder
from eomgen.cli.printing import print_json, print_table, say
from eomgen.errors import FileError, Problem, UsageError
from eomgen.scene.sources.register import own_endings

if TYPE_CHECKING:
    from importlib.resources.abc import Traversable

#: The scene of ``eomgen new`` without an example.
FIRST_SCENE = Path(__file__).with_name("first_scene.toml")
_HEADING = re.compile(r"# (.+)")
_SENTENCE = re.compile(r"(?<=\.)\s")
_LINK = re.compile(r"\[([^\]]*)\]\([^)]*\)")
_SHELLS = ("bash", "zsh", "fish")


def welcome() -> str:
    """Return the text of ``eomgen`` without a verb."""
    added = "".join(f"\n  eomgen {verb.first_step}" for verb in own() if verb.first_step)
    return f"""eomgen {__version__}: equations of motion as readable C, from the description of a mechanical scene.

  eomgen new pendulum                                 a folder with a first scene
  eomgen simulate pendulum/scene.toml --out pendulum/out{added}

  eomgen examples                                     fifty machines to start from
  eomgen doctor                                       the tools of this machine
  eomgen --help                                       all verbs"""


def example_names() -> list[str]:
    """Return the names of the examples, in alphabetical order."""
    return sorted(folder.name for folder in example_folder().iterdir() if (folder / "README.md").is_file())


def title_and_sentence(name: str) -> tuple[str, str]:
    """Return the heading of an example and the first sentence of its page, without links."""
    text = (example_folder() / name / "README.md").read_text(encoding="utf-8")
    heading = _HEADING.search(text)
    paragraphs = [part for part in text.split("\n\n")[1:] if part.strip() and part[0].isalnum()]
    sentence = _SENTENCE.split(" ".join(_LINK.sub(r"\1", (paragraphs or [""])[0]).split()))[0]
    return heading[1] if heading else name, sentence


def files_of(folder: Traversable, above: str = "") -> Iterator[tuple[str, Traversable]]:
    """Yield the files in a folder and in its folders, each with its place below the folder."""
    for item in sorted(folder.iterdir(), key=lambda item: item.name):
        if item.is_file():
            yield above + item.name, item
        elif item.name != "__pycache__":
            yield from files_of(item, f"{above}{item.name}/")


def scenes_of(folder: Traversable) -> list[str]:
    """Return the files of a folder that verbs take, and the programs, below the folder."""
    return [name for name, _ in files_of(folder) if name.endswith((*own_endings(), ".py"))]


def _complete(context: click.Context, parameter: click.Parameter, start: str) -> list[CompletionItem]:
    return [
        CompletionItem(name, help=title_and_sentence(name)[0]) for name in example_names() if name.startswith(start)
    ]


def copy_example(name: str, target: Path) -> list[str]:
    """Copy an example to a new or empty folder, and return the names of the copied scene files and programs.

    Raises
    ------
    UsageError
        There is no such example.
    FileError
        The folder holds files, or cannot be written.
    """
    if name not in example_names():
        raise UsageError(Problem("", f"there is no example {shown(name)} [E0160]", nearest(name, example_names())))
    _check_empty(target)
    for relative_path, file in files_of(example_folder() / name):
        make_folder((target / relative_path).parent)
        write_bytes(target / relative_path, file.read_bytes())
    return scenes_of(target)


def _check_empty(target: Path) -> None:
    """Raise FileError for a file, or for a folder with content."""
    if target.exists() and not target.is_dir():
        raise FileError(Problem(str(target), "there is a file of this name [E0162]", "another name"))
    if target.is_dir() and any(target.iterdir()):
        fault = "this folder is not empty, and all files are kept [E0161]"
        raise FileError(Problem(str(target), fault, "another name"))


def _say_next(folder: Path, files: Iterable[str]) -> None:
    """Say the next commands on stderr after ``files`` were written to a folder: the copy of an example whose files a
    scene or a program takes from the folder above, and the run of the first scene with a [simulation], else the first
    program; silent without either."""
    texts = {file: (folder / file).read_text(encoding="utf-8") for file in files}
    every = "".join(texts.values()).replace("../../", "../")
    for name in (name for name in example_names() if f'file = "../{name}/' in every or f'.parent / "{name}"' in every):
        if not (folder.parent / name).exists():
            say(f"next: eomgen examples {name} --out {shlex.quote(str(folder.parent))}")
    scenes = [file for file, text in texts.items() if file.endswith(own_endings()) and "[simulation]" in text]
    if scenes:
        scene, out = (shlex.quote(str(folder / name)) for name in (scenes[0], "out"))
        say(f"next: eomgen simulate {scene} --out {out}")
    elif programs := [file for file in files if file.endswith(".py")]:
        say(f"next: python {shlex.quote(str(folder / programs[0]))}")


@click.command()
@click.argument("name", metavar="NAME")
@click.option(
    "--example",
    default=None,
    metavar="EXAMPLE",
    shell_complete=_complete,
    help="Copy this example of `eomgen examples` in place of a pendulum with two links.",
)
@json_option
@debug_option
def new(name: str, example: str | None, as_json: bool) -> None:
    """Make the folder NAME with a scene that runs, and say the next command.

    The folder must not exist or be empty. Without --example the scene is two links on a support that shakes, with a
    comment at each part.
    """
    folder = Path(name)
    if example is None:
        plain = unicodedata.normalize("NFKD", folder.name).encode("ascii", "ignore").decode()
        word = re.sub(r"\W+", "_", plain).strip("_")[:NAME_LENGTH]
        if not word or word[0].isdigit():
            raise UsageError(Problem(name, "the name of a scene begins with a letter [E0163]", "eomgen new pendulum"))
        _check_empty(folder)
        text = FIRST_SCENE.read_text(encoding="utf-8")
        write_text(make_folder(folder) / "scene.toml", re.sub(r'(?m)^name = ".*"', f'name = "{word}"', text, count=1))
        files = ["scene.toml"]
    else:
        files = copy_example(example, folder)
    if as_json:
        print_json({"folder": str(folder), "files": files})
    _say_next(folder, files)


@click.command()
@click.argument("names", metavar="[NAME]...", nargs=-1, shell_complete=_complete)
@optional_folder("Copy to folders below DIR.  [default: this folder]")
@json_option
@debug_option
def examples(names: tuple[str, ...], folder: str | None, as_json: bool) -> None:
    """List the examples, or copy the named ones, each to a folder of the same name.

    Each example has a README.md with the source of all numbers and an independent reference.
    """
    if not names:
        rows = [(name, *title_and_sentence(name)) for name in example_names()]
        if as_json:
            keys = ("name", "title", "sentence")
            print_json(
                [{**dict(zip(keys, row, strict=True)), "files": scenes_of(example_folder() / row[0])} for row in rows]
            )
        else:
            print_table("", ("example", "machine"), [row[:2] for row in rows], whole=(0,))
            say("eomgen examples NAME copies one, eomgen new FOLDER --example NAME, too")
        return
    made = []
    for name in names:
        target = Path(folder or ".") / name
        made.append({"folder": str(target), "files": copy_example(name, target)})
        if not as_json:
            click.echo(str(target))
            _say_next(target, scenes_of(target))
    if as_json:
        print_json(made)


@click.command()
@click.argument("shell", type=click.Choice(_SHELLS))
@debug_option
def completion(shell: str) -> None:
    """Print the script that makes a SHELL complete verbs, options, examples and files.

    For bash: eomgen completion bash >> ~/.bashrc. For zsh: the same with ~/.zshrc. For fish: eomgen completion fish >
    ~/.config/fish/completions/eomgen.fish.
    """
    program = click.get_current_context().find_root().command
    kind = get_completion_class(shell)
    if kind is None:
        raise UsageError(Problem("completion", f"click completes no {shell} [E0164]", ", ".join(_SHELLS)))
    click.echo(kind(program, {}, "eomgen", "_EOMGEN_COMPLETE").source())
