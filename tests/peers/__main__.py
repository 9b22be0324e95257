"""Compare eomgen with other programs, and write docs/peers.md: ``python -m tests.peers --help``."""

from __future__ import annotations

import argparse
import datetime
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

from benchmarks.suite.environments import PEERS, reasons
from tests.peers import MEASURED, PROGRAMS, ROWS, measured, version
from tests.peers.page import line, page


def compare(name: str, count: int | None) -> dict[str, Any]:
    """Return version, number of scenes, largest differences and the seeds that have them, of one row."""
    row = ROWS[name]
    found: dict[str, Any] = {"date": datetime.date.today().isoformat()}
    if not (installed := version(row.program)):
        words = (reason for wanted, reason in reasons(PEERS).items() if wanted.startswith(PROGRAMS[row.program]))
        return found | {"missing": next(words, f"{PROGRAMS[row.program]} is not installed on this machine")}
    largest: dict[str, float] = {}
    seeds: dict[str, int] = {}
    for seed in range(count or row.count):
        for quantity, value in row.differences(seed).items():
            if not value <= largest.get(quantity, -1.0):  # also if it is no number
                largest[quantity], seeds[quantity] = value, seed
    return found | {"version": installed, "scenes": count or row.count, "differences": largest, "seeds": seeds}


def compare_apart(name: str, count: int | None) -> dict[str, Any]:
    """Return the measurement of a row by a process of its own: libraries of two programs may not agree."""
    words = [sys.executable, "-W", "ignore", "-m", "tests.peers", "--alone", "--only", name]
    words += ["--count", str(count)] if count else []
    result = subprocess.run(words, capture_output=True, text=True, check=False)
    if result.returncode:
        print(result.stderr, file=sys.stderr)
        last = (result.stderr.splitlines() or [f"exit code {result.returncode}"])[-1]
        return {"date": datetime.date.today().isoformat(), "failed": last}
    return dict(json.loads(result.stdout.splitlines()[-1]))


def main() -> int:
    """Measure, print, and write what the command line asks for; return 1 if a row fails or leaves its limit."""
    parser = argparse.ArgumentParser(prog="python -m tests.peers", description=__doc__)
    parser.add_argument("file", type=Path, nargs="?", help="page to write: docs/peers.md")
    parser.add_argument("--only", nargs="+", choices=list(ROWS), metavar="ROW", help="rows to measure; all")
    parser.add_argument("--count", type=int, help="number of scenes in place of the register's")
    parser.add_argument("--page", action="store_true", help="write the page from the kept measurements")
    parser.add_argument("--alone", action="store_true", help="measure in this process and print JSON")
    options = parser.parse_args()
    names = options.only or list(ROWS)
    if options.alone:
        print("\n" + json.dumps(compare(names[0], options.count)))
        return 0
    kept = measured() if MEASURED.is_file() else {}
    failed = []
    for name in [] if options.page else names:
        found = compare_apart(name, options.count)
        kept[name] = found
        print(line(ROWS[name], found), flush=True)
        failed += [name] if "failed" in found or ROWS[name].above_limit(found) else []
    if options.file:
        if not options.page:
            ordered = {name: kept[name] for name in ROWS if name in kept}
            MEASURED.write_text(json.dumps(ordered, indent=1) + "\n", encoding="utf-8")
        options.file.write_text(page(kept), encoding="utf-8")
    if failed:
        print(f"not within their limits, or without a result: {', '.join(failed)}", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
