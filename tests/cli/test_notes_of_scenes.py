"""Notes that reading a scene has made: every verb that loads a scene prints each of them once, to stderr."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

import eomgen
from eomgen.cli import main
from eomgen.products.linear.plots import oscillating_first
from eomgen.products.studies.work_precision.running import Grid, Runner
from tests.models.scenes import PENDULUM_TOML

#: Nothing depends on it, which is a note.
_UNUSED = "\n[parameters.unused]\nvalue = 1.0\n"
_RUN = ("--t-end", "0.01", "--step", "1e-3")


@pytest.mark.slow_cases("ensemble")
@pytest.mark.parametrize(
    "arguments",
    [
        ("equilibrium",),
        ("linearize",),
        ("simulate", *_RUN, "--no-plots", "--out", "run"),
        ("ensemble", *_RUN, "--vary", "q.hinge=normal(0, 0.1)", "--samples", "2", "--no-plots", "--out", "many"),
        ("generate", "--out", "code"),
    ],
    ids=lambda arguments: arguments[0],
)
def test_every_verb_prints_the_notes_of_its_scene(
    arguments: tuple[str, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("scene.toml").write_text(PENDULUM_TOML + _UNUSED, encoding="utf-8")
    verb, *options = arguments
    code = main([verb, "scene.toml", *options])
    told = capsys.readouterr()
    assert code == 0, told.err
    assert told.err.count("note: the parameter unused changes nothing: no formula mentions it") == 1


def test_generate_says_which_method_it_takes_for_auto(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("scene.toml").write_text(PENDULUM_TOML, encoding="utf-8")
    assert main(["generate", "scene.toml", "--method", "auto", "--out", "code"]) == 0
    assert "files with steps of generalized_alpha, as auto chooses before runs alone; README" in capsys.readouterr().err
    readme = Path("code/README.md").read_text(encoding="utf-8")
    assert "Method: generalized-alpha on Lie groups: the scene asks for `auto`, which chooses" in readme
    assert json.loads(Path("code/manifest.json").read_text())["method"] == "generalized-alpha on Lie groups"
    Path("scene.toml").write_text(PENDULUM_TOML + 'method = "auto"\n', encoding="utf-8")
    assert main(["info", "scene.toml"]) == 0
    assert "note" not in capsys.readouterr().err


def test_a_hamiltonian_run_prints_the_parameters_that_it_changes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("system.toml").write_text(
        'format = 1\nkind = "hamiltonian"\nname = "mass"\n'
        'hamiltonian = { kinetic = "p_x**2 / (2 * m)", potential = "k * x**2 / 2" }\n'
        '[parameters]\nm = { value = 0.5, unit = "kg" }\nk = 2.0\n'
        '[coordinates]\nx = { initial = [0.2, 0], unit = "m", momentum_unit = "N s" }\n'
        "[simulation]\nduration = 0.1\nstep = 0.01\n",
        encoding="utf-8",
    )
    assert main(["simulate", "system.toml", "--set", "m=0.25", "--no-plots", "--out", "run"]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "parameter m 0.25 kg, in the scene 0.5" in told
    assert "parameter k" not in told


@pytest.mark.parametrize("few", [3, 8])
def test_decaying_modes_are_listed_after_all_others(few: int) -> None:
    """Unless there are only a few modes, which are listed slowest first."""

    class Modes:
        eigenvalues = np.array([0.0, -5.0, -6.0, -1.0 + 9.0j, 9.5])
        uncertainty = np.full(5, 1e-9)
        oscillating = np.array([False, False, False, True, False])

        def __len__(self) -> int:
            return len(self.eigenvalues)

    modes = Modes()
    found = oscillating_first(cast("Any", modes), few)
    assert found == ([0, 1, 2, 3, 4] if few == 8 else [0, 3, 4, 1, 2])


def test_studies_take_for_auto_the_method_of_a_run() -> None:
    """A pendulum is smooth and slow beside its step: its run takes the explicit method of order 4."""
    scene = eomgen.load({**tomllib.loads(PENDULUM_TOML), "simulation": {"method": "auto", "duration": 1, "step": 1e-3}})
    formulations = cast("Any", SimpleNamespace(own="joint", scenes={"joint": scene}))
    taken = Runner(formulations, Grid(row=1e-3, rows=10)).own_method()
    assert taken == eomgen.build(scene).simulate(0.01, error_estimate=False).metadata["method"] == "rk4"


def test_studies_leave_out_parameters_that_the_method_of_auto_does_not_take() -> None:
    simulation = {"method": "auto", "duration": 1, "step": 1e-3, "alpha": 0.1, "settings": {"max_iterations": 9}}
    scene = eomgen.load({**tomllib.loads(PENDULUM_TOML), "simulation": simulation})
    runner = Runner(cast("Any", SimpleNamespace(own="joint", scenes={"joint": scene})), Grid(row=1e-3, rows=10))
    configuration = runner.own_configuration()
    assert (configuration.method, configuration.parameters, configuration.settings) == ("rk4", {}, {})
    assert runner.method(configuration).family == "runge_kutta"


def test_info_has_notes_on_shapes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Compiled libraries are without these, since shapes are of pictures alone."""
    file = tmp_path / "scene.toml"
    file.write_text(
        """
        format = 1
        name = "arm"
        bodies.arm = { mass = 1, inertia = [0.01, 0.01, 0.001], center_of_mass = [0.2, 0, 0] }
        joints.hinge = { type = "revolute", parent = "base", child = "arm", axis = [0, 1, 0] }
        points.tip = { body = "arm", position = [0.4, 0, 0] }
        outputs.tip = { position = "tip" }
        shapes.wheel = { body = "arm", type = "sphere", radius = 310 }
        """,
        encoding="utf-8",
    )
    note = "shapes.wheel: the size of the shape is 310 m, and the scene is no larger than 0.4 m"
    assert main(["info", str(file), "--json"]) == 0
    (found,) = json.loads(capsys.readouterr().out)["notes"]
    assert found.startswith(note)
    assert main(["info", str(file)]) == 0
    assert "the size of the shape is 310 m" in " ".join(capsys.readouterr().out.split())
