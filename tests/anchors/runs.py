"""Runs of scenes next to runs of other programs: each row of ``runs*.toml`` is a scene, its signals and a few figures.

``python -m tests.anchors.runs`` prints the differences of all rows, eomgen and the program to the solution that counts,
and eomgen to the program, and the cases that eomgen cannot express. ``--external DIR`` compares whole files in a folder
that has them, and ``--digits`` prints the figures of rows from their files. A row beyond its tolerance gives the exit
code 1.
"""

from __future__ import annotations

import argparse
import sys
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import eomgen
from tests.anchors.quantities import QUANTITIES
from tests.anchors.thirds import THIRDS

Array = NDArray[np.float64]
#: Files of rows, in the order of the page.
ROWS = sorted(Path(__file__).parent.glob("runs*.toml"))
#: Difference of which the page speaks.
DISAGREEMENT = 1e-4
SCENES = Path(__file__).parents[2] / "examples" / "verification"


@dataclass(frozen=True)
class Program:
    """A program whose runs are compared.

    Attributes
    ----------
    name, source, date : str
        The program, the publication of its runs, and its date.
    accuracy : str
        Tolerance of its integration and number of digits, as its publisher states them.
    within : float
        The same as a part of the largest figure, as the publisher states it or as its digits allow.
    """

    name: str
    source: str
    date: str
    accuracy: str
    within: float


@dataclass(frozen=True)
class Signal:
    """An output of a scene, with its figures by the other program.

    Attributes
    ----------
    columns : tuple of str
        Headings in the file of the program, one for each component.
    digits : tuple of float
        Figures at the instants of the run, the components of an instant together.
    factor : float
        Factor of the output of eomgen; -1 for the force on the other body.
    size : float
        Largest figure of the whole file, by which differences are divided; 0: the largest of ``digits``.
    each : bool
        Whether each figure is compared relative to itself, as of frequencies; else relative to the largest one.
    """

    digits: tuple[float, ...]
    columns: tuple[str, ...] = ()
    factor: float = 1.0
    size: float = 0.0
    each: bool = False


class Difference(NamedTuple):
    """Largest differences of a run over its signals, each relative to the largest figure of the signal, or to each."""

    eomgen: float
    program: float
    between: float


@dataclass(frozen=True)
class Gap:
    """A case of another program that eomgen cannot express, with the reason."""

    name: str
    subject: str
    case: str
    program: Program
    reason: str


@dataclass(frozen=True, kw_only=True)
class Run:
    """A run of a scene next to a run of another program.

    Attributes
    ----------
    name, subject, case : str
        Key, heading of the page, and the machine.
    scene : str
        File in ``examples/verification``.
    program : Program
    file : str
        The run of the program, in a folder that ``--external`` names; none if the row has all its figures.
    at : tuple of float
        Instants of the figures, s.
    tolerance : float
        Largest difference of eomgen to the third solution, or without one to the program.
    signals : dict of Signal by the name of the output
    quantity : str
        Name of a result in ``quantities.py`` that is no run: frequencies, a load, a probability.
    options : dict
        Of the quantity.
    third : str
        Name of a third solution in one of the files ``third*.py``, which counts then in place of the program.
    note : str
        Cause of a disagreement.
    changed : str
        Date and reason of the last change of the figures, ``"2026-11-30: reason"``.
    """

    name: str
    subject: str
    case: str
    scene: str
    program: Program
    tolerance: float
    signals: Mapping[str, Signal]
    file: str = ""
    at: tuple[float, ...] = (0.0,)
    quantity: str = ""
    options: Mapping[str, Any] = field(default_factory=dict)
    third: str = ""
    note: str = ""
    changed: str = ""

    def outputs(self, times: Sequence[float] | Array) -> dict[str, Array]:
        """Simulate the scene, and return its signals (times, components) at instants."""
        scene = SCENES / self.scene
        if self.quantity:
            values = QUANTITIES[self.quantity](scene, **self.options)
        else:
            values = eomgen.build(scene, profile="quick").simulate().outputs_at(np.asarray(times, float))
        return {
            name: signal.factor * np.reshape(values[name], (len(times), -1)) for name, signal in self.signals.items()
        }

    def difference(self) -> Difference:
        """Return the differences at the instants of the figures."""
        figures = {name: np.reshape(signal.digits, (len(self.at), -1)) for name, signal in self.signals.items()}
        return self._difference(self.at, figures)

    def whole_difference(self, folder: Path) -> Difference:
        """Return the differences over the whole file of the program in a folder; of a row without a file, its own."""
        if not self.file:
            return self.difference()
        times, columns = table(folder / self.file)
        figures = {
            name: np.column_stack([columns[heading] for heading in signal.columns])
            for name, signal in self.signals.items()
        }
        return self._difference(times, figures)

    def _difference(self, times: Sequence[float] | Array, figures: Mapping[str, Array]) -> Difference:
        own = self.outputs(times)
        counts = figures
        if self.third:
            counts = THIRDS[self.third](np.asarray(times, float))

        def size(name: str) -> Array:
            sizes = np.abs(counts[name])
            return sizes if self.signals[name].each else np.maximum(sizes.max(keepdims=True), self.signals[name].size)

        def apart(first: Mapping[str, Array], second: Mapping[str, Array]) -> float:
            return max(float((np.abs(first[name] - second[name]) / size(name)).max()) for name in own)

        return Difference(apart(own, counts), apart(figures, counts), apart(own, figures))


