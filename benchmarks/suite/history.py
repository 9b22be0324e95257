"""Times of all rows over the releases: one file that grows.

    python -m benchmarks.suite.history

Adds the results of ``benchmarks/results`` to ``benchmarks/history.csv``, one line for each measured contestant of a
row, commit and machine. The command may be repeated: lines that the file has already are replaced.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Iterable, Sequence
from dataclasses import astuple, dataclass, fields
from datetime import UTC, datetime
from pathlib import Path

from benchmarks.suite.environments import ROOT
from benchmarks.suite.outcomes import MEASURED, RESULTS, Finding, read
from benchmarks.suite.register import Row

HISTORY = ROOT / "benchmarks" / "history.csv"


@dataclass(frozen=True, order=True)
class Measurement:
    """One measured contestant of a row.

    Attributes
    ----------
    date : time of the measurement in UTC, ISO 8601.
    commit, release : of eomgen.
    machine : processor, vector instructions and number of cores.
    row, contestant : names in the register of rows.
    version : of the package that did the work, empty if the contestant names none.
    seconds : median time of one unit of the row.
    spread : range of the rounds divided by the median.
    """

    date: str
    commit: str
    release: str
    machine: str
    row: str
    contestant: str
    version: str
    seconds: float
    spread: float

    @property
    def key(self) -> tuple[str, str, str, str]:
        return self.row, self.contestant, self.commit, self.machine


def measurements(results: Iterable[Finding]) -> list[Measurement]:
    """Return the measured contestants of stored results, quick runs left out."""
    made = []
    for result in results:
        if result.quick:
            continue
        machine = result.machine
        vectors = machine["vectors"] or "no wide vectors"
        place = f"{machine['processor']}, {machine['family']}, {vectors}, {machine['cores']} cores"
        date = datetime.fromtimestamp(machine["time"], UTC).isoformat(timespec="minutes")
        releases = {one.versions["eomgen"] for one in result.outcomes if "eomgen" in one.versions}
        for one in result.outcomes:
            if one.state == MEASURED and one.value is not None:
                version = " ".join(one.versions.values())
                made.append(
                    Measurement(
                        date, machine["commit"], "".join(sorted(releases)), place, result.row, one.name, version,
                        one.value, one.spread or 0.0,
                    )
                )  # fmt: skip
    return made


def read_history(file: Path) -> list[Measurement]:
    """Return the measurements of a history file, none if the file does not exist."""
    if not file.exists():
        return []
    with file.open(encoding="utf-8", newline="") as stream:
        return [
            Measurement(**{**line, "seconds": float(line["seconds"]), "spread": float(line["spread"])})
            for line in csv.DictReader(stream)
        ]


def extended(history: Iterable[Measurement], new: Iterable[Measurement]) -> list[Measurement]:
    """Return a history with new measurements in order of time; equal row, contestant, commit and machine replace."""
    return sorted({one.key: one for one in (*history, *new)}.values())


def write_history(file: Path, history: Iterable[Measurement]) -> None:
    with file.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow([field.name for field in fields(Measurement)])
        writer.writerows(astuple(one) for one in history)


def series(history: Iterable[Measurement], row: str, contestant: str) -> dict[str, list[tuple[datetime, float]]]:
    """Return times and seconds of a contestant of a row, by machine."""
    lines: dict[str, list[tuple[datetime, float]]] = {}
    for one in history:
        if (one.row, one.contestant) == (row, contestant):
            lines.setdefault(one.machine, []).append((datetime.fromisoformat(one.date), one.seconds))
    return lines


def contestants(row: Row) -> tuple[str, str | None]:
    """Return eomgen's contestant of a row and the first other one, None if the row has none."""
    if row.comparisons:
        return row.comparisons[0].own, row.comparisons[0].peer
    return (row.goals[0].own if row.goals else "eomgen"), None


def main(words: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.suite.history", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--folder", type=Path, default=RESULTS, help="of results")
    parser.add_argument("--history", type=Path, default=HISTORY)
    chosen = parser.parse_args(words)
    new = measurements(read(chosen.folder).values())
    history = extended(read_history(chosen.history), new)
    if not history:
        print(f"{chosen.folder} has no results; try: python -m benchmarks.suite", file=sys.stderr)
        return 1
    write_history(chosen.history, history)
    print(f"{chosen.history}: {len(history)} measurements of {len({one.commit for one in history})} commits")
    return 0


if __name__ == "__main__":
    sys.exit(main())
