"""Limits, quanta and delays of actuators and sensors: written scenes against sampled loops in NumPy."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

import eomgen
from eomgen.base.arrays import Array
from eomgen.control import OutputFeedback, Regulator, kalman, lqr
from eomgen.errors import UsageError
from eomgen.products.linear.controllers import with_controller
from eomgen.products.linear.state_space import StateSpace
from tests.linear.by_hand import linear_model

PERIOD, MASS, STIFFNESS, LOAD = 0.01, 2.0, 40.0, 3.0
START = (0.1, 0.0)


def cart() -> dict[str, Any]:
    """Return nested data of a cart on a spring under a constant load: at rest a force may be needed."""
    return {
        "format": 1,
        "name": "cart",
        "gravity": [0, 0, 0],
        "bodies": {"b": {"mass": MASS}},
        "joints": {
            "x": {
                "type": "prismatic", "parent": "base", "child": "b", "axis": [1, 0, 0], "stiffness": STIFFNESS,
                "initial": {"position": START[0]},
            }
        },
        "inputs": {"push": {"unit": "N"}},
        "efforts": {"motor": {"joint": "x", "effort": f"push - {LOAD}"}},
        "outputs": {"place": {"formula": "q.x", "unit": "m"}},
    }  # fmt: skip  # a table


@pytest.fixture(scope="module")
def plant() -> StateSpace:
    """Return the cart about x = 0, at which the command is 3 N."""
    space = linear_model(
        MASS, 0.0, STIFFNESS, ["x"], {"push": [1.0]}, None, {"place": {"q": [1.0]}}, ["m"]
    ).state_space()
    return replace(
        space, units={**space.units, "inputs": ("N",)}, references={**space.references, "inputs": np.array([LOAD])}
    )


def by_hand(law: Regulator | OutputFeedback, hardware: Mapping[str, Any], rows: int, fine: int) -> Array:
    """Return position and velocity of the cart ``fine`` times a sample, by exponentials of the cart's own matrix.

    The loop has the predictor and corrector form of an observer, with the command that the converter gives.
    """
    lower, upper = hardware.get("limits", {}).get("push", (-np.inf, np.inf))
    of_sensor = hardware.get("limits", {}).get("place", (-np.inf, np.inf))
    quantum, delay = hardware.get("quantum", {}), hardware.get("delay", {})
    design = round(law.space.input_delay / PERIOD, 9)
    late = delay.get("push", law.space.input_delay) / PERIOD
    dot = np.zeros((3, 3))
    dot[0, 1], dot[1, 0], dot[1, 2] = 1.0, -STIFFNESS / MASS, 1.0 / MASS
    tick = PERIOD / fine
    over_a_tick = expm(dot * tick)
    state, motion, commands, readings = np.array([*START]), [np.array([*START])], [], []
    space = law.space
    estimate, waiting = np.zeros(len(space.states)), int(np.ceil(design))
    for sample in range(rows):
        reading = np.clip(state[0], *of_sensor)
        step = quantum.get("place", 0.0)
        readings.append(np.round(reading / step) * step if step else reading)
        seen = sample - int(np.ceil(delay.get("place", 0.0) / PERIOD - 1e-9))
        measured = readings[seen] if seen >= 0 else 0.0
        if isinstance(law, OutputFeedback):
            corrected = estimate + law.observer.gains[:, 0] * (measured - (law.observer.C @ estimate)[0])
        else:
            past = [commands[-k] - LOAD if len(commands) >= k else 0.0 for k in range(1, waiting + 1)]
            corrected = np.array([measured, state[1], *past])
        gains = law.regulator.gains if isinstance(law, OutputFeedback) else law.gains
        asked = np.clip(LOAD - (gains @ corrected)[0], lower, upper)
        step = quantum.get("push", 0.0)
        commands.append(np.round(asked / step) * step if step else asked)
        estimate = space.A @ corrected + space.B[:, 0] * (commands[-1] - LOAD)
        for part in range(fine):
            at_work = sample - int(np.ceil(late - part / fine - 1e-9))
            force = (commands[at_work] if at_work >= 0 else LOAD) - LOAD
            state = (over_a_tick @ [*state, force])[:2]
            motion.append(state)
    return np.array(motion)


HARDWARE: dict[str, dict[str, Any]] = {
    "limits": {"limits": {"push": (-0.8, 4.5)}},
    "quantum": {"quantum": {"push": 0.03, "place": 1e-3}},
    "delay": {"delay": {"push": 0.0035, "place": 0.02}},
    "sensor": {"limits": {"place": (-0.06, 0.06)}, "delay": {"place": 0.004}},
    "all": {
        "limits": {"push": (-0.75, 4.5), "place": (-0.08, 0.08)},
        "quantum": {"push": 0.03, "place": 1e-3},
        "delay": {"push": 0.0035, "place": 0.02},
    },
    "late": {"limits": {"push": (1.2, 4.5)}, "quantum": {"push": 0.03}, "delay": {"push": 0.012}},
}


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:delay of (place|x)")
@pytest.mark.parametrize(
    ("kind", "delay", "estimated"),
    [
        ("all", 0.005, True), ("late", 0.015, True), ("sensor", 0.0, True),
        ("limits", 0.0, False), ("delay", 0.005, False), ("quantum", 0.005, False),
    ],
)  # fmt: skip  # a table
def test_the_written_scene_moves_as_the_sampled_loop(
    kind: str, delay: float, estimated: bool, plant: StateSpace
) -> None:
    law: Regulator | OutputFeedback = lqr(plant, {"place": 4000.0}, {"push": 0.01}, sample=PERIOD, delay=delay)
    if estimated:
        law = OutputFeedback(law, kalman(plant, {"push": 5.0}, {"place": 1e-6}, sample=PERIOD, delay=delay))  # type: ignore[arg-type]
    hardware = HARDWARE[kind]
    given = hardware
    if not estimated:  # a state is measured by its own name
        given = {
            key: {"x" if name == "place" else name: of for name, of in row.items()} for key, row in hardware.items()
        }
    model = eomgen.build(with_controller(cart(), law, **given), profile="instant")
    rows, fine = 60, 40
    run = model.simulate(rows * PERIOD, PERIOD / fine, method="rk4", error_estimate=False)
    expected = by_hand(law, hardware, rows, fine)
    np.testing.assert_allclose(np.column_stack([run.q, run.v]), expected, rtol=0, atol=1e-12)
    command = run.z[:, model.states.index("push")]
    if "push" in hardware.get("limits", {}):
        lower, upper = hardware["limits"]["push"]
        assert command.min() >= lower and command.max() <= upper
        assert np.sum(np.isclose(command, lower, atol=0.03) | np.isclose(command, upper, atol=0.03)) >= fine
    plain = eomgen.build(with_controller(cart(), law), profile="instant")
    free = plain.simulate(rows * PERIOD, PERIOD / fine, method="rk4", error_estimate=False)
    assert np.max(np.abs(free.q - run.q)) > 1e-5  # the hardware is felt


@pytest.mark.parametrize(
    ("hardware", "message"),
    [
        ({"limits": {"pusch": (-1, 1)}}, "limits: 'pusch' is neither an input of the law nor a signal"),
        ({"quantum": {"x": 0.1}}, "quantum: 'x' is neither an input of the law nor a"),
        ({"quantum": {"push": 0.0}}, "quantum of push: the quantum 0 is not positive; try: a positive number, or no"),
        ({"quantum": {"push": float("nan")}}, "quantum of push: quantum of push is nan, not a finite number"),
        ({"quantum": {"push": "3 m"}}, "quantum of push:"),
        ({"quantum": {"place": True}}, "quantum of place: a number is needed, not bool"),
        ({"quantum": 0.1}, "quantum: a mapping from names to values is needed, not float; try: quantum={'push': 0.01}"),
        ({"limits": {"push": (5.0, 1.0)}}, "limits of push: the lower limit 5 is not below the upper limit 1"),
        ({"limits": {"push": 5.0}}, "limits of push: a lower and an upper limit are needed, not 5.0; try: (-5.0, 5.0)"),
        ({"limits": {"push": (-1.0, 1.0)}}, "limits of push: push is 3 at the reference of the linear model, and the"),
        ({"limits": {"push": (1.5, 5.9)}, "quantum": {"push": 3.0}}, "quantum of push: fewer than two multiples of 3"),
        ({"delay": {"push": -0.001}}, "delay of push: the delay -0.001 s is negative; try: a time from zero on"),
        ({"delay": {"place": "3 kg"}}, "delay of place:"),
        ({"delay": {"place": None}}, ""),
        ({"limit": {"push": (2.9, 3.1)}}, "limit"),
    ],
)  # fmt: skip  # a table
def test_hardware_that_cannot_be_is_refused(hardware: dict[str, Any], message: str, plant: StateSpace) -> None:
    law = OutputFeedback(
        lqr(plant, {"place": 4000.0}, {"push": 0.01}, sample=PERIOD),
        kalman(plant, {"push": 5.0}, {"place": 1e-6}, sample=PERIOD),
    )
    if not message:
        assert with_controller(cart(), law, **hardware) == with_controller(cart(), law)
        return
    with pytest.raises(UsageError, match=re.escape(message)):
        with_controller(cart(), law, **hardware)


def test_quanta_and_delays_need_a_sampled_law(plant: StateSpace) -> None:
    law = lqr(plant, {"place": 4000.0}, {"push": 0.01})
    for argument in ("quantum", "delay"):
        with pytest.raises(UsageError) as caught:
            with_controller(cart(), law, **{argument: {"push": 0.01}})
        assert f"{argument}: the law is continuous in time, and has no {argument} of push; try: a sampled law" in str(
            caught.value
        )


def test_units_of_texts_and_limits_at_whole_quanta(plant: StateSpace) -> None:
    law = lqr(plant, {"place": 4000.0}, {"push": 0.01}, sample=PERIOD)
    limits: dict[str, Any] = {"push": ("-2 kN", "0.0045 kN")}
    late = (
        r"^delay of x: a reading that comes 0.003 s late is used 1 sample later, after 0.01 s, which the design did not"
    )
    with pytest.warns(RuntimeWarning, match=late) as caught:
        states = with_controller(cart(), law, limits=limits, quantum={"x": "1 mm"}, delay={"x": "3 ms"})["states"]
    assert [each.filename for each in caught] == [__file__]
    assert "max(-2000.0, min(4.5, " in states["push"]["formula"]
    assert (states["sensor_x"]["quantum"], states["sensor_x"]["delay"]) == (0.001, 0.003)
    states = with_controller(cart(), law, limits={"push": (-1.0, 4.5)}, quantum={"push": 0.4})["states"]
    assert states["push"]["formula"].startswith("max(-0.8, min(4.4")
