"""Remedies for mistakes in the words of a command line."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import click

from eomgen.base.messages import close_names, nearest, shown
from eomgen.base.products import fault_of_absent, fault_of_removed
from eomgen.errors import Message
from eomgen.scene.sources.register import one_of_each, own_endings

#: Names of verbs in other tools.
_VERBS: Mapping[str, str] = {
    **dict.fromkeys(("run", "sim", "solve", "integrate", "start"), "simulate"),
    **dict.fromkeys(("draw", "figure", "chart"), "plot"),
    **dict.fromkeys(("modes", "eigen", "modal", "poles", "stability", "frequencies"), "linearize"),
    **dict.fromkeys(("compile", "build", "codegen", "export", "c"), "generate"),
    **dict.fromkeys(("validate", "lint", "show", "print", "load"), "info"),
    **dict.fromkeys(("view", "movie", "visualize", "animation"), "animate"),
    **dict.fromkeys(("statics", "static", "rest", "trim"), "equilibrium"),
    **dict.fromkeys(("verify", "test"), "check"),
    **dict.fromkeys(("campbell", "critical"), "linearize SCENE --campbell spin=0:300:31 --out FOLDER"),
    "help": "eomgen --help, or eomgen VERB --help",
    "version": "eomgen --version",
}
#: Names of options in other tools.
_OPTIONS: Mapping[str, str] = {
    **dict.fromkeys(("--dt", "--timestep", "--time-step", "--step-size", "-h"), "--step"),
    **dict.fromkeys(("--tend", "--t_end", "--duration", "--time", "--end", "--tf"), "--t-end"),
    **dict.fromkeys(("-o", "--output", "--dir", "--outdir", "--folder"), "--out"),
    **dict.fromkeys(("--param", "--parameter", "--parameters", "-p"), "--set"),
    **dict.fromkeys(("--inputs", "--u"), "--input"),
    **dict.fromkeys(("--init", "--q0", "--x0", "--initial-state"), "--initial"),
    **dict.fromkeys(("--solver", "--integrator"), "--method"),
    **dict.fromkeys(("--tol", "--rtol", "--atol", "--eps"), "--tolerance"),
    **dict.fromkeys(("--quiet", "--silent"), "2> /dev/null, since only results go to stdout"),
}
#: Names of choices of options in other tools.
_CHOICES: Mapping[str, str] = {
    **dict.fromkeys(("floating", "float", "freeflyer", "free_flyer", "6dof"), "free"),
    **dict.fromkeys(("base", "world", "ground"), "fixed"),
    **dict.fromkeys(("release", "o3", "native"), "fast"),
    **dict.fromkeys(("debug", "o0"), "quick"),
    **dict.fromkeys(("rest", "static", "steady"), "equilibrium"),
    **dict.fromkeys(("maximal", "cartesian", "redundant"), "absolute"),
    **dict.fromkeys(("minimal", "relative", "reduced"), "joint"),
}
#: Words of click's messages.
_OF_CLICK = tuple(
    map(
        Message,
        (
            "no such option [E0008]", "missing option [E0009]", "missing argument [E0010]", "missing parameter [E0011]",
            "is not one of [E0013]", "is not a valid integer [E0014]", "is not a valid float [E0015]",
            "is not in the range [E0016]", "does not exist [E0017]", "is a directory [E0018]", "is a file [E0019]",
            "got unexpected extra argument [E0020]", "requires an argument [E0021]", "does not take a value [E0022]",
            "requires [E0023]", "invalid value for [E0012]",
        ),
    )
)  # fmt: skip  # a table
_EXTRA = re.compile(r"unexpected extra arguments? \((.+)\)")
_GIVEN = re.compile(r": '([^']*)' is ")
if TYPE_CHECKING:
    from eomgen.base.verbs import Verb

#: Examples of arguments and options that are missing.
_EXAMPLES: Mapping[str, str] = {
    "folder": "--out results",
    "path": "--out page.html",
    "sources": "the path of a scene, or the folder of a run",
    "files": "the path of a .toml file",
    "shell": "bash, zsh or fish",
    "name": "eomgen new pendulum",
}


def verb_remedy(word: str, verbs: Mapping[str, Verb]) -> str:
    """Return the remedy for a word that is not a verb; ``verbs`` are the rows of the register by name."""
    if word.endswith(own_endings()):
        others = [name for name, verb in verbs.items() if verb.takes_scene][:7]
        return f"eomgen info {shown(word)[1:-1]}, or another verb before the scene: {', '.join(others)}"
    return _VERBS.get(word.lower()) or nearest(word, list(verbs))


def what_of_usage(error: click.UsageError) -> str:
    """Return the fault in the arguments of a verb, without click's own hints."""
    if isinstance(error, click.NoSuchOption):
        because, _ = _absent(error) or ("", "")
        return f"no such option {shown(error.option_name)}{because and ': '}{because}"
    return error.format_message().partition(". Choose from:")[0].rstrip(".")


