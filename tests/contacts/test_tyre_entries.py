"""Tyres in scene files: what is read, what it defaults to, and every message."""

from __future__ import annotations

import pytest

from eomgen.errors import DescriptionError
from eomgen.formula.nodes import Symbol
from eomgen.scene.load import load_toml
from eomgen.scene.scene import Scene

WHEEL = """\
format = 1
name = "wheel"
bodies.wheel = { mass = 1, inertia = [0.1, 0.1, 0.1] }
joints.wheel = { type = "free", parent = "base", child = "wheel" }
parameters.soft = { value = 1e4, tunable = true }
inputs.lift = {}
points.hub = { body = "wheel" }
points.rim = { body = "wheel", position = [0.3, 0, 0] }
points.stone = { body = "base" }
"""
TYRE = """[tyres.front]
center = "hub"
radius = 0.3
stiffness = "soft"
"""


def read(keys: str = "", tyre: str = TYRE) -> Scene:
    return load_toml(WHEEL + tyre + keys, file="wheel.toml")


def problem(keys: str, tyre: str = TYRE) -> str:
    with pytest.raises(DescriptionError) as caught:
        read(keys, tyre)
    assert len(caught.value.problems) == 1, str(caught.value)
    return str(caught.value.problems[0]).partition(" (")[2]


def test_load_and_deflection_are_words_of_formulas() -> None:
    scene = read('[outputs]\nload = { formula = ["load.front", "deflection.front"] }')
    assert scene.outputs[0].values == (Symbol("load", "front"), Symbol("deflection", "front"))


OWN = "is not x or y of the road's own wheel; try: position.hub[0] or position.hub[1]"


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ("damping = -1", ".damping): the damping of a tyre is -1; try: 0 or more"),
        ("onset = 0", ".onset): the onset of a tyre is 0; try: a number above 0"),
        ('road = "0.1 * position.hub[2]"', f".road): position.hub[2] {OWN}"),
        ('road = "lift"\ndamping = 5', "): the damping needs the rate of the road, which does not follow"),
        ('road = "sin(position.hub[0])"\nroad_rate = "lift"', ".road_rate): no input moves the road,"),
        ("slip = { stiffness = [1, 2, 3] }", ".slip.stiffness): one stiffness, or two, longitudinal and lateral,"),
        ("slip = { stiffness = [1, -2] }", ".slip.stiffness[1]): a slip stiffness is -2; try: 0 or more"),
        ("slip = { stiffness = 1, friction = 0 }", ".slip.friction): the friction of a tyre is 0; try: a number above"),
        ("slip = { stiffness = 1, velocity = 0 }", ".slip.velocity): the velocity of a slip is 0; try: a number above"),
        ("slip = { stiffness = 1, axis = [0, 0, 0] }", ".slip.axis): the axis has no direction; try: an axis such as"),
    ],
)
def test_messages(keys: str, message: str) -> None:
    assert problem(keys).startswith(f"tyres.front{message}")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [('"hub"', '"stone"', ".center): the point stone is on the base, on which a wheel's force has no effect")],
)
def test_messages_on_what_is_needed(old: str, new: str, message: str) -> None:
    assert problem("", TYRE.replace(old, new)).startswith(f"tyres.front{message}")


def test_loads_of_unknown_tyres_are_refused() -> None:
    message = "outputs.load.formula[0]): load.frnt: there is no tyre 'frnt' (column 1); try: front"
    assert problem('[outputs]\nload = { formula = "load.frnt" }') == message
