"""Doubts that a scene or a call silences by name are not reported, and others are errors if strict."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

import eomgen
from eomgen.base.limits import CALLED, NO_SETTINGS
from eomgen.cli import commands, main
from tests.models.scenes import PENDULUM_TOML

IDLE = f"{PENDULUM_TOML}\n[parameters.idle]\nvalue = 1.0\n"
#: Steps of a sixth of a period.
COARSE = ("--t-end", "10", "--step", "0.25", "--set", "shake=0", "--profile", "quick", "--no-plots", "--json")


def quiet(*names: str, strict: bool = False) -> str:
    return f"{IDLE}\n[doubts]\nquiet = {json.dumps(names)}\nstrict = {json.dumps(strict)}\n"


def loaded(text: str, folder: Path) -> eomgen.Scene:
    (folder / "scene.toml").write_text(text, encoding="utf-8")
    return eomgen.load(folder / "scene.toml")


def names_of(scene: eomgen.Scene) -> set[str]:
    run = eomgen.build(scene, profile="quick").simulate(10.0, 0.25, parameters={"shake": 0.0})
    names = {finding.name for finding in run.findings}
    assert run.success and all((finding.text in run.message) for finding in run.findings)
    return names


def test_a_scene_silences_notes_and_checks_by_name(tmp_path: Path) -> None:
    told, other = loaded(IDLE, tmp_path), loaded(quiet("unused names", "discretisation_error"), tmp_path)
    assert [*told.notes] == ["the parameter idle changes nothing: no formula mentions it"] and not other.notes
    assert names_of(told) - names_of(other) == {"discretisation_error"}


def test_a_call_silences_checks_by_name(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "scene.toml").write_text(PENDULUM_TOML, encoding="utf-8")
    call = ("simulate", f"{tmp_path / 'scene.toml'}", "--out", f"{tmp_path / 'out'}", *COARSE)
    found = []
    for words in (call, (*call, "--quiet", "discretisation_error"), call):
        assert main(words) == 0
        result = json.loads(capsys.readouterr().out)
        found.append({finding["name"] for finding in result["findings"]})
    assert found[0] == found[2] == found[1] | {"discretisation_error"}


def test_unknown_names_have_one_message_with_a_known_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    problem = problem_of(quiet("discretization_error"), tmp_path)
    assert problem.what == "there is no doubt 'discretization_error'" and problem.hint == "discretisation_error"
    (tmp_path / "scene.toml").write_text(PENDULUM_TOML, encoding="utf-8")
    call = ("simulate", f"{tmp_path / 'scene.toml'}", "--out", f"{tmp_path / 'out'}", "--quiet")
    for name, hint in (("passed_sprung", "passed_spring"), ("unused_names", "unused names")):
        assert main((*call, name)) == 2
        assert f"--quiet {name}: there is no doubt '{name}'; try: {hint}" in capsys.readouterr().err


@pytest.mark.slow
def test_a_failure_is_never_silent(tmp_path: Path) -> None:
    """A step far beyond the limit of an explicit method."""
    text = quiet("unstable", "stopped", "infinite_energy", "unbounded_growth", "energy_balance")
    stiff = text.replace('type = "revolute"', 'type = "revolute"\nstiffness = 1e6')
    run = eomgen.build(loaded(stiff, tmp_path), method="rk4", profile="quick").simulate(1.0, 0.01)
    assert not run.success and any(finding.severity == "failure" for finding in run.findings)


NOTE = "the parameter idle changes nothing: no formula mentions it (doubt: unused names)"


def test_doubts_of_a_strict_scene_are_errors(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for _ in range(2):  # no record of the first reading answers the second one
        problem = problem_of(quiet(strict=True), tmp_path)
        assert (problem.what, problem.code) == (NOTE, "W0101")
        assert problem.where.endswith("scene.toml:51 (parameters.idle)")
        assert problem.hint == 'doubts.quiet = ["unused names"]'
    assert main(["info", f"{tmp_path / 'scene.toml'}"]) == 3
    assert NOTE in capsys.readouterr().err


def test_doubts_about_a_run_of_a_strict_scene_fail_it(tmp_path: Path) -> None:
    silent = ("unused names", "energy_balance")
    model = eomgen.build(loaded(quiet(*silent, strict=True), tmp_path), profile="quick")
    run = model.simulate(10.0, 0.25, parameters={"shake": 0.0})
    (found,) = (finding for finding in run.findings if finding.name == "discretisation_error")
    assert not run.success and found.severity == "failure" and found.text.endswith(" (doubt: discretisation_error)")
    assert f", but {found.text}" in run.message
    assert not [finding for finding in run.findings if finding.name in silent]
    assert model.simulate(1.0, 0.001, parameters={"shake": 0.0}).success


def test_the_option_strict_makes_errors_of_doubts(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A file that was read before without the option, and with it."""
    file = tmp_path / "scene.toml"
    call = ("simulate", f"{file}", "--out", f"{tmp_path / 'out'}", *COARSE)
    file.write_text(IDLE, encoding="utf-8")
    assert main(call) == 0
    for _ in range(2):
        assert main((*call, "--strict")) == 3
        assert f'(parameters.idle): {NOTE}; try: --quiet "unused names"' in capsys.readouterr().err
    file.write_text(PENDULUM_TOML, encoding="utf-8")
    assert main((*call, "--strict")) == 6
    assert "(doubt: discretisation_error)" in json.loads(capsys.readouterr().out)["message"]
    silent = ("discretisation_error", "energy_balance", "unresolved_motion")
    assert main((*call, "--strict", *(word for name in silent for word in ("--quiet", name)))) == 0
    assert main(call) == 0


