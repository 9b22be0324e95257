"""The JSON Schema that editors get: every scene of the repository fits it, under the drafts that editors know."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from eomgen.scene.document.reference import json_schema
from eomgen.scene.document.schema import every_document
from eomgen.scene.reading.key_metadata import fields_of, tables_of
from tests.scene.descriptions import headless_descriptions, nodes
from tests.scene.test_scene_files import FREE, PENDULUM

DOCUMENT = every_document()

ROOT = Path(__file__).parents[2]
SCHEMA = json.loads(json_schema())
SCENES = sorted(ROOT.glob("examples/*/*.toml"))
DRAFTS = (jsonschema.Draft4Validator, jsonschema.Draft7Validator, jsonschema.Draft202012Validator)

UNITS = """\
format = 1
name = "units"
gravity = [0, 0, "-9.81 m/s^2"]
[parameters]
length = "250 mm"
load = { value = "3 kg", tunable = true }
[include.left]
file = "wheel.toml"
parent = "link"
position = ["1 mm", 0, "length"]
parameters = { stiffness = "2 kN/m", mass = 3, rest = "length" }
[bodies.link]
mass = "2 kg"
inertia = { xx = "1 kg m^2", yy = 1, zz = 1 }
[simulation]
step = "1 ms"
"""


def faults(text: str, draft: Any) -> list[str]:
    return [error.message for error in draft(SCHEMA).iter_errors(tomllib.loads(text))]


def test_the_description_of_each_key_has_a_head_noun() -> None:
    assert headless_descriptions(json_schema()) == []


@pytest.mark.slow_cases("Draft202012Validator")
@pytest.mark.parametrize("draft", DRAFTS, ids=lambda draft: draft.__name__)
def test_every_scene_fits(draft: Any) -> None:
    draft.check_schema(SCHEMA)
    assert len(SCENES) >= 15
    for path in SCENES:
        assert faults(path.read_text(encoding="utf-8"), draft) == [], path.name
    for text in (PENDULUM, FREE, UNITS):
        assert faults(text, draft) == []


@pytest.mark.parametrize("draft", DRAFTS, ids=lambda draft: draft.__name__)
@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("format = 1", "format = 2"),
        ('name = "pendulum"', ""),
        ("length = 0.8", 'length = "long"'),
        ('mass = "2*length"', "mas = 3"),
        ('[0, 0, "-length/2"]', "[0, 0]"),
        ('"revolute"', '"revolut"'),
        ('child = "link"', ""),
    ],
)
def test_what_does_not_fit_is_marked(draft: Any, old: str, new: str) -> None:
    assert old in PENDULUM
    assert faults(PENDULUM.replace(old, new, 1), draft)


def test_nothing_in_it_is_newer_than_draft_4() -> None:
    keywords = {keyword for node in nodes(SCHEMA) for keyword in node}
    assert not keywords & {"prefixItems", "const", "if", "contains", "dependentRequired", "unevaluatedProperties"}


def test_every_key_has_a_description_and_its_unit() -> None:
    for name, model in tables_of(DOCUMENT).items():
        written = SCHEMA["$defs"].get(name, SCHEMA)
        properties = next(part["properties"] for part in (written, *written.get("anyOf", [])) if "properties" in part)
        for key, (meaning, inner) in fields_of(model).items():
            if not (model is DOCUMENT and inner is not None):
                assert properties[key].get("description"), f"{name}.{key}"
            assert bool(meaning.unit) == ("x-unit" in properties[key])
            assert (meaning.names is not None) == ("x-names" in properties[key])
