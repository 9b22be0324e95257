"""eomgen beside its peers: checked first, then timed in turns, stored as JSON.

    python -m benchmarks.suite [--rows NAME ...] [--quick] [--here] [--folder benchmarks/results]

The peers' environments are made by ``python -m benchmarks.suite.environments``, the page by
``python -m benchmarks.suite.page``; ``make bench`` does all three.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from benchmarks.programs import default_folder
from benchmarks.suite.contest import Context, machine
from benchmarks.suite.outcomes import FAILED, RESULTS, WRONG, Finding, Outcome
from benchmarks.suite.register import ROWS, Row


def run(row: Row, context: Context) -> Finding:
    """Return what a row finds: whatever goes wrong is an outcome, not the end of the suite."""
    try:
        outcomes = row.run(context)
    except Exception as error:  # peers and their compilers may fail in any way: the page says so
        text = (str(error).strip().splitlines() or [""])[0]
        outcomes = [Outcome("all", FAILED, note=f"{type(error).__name__}: {text}"[:300])]
    return Finding(row.name, tuple(outcomes), machine(), context.quick)


def told(outcome: Outcome) -> str:
    """Return an outcome as a line for a terminal."""
    value = f"{outcome.value:.3g} s" if outcome.value is not None else outcome.state
    error = f"error {outcome.error:.0e}" if outcome.error is not None else ""
    return f"    {outcome.name:<28} {value:<12} {error:<14} {outcome.note}".rstrip()


def main(words: Sequence[str] | None = None) -> int:
    description = (__doc__ or "").partition("\n")[0]
    parser = argparse.ArgumentParser(prog="python -m benchmarks.suite", description=description)
    names = [row.name for row in ROWS]
    parser.add_argument("--rows", nargs="+", choices=names, default=names, metavar="ROW", help=f"of {', '.join(names)}")
    parser.add_argument("--rounds", type=int, default=7, help="turns in which every contestant runs once")
    parser.add_argument("--core", type=int, help="the core that single threads stay on (the last one by default)")
    parser.add_argument("--work", type=Path, default=default_folder(), help="where compiled programs are kept")
    parser.add_argument("--folder", type=Path, help=f"where JSON goes; {RESULTS} where it is not --quick")
    parser.add_argument("--quick", action="store_true", help="small pieces of work and one round: checks, no times")
    parser.add_argument("--here", action="store_true", help="contestants of this Python alone, missing ones left out")
    chosen = parser.parse_args(words)
    core = max(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 0
    core = core if chosen.core is None else chosen.core
    context = Context(chosen.quick, chosen.here, chosen.work, chosen.rounds, core)
    folder = chosen.folder or (None if chosen.quick else RESULTS)
    bad, whole = 0, time.monotonic()
    for row in ROWS:
        if row.name not in chosen.rows:
            continue
        began = time.monotonic()
        print(f"{row.name}: {row.work}, time per {row.per}", flush=True)
        finding = run(row, context)
        print("\n".join(map(told, finding.outcomes)), f"\n    {time.monotonic() - began:.1f} s", flush=True)
        bad += sum(one.state in (WRONG, FAILED) for one in finding.outcomes)
        if folder:
            finding.write(folder)
    print(f"{time.monotonic() - whole:.0f} s in all; {bad} wrong or failed")
    return 1 if bad and chosen.quick else 0


if __name__ == "__main__":
    sys.exit(main())
