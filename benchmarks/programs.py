"""Compiling timing programs: kept by content, with the CPU seconds that the compiler took."""

from __future__ import annotations

import hashlib
import json
import resource
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import platformdirs

from eomgen.toolchain.profiles import PROFILES

NATIVE = Path(__file__).resolve().parent / "native"
#: ``O3`` is what one types, with gcc's own dialect, as ISO C would forbid it to fuse multiplications and additions;
#: ``fast`` is eomgen's profile of that name.
FLAGS: Mapping[str, tuple[str, ...]] = {
    "O3": ("-std=gnu99", "-O3", "-march=native"),
    "fast": ("-std=c99", *PROFILES["fast"].flags),
}


@dataclass(frozen=True)
class Program:
    """A folder with what was built in it, and the compiler's CPU seconds for the commands that count."""

    folder: Path
    seconds: float

    def file(self, name: str) -> Path:
        return self.folder / name


def default_folder() -> Path:
    """Return where programs are kept between runs."""
    return Path(platformdirs.user_cache_dir("eomgen-benchmarks"))


def build(
    shelf: Path,
    files: Mapping[str, str],
    counted: Sequence[Sequence[str]],
    others: Sequence[Sequence[str]] = (),
    note: str = "",
) -> Program:
    """Write files into a folder named after their content and run commands there, once.

    Parameters
    ----------
    counted, others : commands
        Run in this order; only the first ones' CPU time is kept.

    Raises
    ------
    RuntimeError
        With what the compiler said.
    """
    content = json.dumps(
        [sorted(files.items()), [list(command) for command in counted], [list(command) for command in others]]
    )
    folder = shelf / hashlib.sha256(content.encode()).hexdigest()[:20]
    stamp = folder / "seconds.json"
    if stamp.exists():
        return Program(folder, float(json.loads(stamp.read_text(encoding="utf-8"))))
    if note:
        print(note, file=sys.stderr)
    shelf.mkdir(parents=True, exist_ok=True)
    private = Path(tempfile.mkdtemp(dir=shelf, prefix="tmp-"))
    for name, text in files.items():
        (private / name).write_text(text, encoding="utf-8")
    before = _children_seconds()
    _run_all(counted, private)
    seconds = _children_seconds() - before
    _run_all(others, private)
    (private / "seconds.json").write_text(json.dumps(seconds), encoding="utf-8")
    shutil.rmtree(folder, ignore_errors=True)
    private.rename(folder)
    return Program(folder, seconds)


def _run_all(commands: Sequence[Sequence[str]], folder: Path) -> None:
    for command in commands:
        result = subprocess.run(list(command), cwd=folder, capture_output=True, text=True, check=False)
        if result.returncode:
            errors = [line for line in result.stderr.splitlines() if "error" in line] or result.stderr.splitlines()
            raise RuntimeError(f"{command[0]} failed in {folder}: " + "\n".join(errors[:5]))


def _children_seconds() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def timing_program(shelf: Path, sources: Mapping[str, str], call: str, flags: Sequence[str]) -> Program:
    """Build ``./run``: generated C sources, which count, and the timing loop around ``call`` (the text of call.h)."""
    names = [name for name in sources if name.endswith(".c")]
    files = {**sources, "call.h": call}
    files |= {name: (NATIVE / name).read_text(encoding="utf-8") for name in ("time_c_function.c", "time_batches.h")}
    objects = [name.removesuffix(".c") + ".o" for name in names]
    counted = [["gcc", *flags, "-c", name] for name in names]
    return build(shelf, files, counted, [["gcc", *flags, "time_c_function.c", *objects, "-o", "run", "-lm"]])
