"""Comparisons of descriptions with other frames, other formats and other readers; the command, and its refusals."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import sympy
from click.testing import CliRunner
from sympy.physics import mechanics as me

import eomgen
from eomgen.base.verbs import own
from eomgen.scene.load import load_toml
from tests.comparison.test_planted_differences import MJCF, SCENE, URDF

PI_SERVO = Path(__file__).parents[2] / "examples" / "pi_servo"
TWIN = Path(__file__).with_name("twin.xml")


def written(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


def run(*arguments: object) -> tuple[int, str]:
    """Return exit code and output of the command."""
    verb = next(verb for verb in own() if verb.name == "compare")
    command = verb.imported(verb.command, callable, "command")
    result = CliRunner().invoke(command, [str(item) for item in arguments], standalone_mode=False)
    assert result.exception is None, result.exception
    return result.return_value, result.output


def test_a_scene_equals_itself_as_data_and_as_scene(tmp_path: Path) -> None:
    path = written(tmp_path / "four_bar.toml", SCENE)
    comparison = eomgen.compare(path, eomgen.load(path), states=2)
    assert comparison.equal
    assert comparison.first is None
    assert comparison.matched == 3
    assert comparison.errors == {"mass matrix": 0.0, "bias": 0.0, "force": 0.0}
    assert comparison.summary.startswith("four_bar.toml and four_bar are equal in 3 joints")


def test_other_programs_read_the_same_machine(tmp_path: Path) -> None:
    """MuJoCo a URDF, an MJCF with springs, and free and ball joints; Pinocchio a URDF: to 1e-12 at ten states."""
    pytest.importorskip("mujoco")
    urdf, mjcf = written(tmp_path / "arm.urdf", URDF), written(tmp_path / "arm.xml", MJCF)
    for path, reader in ((urdf, "mujoco"), (urdf, "pinocchio"), (mjcf, "mujoco"), (TWIN, "mujoco")):
        comparison = eomgen.compare(path, reader=reader, tolerance=1e-9)
        assert comparison.equal, str(comparison)
        assert max(comparison.errors.values()) < 1e-12, (path.name, reader)


def test_options_of_the_caller_are_heeded_or_refused(tmp_path: Path) -> None:
    first = written(tmp_path / "a.urdf", URDF)
    second = written(tmp_path / "b.urdf", URDF.replace('friction="0.2"', 'friction="0.3"').replace('"1.5"', '"1.4"'))
    for options, expected in (
        ({}, {"coulomb", "upper"}),
        ({"limits": False}, {"coulomb"}),
        ({"friction": False}, {"upper"}),
    ):
        found = eomgen.compare(first, second, states=2, **options)
        assert {item.quantity for item in found.differences} == expected
    with pytest.raises(eomgen.UsageError, match=r"limits, friction, .* are for URDF only"):
        eomgen.compare("examples/robot_arm/scene.toml", second, reader="pinocchio", limits=True)


SERVO = """<mujoco model="two"><worldbody>
  <body name="a"><joint name="x" type="slide" axis="1 0 0"/><inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/></body>
</worldbody><actuator>
  <position name="servo" joint="x" kp="30" kv="2"/>
