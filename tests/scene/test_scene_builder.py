"""The builder: the same scene as from a file, and messages that point at the caller's lines."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np
import pytest

import eomgen
from eomgen.errors import DescriptionError
from eomgen.scene.builder import SceneBuilder
from eomgen.scene.document.schema import every_document
from eomgen.scene.load import from_data
from eomgen.scene.reading.key_metadata import fields_of, inner_table
from tests.builder_keys import COMMAND, stub
from tests.models.library import scene
from tests.scene.every_value import SCENE

DOCUMENT = every_document()


def test_numbers_of_numpy_and_pairs_of_rotations_are_those_of_files() -> None:
    builder = SceneBuilder("one", gravity=(0, "-g", 0), terms=["mass"]).parameter("g", np.float64(9.81))
    builder.body("rod", 2, center_of_mass=np.array([0, -1, 0]), inertia=np.diag([0.1, 0.2, 0.1]))
    builder.joint("hinge", "revolute", "base", "rod", axis=(0, 0, 1), rotation=[((1, 0, 0), "pi")])
    body = {"mass": 2, "center_of_mass": [0, -1, 0], "inertia": [[0.1, 0, 0], [0, 0.2, 0], [0, 0, 0.1]]}
    joint = {"type": "revolute", "parent": "base", "child": "rod", "axis": [0, 0, 1]}
    joint["rotation"] = [{"axis": [1, 0, 0], "angle": "pi"}]
    head = {"format": 1, "name": "one", "gravity": [0, "-g", 0], "terms": ["mass"], "parameters": {"g": 9.81}}
    assert builder.build().digest == from_data({**head, "bodies": {"rod": body}, "joints": {"hinge": joint}}).digest


def line_of(text: str) -> str:
    """Return ``file:line`` of the first line of this file that holds a text."""
    path = Path(__file__)
    return f"{path.name}:{next(n for n, line in enumerate(path.read_text().splitlines(), 1) if text in line)}"


def test_messages_name_the_callers_line() -> None:
    builder = SceneBuilder("crane").base(["0.1*t", 0, 0]).body("load", 2, inertia=[1, 1, 1])
    builder.joint("rope", "revolute", "base", "load", axis=[0, 0, 1]).simulation(step=1e-2)
    builder.point("peak", "lod")
    builder.body("load", 3)
    builder.base()
    builder.simulation(duration=5)
    with pytest.raises(DescriptionError) as caught:
        builder.build()
    again = line_of('builder.body("load", 3')
    before, first = "this was given before, at", line_of('SceneBuilder("crane")')
    assert {str(problem) for problem in caught.value.problems} == {
        f"{again} (bodies.load): {before} {first}; try: another name",
        f"{line_of('builder.base()')} (base): {before} {first}; try: one call",
        f"{line_of('builder.simulation(d')} (simulation): {before} {line_of('.simulation(step')}; try: one call",
        f"{line_of('builder.point(')} (points.peak.body): there is no body 'lod'; try: load",
    }


@pytest.mark.parametrize(
    "value",
    [True, float("nan"), float("inf"), None, 1j, pytest.param(10**5000, id="long"), [1], {"a": 1}, b"1", object()],
)
def test_values_that_are_no_numbers(value: object) -> None:
    builder = SceneBuilder("one").body("link", 1).joint("slide", "prismatic", "base", "link", axis=[0, 0, 1])
    builder.parameter("length", value)  # type: ignore[arg-type]
    with pytest.raises(
        DescriptionError, match=r"\(parameters\.length\.value\): (a (finite )?number is needed here, not|the key)"
    ):
        builder.build()


def test_a_name_that_is_no_text() -> None:
    with pytest.raises(DescriptionError, match=r"\(name\): a text is needed here, not 3"):
        SceneBuilder(3).build()  # type: ignore[arg-type]


#: Sections of the schema, and the methods that enter them where their names are not those of the sections.
METHODS = {name: name for name in ("doubts", "waves", "include", "simulation", "base")} | {"bodies": "body"}


#: What the scene with every value does not have.
PENDULUM = scene(
    "pendulum",
    base={"acceleration": ["quake(t)", 0, 0], "drift": "keep"},
    curves={"quake": {"points": [[0, 0], [1, 5], [2, 0]]}},
    definitions={"swing": {"formula": "q.hinge - 0.1", "unit": "rad"}},
    states={"lag": {"rate": "swing - lag", "initial": 2}},
    maps={"m": {"x": [0, 1], "y": [0, 1], "values": [[0, 1], [1, 2]], "interpolation": "linear", "outside": "hold"}},
    efforts={"motor": {"joint": "hinge", "effort": "ride - lag"}},
    events={"stop": {"when": "q.hinge - 1", "action": "reset", "reset": {"lag": "0"}}},
    references={"servo": {"position": {"hinge": "sin(t)"}}},
    controllers={"ride": {"type": "state_feedback", "coordinates": ["hinge"], "position_gains": {"hinge": 100}}},
)


@pytest.mark.parametrize("data", [SCENE, PENDULUM], ids=lambda data: data["name"])
def test_a_call_for_each_entry_makes_the_scene_of_the_data(data: dict[str, Any]) -> None:
    builder = SceneBuilder(data["name"], gravity=data.get("gravity", (0, 0, -9.81)))
    fields = fields_of(DOCUMENT)
    data = {section: entries for section, entries in data.items() if section in fields}  # a product may be absent
    for section, entries in data.items():
        found = fields[section][1]
        if found is None:
            continue
        names = {field.alias or name: name for name, field in found.model.model_fields.items()}
        for name, entry in entries.items() if found.shape == "entries" else [(None, entries)]:
            keys = {names[key]: value for key, value in entry.items()}
            getattr(builder, METHODS.get(section, section.removesuffix("s")))(*([name] if name else []), **keys)
    expected = from_data(data, file=f"scene {data['name']}", lines=builder._lines)
    assert builder.build().digest == expected.digest


@pytest.mark.parametrize(
    ("section", "table"),
    [
        (name, found.model)
        for name, field in DOCUMENT.model_fields.items()
        if (found := inner_table(field.annotation)) is not None and name != "repeat"  # in Python a loop does it
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_methods_have_the_keys_of_the_schema(section: str, table: type) -> None:
    method = getattr(SceneBuilder, METHODS.get(section, section.removesuffix("s")))
    signature = inspect.signature(method)
    assert set(table.model_fields) == set(signature.parameters) - {"self", "name", "keys"}
    assert get_type_hints(method)["return"]
    for name, field in table.model_fields.items():
        parameter = signature.parameters[name]
        if parameter.kind is parameter.KEYWORD_ONLY:
            assert (parameter.default is parameter.empty) == field.is_required()
        assert f"\n{name} : " in inspect.getdoc(method)


def test_type_checkers_know_the_keys_of_the_schema() -> None:
    path = Path(eomgen.__file__).parent / "scene" / "builder_keys.pyi"
    assert path.read_text(encoding="utf-8") == stub(), f"run {COMMAND}"
