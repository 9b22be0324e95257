"""Tables of events and files of curves, from arrays by hand."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from eomgen.errors import EomgenError, FileError
from eomgen.results import plots
from eomgen.results.events import BLOCKS, NO_EVENTS, Events
from eomgen.results.plots import PlottedCurve
from eomgen.results.poses import BodyPoses
from eomgen.results.solution_files import _loads, write_parquet


def events(*names: str) -> Events:
    """Return events at 0.5, 1.0 ... s of a system with two coordinates, velocities and modes, and no state."""
    count = len(names)
    table = np.arange(2.0 * count).reshape(count, 2)
    blocks = {name: table + 100.0 * k if name[0] != "z" else np.zeros((count, 0)) for k, name in enumerate(BLOCKS)}
    counts = {"hit": names.count("hit"), "turn": names.count("turn")}
    times = 0.5 * np.arange(1.0, count + 1.0)
    return Events(names, times, **blocks, counts=counts, mode_names=("stick", "slip"), first_modes=np.array([1.0, 0.0]))


def test_events_are_counted_by_name_in_their_order() -> None:
    some = events("hit", "turn", "hit")
    assert [(event.name, event.number, event.t) for event in some] == [
        ("hit", 1, 0.5),
        ("turn", 1, 1.0),
        ("hit", 2, 1.5),
    ]
    last = [*some][-1]
    for k, name in enumerate(BLOCKS):
        assert getattr(last, name).tolist() == ([] if name[0] == "z" else [100.0 * k + 4.0, 100.0 * k + 5.0])
    hits = some["hit"]
    assert hits.names == ("hit", "hit") and hits.t.tolist() == [0.5, 1.5] and dict(hits.counts) == {"hit": 2}
    assert hits.v.tolist() == [[400.0, 401.0], [404.0, 405.0]]
    joined = some.followed_by(events("turn", "hit"), 1.0)
    assert joined.names == ("hit", "turn", "turn", "hit") and joined.t.tolist() == [0.5, 1.0, 0.5, 1.0]
    assert joined.q.shape == (4, 2) and joined.first_modes.tolist() == [1.0, 0.0]
    assert repr(some) == "<Events: 2 hit, 1 turn from t = 0.5 to 1.5 s>"


def test_a_table_of_events_has_the_states_before_and_after(tmp_path: Path) -> None:
    some = events("hit", "turn")
    columns = some.columns({"q": ["q.x", "q.y"]})
    assert list(columns) == [
        "t", "q.x before", "q.y before", "v[0] before", "v[1] before", "q.x after", "q.y after", "v[0] after",
        "v[1] after", "mode.stick", "mode.slip",
    ]  # fmt: skip  # few lines
    assert columns["q.y before"].tolist() == [1.0, 3.0] and columns["v[0] before"].tolist() == [100.0, 102.0]
    assert columns["q.x after"].tolist() == [300.0, 302.0] and columns["mode.slip"].tolist() == [601.0, 603.0]
    lines = some.write(tmp_path / "events.csv", {}).read_text().splitlines()
    assert lines[0].startswith("event,t,q[0] before,q[1] before,v[0] before")
    assert [line.partition(",")[0] for line in lines] == ["event", "hit", "turn"]
    assert [float(word) for word in lines[2].split(",")[1:]] == [column[1] for column in columns.values()]


def curve(name: str, values: Any, unit: str = "m") -> PlottedCurve:
    return PlottedCurve(name, unit, np.asarray(values, float))


def test_nodes_of_beams_are_drawn_as_displacements_and_rotation_vectors() -> None:
    """The middle and the last of five nodes; 0 to 0.4 rad about an axis of the world, then of the node."""
    angles, axis = np.array([0.0, 0.1, 0.4]), np.array([2.0, -1.0, 2.0]) / 3.0
    first = Rotation.from_rotvec([0.3, 0.2, -0.5])
    curves = [curve("q.crank", [1.0, 2.0, 3.0])]
    for number in range(1, 6):
        turned = Rotation.from_rotvec(np.outer(number * angles, axis)) * first
        quaternions = turned.as_quat(scalar_first=True) * [[1.0], [-1.0], [1.0]]  # of either sign
        places = np.outer(angles, number * np.array([1.0, 2.0, 3.0])) + 7.0
        parts = np.hstack([quaternions, places]).T
        curves += [curve(f"q.rope.{number}[{k}]", part) for k, part in enumerate(parts)]
    kept, middle, last = plots._by_nodes(curves)
    assert [item.name for item in kept] == ["q.crank"]
    assert {item.name[:8] for item in middle} == {"q.rope.3"} and {item.name[:8] for item in last} == {"q.rope.5"}
    assert [len(part) for part in (middle, last)] == [7, 7]
    drawn = plots._nodes_as_displacements(curves)
    assert [item.name for item in drawn] == [
        "q.crank", *(f"rope.{number} {letter}" for number in (3, 5) for _ in range(2) for letter in "xyz"),
    ]  # fmt: skip  # two lines
    for start, number in ((1, 3), (7, 5)):
        for k in range(3):
            moved, turned_by = drawn[start + k], drawn[start + 3 + k]
            assert (moved.unit, turned_by.unit) == ("m", "rad")
            np.testing.assert_allclose(moved.values, number * (k + 1.0) * angles, atol=1e-12)
            np.testing.assert_allclose(turned_by.values, number * axis[k] * angles, atol=1e-12)
    assert drawn[1].quantity == "displacement since the start" and drawn[4].quantity == "rotation since the start"


def test_files_of_a_run_are_one_for_each_kind_that_has_curves(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """25 panels of different units: one more than a figure has."""
    made: list[tuple[int, str | None, str]] = []
    kinds = {
        "coordinates": [curve("q.x", [0.0, 1.0])],
        "velocities": [],
        "accelerations": [curve("a.x", [0.0, 1.0])],
        "states": [curve("level", [0.0, 1.0]), curve("level_sampled", [0.0, 1.0])],
        "outputs": [curve(f"o{k}", [0.0, k], unit=f"unit{k}") for k in range(25)],
    }

    def figure(solution: object, panels: list[list[PlottedCurve]], over: PlottedCurve | None, heading: str) -> str:
        made.append((sum(map(len, panels)), over and over.name, heading))
        return "figure"

    monkeypatch.setattr(plots, "_by_kind", lambda solution: kinds)
    monkeypatch.setattr(plots, "_figure", figure)
    monkeypatch.setattr(plots, "save_figure", lambda figure, path, *_: path)
    run: Any = SimpleNamespace(metadata={"scene": "arm"}, events=events("hit", "turn"))
    files = plots.draw(run, tmp_path)
    assert [file.name for file in files] == ["coordinates.png", "states.png", "outputs.png"]
    dotted = "; dotted: hit, turn"
    assert made == [
        (1, None, f"arm: coordinates{dotted}"), (1, None, f"arm: states{dotted}"),
        (24, None, f"arm: outputs (the first 24 of 25){dotted}"),
    ]  # fmt: skip  # three figures
    made.clear()
    assert len(plots.drawings(run, tmp_path)) == 3 and not made
    monkeypatch.setattr(plots, "only_curve", lambda solution, name, asked: kinds["outputs"][0])
    monkeypatch.setattr(plots, "chosen_curves", lambda solution, names: kinds["outputs"][:4])
    assert [file.name for file in plots.draw_over(run, tmp_path, "o0")] == ["outputs_over.png"]
    assert made == [(3, "o0", "arm: over o0")]
    run.events = NO_EVENTS
    assert plots._heading(run, None) == "arm"


def test_section_loads_of_a_file_fit_to_its_times() -> None:
    fields = ("curvature", "strain", "moment", "force", "moment_at_ends", "force_at_ends")
    arrays = {"a.b.x": np.array([0.5, 1.5])} | {f"a.b.{name}": np.full((4, 2, 3), k) for k, name in enumerate(fields)}
    (loads,) = _loads(arrays, (4,), Path("run.npz")).values()
    assert [*_loads(arrays, (4,), Path("run.npz"))] == ["a.b"]
    assert loads.x.tolist() == [0.5, 1.5] and [getattr(loads, name)[0, 0, 0] for name in fields] == [*range(6)]
    for wrong, rows in ((arrays, 5), ({**arrays, "a.b.force": np.zeros((3, 2, 3))}, 4), ({"a.b.x": np.zeros(2)}, 4)):
        with pytest.raises(FileError, match=r"run.npz: .* the section loads of a.b do not fit to its times"):
            _loads(wrong, (rows,), Path("run.npz"))


def test_quaternions_of_short_turns_are_drawn_as_rotation_vectors() -> None:
    """About z, from half a radian on; a turn by more than 3 rad keeps its quaternion."""
    for end, names in ((2.5, ["q.ball x", "q.ball y", "q.ball z"]), (4.0, [f"q.ball[{k}]" for k in range(4)])):
        angle, zero = np.linspace(0.5, end, 9), np.zeros(9)
        parts = np.cos(angle / 2), zero, zero, np.sin(angle / 2)
        given = [PlottedCurve(f"q.ball[{k}]", "1", part, "quaternion") for k, part in enumerate(parts)]
        drawn = plots._rotations([curve("q.x", [1.0] * 9), *given])
        assert [item.name for item in drawn] == ["q.x", *names]
        expected = angle - 0.5 if end < 3.0 else parts[3]
        np.testing.assert_allclose(drawn[-1].values, expected, atol=1e-15)
    three = [replace(one, name=f"q.other[{k}]") for k, one in enumerate(given[:3])]
    assert plots._rotations(three) == three


def test_points_have_no_poses() -> None:
    poses = BodyPoses({"arm": np.zeros((2, 7))}, {"points": [{"name": "tip"}]})
    with pytest.raises(EomgenError, match=r'tip is a point, and only bodies have poses; try: outputs\["tip"\]'):
        poses["tip"]


def test_parquet_has_every_column_with_its_unit(tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    columns = {"t": np.array([0.0, 0.5]), "q.x": np.array([3, 4]), "load": np.array([1.0, np.nan])}
    run: Any = SimpleNamespace(
        columns=lambda: columns,
        units=lambda: {"t": "s", "q.x": "m"},
        metadata={"scene": "arm"},
        message="done",
        success=True,
    )
    write_parquet(run, tmp_path / "run.parquet")
    table = parquet.read_table(tmp_path / "run.parquet")
    assert table.column_names == ["t", "q.x", "load"]
    for name, values in columns.items():
        np.testing.assert_array_equal(table[name].to_numpy(), values)
    assert [table.schema.field(name).metadata[b"unit"] for name in columns] == [b"s", b"m", b""]
    about = {key.decode(): value.decode() for key, value in table.schema.metadata.items()}
    assert about == {"scene": "arm", "message": "done", "success": "True"}
