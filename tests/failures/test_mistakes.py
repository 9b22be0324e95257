"""What users tried by mistake is answered, and every answer says where, what, and what to try.

An answer is an error, the message of a run, or the notes of a scene.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import pytest

import eomgen
from tests.failures.mistakes import arm, changed, pendulum, pushed, run_of, runs, slider, stiff


def check_answer(call: Callable[[], Any], pieces: tuple[str, ...]) -> None:
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        try:
            answer = str(call())
        except Exception as error:  # the error is the answer
            answer = f"{type(error).__name__}: {error}"
    answer = " ".join([answer, *(str(item.message) for item in told)])
    missing = [piece for piece in pieces if piece not in answer]
    assert not missing, f"{missing} in: {answer}"


UNUSED = '[inputs.spare]\nunit = "N"\n'
AXIS = "axis = [0, 1, 0]"
NAMED = f"{AXIS}\ninitial = {{ angle = 0.3 }}"


@pytest.mark.parametrize(
    ("call", "pieces"),
    [
        (changed('mass = "1 + load"\n', ""), ("scene.toml:11 (bodies.upper.mass)", "try: mass =")),
        (changed("", "", UNUSED), ("the input spare changes nothing", "no formula")),
        (changed(AXIS, NAMED), ("'angle' is unknown here", "position")),
        (lambda: arm().simulate(0.01, 1e-3)["q.elbow"], ("no column 'q.elbow'", "q.shoulder")),
        (runs(t_end=0.5, step=1.0), ("reached t = 0.5 s in 1 steps", "do not resolve", "try: a step of")),
        (
            runs(inputs={"motor": lambda: 1.0}),
            ("input motor: the function failed at t = 0 s", "positional arguments"),
        ),
        (lambda: arm().simulate(0.01, 1e-3).at(5.0), ("outside the solution", "a longer run")),
    ],
)
def test_answers(call: Callable[[], Any], pieces: tuple[str, ...]) -> None:
    check_answer(call, pieces)


def four_bar() -> eomgen.SceneBuilder:
    builder = eomgen.SceneBuilder("bars")
    for name, length in (("crank", 0.3), ("coupler", 0.5), ("rocker", 0.4)):
        builder.body(name, 1.0, center_of_mass=[length / 2, 0, 0], inertia=[0.01, 0.01, 0.01])
    for name, parent, child, place in (
        ("a", "base", "crank", 0.0),
        ("b", "crank", "coupler", 0.3),
        ("c", "base", "rocker", 2.0),
    ):
        builder.joint(name, "revolute", parent, child, axis=[0, 1, 0], position=[place, 0, 0])
    return builder.constraint(
        "close", "spherical", {"body": "coupler", "position": [0.5, 0, 0]}, {"body": "rocker", "position": [0.4, 0, 0]}
    )


UNSTABLE = "but the method is unstable at this step"
NOT_FINITE = "the first block that is not finite is Q"
FALLING = {"position": 1.0, "velocity": -3.0}
SPRUNG = slider().point("a", "m", [0, 0, 0]).point("o", "base", [0, 0, 0])
SPRUNG.spring("s", "a", "o", stiffness=10, length=1.0)


@pytest.mark.slow_except("a run shorter than a step")
@pytest.mark.parametrize(
    ("call", "pieces"),
    [
        pytest.param(
            run_of(stiff(), 1.0, 1e-2, method="rk4"), (UNSTABLE, "try: a step of 0.0025 s"), id="rk4 that overflows"
        ),
        pytest.param(
            run_of(stiff(), 1.0, 1e-2),
            ("the estimated error is", "out of balance by 100 %", "159 Hz"),
            id="a step that is too coarse",
        ),
        pytest.param(run_of(pendulum(), 1e-4, 1e-3), ("reached t = 0.0001 s",), id="a run shorter than a step"),
        pytest.param(
            run_of(four_bar(), 1.0, 1e-3),
            ("close: origins meet along x by", "lengths and axes that fit"),
            id="a four-bar that cannot close",
        ),
        pytest.param(
            run_of(pushed(), 1.0, 1e-3, inputs={"u": lambda t: 0.0 if t < 0.5 else {}["x"]}),
            ("stopped at t =", "input u: the function failed", "KeyError"),
            id="an input that raises",
        ),
        pytest.param(
            run_of(pushed(), 1.0, 1e-3, inputs={"u": lambda t: float("nan") if t > 0.5 else 0.0}),
            ("the function gives nan", "finite numbers over the whole run"),
            id="an input that is not a number",
        ),
        pytest.param(
            run_of(slider(initial={"position": 1.0}).effort("e", "x", "q.x**3"), 10.0, 1e-3),
            ("stopped at", "it is the equations that diverge"),
            id="equations that diverge",
        ),
        pytest.param(
            run_of(slider(initial=FALLING).effort("e", "x", "sqrt(q.x)"), 3.0, 1e-3),
            (NOT_FINITE, "v.x", "try:"),
            id="a root of a negative number",
        ),
        pytest.param(run_of(SPRUNG, 3.0, 1e-3), (NOT_FINITE, "t = 0 s"), id="a spring without length"),
        pytest.param(
            run_of(slider(stiffness=100, damping=-5, initial={"position": 0.1}), 50.0, 1e-2),
            ("the estimated error is", "try: a step smaller"),
            id="negative damping",
        ),
        pytest.param(
            run_of(slider(initial=FALLING | {"velocity": -1.0}).effort("e", "x", "-1 / q.x"), 3.0, 1e-3),
            ("the step was halved", "the estimated error is", "try:"),
            id="an attraction into a point",
        ),
    ],
)
def test_answers_of_runs(call: Callable[[], Any], pieces: tuple[str, ...]) -> None:
    check_answer(call, pieces)
