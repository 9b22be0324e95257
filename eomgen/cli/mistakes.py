"""What to try after a mistake in the words of a command line."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import click

from eomgen.text import nearest, shown

#: What others call a verb.
_VERBS: Mapping[str, str] = {
    **dict.fromkeys(("run", "sim", "solve", "integrate", "plot", "start"), "simulate"),
    **dict.fromkeys(("modes", "eigen", "modal", "poles", "stability", "frequencies"), "linearize"),
    **dict.fromkeys(("compile", "build", "codegen", "export", "c"), "generate"),
    **dict.fromkeys(("validate", "lint", "show", "print", "load"), "info"),
    **dict.fromkeys(("view", "movie", "visualize", "animation"), "animate"),
    **dict.fromkeys(("statics", "static", "rest", "trim"), "equilibrium"),
    **dict.fromkeys(("verify", "test"), "check"),
    "help": "eomgen --help",
    "version": "eomgen --version",
}
#: What others call an option.
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
#: What a missing argument or option is given as.
_EXAMPLES: Mapping[str, str] = {
    "scene": "the path of a .toml or .urdf file",
    "folder": "--out results",
}


def of_verb(word: str, verbs: Collection[str]) -> str:
    """Return what to try in place of a word that is no verb."""
    if word.endswith((".toml", ".urdf")):
        return f"eomgen info {shown(word)[1:-1]}, or another verb before the scene: {', '.join(list(verbs)[:7])}"
    return _VERBS.get(word.lower()) or nearest(word, list(verbs))


def of_usage(error: click.UsageError, path: str) -> str:
    """Return what to try after an error in the arguments of a verb; ``path`` is the command as it was called."""
    listing = f"{path} --help"
    if isinstance(error, click.NoSuchOption):
        other = _OPTIONS.get(error.option_name, "")
        return f"{other}; {listing} lists all" if other else listing
    if isinstance(error, click.MissingParameter) and error.param is not None:
        example = _EXAMPLES.get(error.param.name or "", "")
        return f"{example}; {listing} lists all" if example else listing
    if "unexpected extra argument" in error.format_message():
        return f"--set name=value without blanks, and one scene; {listing} lists all"
    return listing
