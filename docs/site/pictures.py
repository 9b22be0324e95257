"""Pictures that a build of the site draws, each anew only if its sources changed: by programs of examples, by blocks of
pages, from the tables of costs and accuracy, and of the runs of animations.

They have paths in the repository, where pages link to them, and no files there.
"""

from __future__ import annotations

import hashlib
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import matplotlib

import eomgen
from benchmarks.example_pages import STUDIES
from docs.site.pages import ROOT, read
from tests.docs.executed import PAGES, pictures

matplotlib.use("Agg")
from matplotlib import pyplot

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Programs of examples that draw the picture into an empty folder, with arguments; the others are of the animated run.
PROGRAMS: Mapping[str, str] = {
    "acrobot_swing_up": "demo.py --out .",
    "cart_pole_swing_up": "demo.py --out .",
    "driving_car": "demo.py --out .",
    "duffing_random_excitation": "demo.py --out .",
    "fastest_panda": "demo.py --out .",
    "flying_spaghetti": "spaghetti.py --picture flying_spaghetti.png",
    "hopping_leg": "hop.py --picture hopping_leg.png",
    "motorcycle": "weave_and_wobble.py --picture motorcycle.png",
    "roll_up": "roll_up.py --elements 5 --picture roll_up.png",
    "rotor_blade": "blade.py --picture rotor_blade.png",
    "scalar_wave": "demo.py --out .",
    "storm_in_lagrangian_waves": "demo.py --out .",
    "turned_four_bar": "demo.py --out .",
}
#: Processes that draw beside the build.
_JOBS = 2
#: Seconds by the units of the tables.
_UNITS = {"ns": 1e-9, "µs": 1e-6, "ms": 1e-3, "s": 1.0}


@dataclass(frozen=True)
class Drawing:
    """Pictures that one command draws.

    Attributes
    ----------
    command : tuple of str
        Arguments of Python, in an empty folder.
    sources : tuple of Path
        Files on which the pictures depend.
    pictures : tuple of str
        Their paths in the repository.
    """

    command: tuple[str, ...]
    sources: tuple[Path, ...]
    pictures: tuple[str, ...]


def drawings() -> Iterator[Drawing]:
    """Yield the pictures of programs and pages."""
    for name, words in PROGRAMS.items():
        program, *rest = shlex.split(words)
        folder = ROOT / "examples" / name
        sources = tuple(
            sorted(path for path in folder.rglob("*") if path.suffix in (".py", ".toml", ".csv", ".c", ".tir"))
        )
        shown = pictures((folder / "README.md").read_text(encoding="utf-8"))
        places = tuple(f"examples/{name}/{picture}" for picture in shown)
        yield Drawing((str(folder / program), *rest), sources, places)
    for page in PAGES:
        if names := pictures(page.read_text(encoding="utf-8")):
            folder = page.parent.relative_to(ROOT)
            places = tuple(f"{folder}/{name}" for name in names)
            yield Drawing(("-m", "tests.docs.executed", "--pictures", ".", str(page)), (page,), places)


def digest_of(sources: Iterable[Path]) -> str:
    """Return the digest of files and of the version of eomgen."""
    digest = hashlib.sha256(eomgen.__version__.encode())
    for path in sources:
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def commanded(kept: Path) -> dict[str, Path]:
    """Draw the pictures of programs and pages, and return their files in a folder, by their paths.

    Raises
    ------
    subprocess.CalledProcessError
        A command fails.
    """

    def draw(drawing: Drawing) -> dict[str, Path]:
        digest = digest_of(drawing.sources)
        files = {picture: kept / f"{Path(picture).stem}-{digest}.png" for picture in drawing.pictures}
        if not all(file.is_file() for file in files.values()):
            environment = {**os.environ, "PYTHONPATH": str(ROOT), "MPLBACKEND": "Agg"}
            with TemporaryDirectory() as folder:
                command = [sys.executable, *drawing.command]
                subprocess.run(command, cwd=folder, env=environment, check=True, stdout=subprocess.DEVNULL)
                for picture, file in files.items():
                    shutil.copyfile(Path(folder) / Path(picture).name, file)
        return files

    with ThreadPoolExecutor(_JOBS) as pool:
        return {picture: file for files in pool.map(draw, drawings()) for picture, file in files.items()}


def saved(kept: Path, name: str, sources: Iterable[Path], draw: Callable[[], Figure]) -> Path:
    """Return the file of a figure in a folder; it is drawn if none is there of these sources."""
    file = kept / f"{name}-{digest_of(sources)}.png"
    if not file.is_file():
        figure = draw()
        figure.savefig(file, dpi=100)
        pyplot.close(figure)
    return file


def costs(kept: Path) -> dict[str, Path]:
    """Draw the tables of costs and accuracy, and return the files by their paths."""
    found = {}
    for name in STUDIES:
        page = f"docs/examples/{name}.md"
        found[f"docs/examples/{name}.png"] = saved(kept, f"cost-{name}", [ROOT / page], lambda page=page: cost(page))
    return found


def cost(page: str) -> Figure:
    """Return error over time of the cheapest runs in the table of a page."""
    figure, axes = pyplot.subplots(figsize=(7, 3), layout="constrained")
    points = sorted(rows_of(read(page)))
    axes.loglog([time for time, *_ in points], [error for _, error, _ in points], "o-", linewidth=0.8)
    for time, error, method in points:
        axes.annotate(method, (time, error), xytext=(5, 3), textcoords="offset points", fontsize=8)
    axes.set(xlabel="processor time of all steps, s", ylabel="largest relative error")
    axes.margins(0.15)
    axes.grid(alpha=0.3, linewidth=0.5)
    return figure


def rows_of(text: str) -> set[tuple[float, float, str]]:
    """Return time, error and method of the rows of a table of costs and accuracy."""
    rows = re.findall(r"^\| \S+ \| (\w+)[^|]*\|[^|]*\| (\S+) \| (\S+) (\w?s) \|$", text, re.MULTILINE)
    return {(float(time) * _UNITS[unit], float(error), method) for method, error, time, unit in rows}
