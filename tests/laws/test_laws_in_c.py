"""Laws in C files: equality with formulas, derivatives, methods, number types, generated C, mistakes."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.mechanics.derive import derive
from eomgen.scene.load import from_data
from tests.models.c_laws import TYRE_C, TYRE_LAW, wheel_scene
from tests.oracles.evaluation import tape_evaluator


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Change to an empty folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def states(model: eomgen.Model, count: int = 40) -> tuple[np.ndarray, np.ndarray]:
    """Return random states of the car and its wheel."""
    rng = np.random.default_rng(1)
    q = np.zeros((count, model.nq)) + rng.uniform(-0.05, 0.05, (count, model.nq))
    v = rng.uniform([-0.5, 5.0, -3.0, -0.2, 20.0], [0.5, 30.0, 3.0, 0.2, 90.0], (count, 5))
    return q, v


WITHOUT = {key: value for key, value in TYRE_LAW.items() if key != "partials"}


def difference(first: Any, second: Any) -> float:
    """Return the largest difference relative to the largest number, of arrays or sequences of arrays."""
    if isinstance(first, tuple):
        return max(difference(one, other) for one, other in zip(first, second, strict=True))
    return float(np.abs(first - second).max() / max(np.abs(second).max(), 1e-300))


@pytest.mark.slow_cases("True")
@pytest.mark.parametrize("partials", [True, False])
def test_a_tyre_in_c_is_the_tyre_by_definitions(folder: Path, *, partials: bool) -> None:
    law = TYRE_LAW if partials else WITHOUT
    model, formula = (eomgen.build(scene) for scene in (wheel_scene(law, folder), wheel_scene(None)))
    q, v = states(model)
    assert difference(model.forward_dynamics(q, v), formula.forward_dynamics(q, v)) < 1e-13
    a = formula.forward_dynamics(q, v)
    slopes = difference(tuple(model.partials(q, v, a)), tuple(formula.partials(q, v, a)))
    assert slopes < (1e-13 if partials else 1e-9)
    assert partials or slopes > 1e-14


@pytest.mark.slow
@pytest.mark.parametrize("method", ["rosenbrock", "generalized_alpha", "dopri5"])
def test_runs_by_a_law_are_runs_by_the_formula(folder: Path, method: str) -> None:
    scenes = wheel_scene(TYRE_LAW, folder), wheel_scene(None)
    tight = {"settings": {"rtol": 1e-14, "atol": 1e-16}} if method == "generalized_alpha" else {}
    run, expected = (eomgen.build(scene, method=method).simulate(t_end=0.5, **tight) for scene in scenes)
    assert difference(run.q, expected.q) < 1e-11
    assert difference(run.v, expected.v) < 1e-11
    assert difference(run.outputs["forces"], expected.outputs["forces"]) < 1e-10


@pytest.mark.slow
def test_linear_models_and_derivatives_of_runs(folder: Path) -> None:
    model, formula = (eomgen.build(scene) for scene in (wheel_scene(TYRE_LAW, folder), wheel_scene(None)))
    linear, expected = (item.linearize(*(row[0] for row in states(model))) for item in (model, formula))
    assert difference(linear.state_space().A, expected.state_space().A) < 1e-12
    given = {"t_end": 0.05, "by": ["mu"], "settings": {"rtol": 1e-14, "atol": 1e-16}}
    run, formula_run = (item.sensitivities(**given) for item in (model, formula))
    assert difference(run.derivatives["forces"], formula_run.derivatives["forces"]) < 1e-8


@pytest.mark.slow
def test_generated_c_has_the_file_and_runs(folder: Path) -> None:
    eomgen.generate(wheel_scene(TYRE_LAW, folder), folder / "c")
    text = (folder / "c" / "car_user_tyre.c").read_text(encoding="utf-8")
    assert TYRE_C in text
    command = json.loads((folder / "c" / "manifest.json").read_text(encoding="utf-8"))["compile"]
    subprocess.run(f"{command} -Wall -Wextra -Werror", shell=True, cwd=folder / "c", check=True)
    subprocess.run(["./car"], cwd=folder / "c", check=True, capture_output=True)


@pytest.mark.slow
def test_ensembles_have_the_bits_of_single_runs(folder: Path) -> None:
    model = eomgen.build(wheel_scene(TYRE_LAW, folder))
    values = np.linspace(0.5, 1.0, 9)
    many = model.simulate_many(t_end=0.1, table={"mu": values})
    for place in (0, 3, 8):
        single = model.simulate(t_end=0.1, parameters={"mu": values[place]})
        assert many.results["output.forces[0].final"][place] == single.outputs["forces"][-1, 0]


def test_derivatives_of_third_order_are_not_numbers(folder: Path) -> None:
    """Complex steps through second derivatives would need the next order: no other number stands for that."""
    system = derive(from_data(wheel_scene(TYRE_LAW, folder)), ["rates"])
    blocks = {name: np.full(size, 0.01 + 0j) for name, size in (("q", 5), ("v", 5), ("a", 5), ("j", 5), ("s", 5))}
    blocks["v"] += np.array([0.0, 20.0, 0.5, 0.0, 60.0])
    blocks["p"] = np.array([0.9 + 0j])
    evaluate = tape_evaluator(system)
    real = evaluate("rates", blocks)["tau_ddot"]
    assert np.all(np.isfinite(real)) and not np.any(real.imag)
    moved = evaluate("rates", {**blocks, "v": blocks["v"] + 1e-30j})
    assert np.all(np.isfinite(moved["tau_dot"])) and np.any(np.isnan(moved["tau_ddot"]))


@pytest.mark.slow
def test_verification_of_closed_forms_takes_laws(folder: Path) -> None:
    report = eomgen.studies.check(wheel_scene(TYRE_LAW, folder), only=["rates", "partials"], states=2)
    assert {form.name: form.verdict for form in report.forms if form.verdict == "FAILS"} == {}
