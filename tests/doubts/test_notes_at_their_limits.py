"""Notes on doubtful values of scenes, on both sides of their limits: lengths beyond the scene, heavy bodies, delays of
many samples, beams, springs, tyres."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

import eomgen
from eomgen.formula.nodes import Number
from eomgen.products.doubts import out_of_scale as scale
from eomgen.scene.joint_types import JOINTS
from tests.models.library import scene


@pytest.mark.parametrize(
    ("key", "length", "well_known", "told"),
    [
        ("springs.s.length", 200.0, True, True),
        ("bodies.b.inertia", 20.0, True, True),
        ("bodies.b.inertia", 20.0, False, False),
        ("beams.b.rotary_inertia", 2.0, False, True),
        ("springs.s.length", math.inf, True, False),
    ],
)
def test_lengths_beyond_the_scene_are_told(key: str, length: float, well_known: bool, told: bool) -> None:
    notes = scale._too_long([(key, "the length", length, "m")], 2.0, well_known=well_known)
    said = f"{key}: the length is {length:.3g} m, and the scene is no larger than 2 m"
    assert [note.startswith(said) for note in notes] == [True] * told


@pytest.mark.parametrize(
    ("delay", "sample", "period", "told"),
    [
        (5, 0.1, 0.1, ["controllers.servo.delay: the delay 5 is 5 s, 50 samples"]),
        (5.5, 0.1, 0.1, []),  # no whole number
        ("5 s", 0.1, 0.1, []),
        (0.1, 10, 10.0, ["controllers.servo.sample: the time between two samples is 10 s"]),
        (0.1, "20 s", 20.0, []),
    ],
)
def test_delays_of_many_samples_and_rare_samples_are_told(
    delay: Any, sample: Any, period: float, told: list[str]
) -> None:
    document = SimpleNamespace(section=lambda name: {"servo": SimpleNamespace(sample=period)} if "con" in name else {})
    data = {"controllers": {"servo": {"delay": delay, "sample": sample}}}
    notes = scale.doubtful_times(cast(Any, SimpleNamespace(data=data, document=document)))
    assert [note.partition(";")[0].partition(": times")[0] for note in notes] == told


def joint(kind: str, q: tuple[float, ...], parent: str = "base", child: str = "arm", **more: Any) -> Any:
    fields = {"type": kind, "initial_position": q, "axis": (0.0, 0.0, 1.0), "parent": parent, "child": child}
    fields |= {"kind": JOINTS[kind], "second_axis": (1.0, 0.0, 0.0), "pitch": Number(0.0)}
    fields |= {"mimic": None, "drive": (), "position": tuple(map(Number, (1.0, 2.0, 3.0))), "orientation": np.eye(3)}
    return SimpleNamespace(**{**fields, **more})


@pytest.mark.parametrize(("value", "unit", "told"), [(400.0, "m", True), (4.0, "m", False), (400.0, "N", False)])
def test_parameters_in_m_beyond_the_scene_are_told(value: float, unit: str, told: bool) -> None:
    drive = {"joint": "hinge", "effort": "r * t"}
    data = scene("pendulum", parameters={"r": {"value": value, "unit": unit}}, efforts={"drive": drive})
    assert any(note.startswith("parameters.r: the length is 400 m") for note in eomgen.load(data).notes) == told
