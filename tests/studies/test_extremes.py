"""Maps of scenes under extreme conditions: verdicts, what children do, the journal, the command line."""

from __future__ import annotations

import faulthandler
import os
import signal
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import matplotlib.image
import numpy as np
import pytest

import eomgen
from eomgen.products.studies.ladders.register import LADDERS, _decades
from eomgen.products.studies.ladders.result import VERDICTS, Cell, Extremes, draw, verdict
from eomgen.products.studies.ladders.runs import (
    CRASH,
    HANG,
    RAISED,
    REACHED,
    REFUSED,
    STOPPED,
    UNFINISHED,
    RunEnding,
    RunnerProcess,
)
from eomgen.products.studies.ladders.scaling import ORIGIN, with_factors

PENDULUM: dict[str, Any] = {
    "format": 1,
    "name": "swing",
    "bodies": {"rod": {"mass": 1.0, "center_of_mass": [0, 0, -0.5], "inertia": [0.02, 0.02, 0.001]}},
    "joints": {
        "pin": {"type": "revolute", "parent": "base", "child": "rod", "axis": [0, -1, 0], "stiffness": 2.0}
        | {"damping": 0.01, "initial": {"position": 0.5, "velocity": 1.0}}
    },
    "simulation": {"step": 1e-3, "duration": 2.0},
}


@pytest.mark.slow
def test_a_swing_has_no_fails() -> None:
    found = eomgen.extremes(PENDULUM, ladders=["length", "time", "structure", "spin", "stiffness"], methods=["rk4"])
    assert not found.fails and not found.left_out
    assert {cell.verdict for cell in found.of("length")} == {"holds"}
    assert {cell.verdict for cell in found.of("structure")} == {"holds"}
    stiff = [cell for cell in found.of("stiffness") if cell.value == 1e12]
    assert [cell.verdict for cell in stiff] == ["stopped"] and "; try: a step smaller than" in stiff[0].said


@pytest.mark.parametrize(
    ("ended", "error", "expected"),
    [
        (RunEnding(REACHED, ""), 0.005, "holds"),
        (RunEnding(REACHED, ""), 0.05, "coarse"),
        (RunEnding(REACHED, "the estimated error is ..."), 0.5, "warned"),
        (RunEnding(REACHED, ""), 0.5, "fails"),
        (RunEnding(REACHED, ""), float("inf"), "fails"),
        (RunEnding(REACHED, "", finite=False), None, "fails"),
        (RunEnding(REACHED, ""), None, "unknown"),
        (RunEnding(STOPPED, "stopped at ..."), None, "stopped"),
        (RunEnding(STOPPED, ""), None, "fails"),
        (RunEnding(REFUSED, "usage error"), None, "refused"),
        (RunEnding(UNFINISHED, "interrupted"), None, "unfinished"),
        (RunEnding(HANG, ""), None, "fails"),
        (RunEnding(CRASH, ""), None, "fails"),
        (RunEnding(RAISED, "ValueError"), None, "fails"),
    ],
)
def test_verdicts(ended: RunEnding, error: float | None, expected: str) -> None:
    assert verdict(ended, error, 0.01) == expected and expected in VERDICTS


def deaf() -> RunEnding:
    signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    time.sleep(60.0)
    return RunEnding(REACHED, "")


def slow() -> RunEnding:
    time.sleep(60.0)
    return RunEnding(REACHED, "")


def killed() -> RunEnding:
    faulthandler.disable()  # whoever reads the tests' output would look for a fault
    os.kill(os.getpid(), signal.SIGSEGV)
    return RunEnding(REACHED, "")


def wrong() -> RunEnding:
    raise ValueError("no")


def right() -> RunEnding:
    arrays = {"t": np.array([0.0, 0.1]), "q": np.array([[1.0 / 3.0], [np.nan]])}
    return RunEnding(REACHED, f"by process {os.getpid()}", arrays, finite=False)


@pytest.fixture
def runner(monkeypatch: pytest.MonkeyPatch) -> Iterator[RunnerProcess]:
    monkeypatch.setattr("eomgen.products.studies.ladders.runs.GRACE", 0.3)
    made = RunnerProcess(lambda call: wrong() if call is None else None, lambda call: call())
    yield made
    made.close()


def test_runs_that_hang_crash_and_raise_are_told_apart(runner: RunnerProcess) -> None:
    assert runner.execute(deaf, 0.1).how == HANG
    assert runner.execute(slow, 0.1).how == UNFINISHED
    crashed = runner.execute(killed, 20.0)
    assert crashed.how == CRASH and crashed.said == "killed by signal 11"
    for call in (wrong, None):  # in the run, and before it
        raised = runner.execute(call, 20.0)
        assert (raised.how, raised.said) == (RAISED, "ValueError: no")


def test_a_process_runs_one_thing_after_another_until_it_is_lost(runner: RunnerProcess) -> None:
    first, used, expected = runner.execute(right, 20.0), runner.used, right().arrays
    assert first.arrays is not None and expected is not None and not first.finite and 0.0 < first.seconds < 20.0
    np.testing.assert_array_equal(first.arrays["q"], expected["q"])
    assert not used and runner.execute(right, 20.0).said == first.said != right().said and runner.used
    assert runner.execute(killed, 20.0).how == CRASH and runner.used
    assert runner.execute(right, 20.0).said != first.said and not runner.used


