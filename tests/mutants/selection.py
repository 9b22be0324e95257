"""Which test files can notice a change of a function: measured for files that ran under probes, else by nearness.

A measurement is kept in a file of the user's cache folder, and holds as long as the test file stays as it is: each
file runs in a process of its own with an empty cache of models, so nothing that another file computed hides a call.
"""

from __future__ import annotations

import ast
import hashlib
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import platformdirs

from tests.mutants.operators import Mutant

ROOT = Path(__file__).parents[2]
TIERS = {"first": "not slow", "second": "slow and not long"}
MEASURED = Path(platformdirs.user_cache_dir("eomgen-mutants")) / "calls.json"


@dataclass
class Calls:
    """Functions that each test file calls, by tier: ``{tier: {file: {digest, seconds, functions}}}``."""

    file: Path = MEASURED
    measured: dict[str, dict[str, dict[str, object]]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.file.is_file():
            self.measured = json.loads(self.file.read_text(encoding="utf-8"))

    def of(self, tier: str, test: str) -> set[str] | None:
        """Return the functions that a test file calls, None if it was not measured as it is now."""
        known = self.measured.get(tier, {}).get(test)
        if known is None or known["digest"] != _digest(test):
            return None
        functions = known["functions"]
        return set(functions) if isinstance(functions, list) else None

    def measure(self, tier: str, tests: Iterable[str], seconds: float) -> int:
        """Measure test files that were not, for so many seconds, and return their number."""
        began, count = time.monotonic(), 0
        for test in tests:
            if self.of(tier, test) is not None:
                continue
            if time.monotonic() - began > seconds:
                break
            start = time.monotonic()
            called = _called(test, TIERS[tier])
            entry = {"digest": _digest(test), "seconds": time.monotonic() - start, "functions": sorted(called)}
            self.measured.setdefault(tier, {})[test] = entry
            self.file.parent.mkdir(parents=True, exist_ok=True)
            self.file.write_text(json.dumps(self.measured), encoding="utf-8")
            count += 1
        return count


def test_files() -> list[str]:
    """Return all test files, relative to the top folder."""
    return sorted(path.relative_to(ROOT).as_posix() for path in (ROOT / "tests").rglob("test_*.py"))


def chosen(mutant: Mutant, tier: str, calls: Calls) -> list[str]:
    """Return the test files that can notice a mutant, the most promising first: all but the ones that are measured
    not to call its function."""
    name = f"{mutant.file}::{mutant.function}"
    ranked = []
    for test in test_files():
        called = calls.of(tier, test)
        rank = nearness(mutant, test, (ROOT / test).read_text(encoding="utf-8"))
        if called is None or name in called:
            ranked.append((-rank, called is None, len(called or ()), test))
    return [test for *_, test in sorted(ranked)]


def nearness(mutant: Mutant, test: str, text: str) -> int:
    """Return a rank from names alone: how likely a test file is about the place of a mutant."""
    module = mutant.file.removesuffix(".py").replace("/", ".").removesuffix(".__init__")
    package, _, last = module.rpartition(".")
    room = module.split(".")[1] if "." in module else ""
    rank = 0
    if module in text and module in imported(text):
        rank += 8
    words = {word for word in re.split(r"[/_.]", last) if len(word) > 3}
    rank += 2 * len(words & set(re.split(r"[/_.]", test)))
    function = mutant.function.rpartition(".")[2]
    if len(function) > 4 and re.search(rf"\b{function}\b", text):
        rank += 3
    if f"/{room}/" in test:
        rank += 1 + 2 * (package in text)
    return rank + (f"eomgen.{room}." in text)


def imported(text: str) -> set[str]:
    """Return the modules that a file imports by name."""
    found = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            found |= {name.name for name in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{name.name}" for name in node.names)}
    return found


def _digest(test: str) -> str:
    return hashlib.sha256((ROOT / test).read_bytes()).hexdigest()


def _called(test: str, expression: str) -> set[str]:
    """Run a test file under probes, and return the functions that it and its child processes called."""
    return called_by(["-m", "pytest", test, "-m", expression, "-p", "no:cacheprovider"], ROOT)


def called_by(arguments: Sequence[str], tree: Path) -> set[str]:
    """Return the functions of the package in a tree that a Python process and its children called."""
    with tempfile.TemporaryDirectory() as folder:
        calls = Path(folder) / "calls"
        calls.mkdir()
        environment = {
            **os.environ,
            "PYTHONPATH": os.pathsep.join((str(tree), str(Path(__file__).parent / "probe"))),
            "EOMGEN_CACHE": str(Path(folder) / "cache"),
            "EOMGEN_PROBE_FOLDER": str(calls),
            "EOMGEN_PROBE_PACKAGE": str(tree / "eomgen"),
        }
        subprocess.run(
            [sys.executable, *arguments],
            cwd=tree,
            env=environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            check=False,
        )
        return {line for file in calls.glob("*.txt") for line in file.read_text(encoding="utf-8").splitlines()}
