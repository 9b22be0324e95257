"""Data of Hamiltonian systems that tests share."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import numpy as np

from eomgen.base.arrays import Array


def system(name: str, hamiltonian: str | dict[str, str], **sections: Any) -> Any:
    """Return the data of a system; the first run is as in ``sections["simulation"]``."""
    return {"format": 1, "kind": "hamiltonian", "name": name, "hamiltonian": hamiltonian, **sections}


def rows_of_program(folder: Path, *arguments: str) -> Array:
    """Return the rows which the generated C of ``folder`` prints, compiled with all warnings as errors."""
    flags = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-O1", "-ffp-contract=off"]
    sources = [str(file) for file in sorted(folder.glob("*.c"))]
    subprocess.run(["cc", *flags, *sources, "-o", str(folder / "run"), "-lm"], check=True)
    done = subprocess.run([str(folder / "run"), *arguments], capture_output=True, text=True, check=True)
    return np.array([line.split(",") for line in done.stdout.splitlines()[1:]], float)


#: A mass of 1 kg on a spring of 1 N/m.
OSCILLATOR = system(
    "oscillator",
    "p_x**2/2 + x**2/2",
    coordinates={"x": {"initial": [1.0, 0.0]}},
    simulation={"duration": 20.0, "step": 0.1},
)
