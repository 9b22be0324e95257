"""Sample mutants of the package, try them, and print a table; results go to a JSON file, from which a run goes on.

python -m tests.mutants --sample 200 --seed 1 --results out/mutants.json     the first tier; the same command goes on
python -m tests.mutants --measure 600                                        which functions test files call, 10 minutes

``killed`` are mutants that a test fails for, ``survived`` ones that pass all tests which can notice them,
``undecided`` ones that pass the tests that ran within --limit; with a larger one they are tried again.
Write a reason into "equivalent" of an entry of the results to count it apart.
"""

from __future__ import annotations

import argparse
import json
import random
import subprocess
import sys
import tempfile
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path
from queue import SimpleQueue
from typing import Any

from tests.mutants.operators import OPERATORS, Mutant, mutants_of
from tests.mutants.selection import ROOT, TIERS, Calls, chosen, test_files
from tests.mutants.trial import Scratch

STATES = ("killed", "survived", "undecided")


def sampled(count: int, seed: int, under: str = "eomgen") -> list[Mutant]:
    """Return mutants of the package or of a part of it, drawn evenly; a larger sample begins with the smaller one."""
    every = [
        mutant
        for path in sorted((ROOT / under).rglob("*.py") if (ROOT / under).is_dir() else [ROOT / under])
        for mutant in mutants_of(path.read_bytes(), path.relative_to(ROOT).as_posix())
    ]
    random.Random(seed).shuffle(every)
    return every[:count]


def tried(mutant: Mutant, tiers: list[str], scratch: Scratch, calls: Calls, limit: float) -> dict[str, Any]:
    """Return the entry of a mutant in the results."""
    entry: dict[str, Any] = {**asdict(mutant), "state": "survived", "tier": "", "test": "", "equivalent": ""}
    entry |= {"tests": 0, "seconds": 0.0, "limit": limit}
    for tier in tiers:
        tests = chosen(mutant, tier, calls)
        if not tests:
            continue
        outcome = scratch.judge(mutant, tier, tests, limit)
        entry["tests"] += outcome.tests
        entry["seconds"] += round(outcome.seconds, 1)
        if outcome.failed:
            return entry | {"state": "killed", "tier": tier, "test": outcome.failed}
        if not outcome.whole:
            entry["state"] = "undecided"
    return entry


def table(results: list[dict[str, Any]]) -> str:
    """Return the counts by operator and the mutants that no test noticed."""
    lines = [f"{'operator':<20}{'tried':>7}{'killed':>8}{'survived':>10}{'undecided':>11}{'equivalent':>12}"]
    for operator in (*OPERATORS, "all"):
        mine = [entry for entry in results if operator in (entry["operator"], "all")]
        states = Counter("equivalent" if entry["equivalent"] else entry["state"] for entry in mine)
        if mine:
            counts = f"{states['killed']:>8}{states['survived']:>10}{states['undecided']:>11}{states['equivalent']:>12}"
            lines.append(f"{operator:<20}{len(mine):>7}{counts}")
    others = [entry for entry in results if entry["state"] != "killed"]
    lines += [
        f"{entry['file']}:{entry['line']}: {entry['state']}: {_short(entry['old'])} -> {_short(entry['new'])}"
        f"{' (equivalent: ' + entry['equivalent'] + ')' if entry['equivalent'] else ''}"
        for entry in others
    ]
    return "\n".join(lines)


def _short(text: str) -> str:
    line = " ".join(text.split())
    return line if len(line) <= 60 else f"{line[:57]}..."


def _key(entry: dict[str, Any]) -> tuple[object, ...]:
    """Return the place and the new text of a mutant, from its entry in the results."""
    return tuple(entry[name] for name in ("file", "start", "end", "new"))


def _state_of_tree() -> str:
    """Return the commit, with the names of changed files of the package."""
    commands = (["git", "rev-parse", "HEAD"], ["git", "status", "--porcelain", "eomgen"])
    said = [subprocess.run(one, cwd=ROOT, capture_output=True, text=True, check=False).stdout for one in commands]
    return " ".join(" ".join(said).split())


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m tests.mutants", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--sample", type=int, default=30, help="how many mutants (30)")
    parser.add_argument("--seed", type=int, default=1, help="of the sample (1)")
    parser.add_argument("--under", default="eomgen", help="a folder or file of the package, to sample there alone")
    tiers = parser.add_mutually_exclusive_group()
    tiers.add_argument("--first-tier", action="store_true", help="tests of the first tier alone, the default")
    tiers.add_argument("--both", action="store_true", help="the second tier, too, for mutants that pass the first")
    parser.add_argument("--jobs", type=int, default=1, help="mutants at the same time, each in a copy of its own (1)")
    parser.add_argument("--limit", type=float, default=300.0, help="processor time in s per mutant and tier (300)")
    parser.add_argument("--results", "--resume", type=Path, default=Path("out/mutants.json"), help="JSON, gone on with")
    parser.add_argument("--measure", type=float, metavar="SECONDS", help="measure test files for so long, try nothing")
    options = parser.parse_args(arguments)
    calls, chosen_tiers = Calls(), ["first", "second"] if options.both else ["first"]
    if options.measure is not None:
        for tier in chosen_tiers:
            count = calls.measure(tier, test_files(), options.measure)
            print(f"{count} test files measured in the {tier} tier, {len(calls.measured.get(tier, {}))} in all")
        return 0
    results: dict[tuple[object, ...], dict[str, Any]] = {}
    if options.results.is_file():
        results = {_key(entry): entry for entry in json.loads(options.results.read_text(encoding="utf-8"))["mutants"]}
    every = sampled(options.sample, options.seed, options.under)
    wanted = [mutant for mutant in every if _key(asdict(mutant)) not in results]
    wanted += [
        mutant
        for mutant in every
        if (entry := results.get(_key(asdict(mutant)))) is not None
        and (entry["state"], entry["equivalent"]) == ("undecided", "")
        and entry["limit"] < options.limit
    ]
    options.results.parent.mkdir(parents=True, exist_ok=True)
    print(f"tiers: {', '.join(TIERS[tier] for tier in chosen_tiers)}; results: {options.results}", flush=True)
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder, ThreadPoolExecutor(options.jobs) as pool:
        free: SimpleQueue[Scratch] = SimpleQueue()
        for number in range(options.jobs):
            free.put(Scratch(Path(folder) / str(number)))

        def trial(mutant: Mutant) -> dict[str, Any]:
            scratch = free.get()
            try:
                return tried(mutant, chosen_tiers, scratch, calls, options.limit)
            finally:
                free.put(scratch)

        for entry in pool.map(trial, wanted):
            results[_key(entry)] = entry
            content = {"tree": _state_of_tree(), "seed": options.seed, "mutants": list(results.values())}
            beside = options.results.with_suffix(".part")
            beside.write_text(json.dumps(content, indent=1), encoding="utf-8")
            beside.replace(options.results)
            place = f"{entry['file']}:{entry['line']}"
            print(f"{entry['state']:<10}{entry['seconds']:>7.1f} s  {place}  {entry['test']}", flush=True)
    print(table(list(results.values())))
    return 0


if __name__ == "__main__":
    sys.exit(main())
