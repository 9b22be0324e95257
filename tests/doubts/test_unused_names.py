"""Parameters and inputs that no formula mentions are noted, and those that some formula mentions are not, wherever it
stands."""

from __future__ import annotations

from typing import Any

import pytest

import eomgen
from eomgen.scene.load import from_data

BASE: dict[str, Any] = {
    "format": 1,
    "name": "arm",
    "parameters": {"a": {"value": 0.5, "tunable": True}, "f": 0.5},
    "inputs": {"u": {}},
    "bodies": {"arm": {"mass": 1.0, "center_of_mass": [0, 0, -0.5], "inertia": [0.1, 0.1, 0.1]}},
    "joints": {"hinge": {"type": "revolute", "parent": "base", "child": "arm", "axis": [0, 1, 0]}},
    "points": {"tip": {"body": "arm", "position": [0, 0, -1]}, "top": {"body": "base", "position": [0, 0.2, 1]}},
    "springs": {"coil": {"first": "top", "second": "tip", "stiffness": 1.0}},
}
WITH_BOTH = {"outputs": {"both": {"formula": "a * u"}}}
FEEDBACK = {"type": "state_feedback", "coordinates": ["hinge"]}


def unused(**sections: Any) -> set[str]:
    """Return the names that the notes on a scene say nothing mentions."""
    notes = [note for note in from_data({**BASE, **sections}).notes if "no formula mentions" in note]
    words = " ".join(note.partition(" change")[0] for note in notes).replace(",", "").split()
    return set(words) - {"the", "parameter", "parameters", "input", "inputs", "controller", "curve"}


def test_what_is_said() -> None:
    assert from_data(BASE).notes == (
        "the parameters a, f change nothing: no formula mentions them",
        "the input u changes nothing: no formula mentions it",
    )
    scene = from_data({**BASE, "parameters": {"a": 0.5}, "outputs": {"angle": {"formula": "q.hinge + u"}}})
    assert scene.notes == ("the parameter a changes nothing: no formula mentions it",)
    assert eomgen.derive(scene, ["mass"]).notes == scene.notes  # from there they go to C, to models and to solutions


@pytest.mark.parametrize(
    ("sections", "left"),
    [
        (WITH_BOTH, {"f"}),  # an input that outputs alone use is used
        ({"efforts": {"e": {"joint": "hinge", "effort": "u"}}}, {"a", "f"}),
        ({"inputs": {"u": {"formula": "a * sin(t)"}}}, {"f", "u"}),
        ({"inputs": {"u": {"points": [[0, "f"], [1, 2]]}}}, {"a", "u"}),
        ({"inputs": {"u": {"road": {"class": "A", "speed": "f"}}}}, {"a", "u"}),
        ({"curves": {"c": {"wave": {"shape": "square", "period": "f"}}}}, {"a", "u", "c"}),
        ({"base": {"rotation": [{"axis": [0, 0, 1], "angle": "a * t"}]}}, {"f", "u"}),
        ({"base": {"rotation": [{"axis": ["f", 0, 1], "angle": "t"}]}}, {"a", "u"}),
        ({"gravity": [0, "a", "-f"]}, {"u"}),
        ({"states": {"z": {"rate": "u - z", "initial": "f"}}}, {"a"}),
        ({"controllers": {"c": {"type": "low_pass", "signal": "u", "time_constant": "a"}}}, {"f", "c"}),
        ({"controllers": {"c": {**FEEDBACK, "signals": {"s": "u - a"}, "calibration": {"method": "lqr"}}}}, {"f", "c"}),
        ({"tyres": {"t": {"center": "tip", "radius": "a", "stiffness": 1, "road": "u"}}}, {"f"}),
        ({"springs": {"coil": {"first": "top", "second": "tip", "force": "u", "length": "a + f"}}}, set()),
        ({"joints": {"hinge": {**BASE["joints"]["hinge"], "initial": {"position": "f"}}}}, {"a", "u"}),
    ],
)
def test_who_is_used(sections: dict[str, Any], left: set[str]) -> None:
    assert unused(**sections) == left
