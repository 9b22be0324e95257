"""``eomgen plot``: pictures of a stored solution."""

from __future__ import annotations

from pathlib import Path

import click

from eomgen.cli.options import completed_files, debug_option, json_option, optional_folder
from eomgen.cli.printing import print_json, say
from eomgen.errors import Problem, UsageError
from eomgen.scene.sources.register import own_endings


@click.command()
@click.option("--over", default=None, metavar="NAME", help="Draw over this column in place of the time.")
@optional_folder("Folder to write to; it is made if it is missing.  [default: the folder of the solution]")
@click.argument("solution", metavar="SOLUTION", shell_complete=completed_files)
@click.argument("names", metavar="[NAME]...", nargs=-1)
@json_option
@debug_option
def plot(solution: str, names: tuple[str, ...], over: str | None, folder: str | None, as_json: bool) -> None:
    """Draw a SOLUTION, a solution.npz of eomgen simulate or its folder, as PNG files.

    NAMEs are columns, as q.hinge, tip or tip[2], or outputs, coordinates, velocities, accelerations, states, inputs,
    energy: all are in one picture. Without a NAME coordinates, velocities,
    states, outputs and energies have a picture each; with --over the outputs alone.
    """
    from eomgen.base.files import make_folder  # noqa: PLC0415  # imported when the arguments are known to be fine
    from eomgen.results.plots import draw, draw_chosen  # noqa: PLC0415  # matplotlib comes with it
    from eomgen.results.solution import Solution  # noqa: PLC0415

    file = _file(Path(solution))
    stored = Solution.load(file)
    target = file.parent if folder is None else make_folder(Path(folder))
    files = [draw_chosen(stored, names, over, target)] if names or over is not None else draw(stored, target)
    if as_json:
        print_json({"solution": str(file), "folder": str(target), "files": [path.name for path in files]})
    else:
        say(f"written to {target}: {', '.join(path.name for path in files)}")


def _file(path: Path) -> Path:
    """Return the file of a stored solution, from its path or from the folder of the run.

    Raises
    ------
    UsageError
        A folder without a solution, or a file of another kind.
    """
    file = path / "solution.npz" if path.is_dir() else path
    if file.suffix == ".npz" and (file is path or file.is_file()):
        return file
    of_run = "the folder of a run of eomgen simulate, or its solution.npz"
    if path.is_dir():
        fault, hint = "this folder has no solution.npz [E0201]", of_run
    elif (kept := path.parent / "solution.npz").is_file():
        fault, hint = "a stored solution is needed, a file .npz [E0202]", f"{kept}"
    elif not path.exists():
        fault, hint = "there is no such file or folder [E2218]", of_run
    else:
        fault, hint = (
            "a stored solution is needed, a file .npz [E0202]",
            f"eomgen simulate {path} --out DIR, which draws, too",
        )
        hint = hint if path.suffix in own_endings() else "the solution.npz of eomgen simulate"
    raise UsageError(Problem(str(path), fault, hint))
