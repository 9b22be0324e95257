"""Anchor cases: published digits, and digits of other programs and of equations solved by other means.

``cases.toml`` holds each case with its source, its digits and the test that measures eomgen's own. The tests take the
digits from here, and `Anchor.check` compares. ``measured.json`` holds what they measured last, and
``docs/verification.md`` is written from both files:

    python -m tests.anchors docs/verification.md              measure all cases, a few minutes, and write the page
    python -m tests.anchors --only composite_beam roll_up     measure two cases and print the comparison
    python -m tests.anchors --page docs/verification.md       write the page from the kept measurements
"""

from __future__ import annotations

import json
import os
import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "KINDS",
    "MEASURED",
    "MEASURED_RUNS",
    "RECORD",
    "Anchor",
    "anchor",
    "anchors",
    "measured",
    "measured_runs",
    "sources",
]

Array = NDArray[np.float64]
FOLDER = Path(__file__).parent
MEASURED = FOLDER / "measured.json"
MEASURED_RUNS = FOLDER / "measured_runs.json"
#: Variable of the environment with the file to which checks add the numbers that they compared.
RECORD = "EOMGEN_ANCHORS"
#: Kinds of sources, in the order of the page.
KINDS = {
    "print": "printed by a paper, a book, a standard or a collection of benchmarks",
    "program": "from another program",
    "equations": "from equations of the same system, written and solved by other means",
}


@dataclass(frozen=True)
class Anchor:
    """One case whose result is known from elsewhere.

    Attributes
    ----------
    name : str
        Key of the case.
    subject, case, quantity : str
        Heading on the page, the machine, and the compared numbers with their unit.
    kind : str
        One of `KINDS`.
    source : str
        Key of a source in ``cases.toml``.
    digits : tuple of str
        The numbers as the source has them.
    test : str
        File and function of the test that measures them.
    tolerance : float or None
        Largest relative difference; None for one unit in the last digit of each number.
    each : bool
        Whether each number is compared relative to itself; else relative to the largest one, as of a vector.
    note : str
        Remark of the page.
    changed : str
        Date and reason of the last change of the digits, ``"2026-11-30: reason"``.
    """

    name: str
    subject: str
    case: str
    quantity: str
    kind: str
    source: str
    digits: tuple[str, ...]
    test: str
    tolerance: float | None = None
    each: bool = False
    note: str = ""
    changed: str = ""

    @property
    def reference(self) -> Array:
        """The numbers of the source, (n,)."""
        return np.array([float(text) for text in self.digits])

    @property
    def scale(self) -> Array:
        """Sizes by which differences are divided, (n,)."""
        sizes = np.abs(self.reference)
        return sizes if self.each else np.full(len(sizes), sizes.max())

    @property
    def allowed(self) -> Array:
        """Largest differences, (n,), in the units of the numbers."""
        if self.tolerance is None:
            return np.array([last_unit(text) for text in self.digits])
        return self.tolerance * self.scale

    def difference(self, numbers: Array) -> float:
        """Return the largest relative difference of numbers, (n,), to the reference."""
        return float((np.abs(numbers - self.reference) / self.scale).max())

    def check(self, numbers: Any) -> None:
        """Compare measured numbers with the reference and with the page; note them if a file is named for that.

        Parameters
        ----------
        numbers : array_like
            In the order of `digits`, in any shape.

        Raises
        ------
        AssertionError
            A number is off the reference, or off the number on the page, by more than `allowed`.
        """
        own = np.asarray(numbers, float).ravel()
        assert own.shape == self.reference.shape, f"{self.name}: {len(own)} numbers for {len(self.digits)}"
        off = np.abs(own - self.reference)
        assert np.all(off <= self.allowed), f"{self.name}: {own} is off {self.digits} by {off}"
        if record := os.environ.get(RECORD):
            with Path(record).open("a", encoding="utf-8") as file:
                file.write(json.dumps([self.name, own.tolist()]) + "\n")
            return
        kept = np.array(measured()[self.name])
        assert np.all(np.abs(own - kept) <= self.allowed), f"{self.name}: {own} is no more {kept}, as on the page"


def last_unit(text: str) -> float:
    """Return one unit in the last digit of a printed number: 0.01 for 4.20, 1e-5 for 1.23e-3."""
    mantissa, _, exponent = text.lower().partition("e")
    return 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2])) * (1.0 + 1e-9)


@cache
def _file() -> dict[str, Any]:
    return tomllib.loads((FOLDER / "cases.toml").read_text(encoding="utf-8"))


@cache
def anchors() -> dict[str, Anchor]:
    """Return all cases by their names, in the order of the page."""
    return {
        name: Anchor(name, **{key: tuple(it) if isinstance(it, list) else it for key, it in row.items()})
        for name, row in _file()["cases"].items()
    }


def anchor(name: str) -> Anchor:
    """Return a case."""
    return anchors()[name]


def sources() -> dict[str, str]:
    """Return the sources in full by their keys."""
    return dict(_file()["sources"])


@cache
def measured() -> dict[str, list[float]]:
    """Return the numbers that were measured last, by the names of the cases."""
    return dict(json.loads(MEASURED.read_text(encoding="utf-8")))


def measured_runs() -> dict[str, list[float]]:
    """Return the differences of runs, `tests.anchors.runs.Difference`, that were measured last."""
    return dict(json.loads(MEASURED_RUNS.read_text(encoding="utf-8"))) if MEASURED_RUNS.is_file() else {}
