"""Trials of mutants in forked copies of one process that has collected all tests.

A fork replaces the code of the mutated function, runs the chosen tests up to the first failure, and ends: so a trial
costs its tests and little more. Child processes of tests import the mutated file. A mutant of a module's or a class's
own statements, or of a function that importing the package calls, needs a process that imports anew.
"""

from __future__ import annotations

import functools
import gc
import importlib
import json
import os
import pkgutil
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import CodeType, FunctionType

import pytest

from tests.mutants.operators import Mutant
from tests.mutants.probe.sitecustomize import MUTANT
from tests.mutants.selection import ROOT, TIERS, Candidate, Recording, file_of

#: Wall time against processor time, for tests that wait for nothing that comes, on a machine that does other things.
WAITING = 40.0
#: A mutant may have no end and take all memory.
MEMORY = 8_000_000_000
#: Flag of a code object that is a function and not the body of a class.
OPTIMIZED = 1


@dataclass(frozen=True)
class Outcome:
    """How a trial ended: ``failed`` is the first test that did not pass, and ``whole`` says whether all ran."""

    failed: str
    whole: bool
    tests: int
    seconds: float


class Trials:
    """A plugin of pytest that runs a function in place of the tests, and forks for each trial."""

    def __init__(self, tier: str, recording: Recording, work: Callable[[Trials], None]) -> None:
        self.tier, self.recording, self.work = tier, recording, work
        self.items: dict[str, pytest.Item] = {}
        self.sound: dict[str, bool] = {}
        self.functions: dict[tuple[str, str, int], list[FunctionType]] = {}
        self.caches: list[functools._lru_cache_wrapper[object]] = []
        self.imported = b""
        self.failed = ""

    # of pytest

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        self.items = {item.nodeid: item for item in session.items}
        self._learn()
        self.imported = self.recording.take()
        self.work(self)
        return True

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed and not self.failed:
            self.failed = report.nodeid

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef: pytest.FixtureDef[object], request: pytest.FixtureRequest):  # type: ignore[no-untyped-def]
        if fixturedef.scope == "function":
            return (yield)
        before = self.recording.take()
        try:
            return (yield)
        finally:
            self.recording.write(f"{file_of(request._pyfuncitem.nodeid)}::", 0.0)
            self.recording.marks[:] = before

    # of the driver

    @property
    def files(self) -> list[str]:
        """Return the files of the collected tests."""
        return list(dict.fromkeys(file_of(name) for name in self.items))

    def measure(self, file: str) -> float:
        """Record the blocks that each test of a file runs, and return the processor time."""
        mine = [item for name, item in self.items.items() if file_of(name) == file]

        def run() -> Iterator[None]:
            self.recording.take()
            for item, following in zip(mine, [*mine[1:], None], strict=True):
                start = _processor_time()
                item.config.hook.pytest_runtest_protocol(item=item, nextitem=following)
                self.recording.write(item.nodeid, _processor_time() - start)
                yield

        outcome = self._forked(run, 600.0, goes_on=True)
        self.recording.close(file)
        return outcome.seconds

    def judge(self, mutant: Mutant, chosen: Sequence[Candidate], limit: float) -> Outcome:
        """Run tests against a mutant up to the first failure, for ``limit`` seconds of processor time."""
        names = [one.test for one in chosen if one.test in self.items]
        source = (ROOT / mutant.file).read_bytes()
        self.recording.put_mutant(mutant)
        replaced = self._replaced(mutant, source)
        seconds, count = 0.0, 0
        while True:
            names = [name for name in names if self.sound.get(name, True)]
            if not names:
                return Outcome("", True, count, seconds)
            left = limit - seconds
            outcome = self._forked(self._runs(names, replaced), left) if replaced else self._anew(names, left)
            seconds, count = seconds + outcome.seconds, count + outcome.tests
            if not outcome.failed:
                return Outcome("", outcome.whole, count, seconds)
            if outcome.failed not in self.items:  # no end, or the file cannot be imported
                return Outcome(outcome.failed, False, count, seconds)
            if outcome.failed not in self.sound:
                self.sound[outcome.failed] = not self._forked(self._runs([outcome.failed], []), 300.0).failed
            if self.sound[outcome.failed]:
                return Outcome(outcome.failed, False, count, seconds)
            if outcome.failed in names:  # else of a file that was run whole
                names = names[names.index(outcome.failed) + 1 :]

    def _runs(
        self, names: Sequence[str], replaced: Sequence[tuple[FunctionType, CodeType]]
    ) -> Callable[[], Iterator[None]]:
        items = [self.items[name] for name in names]

        def run() -> Iterator[None]:
            if replaced:
                os.environ[MUTANT] = str(self.recording.mutant)
            for function, code in replaced:
                function.__code__ = code
            for item, following in zip(items, [*items[1:], None], strict=True):
                yield
                item.config.hook.pytest_runtest_protocol(item=item, nextitem=following)

        return run

    def _forked(self, run: Callable[[], Iterator[None]], limit: float, goes_on: bool = False) -> Outcome:
        """Run one step after the other in a fork, until a test fails or the time is used up."""
        report, cache = self.recording.folder / "report.json", self.recording.folder / "cache"
        report.unlink(missing_ok=True)
        shutil.rmtree(cache, ignore_errors=True)
        child = os.fork()
        if not child:
            self._run_and_exit(run, limit, goes_on, report, cache)
        began = time.monotonic()
        while True:
            ended, _, usage = os.wait4(child, os.WNOHANG)
            if ended:
                break
            if time.monotonic() - began > WAITING * limit:
                os.killpg(child, signal.SIGKILL)
            time.sleep(0.01)
        seconds = usage.ru_utime + usage.ru_stime
        if not report.is_file():
            return Outcome("no end", False, 0, seconds)
        record = json.loads(report.read_text(encoding="utf-8"))
        return Outcome(record["failed"], record["whole"], record["tests"], seconds)

    def _run_and_exit(
        self, run: Callable[[], Iterator[None]], limit: float, goes_on: bool, report: Path, cache: Path
    ) -> None:
        count, whole = 0, True
        try:
            os.setsid()
            os.environ["EOMGEN_CACHE"] = str(cache)
            resource.setrlimit(resource.RLIMIT_CPU, (int(limit) + 2, int(limit) + 2))
            resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
            for one in self.caches:
                one.cache_clear()
            start = _processor_time()
            self.failed = ""
            for _ in run():
                if (self.failed and not goes_on) or _processor_time() - start > limit:
                    whole = False
                    break
                count += 1
            record = {"failed": self.failed, "whole": whole, "tests": count}
            report.write_text(json.dumps(record), encoding="utf-8")
        finally:
            os._exit(0)

    def _anew(self, names: Sequence[str], limit: float) -> Outcome:
        """Run tests in a process that imports the mutated file."""
        report = self.recording.folder / "failures.txt"
        report.unlink(missing_ok=True)
        shutil.rmtree(self.recording.folder / "cache", ignore_errors=True)
        environment = {
            **os.environ,
            MUTANT: str(self.recording.mutant),
            "EOMGEN_CACHE": str(self.recording.folder / "cache"),
        }
        files = list(dict.fromkeys(file_of(name) for name in names))
        chosen = names if len(names) < 200 else files
        chosen = [*chosen, *(f"--deselect={name}" for name, sound in self.sound.items() if not sound)]
        plugins = ["-p", "no:cacheprovider", "-x", "-rfE"]
        start = _processor_time()
        with report.open("w") as screen:
            process = subprocess.Popen(
                [sys.executable, "-m", "pytest", "-m", TIERS[self.tier], *plugins, *chosen],
                cwd=ROOT,
                env=environment,
                stdout=screen,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
            try:
                status = process.wait(WAITING * limit)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
                return Outcome("no end", False, 0, limit)
        seconds = _processor_time() - start
        if status in (0, 5):
            return Outcome("", True, len(names), seconds)
        lines = report.read_text(encoding="utf-8").splitlines()
        marked = [line.split(" ")[1] for line in lines if line.startswith(("FAILED ", "ERROR "))]
        return Outcome(marked[0] if marked else "collection", False, len(names), seconds)

    # functions

    def _learn(self) -> None:
        """Import all of the package, and list its functions and its caches of values."""
        package = importlib.import_module("eomgen")
        for module in pkgutil.walk_packages(package.__path__, "eomgen."):
            if not module.name.endswith("__main__"):
                importlib.import_module(module.name)
        gc.unfreeze()
        top = str(ROOT / "eomgen")
        for one in gc.get_objects():
            if type(one) is FunctionType and one.__code__.co_filename.startswith(top):
                self.functions.setdefault(_key(one.__code__), []).append(one)
            elif isinstance(one, functools._lru_cache_wrapper) and getattr(one, "__module__", "").startswith("eomgen"):
                self.caches.append(one)
        gc.freeze()

    def _replaced(self, mutant: Mutant, source: bytes) -> list[tuple[FunctionType, CodeType]]:
        """Return the functions that change, with their new code; none if a process has to import anew."""
        if not mutant.function or self.recording.is_marked(self.imported, mutant):
            return []
        path = str(ROOT / mutant.file)
        before, after = (
            {_key(code): code for code in _of_functions(compile(text, path, "exec", dont_inherit=True))}
            for text in (source, mutant.applied(source))
        )
        changed = [key for key in after if before.get(key) != after[key]]
        result = []
        for key in changed:
            for function in self.functions.get(key, []):
                if len(function.__code__.co_freevars) != len(after[key].co_freevars):
                    return []
                result.append((function, after[key]))
        return result if changed and all(key in self.functions for key in changed) else []


def _key(code: CodeType) -> tuple[str, str, int]:
    return code.co_filename, code.co_qualname, code.co_firstlineno


def _of_functions(code: CodeType) -> Iterator[CodeType]:
    """Return the code of functions of a module and its classes, not of functions inside functions."""
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            if constant.co_flags & OPTIMIZED:
                yield constant
            else:
                yield from _of_functions(constant)


def _processor_time() -> float:
    both = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(usage.ru_utime + usage.ru_stime for usage in both)
