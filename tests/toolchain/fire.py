"""What tests of hostile days need: small and read-only disks, slow compilers, and a program that builds and runs."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import eomgen
from tests.models.scenes import PENDULUM_TOML

ROOT = Path(eomgen.__file__).parents[1]
PROGRAM = """
import sys, eomgen
model = eomgen.build(sys.argv[1], terms=["mass", "forward_dynamics"], method="rk4", profile="quick")
print(model.mass([0.3]).tobytes().hex(), model.simulate(0.1, 1e-2, method="rk4").q.tobytes().hex())
"""


def scene_in(folder: Path) -> Path:
    file = folder / "shaken.toml"
    file.write_text(PENDULUM_TOML, encoding="utf-8")
    return file


def script(file: Path, text: str) -> Path:
    file.write_text(f"#!/bin/sh\n{text}\n", encoding="utf-8")
    file.chmod(0o755)
    return file


def environment(cache: Path, **more: str) -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(ROOT), "EOMGEN_CACHE": str(cache), **more}


def building(scene: Path, cache: Path, **more: str) -> subprocess.Popen[str]:
    """Start a process of its own session that builds the scene and prints what the model computes, as bytes."""
    return subprocess.Popen(
        [sys.executable, "-W", "default", "-c", PROGRAM, str(scene)],
        env=environment(cache, **more),
        text=True,
        cwd=scene.parent,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        start_new_session=True,
    )


def command(words: list[str], cache: Path, longest: int | None = None) -> subprocess.CompletedProcess[str]:
    """Run a command line of eomgen, forbidding it and its children files with more than ``longest`` bytes."""
    limited = [] if longest is None else ["sh", "-c", f'ulimit -f {longest // 512}; exec "$@"', "sh"]
    return subprocess.run(
        [*limited, sys.executable, "-m", "eomgen", *words],
        env=environment(cache),
        text=True,
        capture_output=True,
        check=False,
        timeout=120,
    )


@contextmanager
def mounted(folder: Path, *options: str) -> Iterator[bool]:
    """Mount a small file system in memory with these options where that is allowed, and say whether it was.

    Only its owner writes to it: Linux makes such file systems writable by everyone, of which eomgen warns.
    """
    folder.mkdir(exist_ok=True)
    words = ["mount", "-t", "tmpfs", "-o", ",".join(("mode=755", *options)), "none", str(folder)]
    root = hasattr(os, "geteuid") and os.geteuid() == 0 and shutil.which("mount") is not None
    done = root and subprocess.run(words, capture_output=True, check=False).returncode == 0
    try:
        yield done
    finally:
        if done:
            subprocess.run(["umount", "-l", str(folder)], check=True)


def remounted(folder: Path, *options: str) -> None:
    subprocess.run(["mount", "-o", ",".join(("remount", *options)), str(folder)], check=True)


def left_in(cache: Path) -> dict[str, Any]:
    """Return the names in a cache that are no entries, with what is in them."""
    shelves = ("claims", "failed")
    found: dict[str, Any] = {name: sorted(path.name for path in (cache / name).glob("*")) for name in shelves}
    return {**found, "tmp": sorted(path.name for path in cache.glob("tmp-*"))}


NOTHING_LEFT = {"claims": [], "failed": [], "tmp": []}
