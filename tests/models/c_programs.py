"""Programs of a user around generated C: a main of its own, compiled strictly, and the numbers that it prints."""

from __future__ import annotations

import subprocess
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import eomgen


def program(folder: Path, scene: eomgen.Scene, method: str, main: str, flags: Sequence[str] = ()) -> Path:
    """Generate the C of a scene, put ``main`` in the place of its own, and compile, with more flags than the strict
    ones."""
    eomgen.generate(scene, folder, method=method)
    (folder / "main.c").write_text(main, encoding="utf-8")
    strict = ["-std=c99", "-O1", "-Wall", "-Wextra", "-Werror"]
    sources = sorted(str(file) for file in folder.glob("*.c"))
    subprocess.run(["cc", *strict, *flags, *sources, "-o", str(folder / "program"), "-lm"], check=True)
    return folder / "program"


def printed(made: Path, *arguments: float) -> NDArray[np.float64]:
    """Run a program and return its lines of numbers."""
    words = [str(made), *map(repr, arguments)]
    ran = subprocess.run(words, check=True, capture_output=True, text=True)
    return np.array([[float(x) for x in line.split()] for line in ran.stdout.splitlines()])