@pytest.mark.parametrize("rest", [("--t-end", "soon"), ("--help",)])
def test_the_option_strict_ends_with_its_verb(rest: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    """Also with a verb that never ran: parts of a command line were refused, or the help was printed."""
    words = ("simulate", "no scene", "--strict", "--quiet", "unused names", *rest)
    assert main(words) == (0 if "--help" in rest else 2)
    assert not CALLED.get().strict and not CALLED.get().quiet


@pytest.mark.slow
@pytest.mark.parametrize("verb", ["simulate", "equilibrium"])
def test_a_call_silences_notes_of_the_scene(verb: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A scene whose model of an earlier call has the note, and a scene that is strict itself."""
    file = tmp_path / "scene.toml"
    further = ("--out", f"{tmp_path / 'out'}", "--t-end", "0.01", "--no-plots") if verb == "simulate" else ()
    call, silenced = (verb, f"{file}", "--profile", "quick", *further), ("--quiet", "unused names")
    note = NOTE.removesuffix(" (doubt: unused names)")
    for strict, code in ((False, 0), (True, 3)):
        file.write_text(quiet(strict=strict), encoding="utf-8")
        for more, expected in (((), code), (silenced, 0), (("--strict", *silenced), 0), ((), code)):
            assert main((*call, *more)) == expected
            assert (note in capsys.readouterr().err) == (not more)


@pytest.mark.parametrize(
    ("entry", "place", "code"),
    [
        ('[efforts.push]\njoint = "hinge"\neffort = "sin(90)"', "53 (efforts.push.effort)", "W0300"),
        ("[parameters.idle]\nvalue = 1.0\n[parameters.spare]\nvalue = 1.0", "7 (parameters)", "W0101"),
    ],
)
def test_a_note_of_a_strict_scene_has_place_and_code(entry: str, place: str, code: str, tmp_path: Path) -> None:
    problem = problem_of(f"{PENDULUM_TOML}\n{entry}\n\n[doubts]\nstrict = true\n", tmp_path)
    assert problem.where.endswith(f"scene.toml:{place}") and problem.code == code


#: A mass on a soft spring.
SOFT = """format = 1
name = "soft"
bodies.mass = {mass = 1.0, inertia = [0, 0, 0]}
joints.rail = {type = "prismatic", parent = "base", child = "mass", axis = [0, 0, 1]}
points = {top = {body = "base", position = [0, 0, 0]}, end = {body = "mass", position = [0, 0, -0.1]}}
springs.coil = {first = "top", second = "end", stiffness = 10.0, length = 0.1}
"""


def rest_of(*names: str, strict: bool = False) -> tuple[str, ...]:
    """Return the notes of an equilibrium, with some doubts silenced."""
    data = {**tomllib.loads(SOFT), "doubts": {"quiet": names, "strict": strict}}
    return tuple(eomgen.build(eomgen.load(data), profile="quick").equilibrium().notes)


def problem_of(text: str, folder: Path) -> Any:
    """Return the only problem of a scene."""
    with pytest.raises(eomgen.DescriptionError) as told:
        loaded(text, folder)
    (problem,) = told.value.problems
    return problem


def test_an_equilibrium_silences_warnings_by_name() -> None:
    assert ["moved farther" in note for note in rest_of()] == [True]
    assert ["farther from the start" in note for note in rest_of("inverted springs")] == [True]
    assert not rest_of("inverted springs", "long ways")


def test_warnings_of_an_equilibrium_are_errors_if_strict(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for silent, code in (((), "W0015"), (("inverted springs",), "W0292")):
        with pytest.raises(eomgen.NumericalError, match=r"farther .* \(doubt: .*; try: doubts.quiet = ") as told:
            rest_of(*silent, strict=True)
        assert told.value.code == code
    assert not rest_of("inverted springs", "long ways", strict=True)
    file = tmp_path / "soft.toml"
    file.write_text(SOFT, encoding="utf-8")
    assert main(["equilibrium", f"{file}"]) == 0
    assert main(["equilibrium", f"{file}", "--strict"]) == 6
    assert '(doubt: inverted springs); try: --quiet "inverted springs"' in capsys.readouterr().err


def test_settings_of_a_command_end_with_it_whoever_calls_the_group(tmp_path: Path) -> None:
    file = tmp_path / "soft.toml"
    file.write_text(SOFT, encoding="utf-8")
    with pytest.raises(eomgen.NumericalError):
        CliRunner().invoke(
            commands, ["equilibrium", f"{file}", "--strict"], standalone_mode=False, catch_exceptions=False
        )
    assert CALLED.get() == NO_SETTINGS
