"""Entries that repeat: a table of a scene file makes copies of its entries, numbered by indices.

The copies are entries like any other, made before anything is read. Braces in names and values hold formulas of the
indices: within a name or a longer text their value has to be whole; a formula that is all of a value gives a number.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator, Mapping, MutableMapping, Sequence
from typing import Any

from eomgen.base.data import dataclass
from eomgen.base.messages import NAME_RULE, is_legal, key_of, listed, nearest, shown
from eomgen.formula.evaluate import evaluate
from eomgen.scene.document.schema import section_keys
from eomgen.scene.formula.parser import read_formula
from eomgen.scene.formula.scope import FIXED_PARAMETERS, SceneNames
from eomgen.scene.formula.tokens import FormulaError
from eomgen.scene.reading.kinds import describe
from eomgen.scene.reading.report import Report

_BRACES = re.compile(r"\{([^{}]*)\}")
_INDICES, _WHERE = "indices", "where"
_HOW = "indices = { i = 10 } for i from 0 to 9, or { i = [1, 9] } for 1 to 9"


def expand_repeats(
    data: Mapping[str, Any],
    report: Report,
    sections: Sequence[str] | None = None,
    counts: MutableMapping[str, int] | None = None,
) -> dict[str, Any]:
    """Return the data of a file with the copies made by tables ``repeat``, after the entries of each section.

    Parameters
    ----------
    data : mapping
        As ``tomllib`` reads a scene file, with the key ``repeat``, which the result does not have.
    report : Report
        Takes faults, tables with faults make no copies; and the lines of the copies, which are the lines of the
        originals.
    sections : sequence of str, optional
        Keys of sections whose entries may repeat; by default the sections of scenes.
    counts : mapping, optional
        Takes the number of copies that each table makes from each entry, by the table's name.
    """
    tables = data["repeat"]
    if sections is None:  # with sections of other distributions in the tables
        every = tables.values() if isinstance(tables, Mapping) else ()
        keys = {key for table in every if isinstance(table, Mapping) for key in table} - {_INDICES, _WHERE}
        sections = section_keys(data, dict.fromkeys(keys))
    made = {
        key: dict(entries) if key in sections and isinstance(entries, Mapping) else entries
        for key, entries in data.items()
        if key != "repeat"
    }
    if not isinstance(tables, Mapping):
        report.add("repeat", f"a table is needed here, not {describe(tables)} [E0716]", f"[repeat.chain] and {_HOW}")
        return made
    sources = _by_entry(report.lines)
    counts = {} if counts is None else counts
    lines: dict[str, str] = {}
    total = 0
    for name, table in tables.items():
        key = key_of("repeat", str(name))
        if not isinstance(table, Mapping):
            report.add(key, f"a table is needed here, not {describe(table)} [E0716]", f"[{key}] and {_HOW}")
            continue
        ranges = _ranges(key, table, report)
        if ranges is None:
            continue
        total += math.prod(len(numbers) for numbers in ranges.values())
        if total > 200_000:
            report.add(f"{key}.{_INDICES}", "more than 200000 copies are made [E1847]", "fewer of them")
            break
        counts[str(name)] = _Copies(key, table, ranges, report, lines, sources, sections).put(made)
    report.lines = {**report.lines, **lines}
    return made


def _by_entry(lines: Mapping[str, Any]) -> dict[str, list[tuple[str, Any]]]:
    """Return the lines within each entry of tables ``repeat``: by a dotted key of four parts, as in
    ``repeat.chain.bodies.link``, pairs (rest of the key, line)."""
    result: dict[str, list[tuple[str, Any]]] = {}
    for key in lines:
        if key.startswith("repeat."):
            parts = re.match(
                r"(repeat\.(?:[^.'\"]+|'[^']*'|\"[^\"]*\")\.[a-z_]+\.(?:[^.'\"\[]+|'[^']*'|\"[^\"]*\"))(.*)", key
            )
            if parts:
                result.setdefault(parts[1], []).append((parts[2], lines[key]))
    return result


def _ranges(key: str, table: Mapping[str, Any], report: Report) -> dict[str, range] | None:
    """Return the range of whole numbers that each index of a table ``repeat`` takes, by name; None, after a report at
    the dotted ``key``, for missing or invalid indices."""
    indices_key = f"{key}.{_INDICES}"
    indices = table.get(_INDICES)
    if not isinstance(indices, Mapping) or not indices:
        fault = (
            f"the key {_INDICES} is missing [E1343]" if indices is None else f"indices are {describe(indices)} [E1848]"
        )
        report.add(indices_key, fault, _HOW)
        return None
    ranges: dict[str, range] = {}
    for index, value in indices.items():
        bounds = [0, value - 1] if _whole(value) else value
        if not is_legal(str(index)):
            report.add(indices_key, f"the index {shown(index)} is not a name [E1850]", NAME_RULE)
        elif not (isinstance(bounds, Sequence) and len(bounds) == 2 and all(map(_whole, bounds))):
            fault = f"an index counts by whole numbers, and here is {describe(value)} [E1851]"
            report.add(f"{indices_key}.{index}", fault, _HOW)
        elif bounds[1] < bounds[0]:
            fault = f"the index {index} takes no number from {bounds[0]} to {bounds[1]} [E1852]"
            report.add(f"{indices_key}.{index}", fault, _HOW)
        else:
            ranges[str(index)] = range(bounds[0], bounds[1] + 1)
    return ranges if len(ranges) == len(indices) else None


def _whole(number: object) -> bool:
    return isinstance(number, int) and not isinstance(number, bool)


@dataclass(eq=False)
class _Copies:
    """The copies of the entries in one table ``repeat``. ``key`` is the dotted key of the table, ``ranges`` the numbers
    of each index, ``sources`` the lines in the table's entries by ``_by_entry``, ``sections`` the keys of sections
    whose entries may repeat; ``report`` and ``lines`` are filled."""

    key: str
    table: Mapping[str, Any]
    ranges: Mapping[str, range]
    report: Report
    lines: MutableMapping[str, str]
    sources: Mapping[str, Sequence[tuple[str, Any]]]
    sections: Sequence[str]

    def __post_init__(self) -> None:
        self.names = SceneNames(parameters=dict.fromkeys(self.ranges, False))
        self.formulas: dict[str, Any] = {}
        #: Pieces of texts, in turn literal and a formula.
        self.pieces: dict[str, list[str]] = {}
        #: Values of formulas in the present copy.
        self.numbers: dict[str, float] = {}
        self.twice: set[str] = set()

    def put(self, data: MutableMapping[str, Any]) -> int:
        """Add all copies to ``data`` of the file by section, in place, and return the number for each entry; faults
        are reported."""
        copies = list(self.values())
        for section, templates in self.table.items():
            if section in (_INDICES, _WHERE):
                continue
            label = f"{self.key}.{section}"
            if section not in self.sections:
                hint = nearest(str(section), self.sections)
                self.report.add(label, f"there is no section {shown(section)} whose entries could repeat [E1853]", hint)
            elif not isinstance(templates, Mapping):
                self.report.add(label, f"a table is needed here, not {describe(templates)} [E0716]")
            elif isinstance(entries := data.setdefault(section, {}), MutableMapping):
                within = self.key.removeprefix("repeat.")
                named = [(str(name), key_of("repeat", within, section, str(name))) for name in templates]
                for values in copies:
                    self.numbers.clear()
                    for (name, key), entry in zip(named, templates.values(), strict=True):
                        self._copy(section, name, key, entry, values, entries)
        return len(copies)

    def values(self) -> Iterator[dict[str, int]]:
        """Yield the number of each index by name, for every combination that the table's condition accepts; none, after
        a report, if the condition is not a text."""
        where = self.table.get(_WHERE, "1")
        key = f"{self.key}.{_WHERE}"
        if not isinstance(where, str):
            self.report.add(key, f"a formula is needed here, not {describe(where)} [E0721]", 'where = "i < j"')
            return
        for numbers in itertools.product(*self.ranges.values()):
            values = dict(zip(self.ranges, numbers, strict=True))
            self.numbers.clear()
            if self._number(where, values, key):
                yield values

    def _copy(
        self,
        section: str,
        name: str,
        key: str,
        entry: Any,
        values: Mapping[str, int],
        entries: MutableMapping[str, Any],
    ) -> None:
        """Add a copy of an entry to ``entries``, the section's entries, in place, with values for braces in name and
        keys. ``name`` and ``entry`` are as written, ``key`` is the dotted key for messages, ``values`` has the number
        of each index. An illegal or repeated name is reported, and makes no copy."""
        copy = self._text(name, values, key)
        if self.report.concerns(key):
            return
        if not is_legal(str(copy)):
            self.report.add(key, f"the name {shown(copy)} is not legal [E0715]", NAME_RULE)
            return
        if copy in entries:
            if key not in self.twice:
                self.twice.add(key)
                hint = f"braces with all indices in the name: {shown(name + ''.join(f'_{{{i}}}' for i in self.ranges))}"
                self.report.add(key, f"the name {copy} in {section} is given twice [E1854]", hint)
            return
        entries[copy] = self._fill(entry, values, key)
        for rest, line in self.sources.get(key, ()):
            self.lines[f"{section}.{copy}{rest}"] = line if isinstance(line, str) else f"{self.report.file}:{line}"

    def _fill(self, value: Any, values: Mapping[str, int], key: str) -> Any:
        """Return a value of an entry with numbers in place of the formulas in braces: a number for a text that is only
        braces, a text for a longer text; lists and mappings recursively. ``values`` has the number of each index."""
        if isinstance(value, str):
            if "{" not in value and "}" not in value:
                return value
            pieces = self._pieces(value)
            whole = len(pieces) == 3 and not pieces[0].strip() and not pieces[2].strip()
            return self._number(pieces[1], values, key) if whole else self._text(value, values, key)
        if isinstance(value, Mapping):
            return {name: self._fill(entry, values, key) for name, entry in value.items()}
        if isinstance(value, list | tuple):
            return [self._fill(entry, values, key) for entry in value]
        return value

    def _text(self, text: str, values: Mapping[str, int], key: str) -> str:
        """Return a text with the numbers of the formulas in braces; a single brace is reported at ``key``."""
        pieces = self._pieces(text)
        filled = "".join(repr(self._number(piece, values, key)) if k % 2 else piece for k, piece in enumerate(pieces))
        if ("{" in filled or "}" in filled) and not self.report.concerns(key):
            fault = f"{shown(text)} has a brace without its other [E1855]"
            self.report.add(key, fault, f"{{{next(iter(self.ranges))}}}")
        return filled

    def _pieces(self, text: str) -> list[str]:
        """Return the pieces of a text, in turn literal and the formula within braces."""
        if text not in self.pieces:
            self.pieces[text] = _BRACES.split(text)
        return self.pieces[text]

    def _number(self, formula: str, values: Mapping[str, int], key: str) -> float:
        """Return the value of a formula of the indices, whose numbers are ``values``, as an integer if whole; 0 for a
        formula without a value, which is reported once at the dotted ``key``."""
        if self.report.concerns(key):
            return 0
        if formula in self.numbers:
            return self.numbers[formula]
        try:
            if formula not in self.formulas:
                self.formulas[formula] = read_formula(formula, self.names, FIXED_PARAMETERS)
            number = evaluate(self.formulas[formula], lambda symbol: float(values[symbol.name]))
            self.numbers[formula] = int(number) if number.is_integer() else number
            return self.numbers[formula]
        except FormulaError as error:
            of_indices = f"a formula of {listed(self.ranges)}, such as {{{next(iter(self.ranges))} - 1}}"
            self.report.add(key, f"{{{formula}}}: {error.what}", error.hint or of_indices)
        except ArithmeticError as error:
            of_values = ", ".join(f"{name} = {number}" for name, number in values.items())
            self.report.add(key, f"{{{formula}}} at {of_values}: {error}", "another formula")
        return 0