def table(file: Path) -> tuple[Array, dict[str, Array]]:
    """Return the instants and the columns, by heading, of comma-separated values, or of an assembly of FreeCAD's solver
    (``Joint1.FXonI``)."""
    text = file.read_text(encoding="utf-8")
    if file.suffix == ".txt":
        return _assembly(text)
    headings = text.partition("\n")[0].strip().replace('"', "").split(",")
    rows = np.loadtxt(file, delimiter=",", skiprows=1, ndmin=2)
    return rows[:, 0], dict(zip(headings, rows.T, strict=True))


def _assembly(text: str) -> tuple[Array, dict[str, Array]]:
    """Return the series of an assembly; its first numbers are the input, and no result."""
    lines = text.partition("TimeSeries\n")[2].splitlines()
    times, columns, part = np.array(lines[1].split()[2:], float), {}, ""
    for line in lines[2:]:
        words = line.split()
        if len(words) == 2 and words[1].startswith("/"):
            part = words[1].rpartition("/")[2]
        elif words:
            columns[f"{part}.{words[0]}"] = np.array(words[2:], float)
    return times, columns


@cache
def _tables() -> dict[str, Any]:
    """Return the tables ``programs``, ``runs`` and ``cannot`` of all files of rows."""
    tables: dict[str, Any] = {"programs": {}, "runs": {}, "cannot": {}}
    for file in ROWS:
        for key, rows in tomllib.loads(file.read_text(encoding="utf-8")).items():
            tables[key] |= rows
    return tables


def _programs() -> dict[str, Program]:
    return {name: Program(**row) for name, row in _tables()["programs"].items()}


@cache
def runs() -> dict[str, Run]:
    """Return all rows by their names, in the order of the page."""
    programs = _programs()
    return {name: _run(name, row, programs) for name, row in _tables()["runs"].items()}


@cache
def gaps() -> dict[str, Gap]:
    """Return the cases that eomgen cannot express by their names, in the order of the page."""
    programs = _programs()
    return {
        name: Gap(**row | {"name": name, "program": programs[row["program"]]})
        for name, row in _tables()["cannot"].items()
    }


def _run(name: str, row: dict[str, Any], programs: Mapping[str, Program]) -> Run:
    signals = {output: Signal(**_with_tuples(signal)) for output, signal in row["signals"].items()}
    return Run(**_with_tuples(row) | {"name": name, "program": programs[row["program"]], "signals": signals})


def _with_tuples(row: Mapping[str, Any]) -> dict[str, Any]:
    return {key: tuple(value) if isinstance(value, list) else value for key, value in row.items()}


def main() -> int:
    """Print the differences of rows, or their figures from whole files."""
    parser = argparse.ArgumentParser(prog="python -m tests.anchors.runs", description=__doc__)
    parser.add_argument("--external", type=Path, metavar="DIR", help="folder with whole files of the programs")
    parser.add_argument("--only", nargs="+", choices=list(runs()), metavar="NAME", help="rows; all")
    parser.add_argument("--digits", action="store_true", help="print the figures from the whole files")
    options, code = parser.parse_args(), 0
    for run in (runs()[name] for name in options.only or runs()):
        if options.digits:
            if not run.file:
                continue
            times, columns = table(options.external / run.file)
            rows = [int(np.argmin(np.abs(times - t))) for t in run.at]
            for name, signal in run.signals.items():
                print(run.name, name, [float(columns[heading][row]) for row in rows for heading in signal.columns])
            continue
        difference = run.whole_difference(options.external) if options.external else run.difference()
        beyond = not options.external and difference.eomgen > run.tolerance
        print(f"{run.name:<32}", *(f"{value:9.1e}" for value in difference), "  beyond its tolerance" * beyond)
        code |= beyond
    if not (options.only or options.digits):
        print("\n".join(f"{gap.name:<32} cannot: {gap.reason}" for gap in gaps().values()))
    return code


if __name__ == "__main__":
    sys.exit(main())
