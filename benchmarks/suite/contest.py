"""Contestants in processes of their own: checked first, then timed in turns on one core."""

from __future__ import annotations

import json
import os
import platform
import re
import selectors
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.suite import environments
from benchmarks.suite.environments import OWN, ROOT
from benchmarks.suite.outcomes import CHECKED, FAILED, MEASURED, MISSING, WRONG, Outcome

Array = NDArray[np.float64]
CONTESTANTS = Path(__file__).resolve().parent / "contestants"
#: Wall seconds after which no new turn begins.
BUDGET = 20.0
#: One thread in whatever a peer computes with.
ONE_THREAD = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "NUMBA_NUM_THREADS": "1",
    "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false",
    "JAX_PLATFORMS": "cpu",
    "JAX_ENABLE_X64": "1",
}


@dataclass(frozen=True)
class Context:
    """How the suite runs.

    Attributes
    ----------
    quick : small pieces of work, one round.
    here : all contestants in this Python, whatever it has.
    shelf : where compiled programs are kept.
    rounds : turns in which every contestant runs once.
    core : the one that single threads stay on.
    """

    quick: bool
    here: bool
    shelf: Path
    rounds: int
    core: int

    @property
    def at_least(self) -> float:
        """CPU seconds of a turn."""
        return 0.0 if self.quick else 0.1


@dataclass(frozen=True)
class Entry:
    """A contestant: a script in ``contestants``, the group that it runs in, and what it is told.

    ``small`` replaces items of ``task`` where the suite is quick. ``threads`` other than 1 runs on as many cores.
    ``patience``: seconds until an answer; Pinocchio's headers alone take some minutes to compile.
    """

    name: str
    script: str
    group: str = OWN
    task: Mapping[str, Any] = field(default_factory=dict)
    small: Mapping[str, Any] = field(default_factory=dict)
    threads: int = 1
    patience: float = 600.0


@contextmanager
def pinned(core: int) -> Iterator[None]:
    """Keep this process, and those it starts meanwhile, on one core."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {core})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


class GaveUpError(Exception):
    """A contestant did not answer in time, or ended."""


class Process:
    """The other end of ``contestants/serve.py``."""

    def __init__(self, entry: Entry, context: Context) -> None:
        self.entry = entry
        python = environments.interpreter(entry.group, context.here)
        if not python.exists():
            raise FileNotFoundError(f"there is no {python}: python -m benchmarks.suite.environments")
        cores = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else [0]
        chosen = [context.core] if entry.threads == 1 else cores[: entry.threads]
        added = ONE_THREAD | {"EOMGEN_THREADS": str(entry.threads)}
        if entry.group == OWN:
            added["PYTHONPATH"] = str(ROOT)
        kept = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        self.errors = tempfile.TemporaryFile()  # noqa: SIM115  # closed with the process
        self.process = subprocess.Popen(
            [str(python), str(CONTESTANTS / entry.script), ",".join(map(str, chosen))],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self.errors,
            text=True,
            env=kept | added,
            cwd=ROOT,
        )

    def ask(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Return the answer. Raises GaveUpError."""
        assert self.process.stdin and self.process.stdout
        try:
            self.process.stdin.write(json.dumps(request) + "\n")
            self.process.stdin.flush()
        except BrokenPipeError:
            raise GaveUpError(f"the process ended: {self._last_words()}") from None
        with selectors.DefaultSelector() as ready:
            ready.register(self.process.stdout, selectors.EVENT_READ)
            if not ready.select(self.entry.patience):
                raise GaveUpError(f"no answer within {self.entry.patience:g} s")
        line = self.process.stdout.readline()
        if not line:
            self.process.wait()
            raise GaveUpError(f"the process ended with {self.process.returncode}: {self._last_words()}")
        answer: dict[str, Any] = json.loads(line)
        return answer

    def _last_words(self) -> str:
        self.errors.seek(0)
        lines = self.errors.read().decode(errors="replace").strip().splitlines()
        return lines[-1][:200] if lines else "it said nothing"

    def close(self) -> None:
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        for stream in (self.process.stdin, self.process.stdout, self.errors):
            if stream:
                stream.close()


def relative_to_largest(found: Array, expected: Array) -> float:
    """Return the largest difference, in units of the largest expected number; infinity where shapes differ."""
    if found.shape != expected.shape or not np.all(np.isfinite(found)):
        return float("inf")
    return float(np.max(np.abs(found - expected)) / np.max(np.abs(expected)))


def absolute(found: Array, expected: Array) -> float:
    """Return the largest difference; infinity where shapes differ or a number is not finite."""
    if found.shape != expected.shape or not np.all(np.isfinite(found)):
        return float("inf")
    return float(np.max(np.abs(found - expected)))


def of_first_rows(found: Array, expected: Array) -> float:
    """Return the largest difference of as many rows as there are: slow peers run a part of the samples."""
    return absolute(found, expected[: len(found)])


