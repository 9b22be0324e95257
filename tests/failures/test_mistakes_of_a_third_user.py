"""465 mistakes of a third user: those whose answers did not say, or not rightly, what was meant."""

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
from eomgen.control import OutputFeedback, discretized, kalman, lqr, place
from tests.failures.failure import SCENE
from tests.failures.mistakes import arm, slider
from tests.failures.test_mistakes_of_a_second_user import refused
from tests.failures.test_silent_calls import ROBOT


@cache
def space() -> Any:
    builder = slider(stiffness=50, damping=0.5).input("push").effort("push", "x", "push")
    builder.output("place", formula="q.x", unit="m")
    return eomgen.build(builder.build(), profile="quick").linearize().state_space()


@cache
def solution() -> eomgen.Solution:
    return arm().simulate(0.01, 1e-3)


def regulator(**options: Any) -> Any:
    return lqr(space(), {"place": 1.0}, {"push": 0.1}, **options)


@pytest.mark.parametrize(
    ("call", "piece"),
    [
        (lambda: arm().nle, "a Model has no 'nle'; try: coupling(q, v) - force(q, v), since forces hold gravity"),
        (lambda: arm().gravity, "a Model has no 'gravity'; try: force(q, v), which holds gravity"),
        (lambda: arm().rhs([0.1, 0.0], 0.0), "rhs: the time comes first, and the state behind it; try: rhs(t, y)"),
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
            "text of several lines; try: the path of a .toml file that holds the text, or load(tomllib.loads(text))",
        ),
        (lambda: eomgen.load(ROBOT), "is a text of several lines; try: the path of a .urdf file that holds the text"),
        (lambda: eomgen.load("run.npz"), "try: eomgen.Solution.load('run.npz'), if it is a solution"),
        (
            lambda: eomgen.load("package://two/robot.urdf"),
            "try: a path of the file system: no ROS is asked where package://two is",
        ),
        (lambda: solution().parameters, "a Solution has no 'parameters'; try: metadata[\"parameters\"]"),
        (lambda: solution().tip, "a Solution has no 'tip'; try: [\"tip\"] in place of .tip"),
        (
            lambda: OutputFeedback(kalman(space(), {"push": 0.1}, {"place": 1e-6}), regulator()),
            "OutputFeedback: a Regulator comes first, not an Observer; try: OutputFeedback(regulator, observer)",
        ),
        (lambda: OutputFeedback(regulator(), regulator()), "an Observer comes second, not a Regulator"),
    ],
)  # fmt: skip  # a table
def test_what_was_meant_is_told(call: Callable[[], Any], piece: str) -> None:
    text = refused(call)
    assert piece in text, text


@pytest.mark.parametrize(
    ("call", "piece"),
    [
        (
            lambda: place(space(), [1, 2]),
            "place: poles with positive real parts are asked for, 1, 2: what has them grows; try: negative real parts",
        ),
        (lambda: place(space(), [1 + 2j, 1 - 2j]), "asked for, 1+2j, 1-2j"),
        (lambda: place(space(), [1, 2], sample="10 ms"), "poles z = e^(s T) outside the unit circle"),
        (lambda: regulator(sample=500), 'is 500 s; try: sample="0.002 s" for 500 a second, or "500 s" if it is'),
        (lambda: discretized(space(), 500), 'try: sample="0.002 s" for 500 a second'),
    ],
)  # fmt: skip  # a table
def test_linear_designs_that_are_hardly_meant_are_warned_of(call: Callable[[], Any], piece: str) -> None:
    with pytest.warns(RuntimeWarning) as seen:
        call()
    assert any(piece in str(item.message) for item in seen), [str(item.message) for item in seen]


def test_linear_designs_that_are_meant_are_not_warned_of() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        place(space(), [-1, -2])
        place(space(), [-1, -2], sample="10 ms")
        regulator(sample="20 s")
        regulator(sample=0.002)


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
    assert text.endswith(f"arm' is not a kind of file that can be read; try: {tmp_path}/arm.toml"), text
    assert refused(lambda: eomgen.load("")).endswith("try: a .toml scene or a .urdf file")


RUN = "--out o --no-plots"


@pytest.mark.parametrize(
    ("words", "answer"),
    [
        (f"simulate s.toml {RUN} --duration 1", "no such option '--duration'; try: --t-end; eomgen simulate --help"),
        (f"simulate s.toml {RUN} --recordevery 1", "no such option '--recordevery'; try: --record-every; eomgen"),
        (f"simulate s.toml {RUN} --set load=0.5,motor=2", "try: --set load=0.5 --set motor=2"),
        (f"simulate s.toml {RUN} --set motor=2", "--set motor: motor is an input; try: --input motor=2"),
        (f"simulate s.toml {RUN} --input load=2kg", "--input load: load is a parameter; try: --set load=2kg"),
        (f"simulate s.toml {RUN} --input motor=sin(t)", 'try: [inputs] motor = { formula = "sin(t)" } in the scene'),
        (f"simulate s.toml {RUN} --record-every 0.01", "try: a whole number in steps, not in s, --record-every 10;"),
        (f"simulate s.toml t.toml {RUN}", "unexpected extra argument (t.toml); try: one scene, and a command for each"),
        (f"simulate r.urdf {RUN} --set rod_mass=5", "inertia of rod are fixed in the code; try: --tunable rod, which"),
        (f"simulate r.urdf {RUN} --input lift=5", "lift is a joint, which no input drives; try: --actuated"),
        ("info s.toml --terms mass force", "argument (force); try: --terms mass,force, with commas; eomgen info"),
        ("info s.toml --json out.json", "unexpected extra argument (out.json); try: --json > out.json; eomgen info"),
        ("info r.urdf --root floating", "'floating' is not one of 'fixed', 'free'; try: --root free; eomgen info"),
        ("info r.urdf --lock lift,lift", "try: one name for each: lock=['lift', 'lift'], or --lock lift --lock lift"),
        ("schema s.toml", "unexpected extra argument (s.toml); try: eomgen schema alone: it takes no scene"),
        ("tune s.toml --error 5%", "'5%' is not a valid float; try: --error 0.05; eomgen tune --help lists all"),
        ("animate solution.csv --out a.html", "a stored solution is needed; try: {folder}/solution.npz"),
        ("animate {folder} --out a.html", "a folder, and a scene or a stored solution is needed; try: {folder}"),
        ("animate empty --out a.html", "try: the scene, or the solution.npz of eomgen simulate"),
        ("help simulate", "there is no verb 'help'; try: eomgen --help, or eomgen VERB --help"),
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
