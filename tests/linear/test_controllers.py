"""Designs that are written into scenes: the C of the closed loop moves, near where it is linear, as the design says."""

from __future__ import annotations

import dataclasses
import math
import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.control import OutputFeedback, Regulator, driven_by, kalman, lqr, shaping_filter
from eomgen.errors import UsageError
from eomgen.products.linear.controllers import error_on_group, toml_text, with_controller
from eomgen.products.linear.state_space import StateSpace
from tests.linear.by_hand import linear_model

EXAMPLE = Path(__file__).parents[2] / "examples" / "active_quarter_car" / "lag.toml"
WEIGHTS = {"body_acceleration": 1.0, "travel": 1e3, "deflection": 1e4}
FORCE = {"force": 1e-7}
NOISE, MEASURED = {"road": 1e-6, "force": 1.0}, {"travel": 1e-9, "body_velocity": 1e-5}

#: An upright pole on a cart, driven by a motor with a lag: nonlinear, and it rests where a force is needed.
POLE: dict[str, Any] = {
    "format": 1, "name": "pole", "parameters": {"slope": 0.05}, "inputs": {"push": {"unit": "N"}},
    "states": {"motor": {"rate": "(push - motor) / 0.05", "unit": "N"}},
    "bodies": {
        "cart": {"mass": 2},
        "pole": {"mass": 0.5, "center_of_mass": [0, 0, 0.6], "inertia": [0.02, 0.02, 0.001]},
    },
    "joints": {
        "rail": {"type": "prismatic", "parent": "base", "child": "cart", "axis": [1, 0, 0], "stiffness": 3},
        "hinge": {"type": "revolute", "parent": "cart", "child": "pole", "axis": [0, 1, 0]},
    },
    "efforts": {"push": {"joint": "rail", "effort": "motor + 1.5"}},
    "points": {"tip": {"body": "pole", "position": [0, 0, 1.2]}},
    "outputs": {"cart": {"formula": "q.rail", "unit": "m"}, "tip": {"position": "tip"}},
    "simulation": {"method": "rk4"},
}  # fmt: skip  # a table


def flat() -> dict[str, Any]:
    """Return the data of the quarter car on a flat road."""
    data = tomllib.loads(EXAMPLE.read_text(encoding="utf-8"))
    return data | {"inputs": {"force": {"unit": "N"}, "road": {"formula": 0.0, "unit": "m"}}}


def linear(data: dict[str, Any], **options: Any) -> StateSpace:
    return eomgen.build(data, profile="instant").linearize(**options).state_space()


@pytest.fixture(scope="module")
def car() -> StateSpace:
    return linear(flat(), t=100.0)  # when the road has faded in


@pytest.mark.slow
def test_the_state_space_has_units_and_references(car: StateSpace) -> None:
    assert car.states == ("wheel", "body", "v.wheel", "v.body", "z.tension")
    assert car.units["states"] == ("m", "m", "m/s", "m/s", "N")
    assert car.units["outputs"] == ("m/s^2", "m", "m", "m/s")
    assert (car.units["inputs"], car.units["disturbances"]) == (("N",), ("m",))
    assert (car.unit("outputs", "travel"), car.unit("states", "z.tension")) == ("m", "N")
    np.testing.assert_allclose(car.references["states"], 0.0, atol=1e-9)
    pole = linear(POLE, any_kind=True)
    np.testing.assert_allclose(pole.reference("states", "rail"), 0.5, rtol=1e-9)
    np.testing.assert_allclose(pole.references["outputs"], [0.5, 0.5, 0.0, 1.2], atol=1e-9)


@pytest.mark.parametrize("units", [1.0, 1e-4])
def test_gains_that_are_rounding_are_not_written(units: float) -> None:
    """Heave and roll of a plate by two forces, and a part that no force moves; lengths in other units, too."""
    forces = {"left": [1.0, 0.7, 0.0], "right": [1.0, -0.7, 0.0]}
    M, C, K = np.diag([13.0, 0.4, 0.1]), np.diag([0.0, 0.0, 0.3]), np.diag([1e3, 30.0, 7.0])
    space = linear_model(M, C, K, ("heave", "roll", "spin"), forces).state_space()
    T = np.diag([units, 1.0, 1.0, units, 1.0, 1.0])  # states are T times the ones in other units
    space = dataclasses.replace(space, A=np.linalg.solve(T, space.A @ T), B=np.linalg.solve(T, space.B), C=space.C @ T)
    law = lqr(space, {"heave": 3.3e4 * units**2, "roll": 777.0, "spin": 1.0}, {"left": 0.37, "right": 0.37})
    assert 0.0 < np.max(np.abs(law.gains[:, [2, 5]])) < 1e-10  # which the wheel needs no signal for
    data = {"inputs": {name: {} for name in ("left", "right")}}
    for entry in with_controller(data, law)["controllers"].values():
        assert sorted(entry["signal_gains"]) == ["heave", "roll", "v_heave", "v_roll"]


