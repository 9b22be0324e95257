"""Sample mutants of the package, try them, and print a table; results go to a JSON file, from which a run goes on.

python -m tests.mutants --sample 200 --seed 1 --results out/mutants.json     the first tier; the same command goes on
python -m tests.mutants --measure 600                                        which tests run which lines, 10 minutes

``killed`` are mutants that a test fails for, ``survived`` ones that pass all tests which can notice them,
``undecided`` ones that pass the tests that ran within --limit; with a larger one they are tried again.
Files of tests that no trial needed yet are measured when a mutant passes the others, the nearest first.
Write a reason into "equivalent" of an entry of the results to count it apart.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import binomtest

from tests.mutants.operators import OPERATORS, Mutant, mutants_of
from tests.mutants.selection import ROOT, TIERS, Recording, chosen, unmeasured
from tests.mutants.trial import Outcome, Trials

STATES = ("killed", "survived", "undecided")
#: Test files that are measured before the next tests run against a mutant.
MEASURED_AT_ONCE = 2
#: The screen, behind pytest's capture.
SCREEN = os.dup(1)


def sampled(count: int, seed: int, under: Sequence[str] = ("eomgen",)) -> list[Mutant]:
    """Return mutants of the package or of parts of it, drawn evenly; a larger sample begins with the smaller one."""
    paths = {
        path for part in under for path in ((ROOT / part).rglob("*.py") if (ROOT / part).is_dir() else [ROOT / part])
    }
    every = [
        mutant for path in sorted(paths) for mutant in mutants_of(path.read_bytes(), path.relative_to(ROOT).as_posix())
    ]
    random.Random(seed).shuffle(every)
    return every[:count]


def tried(mutant: Mutant, trials: Trials, recording: Recording, options: argparse.Namespace) -> dict[str, Any]:
    """Return the entry of a mutant in the results.

    Files that are not measured are measured when the tests of the measured ones let the mutant pass, the nearest first.
    """
    files = [file for file in unmeasured(mutant, recording) if file in trials.files]
    passed: set[str] = set()
    total, measuring = Outcome("", True, 0, 0.0), 0.0
    while True:
        tests = [one for one in chosen(mutant, recording) if one.test not in passed]
        outcome = trials.judge(mutant, tests, options.limit - total.seconds)
        passed |= {one.test for one in tests}
        whole = outcome.whole and not files
        total = Outcome(outcome.failed, whole, total.tests + outcome.tests, total.seconds + outcome.seconds)
        if outcome.failed or not files or not outcome.whole or measuring > options.measuring:
            break
        for file in files[:MEASURED_AT_ONCE]:
            measuring += trials.measure(file)
        del files[:MEASURED_AT_ONCE]
    state = "killed" if total.failed else "survived" if total.whole else "undecided"
    entry: dict[str, Any] = {**asdict(mutant), "state": state, "tier": trials.tier, "test": total.failed}
    entry |= {"equivalent": "", "tests": total.tests, "seconds": round(total.seconds, 1)}
    return entry | {"limit": options.limit, "unmeasured": len(files)}


def room(file: str) -> str:
    """Return the room of a file of the package, as ``scene`` or ``products/linear``."""
    parts = file.removesuffix(".py").split("/")[1:]
    return "/".join(parts[: 2 if parts[0] == "products" else 1])


def table(results: list[dict[str, Any]]) -> str:
    """Return the counts by operator and by room, the share killed with its 95 % interval (Wilson), and the mutants that
    no test noticed."""
    lines = [f"{'':<24}{'tried':>7}{'killed':>8}{'survived':>10}{'undecided':>11}{'equivalent':>12}{'killed, %':>18}"]
    groups = {
        **{operator: [entry for entry in results if entry["operator"] == operator] for operator in OPERATORS},
        **{name: [entry for entry in results if room(entry["file"]) == name]
           for name in sorted({room(entry["file"]) for entry in results})},
        "all": results,
    }  # fmt: skip
    for name, mine in groups.items():
        states = Counter("equivalent" if entry["equivalent"] else entry["state"] for entry in mine)
        if counted := len(mine) - states["equivalent"]:
            low, high = 100.0 * np.array(binomtest(states["killed"], counted).proportion_ci(method="wilson"))
            counts = f"{states['killed']:>8}{states['survived']:>10}{states['undecided']:>11}{states['equivalent']:>12}"
            share = f"{100.0 * states['killed'] / counted:.0f} ({low:.0f} to {high:.0f})"
            lines.append(f"{name:<24}{len(mine):>7}{counts}{share:>18}")
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
    parser.add_argument(
        "--under", nargs="*", default=["eomgen"], help="folders or files of the package, to sample there"
    )
    parser.add_argument("--tier", choices=[*TIERS], default="first", help="the tier that runs (first)")
    parser.add_argument("--limit", type=float, default=60.0, help="processor time in s per mutant (60)")
    parser.add_argument("--tests", nargs="*", default=["tests"], help="folders or files of tests (tests)")
    parser.add_argument("--measuring", type=float, default=60.0, help="time in s to measure test files per mutant (60)")
    parser.add_argument(
        "--measure", type=float, metavar="SECONDS", help="measure all test files, for so long, try none"
    )
    parser.add_argument("--only", choices=STATES, help="try mutants again that have this state in the results")
    parser.add_argument("--results", "--resume", type=Path, default=Path("out/mutants.json"), help="JSON, gone on with")
    options = parser.parse_args(arguments)
    recording = Recording(options.tier)
    probe = str(Path(__file__).parent / "probe")
    os.environ["PYTHONPATH"] = os.pathsep.join((str(ROOT), probe))
    os.environ["EOMGEN_PROBE_FOLDER"], os.environ["EOMGEN_PROBE_PACKAGE"] = str(recording.folder), str(ROOT / "eomgen")
    recording.start()
    plugin = Trials(options.tier, recording, lambda trials: _work(trials, recording, options))
    left_out = [f"--ignore={ROOT / 'tests' / name}" for name in ("mutants", "browser", "packaging")]
    return int(
        pytest.main(
            ["-m", TIERS[options.tier], "-p", "no:cacheprovider", *left_out, *options.tests],
            plugins=[plugin],
        )
    )


def _work(trials: Trials, recording: Recording, options: argparse.Namespace) -> None:
    """Measure test files and try mutants."""
    began = time.monotonic()
    if options.measure is not None:
        for file in trials.files:
            if recording.run_of(file) is None and time.monotonic() - began < options.measure:
                trials.measure(file)
        return
    results: dict[tuple[object, ...], dict[str, Any]] = {}
    if options.results.is_file():
        results = {_key(entry): entry for entry in json.loads(options.results.read_text(encoding="utf-8"))["mutants"]}
    every = sampled(options.sample, options.seed, options.under)
    wanted = [mutant for mutant in every if _is_wanted(results.get(_key(asdict(mutant))), options)]
    options.results.parent.mkdir(parents=True, exist_ok=True)
    for mutant in wanted:
        entry = tried(mutant, trials, recording, options)
        before = results.get(_key(entry))
        results[_key(entry)] = entry | {"equivalent": before["equivalent"] if before else ""}
        content = {"tree": _state_of_tree(), "seed": options.seed, "mutants": list(results.values())}
        beside = options.results.with_suffix(".part")
        beside.write_text(json.dumps(content, indent=1), encoding="utf-8")
        beside.replace(options.results)
        place = f"{entry['file']}:{entry['line']}"
        _say(f"{entry['state']:<10}{entry['seconds']:>7.1f} s {entry['tests']:>5}  {place}  {entry['test']}")
    _say(table(list(results.values())))


def _is_wanted(entry: dict[str, Any] | None, options: argparse.Namespace) -> bool:
    """Tell whether a mutant is tried, from its entry in the results."""
    if entry is None:
        return options.only is None
    if entry["equivalent"]:
        return False
    return entry["state"] == (options.only or "undecided") and (options.only or entry["limit"] < options.limit)


def _say(text: str) -> None:
    os.write(SCREEN, f"{text}\n".encode())


if __name__ == "__main__":
    sys.exit(main())
