"""Beams without shear or stretch in loops: which rows are counted, and which follow from others."""

from __future__ import annotations

import math
import re
from typing import Any

import pytest

import eomgen
from eomgen.errors import ModelError
from eomgen.pipeline.pipeline import derive
from eomgen.system.system import System
from tests.models.cosserat import ROLL_UP, beam_scene

WITHOUT = {"kirchhoff": ("shear_y", "shear_z"), "inextensible": ("stretch", "shear_y", "shear_z")}
END = {"body": "rope", "position": [10.0, 0.0, 0.0]}


def closed(model: str, elements: int, to: dict[str, Any], joint: str = "fixed", **beam: Any) -> System:
    """Return a beam whose end is fixed to something, too."""
    stiffness = {strain: value for strain, value in ROLL_UP.items() if strain not in WITHOUT[model]}
    scene = beam_scene(
        elements, {"force": [0, 0, "load"]}, {"model": model, "stiffness": stiffness, **beam}, type=joint
    )
    scene["constraints"] = {"closed": {"type": "fixed", "first": to, "second": END}}
    return derive(eomgen.load(scene))


@pytest.mark.slow
@pytest.mark.parametrize("model", list(WITHOUT))
@pytest.mark.parametrize(("joint", "to"), [("fixed", "base"), ("free", "rope")])
def test_rings_keep_all_their_rows(model: str, joint: str, to: str) -> None:
    system = closed(model, 6, {"body": to}, joint, curvature=[0.0, 0.0, 2.0 * math.pi / 10.0])
    assert len(system.multipliers) == 6 * len(WITHOUT[model]) + 6
    assert not [note for note in (*system.notes, *system.warnings) if "follows from" in note or "off by" in note]
    assert system.nv - len(system.multipliers) == {"kirchhoff": 18, "inextensible": 12}[model] + 6 * (joint == "free")


@pytest.mark.slow
def test_a_straight_beam_that_stretches_may_be_held_at_both_ends() -> None:
    system = closed("kirchhoff", 4, {"body": "base", "position": [10.0, 0.0, 0.0]})
    assert len(system.multipliers) == 14
    assert not system.warnings


@pytest.mark.slow
def test_a_straight_beam_that_does_not_stretch_is_named_where_both_ends_are_held() -> None:
    system = closed("inextensible", 4, {"body": "base", "position": [10.0, 0.0, 0.0]})
    (warning,) = (text for text in system.warnings if "at the start" in text)
    assert "rope: no stretch of element" in warning
    assert (
        'try: another start, or a constraint less (of a straight beam held at both ends: model = "kirchhoff"' in warning
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("place", "what", "hint"),
    [
        (12.0, "longer", 'a longer beam, ends that are nearer to each other, or model = "kirchhoff", which stretches'),
        (8.0, "shorter", "an initial shape that is bent, which says to which side the beam is to bend"),
    ],
)
def test_ends_that_a_beam_cannot_reach_or_not_straight_are_told(place: float, what: str, hint: str) -> None:
    """The end and the elements share the 2 m that do not fit, so the beam lacks less than that."""
    with pytest.raises(ModelError) as raised:
        closed("inextensible", 3, {"body": "base", "position": [place, 0.0, 0.0]})
    told = re.search(
        rf"; the beam rope would have to be {what} by more than (\S+) m, and it does not stretch; try: (.*)$",
        str(raised.value),
    )
    assert told is not None, raised.value
    assert 1.0 < float(told[1]) < 2.0
    assert told[2] == hint


@pytest.mark.slow
def test_a_bent_beam_takes_its_end_where_a_straight_one_cannot() -> None:
    system = closed("inextensible", 6, {"body": "base", "position": [9.0, 1.0, 0.0]}, curvature=[0.0, 0.0, 0.1])
    assert len(system.multipliers) == 6 * 3 + 6


def test_nodes_that_are_pinned_where_they_are_are_off_by_nothing() -> None:
    """Frames at the origins of nodes reach nowhere, so the beam is what rounding is measured by."""
    radius, quarter = 1.0, math.pi / 2.0
    arch = {"length": quarter * radius, "curvature": [0.0, 0.0, -1.0 / radius], "rotary_inertia": [2e-3, 1e-3, 1e-3]}
    scene = beam_scene(8, {"force": [0, "load", 0]}, arch, rotation=[{"axis": [0, 0, 1], "angle": "45 deg"}])
    scene["points"] = {
        "support": {"body": "base", "position": ["sqrt(2)", 0, 0]},
        "end": {"body": "rope", "position": [quarter * radius, 0, 0]},
    }
    first = {"point": "support", "axis": [0, 0, 1]}
    scene["constraints"] = {"pin": {"type": "point_on_line", "first": first, "second": "end"}}
    system = derive(eomgen.load(scene))
    assert not [note for note in (*system.notes, *system.warnings) if " off by " in note]


def test_a_ring_that_closes_at_the_origin_is_off_by_nothing() -> None:
    scene = beam_scene(6, {"force": [0, 0, "load"]}, {"length": 1.0, "curvature": [0.0, 0.0, 2.0 * math.pi]})
    second = {"body": "rope", "position": [1.0, 0.0, 0.0]}
    scene["constraints"] = {"closed": {"type": "fixed", "first": {"body": "rope"}, "second": second}}
    system = derive(eomgen.load(scene))
    assert not [note for note in (*system.notes, *system.warnings) if " off by " in note]
