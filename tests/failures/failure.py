"""One entry of the failure catalogue: what a user did, and the words and the exit code that answer it."""

from __future__ import annotations

import io
import re
import shlex
import sys
import unicodedata
from collections.abc import Callable, Mapping
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from eomgen.base.message_codes import EXAMPLES
from eomgen.cli import commands, main

#: The folder of a command in texts that are shown.
SHOWN_FOLDER = "/an/empty/folder"

#: The scene that most entries change in one place.
SCENE = """\
format = 1
name = "arm"

[parameters]
length = { value = 0.5, unit = "m" }
load = { value = 1.0, unit = "kg", tunable = true }

[inputs]
motor = { formula = "2 * sin(t)", unit = "N m" }

[bodies.upper]
mass = "1 + load"
center_of_mass = [0, 0, "-length / 2"]
inertia = [0.03, 0.03, 0.002]

[joints.shoulder]
type = "revolute"
parent = "base"
child = "upper"
axis = [0, 1, 0]

[points.tip]
body = "upper"
position = [0, 0, "-length"]

[efforts.motor]
joint = "shoulder"
effort = "motor"

[outputs]
tip = { position = "tip" }
"""


@dataclass(frozen=True)
class Failure:
    """A bad input and its answer. ``{folder}`` in texts is the folder that the command runs in.

    Attributes
    ----------
    title : what the user did, a few words
    code : exit code
    message : all of stderr, without the last line's end; empty where it stands in the examples of codes
    command : the words behind ``eomgen``
    old, new : what of SCENE is changed, and to what; both empty where it stays
    more : lines appended to SCENE
    files : further files, or others in the place of ``scene.toml``, by name
    environment : variables set; None where one is taken away
    prepare : a further step in the folder, where files alone do not make the trouble
    preparation : what that step is, for the page
    """

    title: str
    code: int
    message: str = ""
    command: str = "info scene.toml"
    old: str = ""
    new: str = ""
    more: str = ""
    files: Mapping[str, str | bytes] = field(default_factory=dict)
    environment: Mapping[str, str | None] = field(default_factory=dict)
    prepare: Callable[[Path], object] | None = None
    preparation: str = ""

    @property
    def answer(self) -> str:
        """The message, or the answer under this title in the examples of codes."""
        return self.message or _answers()[self.title]

    def told(self, folder: Path) -> tuple[int, str, str]:
        """Return exit code, stdout and stderr of the command in a folder, as on a machine without ``ziglang``."""
        streams = io.StringIO(), io.StringIO()
        with pytest.MonkeyPatch.context() as patch, redirect_stdout(streams[0]), redirect_stderr(streams[1]):
            patch.chdir(folder)
            patch.setitem(sys.modules, "ziglang", None)
            for name, value in self.environment.items():
                if value is None:
                    patch.delenv(name, raising=False)
                else:
                    patch.setenv(name, value.replace("{folder}", str(folder)))
            code = main(shlex.split(self.command))
        return code, streams[0].getvalue(), streams[1].getvalue()

    def lay_out(self, folder: Path) -> None:
        """Write the files of the entry."""
        text = SCENE
        if self.old:
            assert text.count(self.old) == 1, f"{self.title}: {self.old!r} is not once in the scene"
            text = text.replace(self.old, self.new)
        if self.more:
            text = f"{text}\n{self.more}\n"
        for name, content in {"scene.toml": text, **self.files}.items():
            data = content.encode("utf-8", "surrogateescape") if isinstance(content, str) else content
            (folder / name).write_bytes(data)
        if self.prepare is not None:
            self.prepare(folder)

    def shown(self) -> str:
        """Return the bad input as the page shows it: what was written into the scene, and small further files."""
        texts = {name: text for name, text in self.files.items() if isinstance(text, str) and 0 < len(text) < 600}
        if self.new or self.more or "scene.toml" in texts:
            written = texts.pop("scene.toml", "") or "\n\n".join(part for part in (self.new, self.more) if part)
            parts = [written, *(f"# {name}\n{text}" for name, text in texts.items())]
        else:
            parts = [f"# {name}\n{text}" for name, text in texts.items()]
        settings = [
            (
                f"unset {name}"
                if value is None
                else f"export {name}={shlex.quote(value.replace('{folder}', SHOWN_FOLDER))}"
            )
            for name, value in self.environment.items()
        ]
        return "\n\n".join(part.rstrip() for part in [*parts, self.preparation, "\n".join(settings)] if part.rstrip())


def shown_entry(entry: Failure, answer: str = "") -> str:
    """Return the bad input of an entry, its command and its answer, or another one, as text."""
    shown = [_visible(line) for line in entry.shown().splitlines()]
    told = (answer or entry.answer).replace("{any}", "...").replace("{folder}", SHOWN_FOLDER)
    lines = [*shown, *([""] if shown else []), f"$ eomgen {entry.command}", told]
    return "\n".join(lines)


def _visible(line: str) -> str:
    """Return a line with characters that cannot be seen, or that would turn the page around, written out, and not too
    long."""
    text = "".join(c if unicodedata.category(c)[0] != "C" else c.encode("unicode_escape").decode() for c in line)
    return text if len(text) <= 160 else f"{text[:160]} ..."


@cache
def _answers() -> Mapping[str, str]:
    """Return the answers in the examples of codes, by the titles of their entries."""
    entries = EXAMPLES.read_text(encoding="utf-8").rstrip("\n").replace(SHOWN_FOLDER, "{folder}").split("\n= ")[1:]
    found = (re.fullmatch(r"\S+ (.*)\n(?s:.*?)^\$ eomgen .*\n((?s:.*?))\n?", entry, re.MULTILINE) for entry in entries)
    return {match[1]: match[2] for match in found if match}


def invoked(*words: str) -> object:
    """Return the result of a verb, whose errors are raised."""
    return commands.main([*words], standalone_mode=False)


def tables_of_products(name: str) -> list[Any]:
    """Return the tables of a name in the modules ``refused_calls`` of all products that have one."""
    files = sorted(Path(__file__).parents[1].glob("*/refused_calls.py"))
    modules = [import_module(f"tests.{file.parent.name}.refused_calls") for file in files]
    return [getattr(module, name) for module in modules if hasattr(module, name)]
