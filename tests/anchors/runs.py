"""Runs of scenes next to runs of other programs: each row of ``runs.toml`` is a scene, its signals and a few figures.

``python -m tests.anchors.runs --external DIR`` compares whole files, in a folder that has them, and ``--digits NAME``
prints the figures of a row from its file.
"""

from __future__ import annotations

import argparse
import sys
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import eomgen

Array = NDArray[np.float64]
ROWS = Path(__file__).with_suffix(".toml")
SCENES = Path(__file__).parents[2] / "examples" / "verification"


@dataclass(frozen=True)
class Program:
    """A program whose results are compared.

    Attributes
    ----------
    name : str
    source : str
        Publication of the results.
    accuracy : str
        Tolerance of its integration and number of printed digits, as the publisher states them.
    """

    name: str
    source: str
    accuracy: str


@dataclass(frozen=True)
class Signal:
    """An output of a scene, with its figures by the other program.

    Attributes
    ----------
    columns : tuple of str
        Headings in the file, one for each component.
    digits : tuple of float
        Figures at the instants of the run, components next to one another.
    factor : float
        Factor of eomgen's output: -1 for a force on the other body.
    third : tuple of float
        The same figures by a third solution; the other program is off by its difference to them.
    """

    columns: tuple[str, ...]
    digits: tuple[float, ...]
    factor: float = 1.0
    third: tuple[float, ...] = ()


@dataclass(frozen=True)
class Run:
    """A run of a scene and of another program.

    Attributes
    ----------
    name, subject, case : str
        Key, heading of the page, and the machine.
    scene : str
        File in ``examples/verification``.
    program : Program
    file : str
        Its results, in a folder that ``--external`` names.
    at : tuple of float
        Instants of the figures, s.
    tolerance : float
        Largest difference to the third solution, or without one to the other program, relative to the largest
        component of the signal.
    signals : dict of Signal by output
    third : str
        Origin of the third solution.
    note : str
        Cause of a disagreement.
    """

    name: str
    subject: str
    case: str
    scene: str
    program: Program
    file: str
    at: tuple[float, ...]
    tolerance: float
    signals: Mapping[str, Signal]
    third: str = ""
    note: str = ""

    def outputs(self, times: Sequence[float] | Array) -> dict[str, Array]:
        """Simulate the scene, and return its signals (times, components) at instants."""
        model = eomgen.build(SCENES / self.scene, profile="quick")
        solution = model.simulate()
        values = solution.outputs_at(np.asarray(times, float))
        return {name: signal.factor * np.asarray(values[name]) for name, signal in self.signals.items()}

    def differences(self) -> dict[str, tuple[float, float]]:
        """Return, by signal, the largest difference of eomgen to the figures that count, and of the other program to
        them, relative to the largest component."""
        result = {}
        for name, own in self.outputs(self.at).items():
            signal = self.signals[name]
            other = np.array(signal.digits)
            counts = np.array(signal.third or signal.digits)
            size = np.abs(counts).max()
            result[name] = tuple(float(np.abs(numbers - counts).max() / size) for numbers in (own.ravel(), other))
        return result

    def whole_differences(self, folder: Path) -> dict[str, float]:
        """Return, by signal, the largest difference to the file of the other program, relative to the largest number
        of the signal."""
        times, columns = table(folder / self.file)
        result = {}
        for name, own in self.outputs(times).items():
            other = np.column_stack([columns[heading] for heading in self.signals[name].columns])
            result[name] = float(np.abs(own.reshape(other.shape) - other).max() / np.abs(other).max())
        return result


def table(file: Path) -> tuple[Array, dict[str, Array]]:
    """Return the instants and the columns, by heading, of a file of comma-separated values."""
    headings = file.read_text(encoding="utf-8").partition("\n")[0].strip().replace('"', "").split(",")
    rows = np.loadtxt(file, delimiter=",", skiprows=1, ndmin=2)
    return rows[:, 0], dict(zip(headings, rows.T, strict=True))


@cache
def runs() -> dict[str, Run]:
    """Return all rows by their names, in the order of the page."""
    data = tomllib.loads(ROWS.read_text(encoding="utf-8"))
    programs = {name: Program(**row) for name, row in data["programs"].items()}
    result = {}
    for name, row in data["runs"].items():
        signals = {output: Signal(**_tuples(signal)) for output, signal in row.pop("signals").items()}
        result[name] = Run(name, program=programs[row.pop("program")], signals=signals, **_tuples(row))
    return result


def _tuples(row: Mapping[str, object]) -> dict[str, object]:
    return {key: tuple(value) if isinstance(value, list) else value for key, value in row.items()}


def main() -> int:
    """Compare the rows, or print the figures of one."""
    parser = argparse.ArgumentParser(prog="python -m tests.anchors.runs", description=__doc__)
    parser.add_argument("--external", type=Path, metavar="DIR", help="folder with whole files of the other programs")
    parser.add_argument("--only", nargs="+", metavar="NAME", help="rows; all")
    parser.add_argument("--digits", action="store_true", help="print the figures of the rows from their files")
    options = parser.parse_args()
    for run in (runs()[name] for name in options.only or runs()):
        if options.digits:
            times, columns = table(options.external / run.file)
            rows = [int(np.argmin(np.abs(times - t))) for t in run.at]
            for name, signal in run.signals.items():
                print(run.name, name, [float(columns[heading][row]) for row in rows for heading in signal.columns])
        elif options.external:
            print(run.name, {name: f"{value:.1e}" for name, value in run.whole_differences(options.external).items()})
        else:
            print(run.name, {name: f"{own:.1e}, {other:.1e}" for name, (own, other) in run.differences().items()})
    return 0


if __name__ == "__main__":
    sys.exit(main())