def test_text_of_nested_data_is_read_back() -> None:
    odd = {"a": {"b c": 'quote " and \\', "d": [1, 2.5, True], "e": {"f": "x", "g": {"h i": 1e-300}}}, "name": "n"}
    assert tomllib.loads(toml_text(odd)) == odd
    assert tomllib.loads(toml_text(POLE)) == POLE and 'method = "rk4"\n' in toml_text(POLE)


@pytest.mark.parametrize("sample", [None, 0.02])
def test_feedback_is_written_with_the_names_of_the_scene(sample: float | None) -> None:
    """Of a position, a velocity, an internal state and a turn from the reference."""
    names, none = ("hinge", "v.hinge", "z.lag", "ball[1]"), np.zeros((4, 0))
    references = {"states": np.array([0.3, 0.0, 2.0, math.nan]), "inputs": np.array([5.0])}
    space = StateSpace(
        np.zeros((4, 4)), np.ones((4, 1)), none, none.T, np.zeros((0, 1)), np.zeros((0, 0)), names, ("force",), (), (),
        references=references, sample=sample, orientations={"ball": (1.0, 0.0, 0.0, 0.0)},
    )  # fmt: skip  # a table
    law = Regulator(space, np.array([[10.0, 2.0, 0.5, 7.0]]))
    closed = with_controller({"format": 1, "inputs": {"force": {"unit": "N"}}}, law)
    assert "inputs" not in closed
    formula = error_on_group("ball", 1, (1.0, 0.0, 0.0, 0.0))
    if sample is None:
        entry = closed["controllers"]["force"]
        signals = [*entry["signals"].values()]
        assert signals[:4] == ["q.hinge", "v.hinge", "lag", formula]
        assert [*entry["signal_gains"].values()] == [10.0, 2.0, 0.5, 7.0, -1.0]
        assert [*entry["signal_references"].values()] == [0.3, 2.0] and signals[4] in (5.0, "5", "5.0")
    else:
        entry = closed["states"]["force"]
        values = {"q.hinge": 0.4, "v.hinge": 3.0, "lag": 2.5, formula: 0.25}
        text = entry["formula"]
        for name, value in values.items():
            assert name in text
            text = text.replace(name, repr(value))
        assert eval(text, {}) == pytest.approx(5.0 - 10.0 * 0.1 - 2.0 * 3.0 - 0.5 * 0.5 - 7.0 * 0.25)
        assert (entry["sample"], entry["initial"]) == (0.02, 5.0)


@pytest.mark.slow
def test_what_cannot_be_written(car: StateSpace) -> None:
    law = lqr(car, WEIGHTS, FORCE)
    bodies = POLE["bodies"] | {"cart": {"mass": 2, "inertia": [1, 1, 1]}}
    absolute = POLE | {"coordinates": "absolute", "bodies": bodies}
    space = linear(absolute, at="initial")
    of_bodies = lqr(space, dict.fromkeys(space.states, 1.0), {"push": 1.0})
    cases: list[tuple[Any, Any, str]] = [
        ({**flat(), "inputs": {"road": {}}}, law, "the scene has no input 'force' of its own that a controller could"),
        (
            flat(),
            lqr(driven_by(car, shaping_filter([1.0], [1.0, 0.3], "white", "road", "m")), WEIGHTS, FORCE),
            "the feedback needs filter.road, of which formulas of the scene know no value; try: an observer",
        ),
        (
            flat(),
            OutputFeedback(law, kalman(car, NOISE, {"body_acceleration": 1e-3, "travel": 1e-9})),
            "body_acceleration is measured, and formulas of a controller cannot use it",
        ),
        (
            {**flat(), "parameters": {**flat()["parameters"], "estimate_body": 1.0}},
            OutputFeedback(law, kalman(car, NOISE, MEASURED)),
            "the scene has the name estimate_body already; try: another prefix",
        ),
        (absolute, of_bodies, "the feedback needs rail, of which formulas of the scene know no value"),
    ]
    for data, design, message in cases:
        with pytest.raises(UsageError, match=re.escape(message)):
            with_controller(data, design)


# -- written formulas, without a scene that is built -------------------------------------------------------------------

