"""Measure anchor cases by their tests, and write docs/verification.md: ``python -m tests.anchors --help``."""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path

from tests.anchors import MEASURED, RECORD, anchors
from tests.anchors.page import lines_of, page


def measure(names: Iterable[str]) -> tuple[dict[str, list[float]], int]:
    """Run the tests of cases; return the numbers that they compared, and pytest's exit code."""
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
    parser.add_argument("--only", nargs="+", choices=list(anchors()), metavar="CASE", help="cases to measure; all")
    parser.add_argument("--page", action="store_true", help="write the page from the kept measurements")
    options = parser.parse_args()
    kept = json.loads(MEASURED.read_text(encoding="utf-8")) if MEASURED.is_file() else {}
    code = 0
    if not options.page:
        names = options.only or list(anchors())
        found, code = measure(names)
        for name in names:
            if name in found:
                print("\n".join(lines_of(anchors()[name], found[name])))
        kept |= found
        if options.file:
            ordered = {name: kept[name] for name in anchors() if name in kept}
            MEASURED.write_text(json.dumps(ordered, indent=1) + "\n", encoding="utf-8")
    if options.file:
        options.file.write_text(page(kept), encoding="utf-8")
    return code


if __name__ == "__main__":
    sys.exit(main())
