"""Runs with a tolerance whose steps pass over a law are stepped again with a largest step, if that is affordable."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import eomgen
from eomgen.base.message_codes import code_of_finding
from eomgen.cli import main
from eomgen.products.doubts import unseen_laws
from eomgen.simulation import bounded_steps
from tests.doubts.test_laws_between_steps import LAWS, off, sliders
from tests.models.library import scene_file

NEVER = {"largest_step": 0.0}


def names(run: eomgen.Solution) -> set[str]:
    return {finding.name for finding in run.findings}


@pytest.mark.slow
@pytest.mark.parametrize("method", ["rk45", "generalized_alpha_adaptive"])
@pytest.mark.parametrize("law", ["kick at a tunable time", "linear table over place"])
def test_steps_are_bounded_for_a_law_that_they_pass_over(law: str, method: str) -> None:
    given, _, _ = LAWS[law]
    passed = sliders().simulate(2.0, 0.1, method=method, parameters=given, settings=NEVER)
    assert off(passed, given) > 0.1 and "unseen_law" in names(passed)
    run = sliders().simulate(2.0, 0.1, method=method, parameters=given)
    assert off(run, given) < 1e-4 and run.success
    (told,) = run.findings
    bound = run.metadata["settings"]["largest_step"]
    assert told.name == "bounded_steps" and told.severity == "note" and told.value == bound
    formula = "pulse if" if "kick" in law else "hill * tent("
    assert told.text.startswith(
        f"the steps are at most {bound:.3g} s, since steps by the tolerance pass over the formula"
    )
    assert formula in told.text and told.text in run.message
    assert run.stats["largest_step"] <= bound * (1.0 + 1e-9) < 0.002
    again = sliders().simulate(2.0, 0.1, method=method, parameters=given, settings={"largest_step": bound})
    assert np.array_equal(again.q, run.q)  # what the message names is what was done


@pytest.mark.slow
def test_a_bound_that_allows_too_few_steps_is_named() -> None:
    run = sliders().simulate(0.02, 0.01, method="rk45", settings={"largest_step": 1e-9}, error_estimate=False)
    assert not run.success and "; try: a largest_step of more than 1e-08 s" in run.message


def test_a_bound_that_costs_too_much_is_left_to_the_user() -> None:
    given, _, _ = LAWS["kick of 1 us"]
    run = sliders().simulate(0.8, 0.05, method="rk45", parameters=given)
    assert run.metadata["settings"]["largest_step"] == 0.0 and names(run) == {"unseen_law"}
    assert "; try: largest_step = 1.2e-07 in the settings" in run.message


def test_a_bound_with_which_the_run_fails_is_named_and_not_taken(tmp_path: Path) -> None:
    given = {"dose": 10.4, "time": 0.748, "width": 0.0098}
    options: dict[str, Any] = {"method": "generalized_alpha", "tolerance": 1e-6, "parameters": given}
    kept = tmp_path / "run.ckpt"
    run = sliders().simulate(2.0, 0.1, checkpoint=kept, **options)
    assert run.success and names(run) == {"unseen_law"} and run.metadata["settings"]["largest_step"] == 0.0
    assert (
        "; try: a method of fixed steps, of 0.0029 s (with largest_step = 0.0029 it fails at t = 0.7 s)" in run.message
    )
    assert sliders().resume(kept, 2.5).t[-1] == 2.5  # the checkpoint is of the run that is returned


def test_a_bounded_run_that_takes_many_more_steps_is_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bounded_steps, "_GIVEN_UP", 0.01)
    given, _, _ = LAWS["linear table over place"]
    kept = tmp_path / "run.ckpt"
    run = sliders().simulate(2.0, 0.1, method="rk45", parameters=given, checkpoint=kept)
    assert names(run) == {"unseen_law"} and run.metadata["settings"]["largest_step"] == 0.0
    assert "; try: largest_step = " in run.message
    assert sliders().resume(kept, 2.5).metadata["settings"]["largest_step"] == 0.0


@pytest.mark.slow
def test_the_bound_goes_with_checkpoints_files_and_resumed_runs(tmp_path: Path) -> None:
    given, _, _ = LAWS["linear table over place"]
    options: dict[str, Any] = {"method": "rk45", "parameters": given}
    whole = sliders().simulate(2.0, 0.1, **options)
    half = sliders().simulate(1.0, 0.1, checkpoint=tmp_path / "run.ckpt", **options)
    bound = half.metadata["settings"]["largest_step"]
    assert 0.0 < bound < 0.002
    resumed = sliders().resume(tmp_path / "run.ckpt", 2.0)
    assert resumed.metadata["settings"]["largest_step"] == bound
    assert f"the steps are at most {bound:.3g} s, since steps by the tolerance pass over the formula" in resumed.message
    assert np.abs(resumed.q[-1] - whole.q[-1]).max() < 1e-4
    loaded = eomgen.Solution.load(half.save(tmp_path / "run.npz"))
    assert loaded.metadata["settings"]["largest_step"] == bound and "bounded_steps" in names(loaded)
    assert sliders().attach(loaded).at(0.55).q == pytest.approx(half.at(0.55).q, abs=1e-9)


@pytest.mark.slow
def test_the_run_without_variations_decides_for_all_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    given, _, _ = LAWS["linear table over place"]
    examined: list[object] = []
    original = unseen_laws._Examination

    def examination(*args: Any, **options: Any) -> object:
        examined.append(args)
        return original(*args, **options)

    monkeypatch.setattr(unseen_laws, "_Examination", examination)
    options: dict[str, Any] = {"method": "rk45", "parameters": given, "columns": ["q.x"], "workers": 1}
    varied = sliders().simulate_many(1.5, 0.1, vary={"v.x": "normal(1, 0.05)"}, samples=3, **options)
    assert len(examined) <= 4 and "the steps are at most" not in " ".join(varied.notes)
    for value, end in zip(varied.values["v.x"], varied.results["q.x.final"], strict=True):
        true = solve_ivp(
            lambda t, y: [y[1], 100.0 * np.interp((y[0] - 0.503) / 0.01, [0.0, 0.5, 1.0], [0.0, 1.0, 0.0])],
            (0.0, 1.5), [0.0, value], max_step=1e-3, rtol=1e-8,
        )  # fmt: skip
        assert end == pytest.approx(true.y[0, -1], rel=1e-4)


@pytest.mark.slow
def test_the_command_prints_and_writes_the_bound(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    bump = {"joint": "slide", "effort": "30 if 0.503 < q.slide < 0.513 else 0"}
    start, run = {"velocity": 1.0}, {"method": "rk45", "duration": 2.0, "step": 0.1}
    free = {"joints__slide__stiffness": None, "joints__slide__initial": start, "simulation": run}
    scene = scene_file(tmp_path, "oscillator", efforts__bump=bump, **free)
    assert main(["simulate", str(scene), "--out", str(tmp_path), "--json", "--profile", "quick"]) == 0
    told = json.loads(capsys.readouterr().out)
    (found,) = (finding for finding in told["findings"] if finding["name"] == "bounded_steps")
    assert found["code"] == code_of_finding("bounded_steps")
    speed = math.sqrt(1.0 + 2.0 * 30.0 * 0.01)
    assert found["value"] < 0.01 and told["stats"]["largest_step"] <= found["value"] * (1.0 + 1e-9)
    rows = np.genfromtxt(next(tmp_path.glob("**/*.csv")), delimiter=",", names=True)
    assert rows["vslide"][-1] == pytest.approx(speed, rel=1e-4)
