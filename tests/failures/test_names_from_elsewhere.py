"""What other tools call things: keys, functions, attributes and options are answered with what they are called here."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest

import eomgen
from eomgen.base.calls import attributes_elsewhere
from eomgen.cli import VERBS, commands, main
from eomgen.cli.mistakes import verb_remedy
from eomgen.toolchain.profiles import PROFILES
from tests.failures.failure import SCENE, tables_of_products
from tests.failures.mistakes import arm, changed, scene_of
from tests.failures.test_what_was_meant import SERVO, refused

pytestmark = pytest.mark.slow


def formula(text: str) -> Callable[[], Any]:
    return changed('effort = "motor"', f'effort = "{text}"')


def entry(section: str, text: str) -> Callable[[], Any]:
    return changed("", "", f"\n[{section}]\n{text}\n")


@pytest.mark.parametrize(
    ("call", "piece"),
    [
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
        (
            changed('name = "arm"', 'name = "arm"\ngravity = 9.81'),
            "not 9.81; try: gravity = [0, 0, -9.81]",
        ),
        (changed("value = 0.5,", "value = 0,5,"), "try: 0.5 with a decimal point"),
        (entry("bodies.upper", "mass = 1"), "try: one table, or one key, of each name"),
        (
            changed('{ formula = "2 * sin(t)", unit = "N m" }', '{ table = "road.csv" }'),
            "a table is needed here, not 'road.csv'; try: table = { file = \"road.csv\" }",
        ),
        (changed('{ formula = "2 * sin(t)", unit = "N m" }', '"sin(t)"'), 'try: motor = { formula = "sin(t)" }'),
        (changed('{ position = "tip" }', '"tip"'), 'try: tip = { formula = "..." }, or { position = "POINT" }'),
        (entry("curves.road", 'file = "road.csv"'), "the key 'file' is unknown here; try: table = {"),
        (entry("simulation", "dt = 1e-3"), "the key 'dt' is unknown here; try: step"),
        (entry("base", 'z = "0.1 * sin(t)"'), 'try: position = [0, 0, "0.1 * sin(t)"]'),
        (lambda: arm().step(0.1), "a Model has no 'step'; try: start(step=...), whose step(u) takes one step"),
        (lambda: arm().q, "try: simulate(...).q, of a motion; a model has initial_q"),
        (
            lambda: arm().parameters.__setitem__("load", 2.0),
            "the defaults, which do not change; try: simulate(",
        ),
        (
            lambda: arm().simulate(0.01, 1e-3).outputs.tip,
            "none of the attributes; try: ['tip'] in place of .tip",
        ),
        (lambda: arm().simulate(0.1, 1e-3, initial={"q": [1, 2]}), "try: 1 number; q_names, v_names and states of"),
    ],
)
def test_what_it_is_called_here_is_told(call: Callable[[], Any], piece: str) -> None:
    text = refused(call)
    assert piece in text, text


@pytest.mark.parametrize(
    ("call", "piece"),
    [
        (
            changed('unit = "N m" }', 'unit = "N" }'),
            "efforts.motor.effort: 'motor' is a force, a torque in N m is expected, and a label does not convert",
        ),
        (changed('unit = "kg"', 'unit = "kilo"'), "parameters.load.unit: 'kilo' is not a known unit"),
        (
            changed('[0, 0, "-length / 2"]', '["10 mm", 0, -250]'),
            "bodies.upper.center_of_mass[2]: -250 has no unit, unlike neighbouring entries, so it is -250 m",
        ),
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


def of_each_kind() -> dict[str, Any]:
    """Return an object of each class whose attributes have other names elsewhere."""
    things = [arm(), arm().simulate(0.01, 1e-3), arm().start(step=1e-3), eomgen.SceneBuilder("arm")]
    for objects in tables_of_products("objects_with_names"):
        things += objects()
    return {"": eomgen, **{type(thing).__name__: thing for thing in things}}


def test_names_of_elsewhere_are_none_of_ours_and_lead_to_ours() -> None:
    things = of_each_kind()
    assert set(things) == set(attributes_elsewhere())
    for kind, hints in attributes_elsewhere().items():
        for name, hint in hints.items():
            assert not hasattr(things[kind], name), f"{kind}.{name}"
            first = re.findall(r"[\w.]+", hint)[0]
            owner = eomgen if first.startswith("eomgen.") else things[kind]
            *parts, word = first.removeprefix("eomgen.").split(".")
            for part in parts:
                owner = getattr(owner, part)
            # a property may refuse a scene that has nothing of its kind
            assert hasattr(type(owner), word) or hasattr(owner, word), f"{kind}.{name}: {hint}"


def test_the_length_of_a_solution_is_its_rows() -> None:
    solution = arm().simulate(0.01, 1e-3)
    assert len(solution) == len(solution.t) == 11
    assert np.array([solution, solution], dtype=object).shape == (2,)


def test_a_controller_that_keeps_something_itself_is_not_judged_by_repeating_it() -> None:
    """Steps of 0.05 s of a pendulum that a motor starts: growth by its equations, which cannot be looked at again."""
    model = eomgen.build(scene_of(SCENE + SERVO.replace("memory = 1\n", "")), profile="quick")
    run = model.simulate(0.1, 0.05, controllers={"servo": lambda t, signals: 0.0})
    assert run.success and run.v[-1, 0] > 3.0 * run.v[1, 0] > 0.0 and "unstable" not in run.message


@pytest.mark.parametrize(
    ("words", "piece"),
    [
        (["run", "scene.toml"], "there is no verb 'run'; try: simulate"),
        (["scene.toml"], "try: eomgen info scene.toml, or another verb before the scene: info, compare, generate,"),
        (
            ["simulate", "--out", "o"],
            "missing argument 'SCENE'; try: the path of a .toml scene, a .urdf file, an .xml file of",
        ),
        (["simulate", "s.toml", "--out", "o", "--dt", "1"], "try: --step; eomgen simulate --help lists all"),
        (["simulate", "s.toml", "--out", "o", "--t-end", "2 kg"], "--t-end: '2 kg' is a mass, a time in s is expected"),
        (["simulate", "s.toml", "--out", "o", "--step", "small"], "--step: 'small' is not a time; try: 2, or \"2 s\""),
    ],
)
def test_words_of_a_command_line(words: list[str], piece: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(words) == 2
    assert piece in capsys.readouterr().err


def test_a_command_line_takes_times_with_units_and_a_profile(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "scene.toml").write_text(SCENE)
    words = ["simulate", str(tmp_path / "scene.toml"), "--out", str(tmp_path / "o"), "--no-plots", "--profile", "quick"]
    assert main([*words, "--t-end", "20 ms", "--step", "0.01"]) == 0
    assert "reached t = 0.02 s in 2 steps" in capsys.readouterr().err
    for verb in ("simulate", "equilibrium", "linearize"):
        command = commands.get_command(click.Context(commands), verb)
        assert command is not None
        option = next(item for item in command.params if item.name == "profile")
        assert isinstance(option.type, click.Choice) and set(option.type.choices) == set(PROFILES)


def test_verbs_of_elsewhere_lead_to_ours() -> None:
    assert {verb_remedy(word, VERBS) for word in ("sim", "modes", "compile", "validate", "view", "trim")} <= set(VERBS)
