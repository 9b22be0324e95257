"""Scenes of benchmarks with contacts: equal motions by equal laws, errors; nothing here asserts a time."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks import car_runs, contact_peers


@pytest.mark.slow
def test_a_car_on_the_law_of_exudyn_moves_as_in_exudyn() -> None:
    theirs = contact_peers.exudyn_ways("car")[0].run(800)
    ours = contact_peers.eomgen_ways("car", "exudyn")[0].run(800)
    np.testing.assert_allclose(ours, theirs, atol=1e-6)
    other = contact_peers.eomgen_ways("car", "drake")[0].run(800)
    assert np.abs(other - theirs).max() > 1e-2  # the laws are not the same


@pytest.mark.slow
@pytest.mark.parametrize("work", contact_peers.WORKS)
def test_scenes_on_the_law_of_drake_move_as_in_drake(work: str) -> None:
    pytest.importorskip("pydrake")
    theirs = contact_peers.drake_ways(work)[0].run(1e-6)
    np.testing.assert_allclose(contact_peers.eomgen_ways(work, "drake")[1].run(1e-9), theirs, atol=1e-4)


@pytest.mark.slow
def test_the_script_runs(capsys: pytest.CaptureFixture[str]) -> None:
    assert contact_peers.main(["--quick", "--works", "car"]) == 0
    assert "eomgen, EXUDYN's law" in capsys.readouterr().out


@pytest.mark.slow
def test_the_error_of_a_step_steer_is_the_one_of_its_steps(capsys: pytest.CaptureFixture[str]) -> None:
    """Newton's method may end at corrections of 1e-10 or of 1e-5; a wheel without slip takes one evaluation."""
    assert car_runs.main(["--quick", "--cars", "car"]) == 0
    lines = [line for line in capsys.readouterr().out.splitlines() if "generalized_alpha" in line]
    rows = [line.strip("| ").split("|") for line in lines]
    errors, calls = ([float(rows[k][column]) for k in (0, 1)] for column in (6, 3))
    assert errors[0] < 1e-3 and errors[1] == pytest.approx(errors[0], rel=0.1)
    assert calls[1] < calls[0] < 2.0
