"""States and controllers of scene files: what is read, and what is refused with which words."""

from __future__ import annotations

from pathlib import Path

import pytest

from eomgen.errors import DescriptionError
from eomgen.formula.nodes import Number, Operation, Symbol
from eomgen.scene.load import from_data, load, load_toml
from eomgen.scene.scene import Scene

ARM = """\
format = 1
name = "arm"
bodies.link = { mass = 1.0, center_of_mass = [0, 0, -0.5], inertia = [0.1, 0.1, 0.1] }
joints.pin = { type = "revolute", parent = "base", child = "link", axis = [0, 1, 0] }
[parameters]
gain = { value = 3.0, tunable = true }
lag = 0.02
[inputs]
wanted = { formula = "sin(t)" }
[points]
tip = { body = "link", position = [0, 0, -1] }
wall = { body = "base", position = [1, 0, 0] }
"""


def read(text: str) -> Scene:
    return load_toml(ARM + text, file="arm.toml")


def problems(text: str) -> list[str]:
    with pytest.raises(DescriptionError) as caught:
        read(text)
    return [str(problem).split(": ", 1)[1] for problem in caught.value.problems]


def walk(formula: object) -> list[object]:
    return [formula, *(x for a in formula.arguments for x in walk(a))] if isinstance(formula, Operation) else [formula]


def test_a_controller_is_states_and_a_formula() -> None:
    scene = read(
        '[controllers.servo]\ntype = "pi"\nsignal = "wanted - q.pin"\nproportional = "gain"\n'
        'integral = 5\ninitial = 0.5\nunit = "N m"\n'
    )
    (state,), (controller,) = scene.states, scene.controllers
    assert (state.name, state.initial, state.unit) == ("servo_integral", 0.5, "N m")
    e = Operation("sub", (Symbol("input", "wanted"), Symbol("q", "pin")))
    assert state.rate == Operation("mul", (Number(5), e))
    kp = Symbol("parameter", "gain")
    assert controller.output == Operation("add", (Operation("mul", (kp, e)), Symbol("state", "servo_integral")))


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ('"sky_hook"', "'sky_hook' is not known here; try: skyhook"),
        ('"low_pass", time_constant = "lag - 0.02"', "the time constant 0 s is not positive"),
        ('"pi", integral = 2, maximum = 1', "limits need a tracking time if proportional/integral = 0/2 is none"),
        ('"pi", integral = 2, maximum = 1, tracking = 0', "the tracking time 0 s is not positive; try: 0.1"),
    ],
)
def test_controllers_that_cannot_be(keys: str, message: str) -> None:
    signal = "" if "signal" in keys else ", signal = 1"
    [found] = problems(f"[controllers]\nc = {{ type = {keys}{signal} }}\n")
    assert found.startswith(message), found


def test_a_controller_has_a_name_of_its_own() -> None:
    [found] = problems('[controllers]\ngain = { type = "pi", signal = 1 }\n')
    assert found.startswith("the name gain is both a parameter and a controller; try: another name")


def test_loops_through_several_and_through_springs_are_named() -> None:
    several = (
        '[controllers]\na = { type = "pi", signal = "b" }\n'
        'b = { type = "lead_lag", signal = "2 * d", time_constant = 1, lead = 1 }\n'
    )
    (found,) = problems(several + 'd = { type = "pi", signal = "a - q.pin" }\n')
    chain = "controllers.a uses controllers.b uses controllers.d uses controllers.a"
    assert found.startswith(f"an algebraic loop: {chain}, with no state between; try: "), found
    assert read(several + 'd = { type = "low_pass", signal = "a - q.pin", time_constant = 1 }\n').controllers
    spring = '[springs.rope]\nfirst = "tip"\nsecond = "wall"\nstiffness = 10\nforce = "pull"\n'
    (found,) = problems(spring + '[controllers]\npull = { type = "pi", signal = "1 - tension.rope" }\n')
    assert found.startswith("an algebraic loop: controllers.pull uses tension.rope uses controllers.pull, "), found
    lag = '[controllers]\npull = { type = "low_pass", signal = "1 - tension.rope", time_constant = 1 }\n'
    assert read(spring + lag).springs


def test_states_that_controllers_make_have_names_of_their_own() -> None:
    (found,) = problems('[states]\nc_integral = { rate = 1 }\n[controllers]\nc = { type = "pi", signal = 1 }\n')
    assert found.startswith(
        "the controller makes a state c_integral, and there is a state of that name; try: another name"
    )
    long = "c" * 60
    (found,) = problems(f'[controllers]\n{long} = {{ type = "pi", signal = 1 }}\n')
    assert found.startswith("the controller makes a state 'cccc")
    assert "whose name is too long; try: a shorter name" in found


def test_states_can_be_given_as_data() -> None:
    data = {
        "format": 1, "name": "d", "bodies": {"b": {"mass": 1}}, "states": {"x": {"rate": "-x"}},
        "joints": {"j": {"type": "prismatic", "parent": "base", "child": "b", "axis": [1, 0, 0]}},
    }  # fmt: skip  # a table
    assert from_data(data).states[0].name == "x"


@pytest.mark.parametrize(
    ("name", "fault"),
    [
        ("law.c", r"the file is not UTF-8; try: the file saved in UTF-8$"),
        ("absent.c", r"cannot be read: No such file or directory; try: "),
    ],
)
def test_a_fault_of_a_file_of_code_has_its_line_in_the_scene(tmp_path: Path, name: str, fault: str) -> None:
    (tmp_path / "law.c").write_bytes(b"\xff")
    scene = tmp_path / "arm.toml"
    text = 'type = "sampled"\nsample = 0.01\nsignals = { angle = "q.pin" }\nfunction = "held"\n'
    scene.write_text(f'{ARM}[controllers.held]\n{text}source = "{name}"\n', encoding="utf-8")
    with pytest.raises(DescriptionError, match=rf"arm\.toml:\d+ \(controllers\.held\.source\): .*{fault}"):
        load(scene)
