"""Schemas without the sections that a file lacks: they read the same, and build no validators of other sections."""

from __future__ import annotations

from pathlib import Path

import pytest

from eomgen.scene.document import schema
from eomgen.scene.load import from_data, load

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*/scene.toml"))
ARM = {
    "format": 1,
    "name": "arm",
    "bodies": {"arm": {"mass": 1.0, "center_of_mass": [0, 0, -1]}},
    "joints": {"hinge": {"type": "revolute", "parent": "base", "child": "arm", "axis": [0, 1, 0]}},
}


def _whole(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(schema, "_MADE", {})
    patch.setattr(schema, "_MOST_MADE", 0)


@pytest.mark.parametrize("path", EXAMPLES[::4], ids=lambda path: path.parent.name)
def test_a_scene_is_read_as_by_the_whole_schema(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(schema, "_MADE", {})
        short = load(path)
        assert schema._MADE
    _whole(monkeypatch)
    whole = load(path)
    assert short.digest == whole.digest
    assert short.digest == whole.digest
    assert short.notes == whole.notes
    assert repr(short) == repr(whole)


def test_few_shortened_schemas_are_made_in_a_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(schema, "_MADE", {})
    sections = ("parameters", "points", "outputs", "springs", "events", "frames", "curves")
    for name in sections:
        from_data(ARM | {name: {}})
    assert len(schema._MADE) == schema._MOST_MADE + 1 < len(sections)
