"""A mutant in a copy of the tree, against the tests that can notice it."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from tests.mutants.operators import Mutant
from tests.mutants.selection import ROOT, TIERS

#: Parts of the tree that are not copied.
LEFT = (".git", ".venv", ".bench", "out", "__pycache__", ".pytest_cache", ".mypy_cache", ".ruff_cache", ".hypothesis")
#: Wall time against processor time, for tests that wait for nothing that comes, on a machine that does other things.
WAITING = 20.0


@dataclass(frozen=True)
class Outcome:
    """How a run of tests ended: ``failed`` is the first test that did not pass, and ``whole`` tells whether all ran."""

    failed: str
    whole: bool
    tests: int
    seconds: float


class Scratch:
    """A copy of the tree, in which one file at a time is changed and tests run.

    A failure counts if the test passes without the mutant; tests that fail in the copy anyway are left out from
    then on.
    """

    def __init__(self, folder: Path, tree: Path = ROOT) -> None:
        self.folder = folder / "tree"
        self.cache = folder / "cache"
        self.report = folder / "report.json"
        self.sound: set[str] = set()
        self.unsound: set[str] = set()
        shutil.copytree(tree, self.folder, ignore=shutil.ignore_patterns(*LEFT))

    def judge(self, mutant: Mutant, tier: str, tests: Sequence[str], limit: float) -> Outcome:
        """Run test files against a mutant up to the first failure, for ``limit`` seconds of processor time."""
        source = (self.folder / mutant.file).read_bytes()
        while True:
            self._write(mutant.file, mutant.applied(source))
            outcome = self._run(tests, TIERS[tier], limit)
            self._write(mutant.file, source)
            if not outcome.failed or outcome.failed in self.sound:
                return outcome
            if not self._run([outcome.failed], TIERS[tier], limit).failed:
                self.sound.add(outcome.failed)
                return outcome
            self.unsound.add(outcome.failed)

    def _write(self, file: str, source: bytes) -> None:
        (self.folder / file).write_bytes(source)
        shutil.rmtree(self.cache, ignore_errors=True)

    def _run(self, tests: Sequence[str], expression: str, limit: float) -> Outcome:
        self.report.unlink(missing_ok=True)
        left_out = [option for test in sorted(self.unsound) for option in ("--deselect", test)]
        environment = {
            **os.environ,
            "PYTHONPATH": str(self.folder),
            "PYTHONDONTWRITEBYTECODE": "1",
            "EOMGEN_CACHE": str(self.cache),
            "EOMGEN_TRIAL_REPORT": str(self.report),
            "EOMGEN_TRIAL_LIMIT": str(limit),
        }
        plugins = ["-p", "tests.mutants.watch", "-p", "no:cacheprovider"]
        command = [sys.executable, "-m", "pytest", "-x", "-m", expression, *plugins, *left_out, *tests]
        process = subprocess.Popen(
            command,
            cwd=self.folder,
            env=environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        try:
            process.wait(WAITING * limit)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        if not self.report.is_file():
            return Outcome("no end", False, 0, limit)
        record = json.loads(self.report.read_text(encoding="utf-8"))
        return Outcome(record["failed"], record["whole"], record["tests"], record["seconds"])
