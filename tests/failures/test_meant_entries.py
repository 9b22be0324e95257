"""Mistakes in scene files: each answer says what was meant, and what to write in its place."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

import eomgen
from tests.failures.failure import SCENE
from tests.failures.mistakes import changed, scene_of
from tests.failures.test_silent_calls import ROBOT

CORD = '[springs.cord]\nfirst = "tip"\nsecond = "o"\nstiffness = 10\n[points.o]\nbody = "base"\nposition = [0, 0, 3]\n'


def formula(text: str) -> Callable[[], Any]:
    return changed('effort = "motor"', f'effort = "{text}"')


def entry(section: str, text: str) -> Callable[[], Any]:
    return changed("", "", f"\n[{section}]\n{text}\n")


def joint(text: str) -> Callable[[], Any]:
    return changed("axis = [0, 1, 0]", f"axis = [0, 1, 0]\n{text}")


def servo(text: str) -> Callable[[], Any]:
    return entry("controllers.servo", f'type = "pid"\nsignal = "1 - q.shoulder"\ntime_constant = 0.01\n{text}')


def robot(old: str, new: str) -> Callable[[], Any]:
    assert old in ROBOT
    return lambda: scene_of(ROBOT.replace(old, new, 1), "r.urdf")


MEANT: list[tuple[Callable[[], Any], str]] = [
    (changed('mass = "1 + load"', "mass = 2 kg"), 'try: mass = "2 kg": a number with a unit is a text'),
    (changed("value = 0.5,", "value = 0.5 m,"), 'try: value = "0.5 m": a number with a unit is a text'),
    (changed('mass = "1 + load"', "mass = .5"), "try: 0.5 with a decimal point"),
    (changed("value = 0.5,", "value = 1e6, more = -.5,"), "try: -0.5 with a decimal point"),
    (changed('"1 + load"', '"2,5"'), "operation or a function (column 1); try: 2.5 with a decimal point"),
    (changed("[parameters]", '[parameters]\nhalf = "length / 2"'), "a number is needed here, not 'length / 2'; tr"),
    (changed('"2 * sin(t)"', '"2 * g * sin(t)"'), "unknown name 'g' (column 5); try: 9.81, or a parameter: g = {"),
    (joint("rotation = [90, 0, 0]"), 'try: rotation = [{ axis = [1, 0, 0], angle = "90 deg" }]'),
    (joint("rotation = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]"), "this is a matrix, and a list of turns about axes is "
        "needed; try: orientation, which is a matrix"),
    (joint("friction = { mu_s = 0.3, velocity = 0.01 }"), "the key 'mu_s' is unknown here; try: static"),
    (joint("friction = { mu = 0.3, velocity = 0.01 }"), "'mu' is unknown here; try: coulomb, a force in N or a to"),
    (joint('mimic = "elbow"'), "a table is needed here, not 'elbow'; try: mimic = { joint = \"elbow\", multiplier"),
    (entry("base", "follow = true"), 'not a boolean (true); try: follow = { waves = "NAME" }'),
    (entry("links.c", "mass = 1"), "the key 'links' is unknown here; try: bodies"),
    (servo("kp = 20"), "the key 'kp' is unknown here; try: proportional"),
    (entry("controllers.hold", 'type = "state_feedback"\ncoordinates = ["shoulder"]\nposition_gains = [400]'),
        "a table is needed here, not a list; try: position_gains = { JOINT = 400 }"),
    (entry("inputs.u", 'wave = { shape = "sine", period = 2 }'), "'sine' is not known here; try: formula = \"sin("),
    (entry("forces.push", 'body = "tip"\nforce = [1, 0, 0]'), "(forces.push.body): tip is a point of upper, not a"),
    (robot('xyz="0 0 0.2"', 'xyz="0,0,0.2"'), "3 numbers are needed here, not '0,0,0.2'; try: blanks between the "
        "numbers: 0 0 0.2"),
    (changed('"revolute"', '"ball"'), "'ball' is not known here; try: spherical"),
    (changed('tip = { position = "tip" }', 'f = { reaction_force = "cord" }', CORD),
        "cord is in [springs], and no joint, constraint or reaction"),
    (formula("dq.shoulder"), "unknown quantity 'dq' (column 1); try: v.shoulder"),
    (formula("shoulder.q"), "unknown quantity 'shoulder' (column 1); try: q.shoulder"),
    (formula("q_shoulder"), "unknown name 'q_shoulder' (column 1); try: q.shoulder"),
    (formula("theta"), "try: q.shoulder or v.shoulder, a coordinate or a velocity, or one of"),
    (formula("q[0]"), "have parts (column 1); try: q.shoulder"),
    (formula("tip"), "unknown name 'tip' (column 1); try: position.tip[0]"),
    (formula("sin(time)"), "unknown name 'time' (column 5); try: t"),
    (formula("sind(t)"), "try: sin(x * pi / 180): angles are in radians"),
    (formula("step(t - 1)"), "unknown function 'step' (column 1); try: 1 if t > 1 else 0"),
    (formula("integral(t)"), 'try: a state of its own: [states] and NAME = { rate = "..." }'),
    (formula("delay(t, 1)"), "try: a sampled state: [states.NAME] with sample, formula and delay"),
    (formula("t > 1 ? 2 : 0"), "the character '?' is not part of formulas (column 7); try: 2 if t > 1 else 0"),
    (changed('name = "arm"', 'name = "arm"\ngravity = 9.81'), "not 9.81; try: gravity = [0, 0, -9.81]"),
    (changed("value = 0.5,", "value = 0,5,"), "try: 0.5 with a decimal point"),
    (entry("bodies.upper", "mass = 1"), "try: one table, or one key, of each name"),
    (changed('{ formula = "2 * sin(t)", unit = "N m" }', '{ table = "road.csv" }'),
        "a table is needed here, not 'road.csv'; try: table = { file = \"road.csv\" }"),
    (changed('{ formula = "2 * sin(t)", unit = "N m" }', '"sin(t)"'), 'try: motor = { formula = "sin(t)" }'),
    (changed('{ position = "tip" }', '"tip"'), 'try: tip = { formula = "..." }, or { position = "POINT" }'),
    (entry("curves.road", 'file = "road.csv"'), "the key 'file' is unknown here; try: table = {"),
    (entry("simulation", "dt = 1e-3"), "the key 'dt' is unknown here; try: step"),
    (entry("base", 'z = "0.1 * sin(t)"'), 'try: position = [0, 0, "0.1 * sin(t)"]'),
]  # fmt: skip  # a table


@pytest.mark.parametrize(("call", "piece"), MEANT)
def test_what_was_meant_is_told(call: Callable[[], Any], piece: str) -> None:
    with pytest.raises(eomgen.EomgenError) as caught:
        call()
    assert piece in str(caught.value)


@pytest.mark.parametrize(
    ("call", "piece"),
    [
        (changed('unit = "N m" }', 'unit = "N" }'), "efforts.motor.effort: 'motor' is a force, a torque in N m is"),
        (changed('unit = "kg"', 'unit = "kilo"'), "parameters.load.unit: 'kilo' is not a known unit"),
        (changed('[0, 0, "-length / 2"]', '["10 mm", 0, -250]'), "bodies.upper.center_of_mass[2]: -250 has no unit,"),
    ],
)
def test_what_is_hardly_meant_is_noted(call: Callable[[], Any], piece: str) -> None:
    notes = " ".join(call())
    assert piece in notes, notes


def test_labels_that_fit_are_not_noted() -> None:
    assert not scene_of(SCENE).notes
    fitting = ('unit = "kg"', 'unit = "-"'), ('[0, 0, "-length / 2"]', '["10 mm", 0, "-length"]')
    for old, new in fitting:
        assert not changed(old, new)()
