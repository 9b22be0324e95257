"""Remedies for words of a command line, at functions: of options, values, extra words and assignments."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import click
import pytest

from eomgen.base.verbs import Verb
from eomgen.cli import main, mistakes, options
from eomgen.errors import UsageError
from tests.messages.answers import plain

STRUCTURE = click.Option(["--root"], type=click.Choice(["fixed", "free"]))
STEPS = click.Option(["--record-every"], type=click.INT)
COUNT = click.Option(["--points"], type=click.INT)
STEP = click.Option(["--step"], type=click.FLOAT)
OTHER = click.Option(["--name"], type=click.STRING)
PATH = "eomgen simulate"
LISTED = f"; {PATH} --help lists all"


def bad(param: click.Parameter, given: str) -> click.BadParameter:
    return click.BadParameter(f"'{given}' is not valid.", param=param)


@pytest.mark.parametrize(
    ("error", "remedy"),
    [
        (click.NoSuchOption("--dt"), f"--step{LISTED}"),
        (click.NoSuchOption("-h"), f"--step{LISTED}"),
        (click.NoSuchOption("--quiet"), f"2> /dev/null, since only results go to stdout{LISTED}"),
        (click.NoSuchOption("--stepp", possibilities=["--step", "--set"]), f"--step{LISTED}"),
        (click.NoSuchOption("--zzz"), f"{PATH} --help"),
        (
            click.MissingParameter(param=click.Argument(["scene"])),
            f"the path of a .toml scene, a .urdf file, an .xml file of MuJoCo or an .sdf file{LISTED}",
        ),
        (click.MissingParameter(param=click.Option(["--folder"])), f"--out results{LISTED}"),
        (
            click.MissingParameter(param=click.Argument(["sources"])),
            f"the path of a scene, or the folder of a run{LISTED}",
        ),
        (click.MissingParameter(param=click.Argument(["other"])), f"{PATH} --help"),
        (bad(STRUCTURE, "World"), f"--root fixed{LISTED}"),
        (bad(STRUCTURE, "FLOATING"), f"--root free{LISTED}"),
        (bad(STRUCTURE, "fixd"), f"--root fixed{LISTED}"),
        (bad(STRUCTURE, "zzz"), f"{PATH} --help"),
        (bad(STRUCTURE, "minimal"), f"{PATH} --help"),
        (bad(STEPS, "0.1"), f"a whole number in steps, not in s, --record-every 10{LISTED}"),
        (bad(COUNT, "0.1"), f"a whole number, --points 10{LISTED}"),
        (bad(STEP, "0,001"), f"--step 0.001{LISTED}"),
        (bad(STEP, "5%"), f"--step 0.05{LISTED}"),
        (bad(STEP, "small"), f"{PATH} --help"),
        (bad(OTHER, "x"), f"{PATH} --help"),
        (click.UsageError("unlike all others"), f"{PATH} --help"),
    ],
)
def test_remedies_of_options_and_values(error: click.UsageError, remedy: str) -> None:
    assert mistakes.usage_remedy(error, PATH, []) == remedy


@pytest.mark.parametrize(
    ("words", "extra", "remedy"),
    [
        ("simulate a.toml b.toml", "b.toml", "one scene, and a command for each other one"),
        ("info a.toml arm.urdf", "arm.urdf", "one scene, and a command for each other one"),
        ("simulate a.toml --set k 3", "3", "--set name=value without blanks, and one scene"),
        ("info a.toml --terms mass force", "force", "--terms mass,force, with commas"),
        ("info a.toml --terms mass,poses force twists", "twists", "--terms mass,poses,force,twists, with commas"),
        ("info a.toml --json out.json", "out.json", "--json > out.json"),
        ("info a.toml --json x out.json", "out.json", "--set name=value without blanks, and one scene"),
        ("info a.toml --json --out x out.json", "out.json", "--set name=value without blanks, and one scene"),
    ],
)
def test_remedies_of_extra_words(words: str, extra: str, remedy: str) -> None:
    context = click.Context(click.Command("simulate", params=[click.Argument(["scene"]), STEP]))
    error = click.UsageError(f"Got unexpected extra argument ({extra} more)", ctx=context)
    assert mistakes.usage_remedy(error, PATH, words.split()) == f"{remedy}{LISTED}"
    alone = click.UsageError(f"Got unexpected extra arguments ({extra})", ctx=click.Context(click.Command("list")))
    assert mistakes.usage_remedy(alone, PATH, words.split()) == f"{PATH} alone: it takes no scene{LISTED}"


def test_a_missing_choice_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["completion"]) == 2
    text = (
        "usage error: eomgen completion: missing argument '{bash|zsh|fish}'; try: bash, zsh or fish;"
        " eomgen completion --help lists all"
    )
    assert plain(capsys.readouterr().err) == f"{text}\n"


def test_other_names_of_verbs() -> None:
    names = ("new", "simulate", "info", "check", "linearize", "generate", "animate", "equilibrium", "tune")
    verbs = {name: Verb(name, takes_scene=name != "new") for name in names}
    others = {
        "run": "simulate", "Modal": "linearize", "compile": "generate", "lint": "info", "movie": "animate",
        "TRIM": "equilibrium", "verify": "check", "simulat": "simulate",
    }  # fmt: skip
    for word, verb in others.items():
        assert mistakes.verb_remedy(word, verbs) == verb
    assert mistakes.verb_remedy("car.toml", verbs) == (
        "eomgen info car.toml, or another verb before the scene: simulate, info, check, linearize, generate, animate,"
        " equilibrium"
    )
    assert mistakes.what_of_usage(click.NoSuchOption("--dt")) == "no such option '--dt'"
    assert mistakes.what_of_usage(click.UsageError("Too few.")) == "Too few"


def scene_of(**more: Any) -> Any:
    def named(*names: str) -> list[Any]:
        return [SimpleNamespace(name=name, tunable=name != "fixed", beam=None) for name in names]

    return SimpleNamespace(
        inputs=named("push", "both"), parameters=named("k", "both", "arm_mass", "fixed"),
        bodies=named("arm", "arm_tool"), joints=named("hinge", "slide"), states=named("angle"), **more,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "signals", "robot", "message"),
    [
        ({"push": 2.5}, {}, False, "--set push: push is an input; try: --input push=2.5"),
        (
            {"angle": 2.5},
            {},
            False,
            "angle is a state, not a parameter; try: [states.angle] initial = 2.5 in",
        ),
        ({}, {"k": "sin(t)"}, False, "--input k: k is a parameter; try: --set k=sin(t)"),
        ({}, {"hinge": 1.0}, True, "--input hinge: hinge is a joint, which no input drives; try: --actuated, for an"),
        ({"arm_tool_mass": 1.0}, {}, True, "the inertia of arm_tool are fixed in the code; try: --tunable arm_tool,"),
        ({"arm": 1.0}, {}, True, "the inertia of arm are fixed in the code; try: --tunable arm, which makes"),
    ],
)
def test_values_of_another_option_are_named(
    changes: dict[str, Any], signals: dict[str, Any], robot: bool, message: str
) -> None:
    with pytest.raises(UsageError) as raised:
        options.check_assigned(scene_of(), changes, signals, robot=robot)
    assert message in str(raised.value)
