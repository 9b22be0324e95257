"""Measure anchor cases by their tests, and write docs/verification.md: ``python -m tests.anchors --help``."""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from tests.anchors import MEASURED, MEASURED_RUNS, RECORD, anchors, measured_runs
from tests.anchors.page import lines_of, page
from tests.anchors.runs import runs


def measure(names: Sequence[str]) -> tuple[dict[str, list[float]], int]:
    """Run the tests of cases; return the numbers that they compared, and pytest's exit code."""
    if not names:
        return {}, 0
    tests = sorted({anchors()[name].test for name in names})
    with tempfile.TemporaryDirectory() as folder:
        record = Path(folder) / "record"
        record.touch()
        words = [sys.executable, "-m", "pytest", "-q", "-n", "0", *tests]
        code = subprocess.run(words, env={**os.environ, RECORD: str(record)}, check=False).returncode
        rows = [json.loads(line) for line in record.read_text(encoding="utf-8").splitlines()]
    return {name: numbers for name, numbers in rows if name in names}, code


def main() -> int:
    """Measure, print, and write what the command line asks for."""
    parser = argparse.ArgumentParser(prog="python -m tests.anchors", description=__doc__)
    parser.add_argument("file", type=Path, nargs="?", help="page to write: docs/verification.md")
    every = [*anchors(), *runs()]
    parser.add_argument("--only", nargs="+", choices=every, metavar="CASE", help="cases to measure; all")
    parser.add_argument(
        "--external", type=Path, metavar="DIR", help="whole files of the programs, to compare runs with"
    )
    parser.add_argument("--page", action="store_true", help="write the page from the kept measurements")
    options = parser.parse_args()
    kept = json.loads(MEASURED.read_text(encoding="utf-8")) if MEASURED.is_file() else {}
    kept_runs, code = measured_runs(), 0
    if not options.page:
        names = options.only or every
        found, code = measure([name for name in names if name in anchors()])
        for name in names:
            if name in found:
                print("\n".join(lines_of(anchors()[name], found[name])))
            elif name in runs():
                run = runs()[name]
                difference = run.whole_difference(options.external) if options.external else run.difference()
                print(f"{name}: eomgen is off by {difference.eomgen:.1e}, the program by {difference.program:.1e}")
                code |= not options.external and difference.eomgen > run.tolerance
                if options.external or not run.file or name not in kept_runs:
                    kept_runs[name] = [float(f"{value:.3g}") for value in difference]
        kept |= found
        if options.file:
            _write(MEASURED, kept, anchors())
            _write(MEASURED_RUNS, kept_runs, runs())
    if options.file:
        options.file.write_text(page(kept, kept_runs), encoding="utf-8")
    return code


def _write(file: Path, kept: Mapping[str, list[float]], names: Iterable[str]) -> None:
    """Write kept numbers in the order of the page, a line for each case."""
    lines = (f" {json.dumps(name)}: {json.dumps(kept[name])}" for name in names if name in kept)
    file.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
