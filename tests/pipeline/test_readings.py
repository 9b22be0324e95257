"""Scenes taken from records of earlier readings: equal to scenes that are read, and read again after any change."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.errors import DescriptionError, FileError
from eomgen.pipeline import readings
from eomgen.pipeline.readings import NoRecordError, from_text, stored_scene, to_text
from eomgen.scene import load as reader
from eomgen.scene.scene import Scene, digest_of
from eomgen.toolchain.cache import write_postponed
from tests.models.library import scene_text

EXAMPLES = Path(__file__).parents[2] / "examples"
DEFAULTS: dict[str, Any] = {"strict": False, "coordinates": None, "task_frames": ()}
ARM = scene_text(
    "pendulum",
    parameters={"mass": {"value": 2.0, "unit": "kg", "tunable": True}},
    bodies__rod__mass="mass",
    curves={"push": {"table": {"file": "push.csv", "argument": "t", "value": "f"}, "outside": "hold"}},
    forces={"push": {"body": "rod", "point": [1.0, 0, 0], "force": ["push(t)", 0, 0]}},
    include={"tip": {"file": "tip.toml", "parent": "rod"}},
)
TIP = scene_text("pendulum", outputs=None, bodies__rod__mass=0.5)


@pytest.fixture
def arm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Scene of three files, and an empty cache."""
    monkeypatch.setenv("EOMGEN_CACHE", str(tmp_path / "cache"))
    folder = tmp_path / "scene"
    folder.mkdir()
    for name, text in {"arm.toml": ARM, "tip.toml": TIP, "push.csv": "t,f\n0,0\n1,2\n2,0\n"}.items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder / "arm.toml"


def same(first: Scene, second: Scene) -> bool:
    fields = ("name", "source", "notes", "metadata", "description")
    return first.digest == second.digest and all(getattr(first, name) == getattr(second, name) for name in fields)