#: A mass on a spring and a damper, with an input that is 3 N at the reference.
RAIL = StateSpace(
    np.array([[0.0, 1.0], [-20.0, -0.3]]), np.array([[0.0], [0.5]]), np.array([[0.0], [1.0]]),
    np.array([[1.0, 0.2]]), np.zeros((1, 1)), np.zeros((1, 1)), ("x", "v.x"), ("push",), ("wind",), ("place",),
    units={"states": ("m", "m/s"), "inputs": ("N",), "disturbances": ("N",), "outputs": ("m",)},
    references={kind: np.array(values) for kind, values in
                {"states": [0.5, 0.0], "inputs": [3.0], "disturbances": [0.0], "outputs": [0.6]}.items()},
)  # fmt: skip  # tables
SCENE = {"format": 1, "inputs": {"push": {"unit": "N"}}, "outputs": {"place": {"formula": "q.x + 0.2 * v.x + 0.1"}}}


def evaluated(formula: str, values: dict[str, float]) -> float:
    """Return the value of a formula that is written."""
    for name in sorted(values, key=len, reverse=True):
        formula = re.sub(rf"(?<![\w.]){re.escape(name)}(?!\w)", f"({float(values[name])!r})", formula)
    return float(eval(formula, {"max": max, "min": min, "t": 0.0}))


@pytest.mark.parametrize("limited", [False, True])
@pytest.mark.parametrize("sample, delay", [(None, 0.0), (0.05, 0.0), (0.05, 0.02), (0.05, 0.12)])
@pytest.mark.parametrize("estimated", [False, True])
def test_written_formulas_are_the_closed_loop(
    estimated: bool, sample: float | None, delay: float, limited: bool, rng: np.random.Generator
) -> None:
    """From any state of plant and observer: the rates, or the values at the next sample, are those of the matrix of the
    loop. An observer that reads a limited command, within its limits, has the same."""
    regulator = lqr(RAIL, {"place": 50.0}, {"push": 0.1}, sample=sample, delay=delay)
    law: Regulator | OutputFeedback = regulator
    if estimated:
        law = OutputFeedback(regulator, kalman(RAIL, {"wind": 2.0}, {"place": 1e-2}, sample=sample, delay=delay))
    space, n = law.space, len(law.space.states)
    limits = {"push": (-1e6, 1e6)} if limited else {}
    written = with_controller(SCENE, law, limits=limits)
    state = rng.normal(size=len(law.closed_loop.states))
    values = {"q.x": 0.5 + state[0], "v.x": state[1], "z.wind": 0.0}
    values |= {name: 3.0 + state[space.states.index(name)] for name in space.waiting}
    estimates = [f"estimate_{re.sub(r'[^a-zA-Z0-9]', '_', name)}" for name in space.states] if estimated else []
    values |= dict(zip(estimates, state[n:].tolist(), strict=True))
    states, moved = written.get("states", {}), list[float]()
    if sample is None:
        (entry,) = (written["controllers"]["push"],)
        push = -sum(
            gain * (evaluated(str(entry["signals"][name]), values) - entry.get("signal_references", {}).get(name, 0.0))
            for name, gain in entry["signal_gains"].items()
        )
        assert (entry.get("minimum"), entry.get("maximum")) == ((-1e6, 1e6) if limited else (None, None))
        values["push"] = push
        moved = [evaluated(states[name]["rate"], values) for name in estimates]
    else:
        if estimated:
            values["measured_place"] = evaluated(states["measured_place"]["formula"], values)
        asked = "push_asked" if delay else "push"
        push = values[asked] = evaluated(states[asked]["formula"], values)
        moved = [evaluated(states[name]["formula"], values) for name in estimates]
        assert all(states[name]["delay"] == sample for name in estimates)
        assert all(entry["sample"] == sample for entry in states.values())
        if delay:
            assert states["push"] == {
                "sample": sample, "formula": "push_asked", "delay": delay, "initial": 3.0, "unit": "N",
                "description": "found from the sampled linear model",
            }  # fmt: skip  # a table
            for name, (_, samples) in space.waiting.items():
                assert (states[name]["formula"], states[name]["delay"]) == ("push_asked", samples * sample)
    found = np.concatenate([space.A @ state[:n] + space.B[:, 0] * (push - 3.0), moved])
    np.testing.assert_allclose(found, law.closed_loop.A @ state, rtol=1e-9, atol=1e-9 * np.abs(law.closed_loop.A).max())
    own = [written[section] for section in ("states", "controllers") if section in written]
    assert all(entry.get("unit") in ("N", "m", "m/s") for section in own for entry in section.values())
