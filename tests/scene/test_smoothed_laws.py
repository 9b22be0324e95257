"""Laws that jump and are smoothed as asked, against transitions written by hand, and motions that follow them."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.formula.recording import law_and_rate

T = 0.2
Function = Callable[[np.ndarray], np.ndarray]


def driven(drive: str | None, smooth: object = T, **curves: object) -> eomgen.Scene:
    """Return a cart of 2 kg, moved along x, with a pendulum on it; ``late`` is tunable, ``when`` is 0.5."""
    builder = eomgen.SceneBuilder("smoothed").body("cart", 2.0).body("bob", 0.5, inertia=[0.1, 0.1, 0.1])
    builder.parameter("late", 0.5, tunable=True).parameter("when", 0.5)
    for name, entry in curves.items():
        builder.curve(name, **entry)  # type: ignore[arg-type]
    keys = {key: value for key, value in (("drive", drive), ("smooth", smooth)) if value is not None}
    builder.joint("x", "prismatic", "base", "cart", axis=[1, 0, 0], **keys)
    builder.joint("swing", "revolute", "cart", "bob", axis=[0, 1, 0], position=[0.4, 0, 0.2])
    builder.output("motor", formula="drive_effort.x")
    return builder.simulation(duration=2.0).build()


def law(scene: eomgen.Scene) -> Function:
    values = law_and_rate(scene.joints[0].drive[0], {item.name: item.value for item in scene.parameters})
    return lambda t: values(t)[0]


def by_hand(pieces: Sequence[tuple[float, Function]]) -> Function:
    """Return what follows a first piece from minus infinity on, and each other one from its time on."""

    def value(t: np.ndarray) -> np.ndarray:
        total = pieces[0][1](t)
        for (_, left), (start, right) in itertools.pairwise(pieces):
            s = np.clip((t - start) / T, 0.0, 1.0)
            total = total + (right(t) - left(t)) * (6 * s**5 - 15 * s**4 + 10 * s**3)
        return total

    return value


def constant(value: float) -> Function:
    return lambda t: np.full_like(t, value)


def flank(number: int) -> Function:
    """Return a flank of the triangle of period 0.8 from 0 to 1: up those of even numbers, down the others."""
    return lambda t: 2.5 * (t + 0.1) - number if number % 2 == 0 else number + 1 - 2.5 * (t + 0.1)


STAIRS = {"points": [[0, 1], [0.5, 3], [1.25, -1], [1.5, -1]], "interpolation": "steps", "outside": "hold"}
ROAD = {"points": [[0, 0], [1, 2], [1, 3], [2, 3]], "interpolation": "linear", "outside": "hold"}
SQUARE = {"wave": {"shape": "square", "period": 1.2, "low": -1, "high": 1, "start": 0.1}}
SAW = {"wave": {"shape": "triangle", "period": 0.8, "low": 0, "high": 1, "duty": 0.5}}
CASES: list[tuple[str, dict[str, Any], list[tuple[float, Function]]]] = [
    ("1 if t > when else 0", {}, [(-9.0, constant(0.0)), (0.5, constant(1.0))]),
    ("max(0, 2 * (t - 0.5))", {}, [(-9.0, constant(0.0)), (0.5, lambda t: 2 * (t - 0.5))]),
    ("min(0.3, 1 - t) + t", {}, [(-9.0, lambda t: 0.3 + t), (0.7, constant(1.0))]),
    ("abs(t - 1)", {}, [(-9.0, lambda t: 1 - t), (1.0, lambda t: t - 1)]),
    ("sin(t) if 0.5 <= t and t < 1.5 else 0.2", {}, [(-9.0, constant(0.2)), (0.5, np.sin), (1.5, constant(0.2))]),
    ("1 if not t < 0.5 else t", {}, [(-9.0, lambda t: t), (0.5, constant(1.0))]),
    ("stairs(t)", {"stairs": STAIRS}, [(-9.0, constant(1.0)), (0.5, constant(3.0)), (1.25, constant(-1.0))]),
    ("stairs(2 - t)", {"stairs": STAIRS}, [(-9.0, constant(-1.0)), (0.75, constant(3.0)), (1.5, constant(1.0))]),
    ("road(2 * t - 1)", {"road": ROAD}, [(-9.0, constant(0.0)), (0.5, lambda t: 4 * t - 2), (1.0, constant(3.0))]),
    (
        "square(t)",
        {"square": SQUARE},
        [(-9.0, constant(-1.0)), *((0.1 + 0.6 * k, constant((-1.0) ** k)) for k in range(4))],
    ),
    ("saw(t + 0.1)", {"saw": SAW}, [(0.4 * k - 0.1, flank(k)) for k in range(-1, 6)]),
]


@pytest.mark.parametrize(("drive", "curves", "pieces"), CASES, ids=[case[0] for case in CASES])
def test_a_smoothed_law_is_the_transition_by_hand(
    drive: str, curves: dict[str, Any], pieces: list[tuple[float, Function]]
) -> None:
    scene = driven(drive, **curves)
    t = np.linspace(0.0, 2.0, 4001)
    assert law(scene)(t) == pytest.approx(by_hand(pieces)(t), abs=2e-13)
    with pytest.raises(eomgen.EomgenError, match=r"jumps|bends"):
        eomgen.build(driven(drive, None, **curves), profile="quick", method="rk4_partitioned")


@pytest.mark.slow
@pytest.mark.parametrize(("name", "error"), [("rk4_partitioned", 1e-6), ("generalized_alpha", 0.1)])
def test_a_cart_moves_as_the_polynomial_and_its_motor_pushes_as_newton_says(name: str, error: float) -> None:
    """A step of 0.3 m in 0.2 s: the greatest velocity is 15/8 D/T, the greatest acceleration 10/sqrt(3) D/T^2.

    Generalized-alpha's accelerations are off by a part of what they change by within a step, 2.2 m/s^2 at first.
    """
    machine = eomgen.build(driven("0.1 + (0.3 if t > 0.4 else 0)", "200 ms"), profile="quick", method=name)
    step = 1e-3
    found = machine.simulate(1.0, step, error_estimate=False, initial={"swing": 0.0})
    assert found.success, found.message
    s = np.clip((found.t - 0.4) / T, 0.0, 1.0)
    x = 0.1 + 0.3 * s**3 * (10 - 15 * s + 6 * s**2)
    a = 0.3 / T**2 * (60 * s - 180 * s**2 + 120 * s**3)
    k = machine.q_names.index("q.x")
    assert found.q[:, k] == pytest.approx(x, abs=1e-9)
    assert found.v[:, k].max() == pytest.approx(15 / 8 * 0.3 / T, rel=1e-6)
    assert found.a[:, k] == pytest.approx(a, abs=error)
    assert found.a[:, k].max() == pytest.approx(10 / math.sqrt(3) * 0.3 / T**2, rel=1e-3)
    # the pendulum's mass sits at the pivot, so the motor moves 2.5 kg
    assert found.outputs["motor"] == pytest.approx(2.5 * a, abs=3 * error)
    times = machine.discontinuity_times(0.0, 1.0)
    assert any(abs(time - 0.4) < 1e-12 for time in times) and any(abs(time - 0.6) < 1e-12 for time in times)


@pytest.mark.slow
def test_the_order_is_kept_where_transitions_lie_between_points_of_the_grid() -> None:
    builder = eomgen.SceneBuilder("hanging").body("cart", 2.0)
    builder.body("bob", 0.5, center_of_mass=[0, 0, -0.8], inertia=[0.01, 0.01, 0.01])
    builder.joint("x", "prismatic", "base", "cart", axis=[1, 0, 0], drive="0.4 if t > 0.2137 else 0.1", smooth=0.2719)
    builder.joint("swing", "revolute", "cart", "bob", axis=[0, 1, 0], initial={"position": 0.2})
    machine = eomgen.build(builder.build(), profile="quick", method="rk4_partitioned")
    k = machine.q_names.index("q.swing")
    ends = [machine.simulate(0.8, 0.02 / 2**n, error_estimate=False).q[-1, k] for n in range(4)]
    changes = np.abs(np.diff(ends))
    assert np.log2(changes[:-1] / changes[1:]) == pytest.approx(4.0, abs=0.5)


def test_a_length_over_time_and_a_driven_constraint_take_smooth() -> None:
    builder = eomgen.SceneBuilder("winch").body("load", 1.0)
    builder.joint("z", "prismatic", "base", "load", axis=[0, 0, -1], initial={"position": 1.0})
    builder.constraint(
        "rope", "distance", {"body": "base"}, {"body": "load"}, length="1 + 0.5 * max(0, t - 0.5)", smooth=T
    )
    scene = builder.build()
    values = law_and_rate(scene.constraints[0].prescribed_coordinate, {})
    t = np.linspace(0, 2, 1001)
    s = np.clip((t - 0.5) / T, 0, 1)
    assert values(t)[0] == pytest.approx(1 + 0.5 * (t - 0.5) * s**3 * (10 - 15 * s + 6 * s * s), abs=1e-13)


@pytest.mark.parametrize(
    ("drive", "smooth", "curves", "text"),
    [
        ("1 if t > late else 0", T, {}, "the times are not known beforehand at which a comparison of something else"),
        ("stairs(t**2)", T, {"stairs": STAIRS}, "the times are not known beforehand at which stairs jumps"),
        ("stairs(t)", 0.8, {"stairs": STAIRS}, "corners of stairs have a distance of 0.75, less than a transition,"),
        ("t", 0.0, {}, "(joints.x.smooth): the duration is 0 s, and has to be positive; try: smooth ="),
        (None, T, {}, "(joints.x.smooth): smooth needs a drive over time"),
        ("derivative.road(t)", T, {"road": ROAD}, "a derivative of road jumps, which cannot be smoothed by itself"),
    ],
)
def test_what_cannot_be_smoothed_is_refused(drive: str | None, smooth: float, curves: Any, text: str) -> None:
    with pytest.raises(eomgen.DescriptionError, match=re.escape(text)):
        driven(drive, smooth, **curves)


def test_the_refusal_of_a_jump_names_the_key() -> None:
    with pytest.raises(eomgen.DescriptionError, match=r'try: smooth = "10 ms" with the law, or a law that is smooth'):
        eomgen.build(driven("1 if t > 0.5 else 0", None), profile="quick", method="rk4_partitioned")
    with pytest.raises(eomgen.DescriptionError, match=r'interpolation = "quintic", or smooth = "10 ms" with the law'):
        driven("road(t)", None, road=ROAD)
