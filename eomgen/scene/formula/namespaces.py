"""Namespaces of included files: formulas are parsed in the names of their file, then their symbols are renamed;
scene data with its included files.

So a message quotes the file's text, and no text is ever edited.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any, TypeVar

from eomgen.base.data import dataclass, field, fields, replace
from eomgen.formula.evaluate import symbols
from eomgen.formula.nodes import Formula, Symbol
from eomgen.formula.substitution import map_symbols
from eomgen.scene.formula.definitions import NamedExpression, check_extent, definition_symbols, expand
from eomgen.scene.formula.parser import read_formula
from eomgen.scene.formula.scope import DRIVEN, PARAMETERS, REACTING, SceneNames, Scope
from eomgen.scene.formula.tokens import FormulaError
from eomgen.system.events import mode_parameter

Entry = TypeVar("Entry")
_NOTHING_KNOWN = Symbol("parameter", "")


@dataclass(frozen=True, eq=False)
class Namespace:
    """Translation of the names of an included file to names of the including file.

    Attributes
    ----------
    names : by section, from the name in the included file to the name in the including one.
    values : parameters of the included file that are formulas of the including one.
    """

    names: Mapping[str, Mapping[str, str]]
    values: Mapping[str, str]

    def section_with(self, name: str, sections: Sequence[str]) -> str:
        """Return the first of several sections in which the included file has an entry of that name."""
        return next((section for section in sections if name in self.names[section]), sections[0])


class IncludedText(str):
    """A text of an included file, with the namespaces from that file out to the scene."""

    __slots__ = ("spaces",)
    spaces: tuple[Namespace, ...]

    def __new__(cls, text: str, space: Namespace) -> IncludedText:
        """Return a text one namespace further out: a file included by an included file has two."""
        included = super().__new__(cls, text)
        included.spaces = (*spaces_of(text), space)
        return included


def spaces_of(text: str) -> tuple[Namespace, ...]:
    """Return the namespaces around a text, the innermost first; none for a text of the main scene file."""
    return text.spaces if isinstance(text, IncludedText) else ()


def read_included(text: str, names: SceneNames, scope: Scope, inner: SceneNames | None = None) -> Formula:
    """Return the formula of a text in the scene's names; the text may use the names of an included file, and
    definitions, modes, motions and laws are replaced by formulas and parameters.

    ``names`` are the scene's names, ``inner`` the names for the texts of definitions, by default the same.

    Raises
    ------
    FormulaError
        In the words of the file.
    """
    formula = read_as_written(text, names, scope)
    if names.definitions and (used := definition_symbols(formula)):
        space = inner or names
        parts = {word: expand(word, names, scope, lambda text: read_included(text, space, scope)) for word in used}
        check_extent(formula, parts)
        formula = map_symbols(formula, lambda symbol: parts[symbol].formula if symbol in parts else symbol)
    if not names.modes and not names.motions and not any(laws.formulas for laws in names.laws.values()):
        return formula
    return map_symbols(formula, lambda symbol: _by_parameters(symbol, names, scope))


def _by_parameters(symbol: Symbol, names: SceneNames, scope: Scope) -> Formula:
    """Return the replacement of a symbol: for a mode the tunable parameter of the mode, for a motion the polynomial,
    for a law the input of the same name or, in scopes without inputs, the formula; other symbols are unchanged."""
    if symbol.kind in names.laws:
        return Symbol("input", symbol.name) if "input" in scope.kinds else names.laws[symbol.kind].formulas[symbol.name]
    if symbol.kind == "input" and symbol.name in names.motions:
        return names.motions[symbol.name]
    return Symbol("parameter", mode_parameter(symbol.name)) if symbol.kind == "mode" else symbol


def names_of_file(text: str, section: str, names: Collection[str]) -> dict[str, str]:
    """Return the scene's name of each entry among ``names`` by its name in the file with the formula ``text``."""
    spaces = spaces_of(text)
    if not spaces:
        return {name: name for name in names}
    return {local: name for local, name in _outward(section, spaces) if name in names}


def _outward(section: str, spaces: Sequence[Namespace]) -> Iterator[tuple[str, str]]:
    """Yield the names of a section's entries in the innermost file and in the scene, empty for a parameter with a
    formula of a file in between."""
    for local, name in spaces[0].names.get(section, {}).items():
        for space in spaces[1:]:
            name = space.names[section].get(name, "")  # noqa: PLW2901 - follows the name outwards
        yield local, name


def mentions_any(text: str, names: Collection[str]) -> bool:
    """Return whether a text has a word that is, in the names of the text's file, one of the scene's ``names``."""
    here, spaces = names, spaces_of(text)
    if spaces:
        every = (pair for section in spaces[0].names for pair in _outward(section, spaces))
        here = {local for local, name in every if name in names}
    return any(name and re.search(rf"(?<![A-Za-z0-9_]){re.escape(name)}(?![A-Za-z0-9_])", text) for name in here)


