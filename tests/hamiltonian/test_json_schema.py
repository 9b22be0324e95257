"""The JSON Schema of Hamiltonian files: what is read fits it, and it refuses what is refused."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from eomgen.cli import main
from eomgen.products.fields.documents import reading
from eomgen.products.fields.documents.entries import json_schema
from tests.hamiltonian.test_hamiltonian import BODIES, HENON_HEILES, SWINGING, changed

ROOT = Path(__file__).parents[2]
COORDINATES, FIELDS = (json.loads(json_schema(mesh=mesh)) for mesh in (False, True))
DRAFTS = (jsonschema.Draft4Validator, jsonschema.Draft7Validator, jsonschema.Draft202012Validator)
FILES = [
    path
    for path in sorted(ROOT.glob("examples/*/system/*.toml"))
    if tomllib.loads(path.read_text(encoding="utf-8")).get("kind") == "hamiltonian"
]


FIELD = tomllib.loads((ROOT / "examples/density_field/system/density_field.toml").read_text(encoding="utf-8"))


def faults(data: dict[str, Any], draft: Any) -> list[str]:
    return [error.message for error in draft(FIELDS if "mesh" in data else COORDINATES).iter_errors(data)]


@pytest.mark.parametrize("draft", DRAFTS, ids=lambda draft: draft.__name__)
def test_every_file_fits(draft: Any) -> None:
    draft.check_schema(COORDINATES)
    draft.check_schema(FIELDS)
    assert len(FILES) >= 3
    for path in FILES:
        assert faults(tomllib.loads(path.read_text(encoding="utf-8")), draft) == [], path.name
    for data in (HENON_HEILES, SWINGING, BODIES):
        assert faults(data, draft) == []


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (changed(masses={}), "'masses' was unexpected"),
        (changed(coordinates={"x": {}}), "'initial' is a required property"),
        (changed(coordinates={"x": {"initial": [1]}}), "[1] is too short"),
        (changed(coordinates={"2x": {"initial": [1, 2]}}), "'2x' does not match"),
        (changed(name="henon heiles"), "'henon heiles' does not match"),
        (changed(simulation={"tolerance": -1e-8}), "-1e-08 is less than the minimum of 0"),
        (changed(hamiltonian=["x"]), "['x'] is not valid"),
        (changed(simulation={"step": "1 s"}), "'1 s' is not of type 'number'"),
        (changed(simulation={"record_every": 1.5}), "1.5 is not of type 'integer'"),
        (changed(format=2), "2 is not one of [1]"),
        (changed(repeat={"a": {"indices": {"i": 2}, "bodies": {}}}), "'bodies' was unexpected"),
        (changed(repeat={"a": {"parameters": {"a{i}": 1.0}}}), "'indices' is a required property"),
        ({**FIELD, "mesh": {**FIELD["mesh"], "cells": [8, 1]}}, "[8, 1] is not valid"),
        ({**FIELD, "data": {"2x": "1"}}, "'2x' does not match"),
        ({**FIELD, "operators": {next(iter(FIELD["operators"])): {"powr": "1"}}}, "'powr' was unexpected"),
        ({**FIELD, "mass": {"choice": "heavy"}}, "'heavy' is not one of"),
        ({**FIELD, "sampling": {"samples": "many"}}, "'many' is not of type 'integer'"),
    ],
)
def test_it_refuses_what_is_refused(data: dict[str, Any], text: str) -> None:
    found = faults(data, jsonschema.Draft7Validator)
    assert len(found) == 1 and text in found[0], found


def test_the_command_prints_it(capsys: pytest.CaptureFixture[str]) -> None:
    for kind, schema in (("hamiltonian", COORDINATES), ("fields", FIELDS)):
        assert main(["schema", "--kind", kind]) == 0
        assert json.loads(capsys.readouterr().out) == schema


def test_a_section_that_is_read_is_in_the_schema() -> None:
    assert set(reading.SECTIONS) <= set(COORDINATES["properties"])
