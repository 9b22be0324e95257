"""Tyres from files (``.tir``): coefficients of the Magic Formula by name, in SI."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Collection, Mapping
from functools import cache, partial
from pathlib import Path
from typing import Any

from eomgen.base.data import dataclass
from eomgen.base.files import nearby, read_bytes
from eomgen.base.messages import listed, shown
from eomgen.errors import DescriptionError, Problem
from eomgen.formula.evaluate import evaluate
from eomgen.products.contacts.tangential_laws import tangential_law
from eomgen.scene.formula.parser import read_formula
from eomgen.scene.formula.scope import PARAMETERS, SceneNames

MOST_BYTES = 1_000_000
#: A section, a key with a value, the head of a table, or a row of numbers, before a comment; neighbours within it share
#: no characters, so that long lines take no longer than short ones by character.
_LINE = re.compile(
    r"(?:\[(?P<section>[^\]]*)\]\s*|(?P<key>[A-Za-z_]\w*)\s*=\s*(?P<value>(?:'[^']*'|\"[^\"]*\")\s*|[^$!]*)"
    r"|(?P<table>[({].*)|[-+.\d][-+.\deE\s]*)?(?:[$!].*)?"
)
#: Sections whose keys are not coefficients of a tyre.
_DESCRIPTIVE = re.compile(r"MDI_HEADER|UNITS|MODEL|.*RANGE")


@dataclass(frozen=True)
class TyreFile:
    """The content of a tyre's file.

    Attributes
    ----------
    name : str
        Name of the file.
    numbers : mapping of str to float
        Values in SI by key, in upper case; FITTYP is 6, version 5.2, in a file without it.
    texts : mapping of str to str
        Words and texts in quotes by key.
    lines : mapping of str to int
        Line of each key.
    sections : mapping of str to str
        Section of each key.
    """

    name: str
    numbers: Mapping[str, float]
    texts: Mapping[str, str]
    lines: Mapping[str, int]
    sections: Mapping[str, str]

    def fault(self, key: str, text: str, hint: str) -> DescriptionError:
        """Return the error for a key of the file."""
        line = f":{self.lines[key]}" if key in self.lines else ""
        return DescriptionError(Problem(f"{self.name}{line} ({key})", text, hint))

    @property
    def version(self) -> str:
        """Version of the Magic Formula."""
        number = self.numbers["FITTYP"]
        if not (version := version_of(number)):
            fault = f"the Magic Formula of FITTYP = {number:g} is unknown [E2431]"
            raise self.fault("FITTYP", fault, f"one of {', '.join(_data()['versions'])}")
        return version

    @property
    def side(self) -> str:
        """Side of the vehicle for which the coefficients are: ``left`` or ``right``."""
        return "right" if self.texts.get("TYRESIDE", "").lower() == "right" else "left"

    def check_turn_slip(self) -> None:
        """Raise DescriptionError for a file that asks for turn slip."""
        turning = [name for name in _data()["turn_slip"].split() if self.numbers.get(name)]
        if turning and self.numbers.get("USE_MODE", 0.0) % 10.0 == 5.0:
            fault = f"turn slip, by {listed(turning)}, is not part of the law [E2433]"
            raise self.fault("USE_MODE", fault, f"USE_MODE = {self.numbers['USE_MODE'] - 1.0:g} without turn slip")

    def unused_keys(self, used: Collection[str]) -> list[str]:
        """Return the keys without ``used`` ones, for a note; limits and the description of the model are left out."""
        own = [n for n in self.numbers if not _DESCRIPTIVE.fullmatch(self.sections.get(n, "MODEL"))]
        unused = [n for n in own if n not in used]
        return sorted(unused + ["USE_MODE"] * (self.numbers.get("USE_MODE", 4.0) % 10.0 not in (4.0, 5.0)))


def version_of(fitted: float) -> str:
    """Return the version of the Magic Formula by FITTYP; empty for an unknown one."""
    versions: dict[str, str] = _data()["versions"]
    return versions.get(f"{fitted:g}", "")


def read_tyre_file(path: Path) -> TyreFile:
    """Return the content of a tyre's file, in SI.

    Raises
    ------
    DescriptionError
        For a line that is not part of the format, a file without keys, a key that occurs twice, a wrong number and an
        unknown unit.
    """
    numbers: dict[str, float] = {"FITTYP": 6.0}
    texts, units, lines, sections = dict[str, str](), dict[str, str](), dict[str, int](), dict[str, str]()
    file = TyreFile(path.name, numbers, texts, lines, sections)
    section, in_table = "", False
    for number, line in enumerate(read_bytes(path, MOST_BYTES, partial(nearby, endings=(".tir",))).splitlines(), 1):
        text = line.decode("utf-8-sig", "replace")
        match = _LINE.fullmatch(text.strip())
        if match and match["section"] is not None:
            section, in_table = match["section"].strip().upper(), False
        elif in_table or (match and match["table"]):
            in_table = True
        elif not match:
            fault = f"{shown(text.strip()[:40])} is neither a section nor a key with a value [E2434]"
            raise DescriptionError(Problem(f"{path.name}:{number}", fault, "KEY = value, or $ before a comment"))
        elif match["key"]:
            key, value = match["key"].upper(), match["value"].strip().strip("'\"").strip()
            if section == "UNITS":
                units[key] = value.lower()
                continue
            if key in lines:
                fault = f"{key} is in line {lines[key]} and in line {number} [E2435]"
                raise file.fault(key, fault, "one of the two")
            lines[key], sections[key] = number, section
            if key in _coefficients() or re.match(r"[-+.\d]|$", match["value"].strip()):
                numbers[key] = _number(file, key, value)
            else:
                texts[key] = value
    if not lines:
        fault = "no line is a key with a value, as in a tyre's file [E2464]"
        raise DescriptionError(Problem(path.name, fault, "a .tir file, with lines such as PCX1 = 1.6"))
    _convert(file, numbers, units)
    return file


def _number(file: TyreFile, key: str, text: str) -> float:
    """Return a number, which may have Fortran's exponent D."""
    try:
        value = float(text.lower().replace("d", "e"))
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise file.fault(key, f"{shown(text)} is not a number [E2436]", "a number such as 1.25")
    return value


def _convert(file: TyreFile, numbers: dict[str, float], units: Mapping[str, str]) -> None:
    """Bring the numbers of keys with a dimension to SI, in place."""
    factors = {}
    for dimension, text in _data()["units"].items():
        known = {name: float(factor) for name, _, factor in (word.partition("=") for word in text.split())}
        unit = units.get(dimension, next(iter(known)))
        if unit not in known:
            raise file.fault(dimension, f"the unit {shown(unit)} is unknown [E2437]", f"one of {', '.join(known)}")
        factors[dimension] = known[unit]
    names = SceneNames(parameters=dict.fromkeys(factors, False))
    for text, keys in _data()["dimensions"].items():
        factor = evaluate(read_formula(text, names, PARAMETERS), lambda symbol: factors[symbol.name])
        numbers.update({key: factor * numbers[key] for key in keys.split() if key in numbers})


@cache
def _coefficients() -> frozenset[str]:
    """Return the names that are numbers in all files."""
    laws = [tangential_law("magic_formula", version) for version in set(_data()["versions"].values())]
    return frozenset(
        {"FITTYP", "USE_MODE"}.union(*([*law.formulas, *law.coefficients([*law.formulas], {})] for law in laws))
    )


@cache
def _data() -> dict[str, Any]:
    return tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
