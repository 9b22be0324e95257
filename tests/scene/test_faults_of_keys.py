"""Faults of every key in a scene that has nearly all: unknown and missing keys, values of another type, words, names of
entries that are not there. Each is one problem at its place."""

from __future__ import annotations

import copy
import re
from collections.abc import Callable, Iterator
from typing import Any, Literal, get_args, get_origin

import pytest

from eomgen.errors import DescriptionError, Problem
from eomgen.scene.formula.scope import PARAMETERS
from eomgen.scene.load import from_data
from eomgen.scene.reading.key_metadata import Table, fields_of
from tests.scene.every_value import DOCUMENT, SCENE, Path

#: Spoils a table of a model, and returns its spoilt keys with pieces of their problems: of the text, and of the remedy.
Spoil = Callable[[dict[str, Any], type[Table]], dict[str, tuple[str, str]]]


def tables(table: dict[str, Any], model: type[Table], place: Path = ()) -> Iterator[tuple[Path, Any, type[Table]]]:
    """Yield each table within a table of a model, with its place and its model."""
    for key, (_, inner) in fields_of(model).items():
        value = table.get(key)
        if inner is None or not isinstance(value, dict | list):
            continue
        found = {"entries": lambda v: v.items(), "list": enumerate, "table": lambda v: [(None, v)]}[inner.shape](value)
        for name, entry in found:
            if isinstance(entry, dict):
                at = (*place, key) if name is None else (*place, key, name)
                yield at, entry, inner.model
                yield from tables(entry, inner.model, at)


def text_of(place: Path) -> str:
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in place).removeprefix(".")


def problems(data: dict[str, Any]) -> dict[str, Problem]:
    """Return the problems of a scene by their places, of lists without the number of an entry at the end."""
    with pytest.raises(DescriptionError) as caught:
        from_data(data)
    places = [re.sub(r"(\[0\])?\)$", "", problem.where.partition("(")[2]) for problem in caught.value.problems]
    return dict(zip(places, caught.value.problems, strict=True))


def check(spoil: Spoil) -> int:
    """Spoil all tables of each section in turn; return the number of spoilt keys."""
    count = 0
    for section in SCENE:
        data = copy.deepcopy(SCENE)
        if not isinstance(data[section], dict):
            continue
        expected = {
            text_of((*place, key)): pieces
            for place, table, model in list(tables({section: data[section]}, DOCUMENT))
            for key, pieces in spoil(table, model).items()
        }
        found = problems(data) if expected else {}
        within = [
            place for place in expected for other in expected if place.startswith(f"{other}.")
        ]  # of spoilt tables
        expected = {place: pieces for place, pieces in expected.items() if place not in within}
        for place, (what, hint) in expected.items():
            assert place in found and what in found[place].what and hint in found[place].hint, (place, found.get(place))
        count += len(expected)
    return count


def test_unknown_keys_are_refused_with_the_nearest_one() -> None:
    def misspelt(table: dict[str, Any], model: type[Table]) -> dict[str, tuple[str, str]]:
        key = next(iter(table))
        table[f"{key}x"] = 1
        return {f"{key}x": (f"the key '{key}x' is unknown here", key)}

    assert check(misspelt) > 120


@pytest.mark.slow
def test_missing_keys_are_named_with_an_example() -> None:
    def without(table: dict[str, Any], model: type[Table]) -> dict[str, tuple[str, str]]:
        required = [field.alias or name for name, field in model.model_fields.items() if field.is_required()]
        gone = [key for key in required if table.pop(key, None) is not None]
        return {key: (f"the key {key} is missing", f"{key} = ") for key in gone}

    assert check(without) > 150


def words_of(annotation: Any) -> tuple[str, ...]:
    """Return the words that a key takes; none of a key that takes more than these."""
    if get_origin(annotation) is Literal:
        return get_args(annotation)
    return next((words for part in get_args(annotation) if (words := words_of(part))), ())


def test_other_words_are_refused_with_all_that_a_key_takes() -> None:
    def another(table: dict[str, Any], model: type[Table]) -> dict[str, tuple[str, str]]:
        fields = {field.alias or name: words_of(field.annotation) for name, field in model.model_fields.items()}
        changed = {key: words for key, words in fields.items() if words and isinstance(table.get(key), str)}
        table |= dict.fromkeys(changed, "zz")
        return {key: ("'zz' is not known here", str(words[-1])) for key, words in changed.items()}

    assert check(another) > 50


def test_names_of_entries_that_are_not_there_are_refused_with_the_nearest_one() -> None:
    def renamed(table: dict[str, Any], model: type[Table]) -> dict[str, tuple[str, str]]:
        names = {key: table.get(key) for key, (meaning, _) in fields_of(model).items() if meaning.refers}
        names = {key: name for key, name in names.items() if isinstance(name, str) and key != "after"}
        table |= {key: f"{name}xx" for key, name in names.items()}
        return {key: (f"'{name}xx'", str(name)) for key, name in names.items()}

    assert check(renamed) > 70


@pytest.mark.slow
def test_values_of_parameters_are_not_of_time() -> None:
    def of_time(table: dict[str, Any], model: type[Table]) -> dict[str, tuple[str, str]]:
        fields = {key for key, (meaning, _) in fields_of(model).items() if meaning.names is PARAMETERS}
        changed = [key for key in fields if isinstance(table.get(key), int | float)][:1]
        table |= dict.fromkeys(changed, "2 * t")
        return dict.fromkeys(changed, ("time t cannot be used here (column 5)", "parameters"))

    assert check(of_time) > 40


@pytest.mark.slow_except("3")
@pytest.mark.parametrize("place", range(12))
def test_values_of_another_type_are_refused(place: int) -> None:
    """At one key of each table."""

    def boolean(table: dict[str, Any], model: type[Table]) -> dict[str, tuple[str, str]]:
        inner = {key for key, (_, tables) in fields_of(model).items() if tables is not None}
        keys = [key for key, value in table.items() if key not in inner and not isinstance(value, bool)]
        chosen = keys[place : place + 1]
        table |= dict.fromkeys(chosen, True)
        return dict.fromkeys(chosen, ("", ""))

    assert check(boolean) > 0