def unread(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let any reading fail."""

    def refuse(*_: object, **__: object) -> Scene:
        raise AssertionError("the file is read")

    monkeypatch.setattr(reader, "load", refuse)


def records(path: Path) -> list[Path]:
    """Return the records in a cache, with the one that waits for the end of the process."""
    write_postponed()
    return sorted((path.parents[1] / "cache" / "readings").glob("*"))


def test_a_second_reading_takes_the_record(arm: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = eomgen.load(arm)
    assert len(records(arm)) == 1
    unread(monkeypatch)
    assert same(eomgen.load(arm), first)
    assert same(eomgen.load(str(arm)), first)
    monkeypatch.chdir(arm.parent)
    assert same(eomgen.load("arm.toml"), first)


EDITS: dict[str, tuple[str, Callable[[str], str]]] = {
    "scene": ("arm.toml", lambda text: text.replace('"value" = 2.0', '"value" = 3.0')),
    "included file": ("tip.toml", lambda text: text.replace('"mass" = 0.5', '"mass" = 0.6')),
    "table": ("push.csv", lambda text: text.replace("1,2", "1,3")),
}


@pytest.mark.parametrize("edit", EDITS)
def test_an_edit_of_any_file_is_seen(arm: Path, edit: str) -> None:
    first = eomgen.load(arm)
    name, change = EDITS[edit]
    file = arm.parent / name
    before, stamp = file.read_text(encoding="utf-8"), file.stat()
    file.write_text(change(before), encoding="utf-8")
    os.utime(file, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))  # as by tools that keep times
    second = eomgen.load(arm)
    assert second.digest != first.digest
    assert same(eomgen.load(arm), second)
    file.write_text(before, encoding="utf-8")
    assert same(eomgen.load(arm), first)


@pytest.mark.parametrize("edit", EDITS)
def test_an_error_in_any_file_has_its_message_at_each_reading(arm: Path, edit: str) -> None:
    eomgen.load(arm)
    name, _ = EDITS[edit]
    broken = "t,f\n0,x\n" if name.endswith(".csv") else "format = 1\nname = 3\n[bodies.upper]\nmass = -1.0\n"
    (arm.parent / name).write_text(broken, encoding="utf-8")
    texts = []
    for _ in range(2):
        with pytest.raises(DescriptionError) as error:
            eomgen.load(arm)
        texts.append(str(error.value))
    assert texts[0] == texts[1]
    assert name in texts[0]


def test_a_file_that_is_gone_is_missed(arm: Path) -> None:
    eomgen.load(arm)
    (arm.parent / "tip.toml").unlink()
    with pytest.raises(DescriptionError, match=r"tip\.toml"):
        eomgen.load(arm)
    arm.unlink()
    with pytest.raises(FileError, match=r"arm\.toml"):
        eomgen.load(arm)


def test_options_have_records_of_their_own(arm: Path) -> None:
    for _ in range(2):
        joint, absolute, tasks = (
            eomgen.load(arm),
            eomgen.load(arm, coordinates="absolute"),
            eomgen.load(arm, task_frames=["rod"]),
        )
        assert (joint.coordinates, absolute.coordinates, tasks.task_frames) == ("joint", "absolute", ("rod",))
    assert len(records(arm)) == 3


def test_a_copy_beside_other_files_has_a_record_of_its_own(arm: Path, tmp_path: Path) -> None:
    first = eomgen.load(arm)
    other = tmp_path / "other"
    shutil.copytree(arm.parent, other)
    (other / "tip.toml").write_text(TIP.replace("0.5", "0.7"), encoding="utf-8")
    assert eomgen.load(other / "arm.toml").digest != first.digest
    assert same(eomgen.load(arm), first)


@pytest.mark.parametrize("seed", range(8))
def test_a_damaged_record_is_left_aside(arm: Path, seed: int) -> None:
    first = eomgen.load(arm)
    (record,) = records(arm)
    data, random = bytearray(record.read_bytes()), np.random.default_rng(seed)
    if seed % 2:
        data[random.integers(len(data))] ^= 1 << int(random.integers(8))
    else:
        del data[random.integers(len(data)) :]
    record.write_bytes(data)
    assert stored_scene(arm, DEFAULTS) is None
    assert same(eomgen.load(arm), first)
    assert stored_scene(arm, DEFAULTS) is not None


def test_records_that_others_can_write_are_left_aside(arm: Path) -> None:
    eomgen.load(arm)
    cache = arm.parents[1] / "cache"
    cache.chmod(0o777)
    assert stored_scene(arm, DEFAULTS) is None
    cache.chmod(0o755)
    assert stored_scene(arm, DEFAULTS) is not None


@pytest.mark.slow
def test_the_number_of_records_is_bounded(arm: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(readings, "_MOST", 8)
    for number in range(20):
        (arm.parent / f"{number}.toml").write_text(ARM.replace("2.0", f"{number + 1}.0"), encoding="utf-8")
        eomgen.load(arm.parent / f"{number}.toml")
        assert len(records(arm)) <= 8
    assert stored_scene(arm.parent / "19.toml", DEFAULTS) is not None


def test_without_a_cache_scenes_are_read(arm: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = eomgen.load(arm)
    monkeypatch.setenv("EOMGEN_CACHE", "~nobody_of_this_name/cache")
    assert same(eomgen.load(arm), first)
    monkeypatch.setenv("EOMGEN_CACHE", str(arm))  # no folder
    assert same(eomgen.load(arm), first)


_OPENED = """
import sys, json
import eomgen, eomgen.scene.document.assemble
opened = set()
sys.addaudithook(lambda event, args: opened.add(str(args[0])) if event == "open" and args[1] in ("r", "rb") else None)
eomgen.load(sys.argv[1])
print(json.dumps(sorted(opened)))
"""


@pytest.mark.slow
def test_a_record_names_each_file_that_was_opened(arm: Path) -> None:
    """Python's own list of opened files is the oracle."""
    result = subprocess.run([sys.executable, "-c", _OPENED, str(arm)], capture_output=True, text=True, check=True)
    opened = {file for file in json.loads(result.stdout) if file.startswith(str(arm.parent))}
    (record,) = records(arm)
    assert set(json.loads(record.read_bytes()[64:])[0]) == opened
    assert {Path(file).name for file in opened} == {"arm.toml", "tip.toml", "push.csv"}


@pytest.mark.parametrize(
    "text",
    [
        '[[["os:system",["x"]]],{"of":[0,1]}]',
        '[[["eomgen.pipeline.readings:stored_scene",["x"]]],{"of":[0,1]}]',
        '[[["eomgen.toolchain.cache:Cache",["x"]]],{"of":[0,1]}]',
        '[[],{"function":"os:system"}]',
        '[[],{"function":"eomgen.toolchain.cache:no_such_function"}]',
        '[[],{"function":"os:__class__.__base__.__subclasses__"}]',
        '[[],{"function":"eomgen.pipeline.readings:os.system"}]',
        '[[],{"function":"eomgen.pipeline.readings:import_module"}]',
        '[[],{"function":"eomgen.toolchain.cache:Cache"}]',
    ],
)
def test_records_make_data_of_eomgen_alone(text: str) -> None:
    with pytest.raises(NoRecordError):
        from_text(text)


def test_objects_without_text_have_no_record() -> None:
    for value in (object(), {1, 2}, lambda: 1, np.array([object()]), (1, [2])):
        with pytest.raises(NoRecordError):
            to_text(value)


def test_numbers_keep_their_bits() -> None:
    values = (0.1, -0.0, 1e308, 5e-324, float("inf"), 2**70, True, None, "ü\0", b"\xff", (), ((),), {"a": {1: (2.5,)}})
    again = from_text(to_text(values))
    assert digest_of({"": again}) == digest_of({"": values})
    array = np.array([[1.5, np.nan], [-0.0, np.inf]])
    array.flags.writeable = False
    read = from_text(to_text(array))
    assert (read.tobytes(), read.shape, read.dtype, read.flags.writeable) == (
        array.tobytes(),
        array.shape,
        array.dtype,
        False,
    )


@pytest.mark.slow
@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*/scene.toml")), ids=lambda path: path.parent.name)
def test_examples_are_taken_from_records(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("EOMGEN_CACHE", str(tmp_path))
    first = eomgen.load(path)
    if not isinstance(first, Scene):
        return
    stored = stored_scene(path, DEFAULTS)
    assert stored is not None
    assert same(stored.scene, first)
    from eomgen.mechanics.describe import describe

    assert digest_of(vars(stored.description)) == digest_of(vars(describe(first)))
