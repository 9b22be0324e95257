"""Mistakes in names, values, files and calls: each answer says what was meant, and what to write in its place."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.cli import main
from tests.failures.failure import SCENE
from tests.failures.mistakes import arm, changed, run_of, scene_of, slider
from tests.failures.test_silent_calls import ROBOT
from tests.models.urdf import load_urdf

pytestmark = pytest.mark.slow


SERVO = """
[controllers.servo]
type = "sampled"
sample = "10 ms"
signals = { error = "0.1 - q.shoulder", speed = "v.shoulder" }
memory = 1
[efforts.servo]
joint = "shoulder"
effort = "servo"
"""
CORD = '[springs.cord]\nfirst = "tip"\nsecond = "o"\nstiffness = 10\n[points.o]\nbody = "base"\nposition = [0, 0, 3]\n'
ORDER = "signals[0] = error, signals[1] = speed, and memory is an array of 1"


@cache
def servo_model() -> eomgen.Model:
    return eomgen.build(scene_of(SCENE + SERVO), profile="quick")


def refused(call: Callable[[], Any]) -> str:
    with pytest.raises(eomgen.EomgenError) as caught:
        call()
    return str(caught.value)


@cache
def solution() -> eomgen.Solution:
    return arm().simulate(0.01, 1e-3)


@pytest.mark.parametrize(
    ("call", "piece"),
    [
        (lambda: arm().nle, "a Model has no 'nle'; try: coupling(q, v) - force(q, v), since forces hold gravity"),
        (lambda: arm().gravity, "a Model has no 'gravity'; try: force(q, v), which holds gravity"),
        (lambda: arm().rhs([0.1, 0.0], 0.0), "rhs: the time comes first, and then the state; try: rhs(t, y)"),
        (lambda: arm().point("upper", [0.1]), "try: point(body, r, q): r is a place in the body's axes"),
        (lambda: arm().start(step=1e-3).u, "a Simulator has no 'u'; try: inputs"),
        (lambda: arm().start(step=1e-3).step(dt=1e-3), "there is no argument 'dt'; try: model.start(step=...)"),
        (
            lambda: arm().start(step=1e-3).set_parameter({"load": 1.0}),
            "the argument value is missing; try: set_parameter(\"load\", 0.5), or set_parameters({",
        ),
        (lambda: eomgen.build("r.urdf", root="free"), "try: eomgen.build(eomgen.load(path, root=...))"),
        (lambda: eomgen.build("s.toml", parameters={"length": 1.0}), "eomgen.build(scene).simulate(parameters=...)"),
        (
            lambda: eomgen.load(SCENE),
            "path: the path of a file is needed, and 'format = 1\\nname = \"arm\"\\n\\n[parameters]\\nlengt...' is a "
            "text of several lines; try: the path of a file that holds the text, or load(tomllib.loads(text))",
        ),
        (lambda: eomgen.load(ROBOT), "is a text of several lines; try: the path of a file that holds the text"),
        (lambda: eomgen.load("run.npz"), "try: eomgen.Solution.load('run.npz'), if it is a solution"),
        (
            lambda: eomgen.load("package://two/robot.urdf"),
            "try: a path of the file system: no ROS is asked where package://two is",
        ),
        (lambda: solution().parameters, "a Solution has no 'parameters'; try: metadata[\"parameters\"]"),
        (lambda: solution().tip, "a Solution has no 'tip'; try: [\"tip\"] in place of .tip"),
    ],
)  # fmt: skip  # a table
def test_what_was_meant_is_told(call: Callable[[], Any], piece: str) -> None:
    text = refused(call)
    assert piece in text, text


def test_attributes_are_listed_once() -> None:
    assert len(set(dir(solution()))) == len(dir(solution()))


def test_the_home_folder_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "arm.toml").write_text(SCENE, encoding="utf-8")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert eomgen.load("~/arm.toml").name == "arm"
    assert eomgen.load(Path("~/arm.toml")).name == "arm"


@pytest.mark.parametrize(
    ("path", "hint"),
    [
        ("amr.toml", "{folder}/arm.toml"),
        ("other/arm.toml", "another path: there is no folder '{folder}/other'"),
        ("zzz.toml", "another path"),
    ],
)
def test_files_of_names_like_one_that_is_missing(path: str, hint: str, tmp_path: Path) -> None:
    (tmp_path / "arm.toml").write_text(SCENE, encoding="utf-8")
    text = refused(lambda: eomgen.load(tmp_path / path))
    assert text.endswith(f"cannot be read: No such file or directory; try: {hint.format(folder=tmp_path)}"), text


def test_a_scene_without_its_ending(tmp_path: Path) -> None:
    (tmp_path / "arm.toml").write_text(SCENE, encoding="utf-8")
    text = refused(lambda: eomgen.load(tmp_path / "arm"))
    assert text.endswith(f"there is no file '{tmp_path}/arm'; try: {tmp_path}/arm.toml"), text
    assert refused(lambda: eomgen.load("")).endswith(
        "try: a .toml scene, a .urdf file, an .xml file of MuJoCo or an .sdf file"
    )


RUN = "--out o --no-plots"


@pytest.mark.parametrize(
    ("words", "answer"),
    [
        (f"simulate s.toml {RUN} --duration 1", "no such option '--duration'; try: --t-end; eomgen simulate --help"),
        (f"simulate s.toml {RUN} --set load=0.5,motor=2", "try: --set load=0.5 --set motor=2"),
        (f"simulate s.toml {RUN} --set motor=2", "--set motor: motor is an input; try: --input motor=2"),
        (f"simulate s.toml {RUN} --input motor=sin(t)", 'try: [inputs] motor = { formula = "sin(t)" } in the scene'),
        (f"simulate s.toml t.toml {RUN}", "unexpected extra argument (t.toml); try: one scene, and a command for each"),
        (f"simulate r.urdf {RUN} --set rod_mass=5", "inertia of rod are fixed in the code; try: --tunable rod, which"),
        ("info s.toml --terms mass force", "argument (force); try: --terms mass,force, with commas; eomgen info"),
        ("info r.urdf --root floating", "'floating' is not one of 'fixed', 'free'; try: --root free; eomgen info"),
        ("info r.urdf --lock lift,lift", "r.urdf has no joint 'lift,lift' to lock; try: lift"),
        ("schema s.toml", "unexpected extra argument (s.toml); try: eomgen schema alone: it takes no scene"),
        ("tune s.toml --error 5%", "'5%' is not a valid float; try: --error 0.05; eomgen tune --help lists all"),
        ("animate solution.csv --out a.html", "a stored solution is needed; try: {folder}/solution.npz"),
        ("animate empty --out a.html", "try: the scene, or the solution.npz of eomgen simulate"),
    ],
)  # fmt: skip  # a table
def test_words_of_command_lines(
    words: str, answer: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, text in (("s.toml", SCENE), ("r.urdf", ROBOT), ("solution.npz", ""), ("solution.csv", "")):
        (tmp_path / name).write_text(text, encoding="utf-8")
    (tmp_path / "empty").mkdir()
    monkeypatch.chdir(tmp_path)
    folder = "{folder}" in words
    code = main([word.format(folder=tmp_path) for word in words.split()])
    complaint = capsys.readouterr().err
    assert code == 2, complaint
    assert answer.replace("{folder}", str(tmp_path) if folder else ".").replace("./", "") in complaint, complaint


def test_where_joints_start_is_said_by_their_coordinates_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "s.toml").write_text(SCENE, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    starts = ["--initial", "shoulder=0.25", "--initial", "v.shoulder=90deg/s"]
    assert main(["simulate", "s.toml", *RUN.split(), "--t-end", "0.001", *starts]) == 0, capsys.readouterr().err
    first = eomgen.Solution.load(tmp_path / "o" / "solution.npz")
    assert first.q[0] == 0.25 and np.isclose(first.v[0, 0], np.pi / 2, rtol=1e-15)
    assert main(["simulate", "s.toml", *RUN.split(), "--t-end", "0.001", "--initial", "q.shoulder=0.25"]) == 0
    assert eomgen.Solution.load(tmp_path / "o" / "solution.npz").q[0] == 0.25


def test_starts_in_python_are_given_by_coordinates_too() -> None:
    run = arm().simulate(0.01, 1e-3, initial={"v.shoulder": "90 deg/s", "q.shoulder": 0.25})
    assert run.q[0, 0] == 0.25 and np.isclose(run.v[0, 0], np.pi / 2, rtol=1e-15)
    assert "shoulder starts at 30 rad, 4.77 turns" in arm().simulate(0.01, 1e-3, initial={"q.shoulder": 30}).message


def entry(section: str, text: str) -> Callable[[], Any]:
    return changed("", "", f"\n[{section}]\n{text}\n")


def joint(text: str) -> Callable[[], Any]:
    return changed("axis = [0, 1, 0]", f"axis = [0, 1, 0]\n{text}")


def servo(text: str) -> Callable[[], Any]:
    return entry("controllers.servo", f'type = "pid"\nsignal = "1 - q.shoulder"\ntime_constant = 0.01\n{text}')


def robot(old: str, new: str) -> Callable[[], Any]:
    assert old in ROBOT
    return lambda: scene_of(ROBOT.replace(old, new, 1), "r.urdf")


@pytest.mark.parametrize(
    ("call", "piece"),
    [
        (changed('mass = "1 + load"', "mass = 2 kg"), 'try: mass = "2 kg": a number with a unit is a text'),
        (changed("value = 0.5,", "value = 0.5 m,"), 'try: value = "0.5 m": a number with a unit is a text'),
        (changed('"1 + load"', '"2,5"'), "operation or a function (column 1); try: 2.5 with a decimal point"),
        (changed("[parameters]", '[parameters]\nhalf = "length / 2"'), "a number is needed here, not 'length / 2'; tr"),
        (changed('"2 * sin(t)"', '"2 * g * sin(t)"'), "unknown name 'g' (column 5); try: 9.81, or a parameter: g = {"),
        (joint("rotation = [90, 0, 0]"), 'try: rotation = [{ axis = [1, 0, 0], angle = "90 deg" }]'),
        (joint("rotation = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]"), "this is a matrix, and a list of turns about axes is "
            "needed; try: orientation, which is a matrix"),
        (joint("friction = { mu = 0.3, velocity = 0.01 }"), "'mu' is unknown here; try: coulomb, a force in N or a to"),
        (joint('mimic = "elbow"'), "a table is needed here, not 'elbow'; try: mimic = { joint = \"elbow\", multiplier"),
        (entry("base", "follow = true"), 'not a boolean (true); try: follow = { waves = "NAME" }'),
        (entry("links.c", "mass = 1"), "the key 'links' is unknown here; try: bodies"),
        (servo("kp = 20"), "the key 'kp' is unknown here; try: proportional"),
        (entry("controllers.hold", 'type = "state_feedback"\ncoordinates = ["shoulder"]\nposition_gains = [400]'),
            "a table is needed here, not a list; try: position_gains = { JOINT = 400 }"),
        (entry("inputs.u", 'wave = { shape = "sine", period = 2 }'), "'sine' is not known here; try: formula = \"sin("),
        (entry("forces.push", 'body = "tip"\nforce = [1, 0, 0]'), "(forces.push.body): tip is a point of upper, not a"),
        (lambda: slider(k=10.0), "there is no argument 'k'; try: stiffness"),
        (lambda: eomgen.build({"format": 1, "name": "x", "bodies": [{"name": "w", "mass": 1}]}),
            "(bodies): a table is needed here, not a list; try: [bodies.NAME] and its keys, a table for each"),
        (lambda: eomgen.build({"format": 1, "name": "x", "parameters": "", "bodies": {"w": {"mass": 1}}}),
            "(parameters): a table is needed here, not ''; try: [parameters] and a line for each: NAME = 1.0"),
        (robot('xyz="0 0 0.2"', 'xyz="0,0,0.2"'), "3 numbers are needed here, not '0,0,0.2'; try: blanks between the "
            "numbers: 0 0 0.2"),
        (lambda: eomgen.load("r.urdf", fixed_base=False), 'no argument \'fixed_base\'; try: root="fixed" or "fr'),
    ],
)  # fmt: skip  # a table
def test_what_a_file_was_meant_to_say_is_told(call: Callable[[], Any], piece: str) -> None:
    text = refused(call)
    assert piece in text, text


@cache
def free_robot() -> eomgen.Model:
    inertia = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    text = ROBOT.replace('<link name="ground"/>', f'<link name="ground">{inertia}</link>')
    return eomgen.build(load_urdf(text, root="free"), profile="quick")


@cache
def ball() -> eomgen.Model:
    builder = eomgen.SceneBuilder("ball").body("ball", mass=1.0, inertia=[1, 1, 1])
    return eomgen.build(builder.joint("h", "spherical", "base", "ball").build(), profile="quick")


def runs(**options: Any) -> Callable[[], Any]:
    return lambda: arm().simulate(0.01, 1e-3, **options)


TIMES = np.linspace(0.0, 0.01, 5)


@pytest.mark.parametrize(
    ("call", "piece"),
    [
        (lambda: free_robot().mass(np.zeros(free_robot().nq)), "has length 0, not 1; try: neutral(), for the joints'"),
        (lambda: arm().simulate(0.01, initial=arm().equilibrium(u={"motor": 0.0})), "not Equilibrium; try: its .initi"),
        (runs(inputs={"motor": "2 * sin(t)"}), "'2 * sin(t)' is neither a number nor a number with a unit; try: a "
            "function, lambda t: ..., or [inputs] motor = { formula = ... } in the scene"),
        (runs(inputs={"motor": np.column_stack([TIMES, TIMES])}), "try: lambda t: np.interp(t, times, values)"),
        (runs(inputs={"motor": lambda t: None}), "the function returns None at t = 0 s; try: a return statement"),
        (lambda: arm().simulate(np.linspace(0, 1, 11)), "not ndarray; try: t_end=times[-1], step=times[1] - times[0]"),
        (lambda: arm().start(step=1e-3, t_end=1.0), "no argument 't_end'; try: model.start(...).advance(t_end)"),
        (lambda: arm().resume("a.ckpt", step=1e-2), "no argument 'step'; try: model.simulate(...), for other steps"),
        (lambda: arm().mass(np.array([0.1 + 1e-20j])), "try: real numbers; partials(...) has derivatives without step"),
        (lambda: arm().mass({"shoulder": 0.1}), "try: a list of numbers, in the order of the model's q_names"),
        (lambda: arm().simulate(0.01, 1e-3, settings={"max_iter": 50}), "'max_iter'; try: max_iterations"),
        (lambda: ball().simulate(0.01, 1e-3, initial={"h": [0.6, 0.0, 0.6, 0.0]}),
            "has length 0.848528137, not 1; try: it divided by its length, [0.707106781, 0, 0.707106781, 0]"),
        (lambda: list(solution()), "there is no column 0; try: t, q and v by their names: solution.q[0] is the first"),
        (lambda: solution().save("a.npz", format="csv"), "no argument 'format'; try: save(\"run.csv\"), by the ending"),
    ],
)  # fmt: skip  # a table
def test_what_a_call_was_meant_to_be_is_told(call: Callable[[], Any], piece: str) -> None:
    text = refused(call)
    assert piece in text, text


def test_an_input_that_raises_within_a_run_says_what_it_must_give() -> None:
    run = arm().simulate(0.01, 1e-3, inputs={"motor": lambda t: 1.0 / (0.005 - t) if t < 0.004 else 1 / 0})
    assert "ZeroDivisionError: division by zero; try: a function that gives a number at every time" in run.message


def test_a_motion_that_grows_until_its_sines_end_names_the_signs_of_gains() -> None:
    """q'' = 400 q grows as e^(20 t): 1e10 rad at about t = 1.25 s."""
    builder = eomgen.SceneBuilder("wrong").body("m", 1.0, center_of_mass=[0, 0, -1], inertia=[0.1, 0.1, 0.1])
    builder.joint("h", "revolute", "base", "m", axis=[0, 1, 0], initial={"position": 0.5})
    message = run_of(builder.effort("e", "h", "440 * q.h"), 5.0, 1e-3)()
    assert "sines and cosines are computed up to 1e+10 rad" in message
    assert "; the motion grows without end: v.h by a factor of" in message
    assert message.endswith("try: other signs or sizes of gains, damping and stiffnesses")


@pytest.mark.parametrize(("frequency", "known"), [(1000.0, False), (1010.0, False), (10.0, True)])
def test_rows_that_a_force_outruns_do_not_judge_its_energy(frequency: float, known: bool) -> None:
    """F/(m w) (1 - cos(w t)) is the velocity: 0.0159 m/s on average at 1 kHz, and 0 at rows every 1 ms."""
    builder = slider().effort("e", "x", f"100 * sin(2 * pi * {frequency} * t)")
    run = eomgen.build(builder.build(), profile="quick").simulate(0.2, 1e-3, method="rk45")
    force = 100.0 / (2.0 * np.pi * frequency)
    assert np.isclose(run.q[-1, 0], force * 0.2, rtol=1e-5)
    assert run.success and "out of balance" not in run.message
    assert ("energy_error" in run.stats) is known


def test_a_time_within_a_solution_may_have_its_unit() -> None:
    assert np.array_equal(solution().at("5 ms").q, solution().at(0.005).q)


def test_an_end_and_a_step_that_are_exchanged_are_noted() -> None:
    notes = " ".join(arm().simulate(1e-3, 5.0).metadata["notes"])
    assert "which is one shorter step; simulate(5, 0.001) has the end first, and then the step" in notes
    assert "has the end first" not in " ".join(arm().simulate(0.5, 1.0).metadata["notes"])


@pytest.mark.parametrize(
    ("law", "start", "said"),
    [
        (
            "1 / q.x",
            {"position": 0.0},
            "where in a formula 1 / 0 has no value at q.x = 0; try: another start, or a formula",
        ),
        ("sqrt(q.x)", {"position": 0.1, "velocity": -1.0}, "where in a formula sqrt(-"),
        ("log(2 * v.x) if t < 1 else 0", {"velocity": 0.0}, "where in a formula log(0) has no value at v.x = 0"),
        ("(q.x - 1) ** 0.5", {"position": 0.0}, "where in a formula (-1) ** (0.5) has no value at q.x = 0"),
    ],
)
def test_what_has_no_value_in_a_formula_is_named(law: str, start: dict[str, float], said: str) -> None:
    message = run_of(slider(initial=start).effort("e", "x", law), 1.0, 1e-3)()
    assert said in message, message


def test_a_branch_that_is_not_taken_may_have_no_value() -> None:
    law = "1 / q.x if q.x > 0.05 else 1e300 * exp(800 - q.x)"
    message = run_of(slider(initial={"position": 0.0}).effort("e", "x", law), 1.0, 1e-3)()
    assert "a value became infinite" in message and "has no value" not in message


# -- names of models, controllers and robots ---------------------------------------------------------------------------


def test_functions_of_controllers_are_told_their_arguments_in_order() -> None:
    text = refused(lambda: servo_model().simulate(0.02, 1e-3, controllers={"servo": lambda t, x: 0.0}))
    assert "controller servo: the function does not take the 3 arguments that it is called with" in text
    assert f"try: def law(t, signals, memory), where t is in s, {ORDER}" in text
    text = refused(lambda: servo_model().simulate(0.02, 1e-3, controllers={"servo": lambda t, s, memory: s["error"]}))
    assert "IndexError" in text
    assert ORDER in text


def test_a_function_with_further_defaults_and_one_without_a_signature_are_taken() -> None:
    def law(t: float, signals: Any, memory: Any, gain: float = 2.0) -> float:
        return gain * float(signals[0])

    assert servo_model().simulate(0.02, 1e-3, controllers={"servo": law}, error_estimate=False).success
    assert servo_model().simulate(0.02, 1e-3, controllers={"servo": lambda *given: 0.0}, error_estimate=False).success


def test_the_size_of_a_step_is_no_input() -> None:
    run = arm().start(step=1e-3)
    with pytest.warns(
        RuntimeWarning, match=r"step\(0.001\) takes 0.001 as the input motor, not as the size of"
    ) as told:
        run.step(1e-3)
    assert told[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run.step(1e-3)  # within a motion inputs may be any number
        arm().start(step=1e-3).step(2e-3)
        arm().start(step=1e-3).step([1e-3])
    text = refused(lambda: eomgen.build(slider().build(), profile="quick").start(step=1e-3).step(1e-3))
    assert "u: these are inputs, and the scene has none; a step is 0.001 s long" in text
    assert "the size of steps is set by start(step=...)" in text


@pytest.mark.parametrize(
    ("call", "pieces"),
    [
        (lambda: arm().jacobian("tip", [0.1]), ("no body or frame 'tip'", "point_jacobian(body, r, q), or [frames]")),
        (
            lambda: arm().simulate(0.01, 1e-3, initial={"v.shuolder": 1}),
            ("there is no joint 'v.shuolder'; try: shoulder",),
        ),
        (
            lambda: arm().simulate(0.01, 1e-3, inputs={"motor": lambda t, q: 0.0}),
            ("the function failed", "inputs see the time only"),
        ),
        (
            lambda: eomgen.build("scene.toml", coordinates="absolute"),
            ("no argument 'coordinates'", "eomgen.load(path, coordinates=...)"),
        ),
        (changed('"revolute"', '"ball"'), ("'ball' is not known here; try: spherical",)),
        (
            changed('tip = { position = "tip" }', 'f = { reaction_force = "cord" }', CORD),
            ("cord is in [springs], and no joint, constraint or reaction", "try: tension.cord in a formula"),
        ),
    ],
)
def test_what_a_name_was_meant_to_be_is_told(call: Callable[[], Any], pieces: tuple[str, ...]) -> None:
    text = refused(call)
    missing = [piece for piece in pieces if piece not in text]
    assert not missing, f"{missing} in: {text}"


def test_options_of_robots_have_their_counterparts_in_scenes(tmp_path: Path) -> None:
    (tmp_path / "arm.toml").write_text(SCENE)
    text = refused(lambda: eomgen.load(tmp_path / "arm.toml", actuated=True))
    assert "for URDF only; try: [inputs] and [efforts] in the scene file" in text


def test_transmissions_that_are_missing_are_noted() -> None:
    none = "the file has no <transmission>; actuated=True gives an input for each joint"
    assert none in load_urdf(ROBOT, transmissions=True).notes
    assert none not in load_urdf(ROBOT).notes


def test_velocities_are_called_v() -> None:
    assert "a Model has no 'qd'; try: initial_v or v_names; velocities are called v" in refused(lambda: arm().qd)
    assert "try: v" in refused(lambda: arm().simulate(0.01, 1e-3).qdot)