def _absent(error: click.NoSuchOption) -> tuple[str, str] | None:
    """Return the fault of an option of a product that is not installed, or of one that was removed, and a remedy; None
    for another option."""
    option = error.ctx and f"{error.ctx.info_name} {error.option_name}"
    return (fault_of_absent(option) or fault_of_removed("option", option)) if option else None


def usage_code(text: str) -> str:
    """Return the code of a fault in the arguments of a verb; empty for a text that has its own."""
    return "" if text.endswith("]") else next((words.code for words in _OF_CLICK if words in text), "")


def usage_remedy(error: click.UsageError, path: str, words: Sequence[str]) -> str:
    """Return the remedy for an error in the arguments of a verb.

    Parameters
    ----------
    path : the command as called: ``eomgen simulate``
    words : the words after ``eomgen``
    """
    listing = f"{path} --help"
    if isinstance(error, click.NoSuchOption):
        if absent := _absent(error):
            return absent[1]
        close = close_names(error.option_name[2:], [option[2:] for option in error.possibilities or ()], 1)
        suggestion = _OPTIONS.get(error.option_name, "") or "".join(f"--{option}" for option in close)
        return f"{suggestion}; {listing} lists all" if suggestion else listing
    if isinstance(error, click.MissingParameter) and error.param is not None:
        name = error.param.name or ""
        example = f"the path of {one_of_each()}" if name == "scene" else _EXAMPLES.get(name, "")
        return f"{example}; {listing} lists all" if example else listing
    if isinstance(error, click.BadParameter) and error.param is not None:
        example = _value_example(error.param, error.format_message())
        return f"{example}; {listing} lists all" if example else listing
    if extra := _EXTRA.search(error.format_message()):
        return f"{_extra_remedy(extra[1].split()[0], error, path, words)}; {listing} lists all"
    return listing


def _value_example(param: click.Parameter, message: str) -> str:
    """Return a possible value of an option in place of an impossible value; empty if there is no example."""
    option = param.opts[0]
    value = (_GIVEN.search(message) or ("", ""))[1]
    if isinstance(param.type, click.Choice):
        choices = [str(choice) for choice in param.type.choices]
        meant = _CHOICES.get(value.lower(), "")
        close = [meant] if meant in choices else close_names(value.lower(), choices, 1)
        return f"{option} {close[0]}" if close else ""
    if param.type is click.INT:
        counted = " in steps, not in s" if param.name == "record_every" else ""
        return f"a whole number{counted}, {option} 10"
    if param.type is click.FLOAT:
        try:
            share = float(value.removesuffix("%").replace(",", "."))
        except ValueError:
            return ""
        return f"{option} {share / 100.0 if value.endswith('%') else share:g}"
    return ""


def _extra_remedy(word: str, error: click.UsageError, path: str, words: Sequence[str]) -> str:
    """Return the remedy for ``word``, which a command does not take as a further argument, by the option before it."""
    taken = [param for param in error.ctx.command.params if isinstance(param, click.Argument)] if error.ctx else []
    if not taken:
        return f"{path} alone: it takes no scene"
    position = words.index(word) if word in words else 0
    before = next((k for k in range(position - 1, -1, -1) if words[k].startswith("--")), None)
    option = "" if before is None else words[before]
    if option == "--terms":
        names = [name for item in words[before or 0 :][1 : position - (before or 0) + 1] for name in item.split(",")]
        return f"--terms {','.join(names)}, with commas"
    if option == "--json" and position == (before or 0) + 1:
        return f"--json > {word}"
    if word.endswith(own_endings()):
        return "one scene, and a command for each other one"
    return "--set name=value without blanks, and one scene"