</actuator></mujoco>
"""


def test_an_actuator_of_one_description_alone(tmp_path: Path) -> None:
    """The force of a position servo at zero control is -kp q - kv v, the force of a motor is zero."""
    pytest.importorskip("mujoco")
    plain = written(tmp_path / "plain.xml", SERVO.partition("<actuator>")[0] + "</mujoco>")
    servo = written(tmp_path / "servo.xml", SERVO)
    comparison = eomgen.compare(servo, plain)
    assert [str(item) for item in comparison.differences] == [
        "efforts.x_actuation: element is effort and absent (servo.xml:4)"
    ]
    assert comparison.notes == ("inputs of one description alone are zero: servo",)
    other = eomgen.compare(plain, servo).first
    assert other is not None and str(other) == "efforts.x_actuation: element is absent and effort (servo.xml:4)"
    text = SERVO.replace('<position name="servo" joint="x" kp="30" kv="2"/>', '<motor name="servo" joint="x"/>')
    motor = eomgen.compare(written(tmp_path / "motor.xml", text), plain)
    assert motor.equal
    assert motor.notes[0] == "efforts.x_actuation is in one description alone, without an effect at zero inputs"


def test_differences_have_the_lines_of_their_elements(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    first = Path(__file__).with_name("two_arms.xml")
    changes = (('mass="2"', 'mass="3"'), ('damping="1"', 'damping="2"'), ('mass="1"', 'mass="5"'), ('"4"', '"6"'))
    changed = first.read_text(encoding="utf-8")
    for old, new in changes:
        changed = changed.replace(old, new)
    found = eomgen.compare(first, written(tmp_path / "second.xml", changed))
    lines = {(item.element, item.quantity): item.places for item in found.differences}
    for element, quantity, line in (
        *(("bodies.upper", "mass", 3), ("bodies.body_2", "mass", 4)),
        *(("joints.elbow", "damping", 5), ("bodies.other", "mass", 9)),
    ):
        assert lines[element, quantity] == (f"two_arms.xml:{line}", f"second.xml:{line}")


def test_the_command_has_exit_codes_and_json(tmp_path: Path) -> None:
    path = written(tmp_path / "four_bar.toml", SCENE)
    changed = written(tmp_path / "other.toml", SCENE.replace("mass = 2.0", "mass = 2.5"))
    code, output = run(path, changed, "--json")
    data = json.loads(output)
    assert code == 4
    assert not data["equal"]
    assert [data["differences"][0][key] for key in ("element", "quantity", "first", "second", "unit")] == [
        *("bodies.coupler", "mass", 2.0, 2.5, "kg")
    ]
    assert data["differences"][0]["places"] == ["four_bar.toml:10", "other.toml:10"]
    code, output = run(path, changed)
    assert code == 4
    assert "bodies.coupler" in output


def test_states_of_controllers_have_the_line_of_the_controller() -> None:
    """Places of formulas are no differences: the samples of both files differ, and the lines of two sections too."""
    scene = PI_SERVO / "scene.toml"
    text = scene.read_text(encoding="utf-8")
    other = load_toml(text.replace("integral = 12", "integral = 99"), file="other.toml")
    (one,) = eomgen.compare(scene, other, states=2).differences
    line = text[: text.index("[controllers.position]")].count("\n") + 1
    assert one.element == "states.position_integral" and one.places == (f"scene.toml:{line}", f"other.toml:{line}")
    sampled = PI_SERVO / "sampled.toml"
    moved = load_toml("# one line more\n" + sampled.read_text(encoding="utf-8"), file="moved.toml")
    assert eomgen.compare(sampled, moved, states=2).equal


def test_refusals(tmp_path: Path) -> None:
    path = written(tmp_path / "four_bar.toml", SCENE)
    light = written(tmp_path / "arm.urdf", URDF.replace("</robot>", "<gazebo/></robot>"))
    cases = (
        (lambda: eomgen.compare(path), "one description has no second one to be compared with"),
        (lambda: eomgen.compare(path, path, states=0), "states: a whole number from 1 on is needed, not 0"),
        (lambda: eomgen.compare(path, path, seed=-1), "seed: a whole number from 0 on is needed, not -1; try: 0"),
        (lambda: eomgen.compare(path, path, tolerance=0.0), "0.0 would call rounding a difference"),
        (lambda: eomgen.compare(path, eomgen.load(path), reader="mujoco"), "mujoco reads files, not Scene objects"),
        (lambda: eomgen.compare(path, reader="bullet"), "there is no reader 'bullet'"),
        (lambda: eomgen.compare(light, light, strict=True), "not modelled: <gazebo>"),
    )  # fmt: skip  # pairs
    for call, text in cases:
        with pytest.raises((eomgen.UsageError, eomgen.DescriptionError), match=text):
            call()


def test_constraints_are_unknown_to_a_second_reader(tmp_path: Path) -> None:
    held = TWIN.read_text(encoding="utf-8").replace(
        "</worldbody>", '</worldbody><equality><connect body1="rod" anchor="0 0 -0.4"/></equality>'
    )
    comparison = eomgen.compare(written(tmp_path / "held.xml", held), reader="mujoco")
    assert comparison.equal and not comparison.differences


def oscillator(name: str = "x", mass: float = 2.0) -> eomgen.Scene:
    builder = eomgen.SceneBuilder("oscillator").body("load", mass, inertia=[0.1, 0.1, 0.1])
    return builder.joint(name, "prismatic", "base", "load", axis=[1, 0, 0], stiffness=8.0).build()


def test_equations_alone_are_named_as_the_joints() -> None:
    """Their gravity and constraints count as equal, and the sum of their forces is compared."""
    x, (m, k) = me.dynamicsymbols("x"), sympy.symbols("m k")
    method = me.LagrangesMethod(m * x.diff() ** 2 / 2 - k * x**2 / 2, [x])
    document = eomgen.from_sympy(method, parameters={m: 2.0, k: 8.0}, name="spring")
    comparison = eomgen.compare(oscillator(), document, tolerance=1e-12, states=3)
    assert comparison.equal and comparison.errors.keys() == {"mass matrix", "sum"}
    heavier = eomgen.compare(oscillator(mass=2.5), document, states=3).first
    assert heavier is not None and (heavier.element, heavier.first, heavier.second) == ("M[x, x]", 2.5, 2.0)
    with pytest.raises(
        eomgen.UsageError, match="the coordinates of spring are x; try: coordinates named as the joints: y"
    ):
        eomgen.compare(oscillator("y"), document)
    with pytest.raises(eomgen.UsageError, match="equations alone have no bodies"):
        eomgen.compare(document, oscillator())
    assert "1 difference, the first: M[x, x]: mass matrix is 2.5 and 2" in str(
        eomgen.compare(oscillator(mass=2.5), document, states=3)
    )
