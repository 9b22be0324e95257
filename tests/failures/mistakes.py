"""Scenes, models and calls that tests of mistakes share."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import eomgen
from tests.failures.failure import SCENE


def scene_of(text: str, name: str = "scene.toml") -> eomgen.Scene:
    folder = Path(tempfile.mkdtemp())
    (folder / name).write_text(text, encoding="utf-8")
    return eomgen.load(folder / name)


def changed(old: str, new: str, more: str = "") -> Callable[[], Any]:
    """Return what reads the scene with one place changed, and gives its notes."""
    assert not old or SCENE.count(old) == 1, old
    return lambda: scene_of(SCENE.replace(old, new) + more if old else SCENE + more).notes


@cache
def arm() -> eomgen.Model:
    return eomgen.build(scene_of(SCENE), profile="quick")


def runs(**options: Any) -> Callable[[], Any]:
    return lambda: arm().simulate(**{"t_end": 0.1, "step": 1e-3, **options}).message


def slider(**keys: Any) -> eomgen.SceneBuilder:
    builder = eomgen.SceneBuilder("slider").body("m", 1.0)
    return builder.joint("x", "prismatic", "base", "m", axis=[1, 0, 0], **keys)


def pendulum() -> eomgen.SceneBuilder:
    builder = eomgen.SceneBuilder("pendulum").body("m", 1.0, center_of_mass=[0, 0, -1], inertia=[0.1, 0.1, 0.1])
    return builder.joint("h", "revolute", "base", "m", axis=[0, 1, 0], initial={"position": 0.5})


def run_of(builder: eomgen.SceneBuilder, t_end: float, step: float, **options: Any) -> Callable[[], Any]:
    return lambda: eomgen.build(builder.build(), profile="quick").simulate(t_end, step, **options).message


def stiff() -> eomgen.SceneBuilder:
    return slider(stiffness=1e6, initial={"position": 0.1})


def pushed() -> eomgen.SceneBuilder:
    return slider().input("u").effort("e", "x", "u")
