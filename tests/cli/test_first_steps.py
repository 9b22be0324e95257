"""The way to a running scene: ``eomgen``, ``eomgen new``, ``eomgen examples``, ``eomgen completion``."""

from __future__ import annotations

import json
import re
import runpy
from pathlib import Path

import pytest
from click.shell_completion import ShellComplete

import eomgen
from eomgen.cli import VERBS, commands, main
from eomgen.cli.first_steps import FIRST_SCENE, example_names, title_and_sentence
from tests.messages.answers import plain

ROOT = Path(__file__).parents[2]


def test_eomgen_alone_leads_to_a_running_scene(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0
    text = capsys.readouterr().out
    commands = re.findall(r"^  eomgen (\S+)", text, re.MULTILINE)
    assert text.startswith(f"eomgen {eomgen.__version__}: ")
    assert [word for word in commands if word != "--help"] == ["new", "simulate", "animate", "examples", "doctor"]
    assert set(commands) - {"--help"} <= set(VERBS)
    assert len(example_names()) >= 50  # as the text says


def test_the_first_scene_has_two_links_on_a_base_that_moves() -> None:
    scene = eomgen.load(FIRST_SCENE)
    assert [joint.name for joint in scene.joints] == ["shoulder", "elbow"]
    assert scene.base.position is not None and scene.notes == ()


def test_new_makes_a_scene_of_this_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", "my-crane"]) == 0
    assert capsys.readouterr().err == "next: eomgen simulate my-crane/scene.toml --out my-crane/out\n"
    assert eomgen.load("my-crane/scene.toml").name == "my_crane"
    assert main(["new", "my-crane"]) == 7
    assert plain(capsys.readouterr().err) == (
        "input/output error: my-crane: this folder is not empty, and all files are kept; try: another name\n"
    )
    assert main(["new", "2nd"]) == 2
    assert "the name of a scene begins with a letter; try: eomgen new pendulum" in capsys.readouterr().err
    for folder, name in (("mein B\u00fcro", "mein_Buro"), ("a" * 80, "a" * 64)):
        assert main(["new", folder]) == 0
        assert eomgen.load(Path(folder, "scene.toml")).name == name
    capsys.readouterr()
    assert main(["info", "second"]) == 2
    assert "there is no file 'second'; try: a .toml scene" in capsys.readouterr().err
    assert main(["info", "my-crane"]) == 2
    assert "'my-crane' is not a kind of file that can be read; try: my-crane/scene.toml" in capsys.readouterr().err
    assert main(["new", "second", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"folder": "second", "files": ["scene.toml"]}


def test_examples_are_listed_with_their_files(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["examples"]) == 0
    printed = capsys.readouterr().out
    assert all(f"{name} " in printed for name in example_names())
    assert main(["examples", "--json"]) == 0
    rows = {row["name"]: row for row in json.loads(capsys.readouterr().out)}
    assert rows["four_bar"]["title"] == "Four-bar linkage"
    assert rows["four_bar"]["sentence"].startswith("Links of 0.1, 0.35, 0.3 and 0.4 m:")
    assert rows["four_bar"]["files"] == ["scene.toml"] and "bar.py" in rows["scalar_wave"]["files"]


def test_every_example_has_a_title_a_sentence_and_something_to_run() -> None:
    for name in example_names():
        title, sentence = title_and_sentence(name)
        assert title != name and len(sentence) > 20 and "](" not in sentence, (name, title, sentence)


def test_examples_are_copied_whole_or_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["examples", "heavy_top", "scalar_wave", "--out", "mine"]) == 0
    told = capsys.readouterr()
    assert told.out.split() == [str(Path("mine/heavy_top")), str(Path("mine/scalar_wave"))]
    assert "next: eomgen simulate mine/heavy_top/joint_coordinates.toml --out mine/heavy_top/out\n" in told.err
    copied = {path.name: path.read_bytes() for path in Path("mine/heavy_top").iterdir() if path.is_file()}
    source = ROOT / "examples" / "heavy_top"
    assert copied == {path.name: path.read_bytes() for path in source.iterdir() if path.is_file()}
    assert main(["examples", "heavy_top", "--out", "mine"]) == 7
    assert "this folder is not empty, and all files are kept" in capsys.readouterr().err
    assert main(["examples", "heavy_to"]) == 2
    assert plain(capsys.readouterr().err) == "usage error: there is no example 'heavy_to'; try: heavy_top\n"


NEXT = {
    "driving_car": "eomgen examples car --out mine\nnext: eomgen simulate mine/driving_car/system/lane_change.toml"
    " --out mine/driving_car/out",
    "jerk_limited_arm": "eomgen examples sea_arm --out mine\nnext: eomgen simulate mine/jerk_limited_arm/scene.toml"
    " --out mine/jerk_limited_arm/out",
    "density_field": "python mine/density_field/demo.py",
    "car": "eomgen simulate mine/car/system/car.toml --out mine/car/out",
}


@pytest.mark.parametrize("name", NEXT)
def test_the_next_commands_run_as_they_stand(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Parts of scenes without a run of their own are not proposed, and examples that scenes include are."""
    monkeypatch.chdir(tmp_path)
    assert main(["examples", name, "--out", "mine"]) == 0
    assert capsys.readouterr().err == f"next: {NEXT[name]}\n"
    for line in NEXT[name].split("\nnext: "):
        verb, *arguments = line.split()
        assert verb == "python" or arguments[0] == "examples" or Path(arguments[1]).is_file()
        if arguments[0] == "examples":
            assert main(arguments) == 0
        elif verb == "eomgen":
            assert eomgen.load(arguments[1]).simulation.duration is not None


@pytest.mark.parametrize(
    ("name", "other"), [("identified_arm", "robot_arm"), ("identified_quarter_car", "quarter_car")]
)
def test_a_program_that_reads_a_scene_of_another_example_says_so(
    name: str, other: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", "mine/copy", "--example", name]) == 0
    told = f"next: eomgen examples {other} --out mine\nnext: python mine/copy/demo.py\n"
    assert capsys.readouterr().err == told
    assert main(["examples", other, "--out", "mine"]) == 0
    assert runpy.run_path("mine/copy/demo.py")["scene"]()["name"] == name


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_script_of_completion_asks_this_program(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["completion", shell]) == 0
    assert f"_EOMGEN_COMPLETE={shell}_complete" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("simulate --rho", "plain --rho-inf"),
        ("new x --example four", "plain four_bar"),
        ("simulate sce", "file sce"),
        ("cite lsr", "plain lsrt2"),
        ("cite ./a", "file ./a"),
    ],
)
def test_words_are_completed(words: str, expected: str) -> None:
    *before, begun = words.split()
    (found,) = ShellComplete(commands, {}, "eomgen", "_EOMGEN_COMPLETE").get_completions(before, begun)
    assert f"{found.type} {found.value}" == expected


@pytest.mark.slow
@pytest.mark.parametrize("scene", ["README", "new"])
def test_first_commands_have_no_notes(
    scene: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    readme = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("EOMGEN_CACHE", str(tmp_path / "cache"))  # the first run of a machine
    commands = [["simulate", "scene.toml", "--t-end", "1", "--out", "run"], ["info", "scene.toml"]]
    commands += [["generate", "scene.toml", "--out", "c"], ["linearize", "scene.toml"]]
    if scene == "README":
        (text,) = re.findall(r"^```toml\n(.*?)^```", readme, re.DOTALL | re.MULTILINE)
        Path("scene.toml").write_text(text, encoding="utf-8")
    else:
        assert main(["new", "arm"]) == 0
        Path("scene.toml").write_text(Path("arm/scene.toml").read_text(encoding="utf-8"), encoding="utf-8")
    for command in commands:
        assert main(command) == 0
        assert "note" not in capsys.readouterr().err, command
