"""The tables of the pages in ``docs/scene`` are those of the schema, and every key says what it means."""

from __future__ import annotations

from typing import Annotated

import pytest
from pydantic import Field

from docs.scene_tables import COMMAND, described_classes, pages_of_tables, renew, table, tables
from eomgen.scene.document.schema import every_document, section_keys
from eomgen.scene.formula.scope import PARAMETERS
from eomgen.scene.reading.key_metadata import Table, every_unit, key, meaning_of
from eomgen.scene.reading.kinds import Triple, Value
from tests.docs.parts import parts, whole

DOCUMENT = every_document()
SECTIONS = section_keys()


def test_the_tables_on_the_pages_are_those_of_the_schema() -> None:
    texts = {file.name: file.read_text(encoding="utf-8") for file in parts("scene")}
    pages = pages_of_tables(parts("scene"))
    old = [name for name, text in texts.items() if renew(text, pages) != text]
    assert not old, f"docs/scene is not what the schema says; run: {COMMAND}"


def test_every_table_of_the_schema_is_on_the_page_once() -> None:
    on_page, known = described_classes(whole("scene")), list(tables())
    missing = sorted(set(known) - set(on_page))
    assert not missing, (
        f"docs/scene: <!-- keys of {' -->, <!-- keys of '.join(missing)} --> and <!-- end --> are not there"
    )
    assert sorted(on_page) == sorted(known)


def test_every_key_says_what_it_means() -> None:
    silent = [
        f"{name}.{field_name}: key('...', ...) of schema_key"
        for name, model in tables().items()
        for field_name, field in model.model_fields.items()
        if field.description is None
        and not (model is DOCUMENT and field_name in (*SECTIONS, "include", "repeat", "base", "simulation"))
    ]
    assert silent == []


def test_what_refers_to_a_section_refers_to_one() -> None:
    found = {meaning_of(field).refers for model in tables().values() for field in model.model_fields.values()} - {""}
    assert found <= set(SECTIONS) and {"bodies", "points", "joints"} <= found


class PlaceEntry(Table):
    """Made for the test."""


class Sample(Table):
    """Made for the test."""

    place: Triple = key("where it is", (0.0, 0.0, 1.5), unit="m", names=PARAMETERS)
    strength: Value | None = key("how strong", None, unit={"one": "N/m", "two": ("N m/rad", "N/m")}, names=PARAMETERS)
    count: int = key("how many", 3, ge=1, le=9)
    kind: str = key("what it is", alias="class")
    parts: Annotated[int, Field(ge=1)] | None = key("how many parts", None)
    others: Annotated[tuple[PlaceEntry, ...], Field(strict=False)] | None = key("where others are", None)


def test_a_table() -> None:
    assert table(Sample, {}).splitlines()[2:] == [
        "| `place` | 3 values of parameters, m | `[0, 0, 1.5]` | where it is |",
        "| `strength` | value of parameters, N/m or N m/rad | none | how strong |",
        "| `count` | 1 to 9 | `3` | how many |",
        "| `class` | text | required | what it is |",
        "| `parts` | whole number | none | how many parts |",
        "| `others` | list of tables | none | where others are |",
    ]
    linked = "| `others` | [list of tables](places.md) | none | where others are |"
    assert table(Sample, {"Place": "places.md"}).splitlines()[-1] == linked
    assert every_unit(meaning_of(Sample.model_fields["strength"])) == ("N/m", "N m/rad")


def test_a_page_with_an_unknown_table_is_refused() -> None:
    with pytest.raises(KeyError, match="Wheel"):
        renew("<!-- keys of Wheel -->\n<!-- end -->", {})


def test_a_kind_without_words_is_no_table() -> None:
    class Strange(Table):
        count: dict[str, int] = key("what cannot be said")

    with pytest.raises(TypeError, match="no words"):
        table(Strange, {})