def contest(
    context: Context,
    entries: Sequence[Entry],
    tolerance: float,
    *,
    reference: Sequence[Entry] | Array = (),
    measure: Callable[[Array, Array], float] = absolute,
    clock: str = "processor",
) -> list[Outcome]:
    """Run a row: all against the reference, then those that are right in turns.

    Parameters
    ----------
    tolerance : float
        Largest error of a contestant that is timed.
    reference : entries or array
        What all are held against: numbers, or those of the first entry that answers, which gets no time. Without any,
        the first contestant's.
    clock : ``processor`` for CPU seconds of all threads of the contestant, ``wall`` where threads or processes compete.
    """
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        if isinstance(reference, np.ndarray):
            expected, source = reference, None
        else:
            expected, source = _first_results(context, reference, folder)
        told = {"quick": context.quick} | ({"reference": str(source)} if source else {})
        ready: list[tuple[Entry, Process]] = []
        outcomes: dict[str, Outcome] = {}
        for number, entry in enumerate(entries):
            try:
                process = Process(entry, context)
                stack.callback(process.close)
                answer = process.ask(task_of(entry, context) | told)
                if not _refused(answer):
                    file = folder / f"{number}.npy"
                    answer |= process.ask({"results": str(file)})
                if _refused(answer):
                    outcomes[entry.name] = _without(entry, answer)
                    continue
            except (GaveUpError, FileNotFoundError) as error:
                outcomes[entry.name] = Outcome(entry.name, FAILED, note=str(error))
                continue
            found = np.load(file)
            expected = found if expected is None else expected
            error_found = measure(found, expected)
            right = error_found <= tolerance
            outcomes[entry.name] = Outcome(
                entry.name,
                CHECKED if right else WRONG,
                error=error_found if np.isfinite(error_found) else None,
                note=answer["note"],
                versions=answer["versions"],
            )
            if right:
                ready.append((entry, process))
        outcomes |= _timed(context, ready, outcomes, clock)
    return [outcomes[entry.name] for entry in entries]


def task_of(entry: Entry, context: Context) -> dict[str, Any]:
    """Return what a contestant is told first."""
    return {**entry.task, **(entry.small if context.quick else {})}


def _first_results(context: Context, reference: Sequence[Entry], folder: Path) -> tuple[Array | None, Path | None]:
    for entry in reference:
        try:
            process = Process(entry, context)
        except FileNotFoundError:
            continue
        try:
            file = folder / "reference.npy"
            told = {"quick": context.quick, "as_reference": True}
            if not _refused(process.ask(task_of(entry, context) | told)) and not _refused(
                process.ask({"results": str(file)})
            ):
                return np.load(file), file
        except GaveUpError:
            continue
        finally:
            process.close()
    return None, None


def _refused(answer: Mapping[str, Any]) -> bool:
    return "missing" in answer or "failed" in answer


def _without(entry: Entry, answer: Mapping[str, Any]) -> Outcome:
    if "failed" in answer:
        return Outcome(entry.name, FAILED, note=answer["failed"])
    reasons = environments.reasons(entry.group)
    module = re.findall(r"'([^'.]+)", answer["missing"])
    known = [reason for wanted, reason in reasons.items() if module and wanted.startswith(module[0])]
    return Outcome(entry.name, MISSING, note="; ".join([answer["missing"], *known]))


def _timed(
    context: Context, ready: Sequence[tuple[Entry, Process]], checked: Mapping[str, Outcome], clock: str
) -> dict[str, Outcome]:
    taken: dict[str, list[float]] = {entry.name: [] for entry, _ in ready}
    failed: dict[str, str] = {}
    began = time.monotonic()
    for _ in range(1 if context.quick else context.rounds):
        if time.monotonic() - began > BUDGET:
            break
        for entry, process in ready:
            if entry.name in failed:
                continue
            try:
                answer = process.ask({"at_least": context.at_least, "clock": clock})
            except GaveUpError as error:
                failed[entry.name] = str(error)
                continue
            if _refused(answer):
                failed[entry.name] = str(answer.get("failed", answer.get("missing")))
            else:
                taken[entry.name].append(answer["seconds"])
    found = {}
    for name, seconds in taken.items():
        before = checked[name]
        if name in failed:
            found[name] = Outcome(name, FAILED, error=before.error, note=failed[name], versions=before.versions)
            continue
        middle = statistics.median(seconds)
        spread = (max(seconds) - min(seconds)) / middle
        found[name] = Outcome(name, MEASURED, middle, spread, before.error, before.note, before.versions)
    return found


def machine() -> dict[str, Any]:
    """Return what the measurements depend on: processor, its vectors, cores, load, compiler, Python, date and
    commit."""
    information = Path("/proc/cpuinfo")
    named: dict[str, str] = {}
    if information.exists():
        first = information.read_text(encoding="utf-8").split("\n\n", maxsplit=1)[0]
        named = {key.strip(): value.strip() for key, _, value in (line.partition(":") for line in first.splitlines())}
    flags = set(named.get("flags", "").split())
    vectors = "AVX-512" if "avx512f" in flags else "AVX2" if "avx2" in flags else ""
    return {
        "processor": named.get("model name", platform.processor() or platform.machine()),
        "family": f"family {named['cpu family']}, model {named['model']}" if "cpu family" in named else "",
        "vectors": vectors,
        "cores": os.cpu_count(),
        "load": round(os.getloadavg()[0], 1) if hasattr(os, "getloadavg") else None,
        "system": f"{platform.system()} {platform.release().partition('-')[0]}",
        "compiler": _said(["gcc", "-dumpfullversion"]),
        "python": platform.python_version(),
        "date": f"{date.today()}",
        "commit": _said(["git", "-C", str(ROOT), "rev-parse", "--short=8", "HEAD"]),
        "time": round(time.time()),
    }


def _said(command: Sequence[str]) -> str:
    try:
        return subprocess.run(command, capture_output=True, text=True, check=False).stdout.strip()
    except FileNotFoundError:
        return ""
