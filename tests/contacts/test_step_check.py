"""Steps that do not resolve a contact are told before the run, and steps that do are not."""

from __future__ import annotations

import math
from functools import cache

import pytest

import eomgen
from eomgen.pipeline.model import Model
from eomgen.pipeline.pipeline import build_for_run
from tests.contacts.pairs import contact, scene_of

FLOOR = '{ body = "base", axis = [0, 0, 1], x_axis = [1, 0, 0] }'
RAIL = """format = 1
name = "ball"
gravity = [0, 0, -9.81]
parameters.k = {{ value = 1e6, tunable = true }}
bodies.ball = {{ mass = 1 }}
[joints.ball]
type = "prismatic"
parent = "base"
child = "ball"
axis = [0, 0, 1]
initial = {{ position = {0} }}
"""
LINEAR = 'type = "linear", stiffness = "k", damping = 50, onset = 1e-6'
FREE = """format = 1
name = "ball"
gravity = [0, 0, -9.81]
bodies.ball = {{ mass = 0.1, inertia = [4e-5, 4e-5, 4e-5] }}
[joints.ball]
type = "free"
parent = "base"
child = "ball"
initial = {{ position = [0, 0, {0}], velocity = {1} }}
"""
SOFT = 'type = "hunt_crossley", stiffness = 1e5'
BRISTLES = 'type = "bristles", friction = 0.5, damping = 0'


def falls(laws: tuple[str, ...], height: float = 0.405, velocity: str = "[0, 2, 0, 0.5, 0, 0]") -> str:
    return FREE.format(height, velocity) + contact("floor", FLOOR, 'body = "ball"', *laws)


#: A second body that a link carries along: both masses hit.
TIED = """
[bodies.load]
mass = 3
inertia = [1, 1, 1]
[joints.load]
type = "prismatic"
parent = "base"
child = "load"
axis = [0, 0, 1]
initial = { position = 0.45 }
[constraints.tie]
type = "distance"
first = { body = "ball" }
second = { body = "load", position = [0, 0, 1] }
length = 1.0
"""


def rolls(law: str) -> str:
    """Return the scene of a tyre whose normal force has a law."""
    wheel = FREE.format(0.29, "[0, 65, 0, 20, 0.1, 0]").replace("0.1, inertia = [4e-5, 4e-5, 4e-5]", f"20, {INERTIA}")
    return f"""{wheel}
[contacts.road]
first = {FLOOR}
second = {{ body = "ball", axis = [0, 1, 0] }}
shape = "disc"
radius = 0.31
normal = {{ {law} }}
tangential = {{ type = "brush", coefficients = {{ STIFFNESS = 15, FRICTION = 0.9 }} }}
"""


INERTIA = "inertia = [1, 1, 1]"
SCENES = {
    "drop": RAIL.format(0.45) + contact("floor", FLOOR, 'body = "ball"', LINEAR),
    "rest": RAIL.format(0.39999) + contact("floor", FLOOR, 'body = "ball"', LINEAR),
    "tied": RAIL.format(0.45) + TIED + contact("floor", FLOOR, 'body = "ball"', LINEAR),
    "rise": RAIL.format("0.45, velocity = 30") + contact("floor", FLOOR, 'body = "ball"', LINEAR),
    "coulomb": falls((SOFT, 'type = "coulomb", friction = 0.5, velocity = 0.5')),
    "bristles": falls((SOFT, BRISTLES)),
    "sliding": falls((SOFT, BRISTLES), 0.39954, "[0, 0, 0, 3, 0, 0]"),
    "tyre": rolls('type = "linear", stiffness = "200 kN/m", damping = 500'),
    "tyre in time": rolls('type = "formula", force = "2e5 * deflection * (1 + 0.1 * t) - 500 * rate"'),
    "law of positions": rolls('type = "formula", force = "2e5 * deflection * (1 + q.ball[4])"')
    + contact("roof", FLOOR, 'body = "ball"', 'type = "linear", stiffness = 2e9').replace("0.4", "0.31"),
    "stiff law of a speed": rolls('type = "formula", force = "1e5 * deflection * v.ball[3]**2"'),
    "on a roof": falls((SOFT, BRISTLES)).replace(FLOOR, '{ body = "base", position = [0, 0, 9], axis = [0, 0, -1] }'),
}


