"""Other programs as oracles: random scenes of the kinds that they share with eomgen.

    make peers                                    installs the programs below .bench, measures all rows, writes the page
    python -m tests.peers docs/peers.md --only drake_trees.urdf    measures one row again, and writes the page
    python -m tests.peers docs/peers.md --page    writes the page from the kept measurements

A row is a program, a kind of scenes and a function of a seed that returns relative differences by quantity.
``measured.json`` holds the largest differences of the last run; a program that is not there is a row that says so.
"""

from __future__ import annotations

import importlib
import importlib.metadata
import json
import subprocess
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

__all__ = ["EXACT", "MEASURED", "PROGRAMS", "ROWS", "Row", "measured", "version"]

MEASURED = Path(__file__).with_name("measured.json")
#: Largest difference between two programs that solve the same equations in double precision.
EXACT = 1e-9
#: Requirements by program; of Siconos the package of Debian.
PROGRAMS = {
    "Pinocchio": "pin", "MuJoCo": "mujoco", "Drake": "drake", "EXUDYN": "exudyn", "ROSS": "ross-rotordynamics",
    "pybmodes": "pybmodes", "Basilisk": "bsk", "Siconos": "python3-siconos",
}  # fmt: skip  # a table


@dataclass(frozen=True)
class Row:
    """A program on random scenes of one kind.

    Attributes
    ----------
    program : str
        One of `PROGRAMS`.
    scenes : str
        Kind of the scenes.
    function : str
        Module of this package and function of a seed, which returns relative differences by quantity.
    count : int
        Number of scenes; seeds count from 0.
    accuracy : float
        Largest difference; above `EXACT` with a note on the accuracy of the program.
    deviates : tuple of str
        Quantities in which the program deviates, as the note explains with a third result.
    note : str
        Remark of the page.
    """

    program: str
    scenes: str
    function: str
    count: int
    accuracy: float = EXACT
    deviates: tuple[str, ...] = ()
    note: str = ""

    def differences(self, seed: int) -> dict[str, float]:
        """Return the relative differences of one scene by quantity."""
        module, _, name = self.function.partition(".")
        compare: Callable[[int], dict[str, float]] = getattr(importlib.import_module(f"tests.peers.{module}"), name)
        return compare(seed)

    def above_limit(self, found: Mapping[str, Any]) -> list[str]:
        """Return the quantities of a measurement above the limit that are not in `deviates`."""
        return [
            name
            for name, value in found.get("differences", {}).items()
            if name not in self.deviates and not value <= self.accuracy
        ]


#: All rows by their functions, in the order of the page.
ROWS = {
    row.function: row
    for row in (
        Row("Pinocchio", "trees of all joint types, massless bodies, rotors", "pinocchio_trees.terms", 200),
        Row(
            "Pinocchio", "the same without universal and planar joints: partials of inverse dynamics",
            "pinocchio_trees.partials", 100,
        ),
        Row(
            "Pinocchio", "trees with universal or planar joints: partials of inverse dynamics",
            "pinocchio_trees.varying_partials", 50, deviates=("partials by q", "partials by v"),
            note="Pinocchio's `computeRNEADerivatives` is not the derivative of its `rnea` if a joint's motion subspace"
            " changes with its coordinates (universal joints, composites). Differences of `rnea` agree with eomgen.",
        ),
        Row("Pinocchio", "trees of all joint types, the last body held by a ball joint", "pinocchio_trees.loops", 100),
        Row("MuJoCo", "trees with springs, dampers and rotors", "mujoco_trees.dynamics", 200),
        Row("Drake", "trees that both read from one URDF, with a fixed or a free root", "drake_trees.urdf", 100),
        Row("Drake", "trees of all joint types, massless bodies", "drake_trees.joints", 100),
        Row("EXUDYN", "trees of revolute and prismatic joints", "exudyn_trees.dynamics", 100),
        Row(
            "Basilisk", "spacecraft in free flight, two panels on hinges with springs and dampers: state after 5 s",
            "spacecraft.motion", 30, accuracy=1e-8,
            note="Basilisk takes steps of 2 ms by a Runge-Kutta method of order 4; half of that gives a sixteenth of"
            " the differences.",
        ),
        Row(
            "Siconos", "chains of masses that strike two stops, over 2 s", "impacts.motion", 50, accuracy=1e-8,
            note="Siconos integrates by LSODAR at a tolerance of 1e-13; at 1e-12 differences are ten times larger.",
        ),
        Row("ROSS", "rotors: slender shafts with discs on damped bearings", "rotors.modes", 6),
        Row(
            "pybmodes", "blades, uniform or tapered, that stand or turn", "blades.frequencies", 20, accuracy=1e-6,
            note="pybmodes takes means of section properties over elements; frequencies with 60 and 120 elements are"
            " extrapolated. With 120 elements alone the difference is 2e-5.",
        ),
    )
}  # fmt: skip  # a table


def version(program: str) -> str:
    """Return the version of a program on this machine; empty if it is not there."""
    if program == "Siconos":
        words = ["dpkg-query", "--show", "--showformat", "${Version}", PROGRAMS[program]]
        try:
            return subprocess.run(words, capture_output=True, text=True, check=False).stdout.partition("+")[0]
        except OSError:
            return ""
    try:
        return importlib.metadata.version(PROGRAMS[program])
    except importlib.metadata.PackageNotFoundError:
        return ""


@cache
def measured() -> dict[str, dict[str, Any]]:
    """Return what was measured last, by the names of the rows."""
    return dict(json.loads(MEASURED.read_text(encoding="utf-8")))