def test_the_time_limit_is_not_for_compiling() -> None:
    compiled = RunnerProcess(lambda _: time.sleep(0.3), lambda call: call())
    assert compiled.execute(right, 0.2).how == REACHED and 0.3 <= compiled.compiling < 3.0
    compiled.close()


def test_the_origin_moves_all_that_the_base_and_the_world_carry_and_no_more() -> None:
    """Written places move from where they are, absent ones from zero; factors can be set without a new build."""
    places = {"written": {"position": [0.5, 0.25, 0.125]}, "absent": {}}
    carried = {
        f"{name}_{body}": {"body": body, **place} for body in ("base", "world", "bob") for name, place in places.items()
    }
    joints = {
        "pin": {"type": "revolute", "parent": "base", "child": "bob", "axis": [0, 1, 0]},
        "arm": {"type": "revolute", "parent": "bob", "child": "tip", "axis": [0, 1, 0]},
        "slide": {"type": "prismatic", "parent": "base", "child": "cart", "axis": [1, 0, 0], "position": [2.0, 0, 0]},
    }
    constraints = {
        "loop": {"type": "spherical", "first": {"body": "tip"}, "second": {"body": "base", "position": [3.0, 0, 0]}}
    }
    bodies = {name: {"mass": 1.0} for name in ("bob", "tip", "cart")}
    scene = {"format": 1, "name": "carried", "bodies": bodies, "joints": joints, "points": carried}
    scene |= {"constraints": constraints}
    moved = with_factors(scene, (ORIGIN,))
    assert moved["parameters"] == {ORIGIN: {"value": 0.0, "tunable": True}}
    for name, point in moved["points"].items():
        x = 0.5 if name.startswith("written") else 0.0
        before = carried[name].get("position")
        assert point.get("position") == (
            before if name.endswith("bob") else [f"{ORIGIN} + ({x})", *(before or [0.0] * 3)[1:]]
        )
    assert moved["joints"]["pin"]["position"] == [f"{ORIGIN} + (0.0)", 0.0, 0.0]
    assert moved["joints"]["slide"]["position"] == [f"{ORIGIN} + (2.0)", 0, 0]
    assert "position" not in moved["joints"]["arm"] and "position" not in moved["constraints"]["loop"]["first"]
    assert moved["constraints"]["loop"]["second"]["position"] == [f"{ORIGIN} + (3.0)", 0, 0]


def test_unknown_names_are_refused() -> None:
    with pytest.raises(eomgen.UsageError, match="there is no ladder 'stif'; try: stiffness"):
        eomgen.extremes(PENDULUM, ladders=["stif"])
    with pytest.raises(eomgen.UsageError, match="budget: '120' is neither a number nor a number with a unit"):
        eomgen.extremes(PENDULUM, budget=cast(Any, "120"))
    with pytest.raises(eomgen.UsageError, match=r"'soft' is not a value of the ladder step; try: --cell step:1e-08"):
        eomgen.extremes(PENDULUM, cells=["step:soft"])
    for unknown in ({"cells": ["step:0.1:rk5"]}, {"ladders": ["step"], "methods": ["rk5"]}):
        with pytest.raises(eomgen.UsageError, match="there is no method 'rk5'; try: "):
            eomgen.extremes(PENDULUM, **unknown)


def test_a_table_of_infinite_errors_is_json(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("eomgen.products.studies.ladders.result.draw", lambda scene, cells, path: path)
    cell = Cell("step", 1.0, "rk4", "fails", np.inf, np.nan, 0.1, "", "", 1.0)
    Extremes("swing", "", (cell,)).save(tmp_path)
    assert "Infinity" not in (text := (tmp_path / "extremes.json").read_text()) and "NaN" not in text


def test_decades_go_from_the_first_to_the_last() -> None:
    assert _decades(-2, 1) == (0.01, 0.1, 1.0, 10.0)
    assert _decades(-3, 3, 3) == (1e-3, 1.0, 1e3)
    assert _decades(4, 4, 2) == (1e4,)


@pytest.mark.parametrize("ladders", [1, 3])
def test_ladders_of_a_map_stand_apart(ladders: int, tmp_path: Path) -> None:
    cell = Cell("gravity", 1.0, "rk4", "holds", 1e-9, None, 1e-2, "", "", 0.1)
    cells = [
        replace(cell, ladder=ladder.name, method=method, value=value)
        for ladder in LADDERS[:ladders] for method in ("rk4", "rk45", "taylor") for value in (1.0, 10.0)
    ]  # fmt: skip  # a table
    picture = matplotlib.image.imread(draw("pendulum", cells, tmp_path / "map.png"))
    height = 3.0 * ladders + 1.45 * (ladders - 1)  # in rows
    assert len(picture) == pytest.approx(110.0 * (1.5 + 0.27 * max(height, 4.0)), abs=1.0)