@cache
def built(scene: str) -> Model:
    return eomgen.build(scene_of(SCENES[scene]), profile="quick")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "method", "step", "told"),
    [
        ("drop", "rk4", 5e-3, "steps of 0.005 s grow with the normal force of the contact floor, which has a rate of"),
        ("drop", "rk4", 1e-3, ""),
        (
            "drop",
            "trapezoidal",
            2e-3,
            "do not resolve the impact at the contact floor with 0.99 m/s, which lasts 0.0031",
        ),
        ("drop", "trapezoidal", 5e-4, ""),
        (
            "tied",
            "trapezoidal",
            3e-3,
            "do not resolve the impact at the contact floor with 0.99 m/s, which lasts 0.0063",
        ),
        ("tied", "trapezoidal", 1e-3, ""),
        ("rest", "rk4", 5e-3, "grow with the normal force"),
        ("rest", "trapezoidal", 5e-3, ""),
        ("rise", "rk4", 5e-3, ""),
        ("coulomb", "rk4", 1e-3, "grow with the friction of the contact floor"),
        ("coulomb", "rk4", 1e-4, ""),
        ("coulomb", "generalized_alpha", 1e-3, ""),
        ("bristles", "rk4", 1e-3, "grow with the friction of the contact floor"),
        ("bristles", "rk4", 2e-5, ""),
        ("sliding", "rk4", 2e-4, "grow with the friction of the contact floor, which has a rate of 3.06e+04 1/s"),
        ("on a roof", "rk4", 1e-3, ""),
        ("tyre", "rk4", 5e-2, "grow with the friction of the contact road, which has a rate of"),
        ("tyre", "rk4", 1e-3, ""),
        ("tyre in time", "rk4", 5e-2, "grow with the friction of the contact road, which has a rate of"),
        ("law of positions", "rk4", 1e-3, "grow with the normal force of the contact roof"),
        ("stiff law of a speed", "rk4", 5e-3, "grow with the normal force of the contact road"),
        ("stiff law of a speed", "rk4", 1e-3, ""),
    ],
)
def test_steps_are_told_at_the_start(scene: str, method: str, step: float, told: str) -> None:
    run = built(scene).simulate(0.2, step, method=method, error_estimate=False)
    found = [finding for finding in run.findings if finding.name == "contact_step"]
    assert len(found) == bool(told) and all(told in finding.text for finding in found)
    assert all(finding.text in run.message for finding in found)


def test_a_model_for_runs_alone_has_the_functions_of_the_check() -> None:
    """As ``eomgen simulate`` builds models."""
    model = build_for_run(scene_of(SCENES["bristles"]), method="rk4", profile="quick")
    assert "grow with the friction" in model.simulate(0.2, 1e-3, error_estimate=False).message


def test_the_step_of_the_hint_holds_and_the_note_of_a_start_is_the_same() -> None:
    """Of a ball on a spring: R(h s) = 1 at 2.83 of the undamped frequency."""
    model = built("rest")
    (note,) = [str(note) for note in model.start(step=5e-3, method="rk4").notes]
    assert "grow with the normal force" in note
    bound = float(note.rsplit("a step below ", 1)[1].split(" s")[0])
    assert bound == pytest.approx(2.83 / math.sqrt(1e6), rel=0.04)
    assert not model.start(step=0.95 * bound, method="rk4").notes


def test_parameters_of_the_run_count() -> None:
    model = built("rest")
    for stiffness, told in ((1e6, True), (1e5, False)):
        run = model.simulate(0.01, 5e-3, method="rk4", parameters={"k": stiffness}, error_estimate=False)
        assert any(finding.name == "contact_step" for finding in run.findings) is told


def test_a_disc_that_lies_flat_is_no_fault_of_the_check() -> None:
    """It has no single lowest point, so the run stops."""
    text = falls((SOFT,), 0.05, "[0, 0, 0, 0, 0, 0]").replace('"ball" }\nshape = "sphere"', FLAT)
    run = eomgen.build(scene_of(text), profile="quick").simulate(0.1, 1e-3, method="rk4")
    assert "not a number" in run.message


FLAT = '"ball", axis = [0, 0, 1] }\nshape = "disc"'
