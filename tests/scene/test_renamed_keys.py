"""Former names of keys: the register against all keys that were ever published, files that are read with a note, and
``eomgen migrate``."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import eomgen
from eomgen.cli import main
from eomgen.scene.document.reference import json_schema
from eomgen.scene.sources import renamed_keys
from eomgen.scene.sources.renamed_keys import CHANGES, RenamedKey
from tests.messages.answers import plain

EXAMPLES = Path(__file__).parents[2] / "examples"
#: Keys of the first version: places in the schema, with words that a key takes. A later version adds lines by
#: ``python -m tests.scene.test_renamed_keys FILE``, and takes none away.
PUBLISHED = Path(__file__).with_name("keys_of_format_1.txt")
FORMER = (
    RenamedKey("0.3", "2027-03-01", "joints.*.friction_losses", "friction"),
    RenamedKey("0.3", "2027-03-01", "joints.*.friction.dry", "coulomb"),
    RenamedKey("0.4", "2027-06-01", "bodies.*.centroid", "center_of_mass"),
    RenamedKey("0.4", "2027-06-01", "hardpoints", "points"),
)
OLD = """\
format = 1  # for ever
name = "old"   # friction_losses is no key here

[bodies.bob]
mass = 1.0
"centroid" = [0, 0, -1]       # below the pin
inertia = [0.1, 0.1, 0.1]
[joints]
pin = { type = "revolute", parent = "base", child = "bob", axis = [0, 1, 0], friction_losses = {dry=1, velocity=1} }
[hardpoints.tip]
body = "bob"
position = [0, 0, -1]
"""
NEW = (
    OLD.replace('"centroid"', "center_of_mass")
    .replace("friction_losses = {", "friction = {")
    .replace("dry=", "coulomb=")
    .replace("[hardpoints.tip]", "[points.tip]")
)


def keys_of(schema: dict[str, Any]) -> set[str]:
    """Return the dotted keys of a schema, a star for free names, and words of keys, ``joints.*.type=free``."""

    def below(node: Any, path: str, within: tuple[str, ...]) -> Iterator[str]:
        if not isinstance(node, dict):
            return
        if "$ref" in node:
            name = node["$ref"].rpartition("/")[2]
            if name not in within:
                yield from below(schema["$defs"][name], path, (*within, name))
        for choice in (*node.get("anyOf", ()), *node.get("oneOf", ()), *node.get("allOf", ())):
            yield from below(choice, path, within)
        for key, inner in node.get("properties", {}).items():
            place = f"{path}.{key}" if path else key
            yield place
            yield from below(inner, place, within)
        for inner in (node.get("additionalProperties"), *node.get("patternProperties", {}).values()):
            yield from below(inner, f"{path}.*", within)
        items = node.get("items", ())
        for inner in (*(items if isinstance(items, list) else [items]), *node.get("prefixItems", ())):
            yield from below(inner, path, within)
        yield from (f"{path}={word}" for word in (*node.get("enum", ()), *([node["const"]] if "const" in node else ())))

    return set(below(schema, "", ()))


def test_every_published_key_is_still_read_or_has_a_new_name() -> None:
    published = set(PUBLISHED.read_text(encoding="utf-8").split("\n")) - {""}
    assert len(published) > 500
    gone = published - keys_of(json.loads(json_schema()))
    assert gone == {change.path for change in CHANGES}


@pytest.fixture
def old(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(renamed_keys, "CHANGES", FORMER)
    file = tmp_path / "old.toml"
    file.write_bytes(OLD.replace("\n", "\r\n").encode())
    return file


def test_a_file_with_former_names_is_read_with_a_note_for_each(old: Path) -> None:
    scene = eomgen.load(old)
    (pin,) = scene.joints
    assert pin.friction is not None and [point.name for point in scene.points] == ["tip"]
    assert [note for note in scene.notes if "migrate" in note] == [
        f"old.toml:{line} ({key}): since eomgen {version} the name of this key is {name};"
        " write this name by eomgen migrate"
        for line, key, version, name in (
            (6, "bodies.bob.centroid", "0.4", "center_of_mass"),
            (9, "joints.pin.friction.dry", "0.3", "coulomb"),
            (9, "joints.pin.friction_losses", "0.3", "friction"),
            (10, "hardpoints", "0.4", "points"),
        )
    ]


def test_names_alone_are_changed(old: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["migrate", str(old), "--check"]) == 3
    assert capsys.readouterr().err.splitlines() == [
        f"{old}:6 (bodies.bob.centroid): center_of_mass since eomgen 0.4 of 2027-06-01",
        f"{old}:9 (joints.pin.friction.dry): coulomb since eomgen 0.3 of 2027-03-01",
        f"{old}:9 (joints.pin.friction_losses): friction since eomgen 0.3 of 2027-03-01",
        f"{old}:10 (hardpoints): points since eomgen 0.4 of 2027-06-01",
        f"{old}: a mechanical scene, format 1, former names of keys",
    ]
    assert old.read_bytes() == OLD.replace("\n", "\r\n").encode()
    assert main(["migrate", str(old), "--out", str(tmp_path / "new"), "--json"]) == 0
    (report,) = json.loads(capsys.readouterr().out)
    assert report["changes"][0] == {
        "line": 6, "key": "bodies.bob.centroid", "version": "0.4", "date": "2027-06-01",
        "path": "bodies.*.centroid", "name": "center_of_mass",
    }  # fmt: skip
    new = tmp_path / "new" / "old.toml"
    assert report["written"] == str(new) and new.read_bytes() == NEW.replace("\n", "\r\n").encode()
    assert eomgen.load(new).notes == tuple(note for note in eomgen.load(old).notes if "migrate" not in note)
    assert main(["migrate", str(old)]) == 0 and old.read_bytes() == new.read_bytes()
    capsys.readouterr()
    assert main(["migrate", str(old), "--check"]) == 0
    assert capsys.readouterr().err == f"{old}: a mechanical scene, format 1, all keys have their present names\n"


def test_kinds_of_files_are_named_and_kept(capsys: pytest.CaptureFixture[str]) -> None:
    files = [EXAMPLES / "four_bar/scene.toml", EXAMPLES / "henon_heiles/system/henon_heiles.toml"]
    before = [file.read_bytes() for file in files]
    assert main(["migrate", *map(str, files)]) == 0
    assert capsys.readouterr().err.splitlines() == [
        f"{files[0]}: a mechanical scene, format 1, all keys have their present names",
        f"{files[1]}: a Hamiltonian system, format 1, all keys have their present names",
    ]
    assert [file.read_bytes() for file in files] == before


@pytest.mark.parametrize(
    ("name", "text", "words", "code", "answer"),
    [
        ("a.urdf", "<robot/>", [], 2, "this is not a file in TOML, whose keys eomgen defines; try: a .toml file"),
        ("a.toml", "name = 'a'", [], 3, "a.toml:1: the key format is missing; try: format = 1"),
        ("a.toml", "format = 2", [], 3, "a.toml:1: this eomgen reads format 1, not 2; try: format = 1"),
        ("a.toml", "format = 1\nhardpoints = {}\npoints = {}", [], 3,
         "a.toml:2 (hardpoints): this is a former name of points, and the table has both; try: one of them"),
        ("a.toml", "format = 1", ["--check", "--out", "b"], 2, "no file is written, and --out names a folder"),
        ("a.toml", "format = 1", ["./a.toml", "--out", "b"], 2, "two files have one name; try: a call for each folder"),
        ("a.toml", "format = 1", ["b.toml"], 7, "cannot be read"),
    ],
)  # fmt: skip
def test_files_that_cannot_be_renewed_have_an_answer(
    name: str, text: str, words: list[str], code: int, answer: str,
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(renamed_keys, "CHANGES", FORMER)
    Path(name).write_text(text, encoding="utf-8")
    assert main(["migrate", name, *words]) == code
    assert answer in plain(capsys.readouterr().err)
    assert Path(name).read_text(encoding="utf-8") == text and not Path("b").exists()


if __name__ == "__main__":
    Path(sys.argv[1]).write_text("\n".join(sorted(keys_of(json.loads(json_schema())))) + "\n", encoding="utf-8")
