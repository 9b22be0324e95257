"""Texts that maps of examples meet and that no other test reads whole: what happened, where, and what to try."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen

EXAMPLES = Path(__file__).parents[2] / "examples"
NUMBER = r"-?\d\S*"


def told(text: str) -> str:
    """Return a pattern of a text in which # stands for any number."""
    return re.escape(text).replace(r"\#", NUMBER)


def example(name: str) -> eomgen.Model:
    return eomgen.build(EXAMPLES / name / "scene.toml")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "run", "text"),
    [
        (
            "four_bar",
            {"step": 2.8e-3, "t_end": 0.056, "method": "rk4_partitioned", "initial": {"drive": {"velocity": 1e4}}},
            "stopped at t = # s, after # of 20 steps: the correction of the dependent coordinates did not converge,"
            " whichever they are; try: a step smaller than 0.0028 s",
        ),
        (
            "bouncing_ball",
            {"step": 0.0628, "t_end": 2.512, "method": "rk4"},
            "the event bounce comes again and again at t = # s, # times so far: the motion comes to rest there, or it"
            " chatters, after # of 40 steps; try: an event that stops the run, or switches a mode, where the motion"
            " comes to rest",
        ),
    ],
)
def test_how_runs_end(name: str, run: dict[str, Any], text: str) -> None:
    solution = example(name).simulate(**run)
    assert re.fullmatch(told(text) + r"(; .*)?", solution.message), solution.message


@pytest.mark.slow
def test_a_base_too_steep_for_the_step_is_refused() -> None:
    text = (
        "base.position[2]): the position of the base is too steep for a step of 0.015 s near t = # s: over one step it"
        " changes by # m more or less than the integral of its rates, # % of its range; try: a step of # s"
    )
    with pytest.raises(eomgen.UsageError, match=told(text)):
        example("pendulum_on_shaking_base").simulate(0.6, 0.015)


@pytest.mark.slow
def test_what_nothing_in_a_wheel_turns_for_is_left_out() -> None:
    slider = {"type": "prismatic", "parent": "base", "child": "b", "axis": [1, 0, 0], "stiffness": 1.0}
    scene = {"format": 1, "name": "cart", "gravity": [0, 0, 0], "bodies": {"b": {"mass": 1.0}}, "joints": {"x": slider}}
    left_out = eomgen.extremes(scene, ladders=["damping", "gravity", "spin", "turns"]).left_out
    assert left_out == {
        "damping": "it has no key damping with a value",
        "gravity": "it is without gravity",
        "spin": "nothing in it turns by a velocity of its own",
        "turns": "it has no angles as coordinates",
    }
    assert not np.any(eomgen.build(scene).initial_v)
