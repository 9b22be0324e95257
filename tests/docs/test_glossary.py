"""Every place that the two pages of the glossary name exists; terms are sorted, and each stands once in its topic."""

from __future__ import annotations

import importlib
import re
from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import pytest

import eomgen
from eomgen.cli import VERBS
from eomgen.integrators.families.register import method_names
from eomgen.scene.document.reference import schema
from eomgen.scene.document.schema import every_document
from eomgen.system.terms import TERMS
from tests.docs.test_docs import PAGES, words_of

DOCUMENT = every_document()

COLUMNS = ["term", "symbol", "meaning", "unit", "in other tools", "in eomgen"]
PAGE = PAGES["glossary.md"] + PAGES["glossary_of_methods.md"]


class Entry(NamedTuple):
    topic: str
    term: str
    meaning: str
    places: tuple[tuple[str, str], ...]


def cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.strip("|").split("|")]


def entries() -> list[Entry]:
    rows = []
    for text in PAGE.split("\n## ")[1:]:
        topic, *lines = text.splitlines()
        for line in lines:
            if line.startswith("| ") and cells(line) != COLUMNS:
                term, _, meaning, _, _, places = cells(line)
                rows.append(Entry(topic, term, meaning, tuple(re.findall(r"(?:(key|term|method) )?`([^`]+)`", places))))
    return rows


ENTRIES = entries()


def is_importable(name: str) -> bool:
    """Return whether a dotted name is a module, or an attribute of one."""
    module, _, attribute = name.rpartition(".")
    try:
        importlib.import_module(name)
    except ModuleNotFoundError:
        return hasattr(importlib.import_module(module), attribute)
    return True


@cache
def words_of_sections() -> dict[str, set[str]]:
    """Return the keys and values of each section of a scene file, by the schema."""
    description = schema()
    return {name: words_of(node, description["$defs"]) for name, node in description["properties"].items()}


def is_in_scene_files(place: str) -> bool:
    """Return whether a section, or a section and one of its keys or values, is in the schema."""
    section, _, word = place.removeprefix("[").partition("]")
    words = words_of_sections().get(section)
    return words is not None and (not word or word.strip() in words)


EXISTS: dict[str, Callable[[str], bool]] = {
    "key": lambda name: name in DOCUMENT.model_fields,
    "term": lambda name: name in TERMS,
    "method": lambda name: name in method_names(),
}


def exists(kind: str, place: str) -> bool:
    if kind:
        return EXISTS[kind](place)
    if place.startswith("["):
        return is_in_scene_files(place)
    owner, _, name = place.partition(".")
    if owner in ("model", "solution"):
        return hasattr({"model": eomgen.Model, "solution": eomgen.Solution}[owner], name)
    return place.removeprefix("eomgen ") in VERBS if place.startswith("eomgen ") else is_importable(place)


@pytest.mark.parametrize("topic", dict.fromkeys(entry.topic for entry in ENTRIES))
def test_every_place_exists(topic: str) -> None:
    wrong = [
        f"{entry.term}: {place}"
        for entry in ENTRIES
        if entry.topic == topic
        for kind, place in entry.places
        if not exists(kind, place)
    ]
    assert not wrong, wrong


def test_every_term_has_a_meaning_and_a_place_once_and_in_order() -> None:
    assert len(ENTRIES) >= 150
    assert [entry.term for entry in ENTRIES if not entry.meaning or not entry.places] == []
    for topic in {entry.topic for entry in ENTRIES}:
        terms = [entry.term.lower() for entry in ENTRIES if entry.topic == topic]
        assert terms == sorted(set(terms)), topic


def test_a_wrong_place_is_found() -> None:
    places = ("model.no_method", "eomgen no_verb", "eomgen.symbolic.no_module", "[no_section]", "[joints] no_key")
    assert not any(exists("", place) for place in places)
    assert not exists("term", "no_term") and not exists("method", "no_method")
