"""Doubts that a scene or a call silences by name are not reported, and failures are."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import eomgen
from eomgen.cli import main
from tests.models.scenes import PENDULUM_TOML

IDLE = f"{PENDULUM_TOML}\n[parameters.idle]\nvalue = 1.0\n"
#: Steps of a sixth of a period.
COARSE = ("--t-end", "10", "--step", "0.25", "--set", "shake=0", "--profile", "quick", "--no-plots", "--json")


def quiet(*names: str) -> str:
    return f"{IDLE}\n[doubts]\nquiet = {json.dumps(names)}\n"


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
    with pytest.raises(eomgen.DescriptionError) as told:
        loaded(quiet("discretization_error"), tmp_path)
    (problem,) = told.value.problems
    assert problem.what == "there is no doubt 'discretization_error'" and problem.hint == "discretisation_error"
    (tmp_path / "scene.toml").write_text(PENDULUM_TOML, encoding="utf-8")
    call = ("simulate", f"{tmp_path / 'scene.toml'}", "--out", f"{tmp_path / 'out'}", "--quiet")
    for name, hint in (("passed_sprung", "passed_spring"), ("unused names", "doubts.quiet in the file")):
        assert main((*call, name)) == 2
        assert f"--quiet {name}: there is no doubt '{name}'; try: {hint}" in capsys.readouterr().err


def test_a_failure_is_never_silent(tmp_path: Path) -> None:
    """A step far beyond the limit of an explicit method."""
    text = quiet("unstable", "stopped", "infinite_energy", "unbounded_growth", "energy_balance")
    stiff = text.replace('type = "revolute"', 'type = "revolute"\nstiffness = 1e6')
    run = eomgen.build(loaded(stiff, tmp_path), method="rk4", profile="quick").simulate(1.0, 0.01)
    assert not run.success and any(finding.severity == "failure" for finding in run.findings)


def rest_of(*names: str) -> tuple[str, ...]:
    """Return the notes of an equilibrium of a mass on a soft spring, with some doubts silenced."""
    builder = eomgen.SceneBuilder("soft").body("mass", 1.0).joint("rail", "prismatic", "base", "mass", axis=[0, 0, 1])
    builder = builder.point("top", "base").point("end", "mass", position=[0, 0, -0.1]).doubts(quiet=names)
    builder = builder.spring("coil", "top", "end", stiffness=10.0, length=0.1)
    return tuple(eomgen.build(builder.build(), profile="quick").equilibrium().notes)


def test_an_equilibrium_silences_warnings_by_name() -> None:
    assert ["moved farther" in note for note in rest_of()] == [True]
    assert ["farther from the start" in note for note in rest_of("inverted springs")] == [True]
    assert not rest_of("inverted springs", "long ways")
