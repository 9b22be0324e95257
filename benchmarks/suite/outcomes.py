"""What a row of the suite found, and how it is stored."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

RESULTS = Path(__file__).resolve().parents[1] / "results"
#: States of an outcome: only what was right is measured.
MEASURED, WRONG, MISSING, FAILED, CHECKED = "measured", "wrong", "missing", "failed", "checked"


@dataclass(frozen=True)
class Outcome:
    """One contestant of a row.

    Attributes
    ----------
    state : ``measured``, ``checked`` (right, and not timed), ``wrong``, ``missing`` or ``failed``.
    value : median of the rounds, in the row's unit, seconds where it is a time; None unless measured.
    spread : range of the rounds in units of the median.
    error : against the row's reference, in the row's measure; None where nothing was computed.
    note : settings that were used, or why there is no value.
    versions : of the packages that did the work.
    """

    name: str
    state: str
    value: float | None = None
    spread: float | None = None
    error: float | None = None
    note: str = ""
    versions: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Finding:
    """All contestants of a row, and where and when they ran."""

    row: str
    outcomes: tuple[Outcome, ...]
    machine: Mapping[str, Any]
    quick: bool = False

    def outcome(self, name: str) -> Outcome | None:
        return next((one for one in self.outcomes if one.name == name), None)

    def value(self, name: str) -> float | None:
        found = self.outcome(name)
        return found.value if found else None

    def write(self, folder: Path) -> Path:
        folder.mkdir(parents=True, exist_ok=True)
        file = folder / f"{self.row}.json"
        file.write_text(json.dumps(dataclasses.asdict(self), indent=1) + "\n", encoding="utf-8")
        return file


def read(folder: Path) -> dict[str, Finding]:
    """Return the stored findings by the names of their rows."""
    found = {}
    for file in sorted(folder.glob("*.json")):
        data = json.loads(file.read_text(encoding="utf-8"))
        data["outcomes"] = tuple(Outcome(**outcome) for outcome in data["outcomes"])
        found[data["row"]] = Finding(**data)
    return found
