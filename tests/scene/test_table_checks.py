"""Checks of tables: values of each type, faults with their places, short forms, keys of other distributions."""

from __future__ import annotations

import subprocess
import sys
from typing import Annotated, Any, Literal

import pytest

from eomgen.errors import DescriptionError
from eomgen.scene.load import from_data
from eomgen.scene.reading.key_metadata import Table, key, optional
from eomgen.scene.reading.kinds import Finite, Pair, Unit, Value
from eomgen.scene.reading.table_checks import By, Fault, Within

ARM: dict[Any, Any] = {
    "format": 1,
    "name": "arm",
    "bodies": {"arm": {"mass": 1.0, "center_of_mass": [0, 0, -1]}},
    "joints": {"hinge": {"type": "revolute", "parent": "base", "child": "arm", "axis": [0, 1, 0]}},
}


class Inner(Table):
    """A table with a short form."""

    size: Finite = key("required")

    @classmethod
    def prepared(cls, given: object) -> object:
        return {"size": given} if isinstance(given, float) else given


class Outer(Table):
    """A key of each type."""

    text: Unit = key("at most 64", "")
    word: Literal["one", "two"] | None = optional("of two")
    count: int = key("0 to 5", 0, ge=0, le=5)
    flag: bool = key("true or false", False)
    ratio: Annotated[float, Within(gt=0.0)] = key("above 0", 1.0)
    value: Value = key("number or formula", 0.0)
    pair: Pair | None = optional("two values")
    either: Finite | tuple[Pair, ...] | None = optional("a number or pairs")
    column: Annotated[int, Within(ge=0)] | Annotated[str, Within(max_length=3)] = key("number or title", 0)
    names: dict[str, Annotated[int, Within(ge=1)]] = key("numbers by name", {})
    table: Inner | None = optional("of another class")
    doubled: Annotated[float, By(lambda given: 2 * given)] = key("changed before its check", 1.0)
    given_in: str | None = optional("with a word of Python as its name", alias="in")


def faults_of(data: dict[Any, Any]) -> list[Fault]:
    faults: list[Fault] = []
    Outer.check(data, ("place",), faults)
    return faults


def test_values_of_each_type() -> None:
    faults: list[Fault] = []
    table = Outer.check(
        {
            "word": "two",
            "count": 5,
            "ratio": 2,
            "value": "2 * a",
            "pair": [1, "b"],
            "either": [[1, 2], [3, 4]],
            "column": "abc",
            "names": {"a": 1},
            "table": 2.0,
            "doubled": 1.5,
            "in": "arm",
        },
        (),
        faults,
    )
    assert not faults
    assert (table.word, table.count, table.ratio, table.value) == ("two", 5, 2.0, "2 * a")
    assert (table.pair, table.either, table.column) == ((1.0, "b"), ((1.0, 2.0), (3.0, 4.0)), "abc")
    assert (table.table.size, table.doubled, table.given_in, table.text) == (2.0, 3.0, "arm", "")
    assert "given_in" in table.model_fields_set and "text" not in table.model_fields_set
    assert table.plain()["table"] == {"size": 2.0} and "word" not in Outer().plain()
    assert Outer().names is not Outer().names
    with pytest.raises(AttributeError, match="a Outer does not change"):
        table.count = 3


@pytest.mark.parametrize(
    ("key", "given", "kind", "place"),
    [
        ("text", 1, "string_type", ()),
        ("text", "x" * 65, "length", ()),
        ("word", "three", "literal_error", ()),
        ("word", ["one"], "literal_error", ()),
        ("count", True, "int_type", ()),
        ("count", 1.0, "int_type", ()),
        ("count", 6, "less_than_equal", ()),
        ("count", -1, "greater_than_equal", ()),
        ("flag", 1, "bool_type", ()),
        ("ratio", "1", "float_type", ()),
        ("ratio", float("nan"), "greater_than", ()),
        ("value", [1], "number", ()),
        ("pair", [1], "list", ()),
        ("pair", [1, None], "number", (1,)),
        ("either", "x", "number", ()),
        ("either", [[1, 2], [3]], "list", (1,)),
        ("column", 1.5, "int_type", ()),
        ("column", -1, "greater_than_equal", ()),
        ("column", "abcd", "length", ()),
        ("names", [1], "dict_type", ()),
        ("names", {"a": 0}, "greater_than_equal", ("a",)),
        ("names", {1: 1}, "string_type", ("1",)),
        ("table", "x", "model_type", ()),
        ("table", {}, "missing", ("size",)),
        ("table", {"size": 1, "sizes": 2}, "extra_forbidden", ("sizes",)),
        ("table", {1: 1, "size": 1}, "invalid_key", ("1",)),
        ("given_in", "arm", "extra_forbidden", ()),
    ],
)
def test_faults_of_each_type(key: str, given: object, kind: str, place: tuple[str | int, ...]) -> None:
    (fault,) = faults_of({key: given})
    assert (fault.kind, fault.place) == (kind, ("place", key, *place))


def test_all_faults_are_found_in_the_order_of_the_keys() -> None:
    faults = faults_of({"wrong": 1, "names": {"b": 0, "a": "x"}, "count": 9})
    assert [fault.place[1:] for fault in faults] == [("count",), ("names", "b"), ("names", "a"), ("wrong",)]


def test_a_key_that_is_no_text_is_refused() -> None:
    with pytest.raises(DescriptionError, match=r"'1'\): keys should be strings"):
        from_data({**ARM, 1: 2})


def test_a_first_reading_makes_no_checks_of_absent_tables() -> None:
    code = f"""
import sys, eomgen
eomgen.load({ARM!r})
from eomgen.scene.reading import key_metadata, table_checks
from eomgen.scene.bodies.beam_schema import Section
before = key_metadata._keys_of.cache_info().misses
Section.model_fields
print(key_metadata._keys_of.cache_info().misses - before, "pydantic" in sys.modules)
"""
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout.split() == ["1", "False"]
