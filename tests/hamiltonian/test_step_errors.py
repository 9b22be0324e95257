"""Estimates of the errors of steps of Hamiltonian systems, held against motions that are known."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.base.arrays import Array
from eomgen.cli import main
from eomgen.errors import NumericalError
from eomgen.products.fields.hamiltonian.model import HamiltonianModel
from eomgen.products.fields.hamiltonian.solution import estimate_errors
from tests.hamiltonian.systems import OSCILLATOR, system
from tests.hamiltonian.test_hamiltonian import HENON_HEILES
from tests.models.toml_text import toml_text


def _model(data: Any = OSCILLATOR) -> HamiltonianModel:
    made: Any = eomgen.build(data, profile="quick")
    return made


@pytest.mark.parametrize(
    ("method", "step", "every", "runs"),
    [
        ("leapfrog", 0.1, 1, "runs in steps of 0.2 and 0.4"),
        ("omf4", 0.5, 1, "runs in steps of 1 and 2"),
        ("suzuki4", 0.1, 3, "runs in steps of 0.2 and 0.4"),
        ("gauss6", 0.25, 7, "runs in steps of 0.5 and 1"),
        ("implicit_midpoint", 20 / 201, 1, "a run in steps of 0.0497512"),  # an odd number of steps
        ("leapfrog", 0.8, 1, "a run in steps of 0.4"),  # not stable in steps four times as long
    ],
)
def test_estimates_are_the_errors(method: str, step: float, every: int, runs: str) -> None:
    run = _model().simulate(20.0, step, method=method, record_every=every)
    found = run.error_estimate
    assert found.available and found.method == runs
    exact = np.stack([np.cos(run.t), -np.sin(run.t)], axis=1)
    error = np.abs(np.hstack([run.q, run.p]) - exact).max()
    assert found.relative * 2 == pytest.approx(error, rel=0.3)  # x and p_x go from -1 to 1
    assert found.error == pytest.approx(error, rel=0.3) and found.name in ("x", "p_x")
    assert math.isnan(found.order) or found.order == pytest.approx(run.metadata["order"], abs=0.5)


def test_a_chaotic_motion_is_said_to_be_lost() -> None:
    model = _model(HENON_HEILES)
    start = {"x": 0.0, "y": -0.15, "p_x": 0.49, "p_y": 0.0}
    run = model.simulate(400.0, 0.1, method="leapfrog", initial=start)
    finer = model.simulate(400.0, 0.01, method="kahan_li8", initial=start, record_every=10, error_estimate=False)
    apart = np.abs(run.q - finer.q).max(axis=1) / np.ptp(finer.q, axis=0).min()
    lost = float(run.t[np.flatnonzero(apart > 0.1)[0]])
    assert run.error_estimate.lost_at == pytest.approx(lost, rel=0.25)
    assert str(run.error_estimate).startswith(f"above 10 % of the motion from t = {run.error_estimate.lost_at:.6g} on")


def test_what_is_not_known_is_said() -> None:
    model = _model()
    switched_off = model.simulate(1.0, error_estimate=False).error_estimate
    assert str(switched_off) == "not known: it was switched off"
    assert switched_off.summary()["relative"] is None
    assert str(model.simulate(0.0).error_estimate) == "not known: the run made no step"

    def fails(multiple: float, spacing: int) -> Array | None:
        return None

    found = estimate_errors(np.zeros((3, 2)), 0.1, 1, 2, 2, ["x", "p_x"], fails)
    assert str(found) == "not known: a run in steps of 0.05 failed"
    exact = model.simulate(4.0, 0.1, method="gauss12").error_estimate
    assert exact.relative < 1e-13


def test_the_command_line_and_files_say_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "oscillator.toml"
    file.write_text(toml_text(OSCILLATOR))
    arguments = ["simulate", str(file), "--out", str(tmp_path / "out"), "--t-end", "10", "--step", "0.1", "--no-plots"]
    assert main(arguments) == 0
    assert "by runs in steps of 0.2 and 0.4" in capsys.readouterr().out
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())["error_estimate"]
    assert summary["declared_order"] == 4 and 0 < summary["relative"] < 1e-5 and summary["lost_at"] is None
    assert main([*arguments, "--no-error-estimate", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["error_estimate"]["reason"] == "it was switched off"


COLLISION = system(
    "collision",
    "p_x**2/2 - 1/abs(x)",
    coordinates={"x": {"initial": [1.0, 0.0]}},
    simulation={"duration": 5.0, "step": 0.01},
)
TEXT = r"reached t = 5 in 500 steps; H, which nothing changes, goes from -1 to [\d.e+-]+: this is not the motion of the"


def test_a_run_whose_energy_explodes_has_failed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Two bodies fall into each other: steps pass the singularity, and H is 3e7 times what it was."""
    run = eomgen.build(COLLISION, profile="quick").simulate()
    assert not run.success and re.match(TEXT, run.message)
    assert run.message.endswith("motion of the system; try: a step smaller than 0.01, or rk45")
    file = tmp_path / "collision.toml"
    file.write_text(toml_text(COLLISION), encoding="utf-8")
    assert main(["simulate", str(file), "--out", str(tmp_path / "out"), "--no-plots"]) == NumericalError.exit_code
    said = capsys.readouterr()
    assert "goes from -1 to" in said.out + said.err
    assert json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))["success"] is False
