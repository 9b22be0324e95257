"""Repeated measurements on one pinned core, with their noise, and tables of them."""

from __future__ import annotations

import os
import platform
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Timing:
    """Nanoseconds per call: median of the rounds' medians, smallest batch of all, and how far the rounds' medians lie
    apart."""

    median: float
    smallest: float
    spread: float


def pin_to_core(core: int | None) -> int | None:
    """Keep this process and its children on one core, the last one by default; return it, or None where that cannot be
    done."""
    if not hasattr(os, "sched_setaffinity"):
        return None
    chosen = max(os.sched_getaffinity(0)) if core is None else core
    os.sched_setaffinity(0, {chosen})
    return chosen


def interleaved(commands: Sequence[Sequence[str]], rounds: int) -> list[Timing]:
    """Run timing programs in turns, so that all see the same disturbances, and return a Timing for each.

    Each turn runs a copy of its own, and all copies stay until the end: functions larger than the instruction cache
    take up to twice as long on some pages of memory as on others, for as long as the file stays on them. The median is
    over that luck too.
    """
    found: list[list[tuple[float, float]]] = [[] for _ in commands]
    with tempfile.TemporaryDirectory() as folder:
        for turn in range(rounds):
            for number, (command, kept) in enumerate(zip(commands, found, strict=True)):
                copy = Path(folder) / f"{turn}_{number}"
                copy.write_bytes(Path(command[0]).read_bytes())
                copy.chmod(0o700)
                words = subprocess.run(
                    [str(copy), *command[1:]], capture_output=True, text=True, check=True
                ).stdout.split()
                kept.append((float(words[0]), float(words[1])))
    return [summary([median for median, _ in kept], min(smallest for _, smallest in kept)) for kept in found]


def summary(medians: Sequence[float], smallest: float) -> Timing:
    """Return the Timing of the medians of several rounds."""
    middle = statistics.median(medians)
    return Timing(middle, smallest, (max(medians) - min(medians)) / middle)


def repeated(call: Callable[[], object], batches: int, at_least: float = 0.02) -> Timing:
    """Time a Python callable by the thread's CPU time, in batches of ``at_least`` seconds; nanoseconds per call."""
    calls = 1
    while (taken := _batch(call, calls)) < at_least:
        calls *= 2 if taken < at_least / 4 else 1 + int(at_least / taken)
    seconds = [_batch(call, calls) / calls * 1e9 for _ in range(batches)]
    return summary(seconds, min(seconds))


def _batch(call: Callable[[], object], calls: int) -> float:
    start = time.thread_time()
    for _ in range(calls):
        call()
    return time.thread_time() - start


def environment_of_users(cache: Path | str) -> dict[str, str]:
    """Return the environment of a new process with the cache in a folder, in which Python keeps compiled modules as
    users have them: without them each process takes 0.2 to 2 s more."""
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    return kept | {"EOMGEN_CACHE": str(cache)}


def machine() -> str:
    """Return processor, cores, load, Python and compiler in one line."""
    processor = platform.processor() or platform.machine()
    information = Path("/proc/cpuinfo")
    if information.exists():
        first = information.read_text(encoding="utf-8").split("\n\n")[0]
        named = {key.strip(): value.strip() for key, _, value in (line.partition(":") for line in first.splitlines())}
        processor = f"{named.get('model name', processor)} (family {named.get('cpu family', '?')})"
    load = f", load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    return f"{processor}, {os.cpu_count()} cores{load}, {platform.system()}, Python {platform.python_version()}"


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table whose columns also line up in a terminal."""
    widths = [max(len(row[k]) for row in [header, *rows]) for k in range(len(header))]
    padded = [[cell.ljust(width) for cell, width in zip(row, widths, strict=True)] for row in [header, *rows]]
    lines = [f"| {' | '.join(row)} |" for row in padded]
    return "\n".join([lines[0], "|" + "|".join("-" * (width + 2) for width in widths) + "|", *lines[1:]])


def figure(value: float | None, digits: int = 3) -> str:
    """Return a number with some significant digits, a dash for None."""
    if value is None:
        return "-"
    return f"{value:.0f}" if abs(value) >= 10 ** (digits - 1) else f"{value:.{digits}g}"