def in_order_of_mention(definitions: Mapping[str, NamedExpression]) -> list[str]:
    """Return the names of definitions in an order with each one after the definitions in its formula; definitions in a
    circle are in the order of their discovery."""
    order: dict[str, None] = {}
    known = {name: name for name in definitions}
    for first in definitions:
        path = [first]
        seen = {first}
        while path:
            name = path[-1]
            text = definitions[name].text
            inner = names_of_file(text, "definitions", definitions) if spaces_of(text) else known
            others = (inner.get(word, name) for word in re.findall(r"[A-Za-z_]\w*", text))
            ahead = next((name for name in others if name not in order and name not in seen), None)
            if ahead is None:
                order[path.pop()] = None
            else:
                path.append(ahead)
                seen.add(ahead)
    return list(order)


def read_as_written(text: str, names: SceneNames, scope: Scope) -> Formula:
    """Return the formula of a text in the scene's names, with symbols for definitions. Raises FormulaError in the words
    of the file."""
    return _read(text, spaces_of(text), names, scope)


def _read(text: str, spaces: tuple[Namespace, ...], names: SceneNames, scope: Scope) -> Formula:
    formula = read_formula(text, _visible(names, spaces), scope)
    return map_symbols(formula, lambda symbol: _resolve(symbol, spaces, names), added=False) if spaces else formula


def _visible(names: SceneNames, spaces: tuple[Namespace, ...]) -> SceneNames:
    """Return the part of the names of a scene that a file can use, under the names of the file.

    ``spaces``: the namespaces from that file out to the scene, the innermost first.
    """
    if not spaces:
        return names
    space, outer = spaces[0], _visible(names, spaces[1:])
    visible: dict[str, Any] = {}
    offered = {
        kind: replace(item, names=tuple(_locally(space, item.section, item.names)))
        for kind, item in outer.offered.items()
    }
    entries = {
        section: _RenamedEntries(items, _locally(space, section, items)) for section, items in outer.entries.items()
    }
    laws = {
        section: replace(item, formulas=_RenamedEntries(item.formulas, _locally(space, section, item.formulas)))
        for section, item in outer.laws.items()
    }
    for kind in fields(SceneNames):
        known = getattr(outer, kind.name)
        here = _locally(space, "inputs" if kind.name == "motions" else kind.name, known)
        visible[kind.name] = _RenamedEntries(known, here) if isinstance(known, Mapping) else tuple(here)
    bound = {}
    for name, value in space.values.items():
        used = symbols(_bound(value, spaces[1:], names))
        bound[name] = any(names.parameters.get(symbol.name, False) for symbol in used)
    parameters = {**visible["parameters"], **bound}
    kinds = {"parameters": parameters, "offered": offered, "entries": entries, "laws": laws}
    return replace(outer, **{**visible, **kinds})


def _locally(space: Namespace, section: str, known: Collection[str]) -> dict[str, str]:
    """Return the known names of a section by name in the file of a namespace."""
    return {local: name for local, name in space.names.get(section, {}).items() if name in known}


class _RenamedEntries(Mapping[str, Entry]):
    """Read-only view of the scene's ``entries`` under the names in an included file; ``names`` has the scene's name by
    local name."""

    def __init__(self, entries: Mapping[str, Entry], names: Mapping[str, str]) -> None:
        self.entries = entries
        self.names = names

    def __getitem__(self, name: str) -> Entry:
        return self.entries[self.names[name]]

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.names)


def _bound(value: str, spaces: tuple[Namespace, ...], names: SceneNames) -> Formula:
    """Return the scene's formula of a parameter of an included file; a nameless symbol for a faulty formula, which is
    reported elsewhere."""
    try:
        return _read(value, spaces, names, PARAMETERS)
    except FormulaError:
        return _NOTHING_KNOWN


def _resolve(symbol: Symbol, spaces: tuple[Namespace, ...], names: SceneNames) -> Formula:
    """Return the symbol of a file's formula under the scene's name, or for a parameter that the include sets by a
    formula this formula. ``spaces`` are the namespaces from the file out to the scene, ``names`` the scene's names."""
    for index, space in enumerate(spaces):
        if symbol.kind == "parameter" and symbol.name in space.values:
            return _bound(space.values[symbol.name], spaces[index + 1 :], names)
        section = names.section_of(symbol.kind)
        if section == "joints" and symbol.name in space.names["beams"]:
            section = "beams"  # elastic coordinates are named like coordinates of joints
        if section in ("reactions", "drives"):
            section = space.section_with(symbol.name, REACTING if section == "reactions" else DRIVEN)
        if section:
            symbol = replace(symbol, name=space.names[section][symbol.name])
        if symbol.reference:
            symbol = replace(symbol, reference=space.names["references"][symbol.reference])
    return symbol


@dataclass
class FileData:
    """The data of a file, including all included files.

    Attributes
    ----------
    data : as in a scene file without includes.
    lines : ``file:line`` of each dotted key.
    notes : of importers, and of elements left out.
    judged : bodies whose inertias an importer has judged.
    bound : by key, formulas for parameters of included files; these formulas are read even without use.
    spaces : every namespace, in order.
    """

    data: dict[str, Any]
    lines: dict[str, str]
    notes: list[str] = field(default_factory=list)
    judged: set[str] = field(default_factory=set)
    bound: dict[str, str] = field(default_factory=dict)
