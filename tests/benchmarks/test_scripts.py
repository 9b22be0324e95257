"""The benchmarks' own numbers are right where they can be checked quickly; nothing here asserts a time."""

from __future__ import annotations

import json
import re
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from benchmarks import (
    beam_kernels,
    beam_simulations,
    build_time,
    equal_elements,
    frame_peers,
    implicit_steps,
    lane_steppers,
    large_files,
    real_time_steps,
    regressor,
    robot_dynamics,
    sensitivities,
    solar_system,
    spin_up_beam,
    statics,
    stepper_overhead,
    stepping,
    steps_in_passes,
    time_derivatives,
)
from tests.models.shear_frame import RESPONSE, SCALE


def quick(script: ModuleType, folder: Path, *options: str) -> dict[str, Any]:
    """Run a script with its small cases and return what it writes."""
    assert script.main(["--quick", *options, "--json", str(folder / "out.json")]) == 0
    written: dict[str, Any] = json.loads((folder / "out.json").read_text(encoding="utf-8"))
    return written


@pytest.mark.long
def test_robot_dynamics_finds_its_own_numbers_right(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status = robot_dynamics.main(
        ["--quick", "--work", str(tmp_path), "--functions", "inverse_dynamics", "forward_dynamics"]
    )
    lines = capsys.readouterr().out.splitlines()
    assert status == 0
    assert [line.partition(",")[0] for line in lines] == [
        f"{function} {flags}: right"
        for function in ("inverse_dynamics", "forward_dynamics")
        for flags in ("O3", "fast")
    ]


@pytest.mark.long
def test_the_regressor_is_pinocchios(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert regressor.main(["--quick", "--work", str(tmp_path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.partition(",")[0] for line in lines] == [f"panda eomgen {flags}: right" for flags in ("O3", "fast")]


@pytest.mark.long
def test_gradients_through_loops_lose_no_digits_by_the_order_of_pivots() -> None:
    """Of 2000 steps of a car on wishbones, whose matrices are eliminated in one order of pivots: the choice by one step
    differed by 2e-9, partial pivoting in each step by 4e-11."""
    model = sensitivities.loops("car")
    step = model.library.layout["defaults"]["step"]
    assert sensitivities.difference(model, 2000 * step, step, {"method": "generalized_alpha"}) <= 5e-11


@pytest.mark.long
def test_gradients_of_a_run_are_its_tangents(capsys: pytest.CaptureFixture[str]) -> None:
    assert sensitivities.main(["--quick"]) == 0
    said = re.fullmatch(r"24 parameters: gradient and tangents differ by (\S+)\n", capsys.readouterr().out)
    assert said is not None and 0.0 < float(said[1]) <= 1e-11


@pytest.mark.long
def test_steppers_in_lanes_have_the_bits_of_one(capsys: pytest.CaptureFixture[str]) -> None:
    assert lane_steppers.main(["--quick"]) == 0
    said = capsys.readouterr().out
    rows = [[cell.strip() for cell in line.split("|")] for line in said.splitlines() if "generalized_alpha" in line]
    assert [(row[1], row[4]) for row in rows] == [("four_bar", "yes"), ("symmetric_top", "yes")]
    assert float(re.findall(r"apart by (\S+)", said)[0]) < 1e-12


@pytest.mark.long
def test_time_derivatives_meet_the_closed_form(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert time_derivatives.main(["--quick", "--work", str(tmp_path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 12 and all(float(line.rpartition(" ")[2]) <= 1e-13 for line in lines)


def test_a_wrong_result_is_not_timed() -> None:
    expected = np.array([[1.0, -4.0], [0.0, 2.0]])
    assert robot_dynamics.error_of(np.array([[1.0, -4.0], [1e-9, 2.0]]), expected) == pytest.approx(2.5e-10)
    assert robot_dynamics.error_of(expected[:1], expected) == float("inf")


@pytest.mark.long
def test_build_time_measures_new_processes(tmp_path: Path) -> None:
    assert build_time.main(["--cases", "four_bar", "--repeats", "1", "--json", str(tmp_path / "made.json")]) == 0
    rows = json.loads((tmp_path / "made.json").read_text(encoding="utf-8"))["rows"]
    first, cached = (rows[f"four_bar, functions of runs, {state}"] for state in ("empty cache", "cached"))
    assert cached["compilers"] < 0.1 * first["compilers"]
    assert cached["build"] < first["build"]


@pytest.mark.slow
def test_stepping_reaches_the_reference(capsys: pytest.CaptureFixture[str]) -> None:
    assert stepping.main(["--quick"]) == 0
    rows = [line.split("|") for line in capsys.readouterr().out.splitlines() if line.startswith("| pendulum")]
    errors = {row[2].strip(): float(row[9]) for row in rows}
    assert errors["rk4"] < 1e-5
    assert errors["generalized_alpha"] < 1e-2


@pytest.mark.slow
def test_a_controlled_robot_moves_as_pinocchio_says(capsys: pytest.CaptureFixture[str]) -> None:
    assert stepper_overhead.main(["--quick"]) == 0
    assert "after 1000 samples: q differs from Pinocchio's by " in capsys.readouterr().out


@pytest.mark.long
def test_all_contestants_spin_the_beam_up(capsys: pytest.CaptureFixture[str]) -> None:
    assert spin_up_beam.main(["--quick"]) == 0
    rows = [line.split("|")[1:-1] for line in capsys.readouterr().out.splitlines() if line.startswith("|")][2:]
    errors = {row[0].strip(): float(row[4]) for row in rows}
    names = ["eomgen, generalized_alpha", "eomgen, rk4", "SciPy, DOP853", "SciPy, Radau", "EXUDYN, 16 elements"]
    assert list(errors) == names
    assert max(errors.values()) < 1e-7 and errors["eomgen, rk4"] < 1e-12
    assert max(errors["SciPy, DOP853"], errors["SciPy, Radau"]) <= errors["eomgen, generalized_alpha"]


@pytest.mark.long
def test_steps_in_passes_are_compared(tmp_path: Path) -> None:
    found = quick(steps_in_passes, tmp_path)
    assert max(item["error"] for item in found.values()) <= 1e-5
    assert found["stiff frame, 1e-05, rk4"]["steps"] > 100 * found["stiff frame, 1e-05, tdg3"]["steps"]


START, END, SOFT = np.array([0.0, 0.0, 0.0, 0.3, 0.0, 0.0, 0.0, 0.0]), 10.0, 2e5


def missed(end: np.ndarray | None) -> float:
    assert end is not None
    return float(np.abs((end - RESPONSE) / SCALE).max())


@pytest.mark.slow
def test_heyoka_and_rebound_have_the_planets_of_the_example() -> None:
    pytest.importorskip("heyoka")
    rows = solar_system.measured(20_000.0, 1)
    assert {row["error of"] for row in rows} == {"energy", "places, au"}
    for row in rows:
        others = ("REBOUND", "Wisdom-Holman") if Path(solar_system.REBOUND_PYTHON).exists() else ()
        for side in ("eomgen", "heyoka", *others):
            assert row[f"{side} error"] <= row["asked"] and row[f"{side} s"] > 0, row


@pytest.mark.long
def test_implicit_steps_reach_what_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(implicit_steps, "ERRORS", (1e-2,))
    rows = implicit_steps.measured()
    assert [row["method"] for row in rows] == list(implicit_steps.METHODS)
    assert all(row["reached"] <= 1e-2 and row["s"] > 0 for row in rows)


@pytest.mark.slow
def test_heyoka_has_the_equations_of_the_frame() -> None:
    pytest.importorskip("heyoka")
    runs = [way(1e-12) for way, _ in frame_peers.heyoka_ways(frame_peers.frame_in_heyoka(SOFT), START, END)]
    assert [run.label.split(", ")[2] for run in runs] == ["forward dynamics"] * 3 + ["by hand"] * 3
    assert [missed(run.call()) for run in runs] == pytest.approx([0.0] * 6, abs=1e-11)


@pytest.mark.long
def test_compiled_rates_and_jacobian_serve_scipy_and_cvode() -> None:
    ffi, library = frame_peers.compiled(SOFT, False)

    def rates(y: np.ndarray) -> np.ndarray:
        dy = np.empty(8)
        library.frame_rates(1.3, ffi.from_buffer("double[]", y), ffi.from_buffer("double[]", dy))
        return dy

    y, columns = SCALE * [0.3, -0.5, 0.8, 1.0, -0.2, 0.7, -0.6, 0.9], np.empty((8, 8))
    library.frame_jacobian(1.3, ffi.from_buffer("double[]", y), ffi.from_buffer("double[]", columns))
    differences = [(rates(y + 1e-5 * unit) - rates(y - 1e-5 * unit)) / 2e-5 for unit in np.eye(8)]
    np.testing.assert_allclose(columns, differences, atol=1e-6)
    ((radau, _), _) = frame_peers.scipy_ways(SOFT, START, END, "Radau")
    assert missed(radau(1e-9).call()) < 1e-7
    pytest.importorskip("sksundae")
    runs = [way(1e-9) for way, _ in frame_peers.cvode_ways(SOFT, END)]
    assert max(missed(run.call()) for run in runs) < 1e-4 and missed(runs[4].call()) < 1e-6
    assert runs[0].steps() > 10 * runs[4].steps() > 1000


@pytest.mark.long
def test_steps_of_one_factorization_are_compared(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    told = quick(real_time_steps, tmp_path)
    assert "| rosenbrock " in capsys.readouterr().out
    found, loop = told["errors"], told["four_bar"]["errors"]
    assert found["rosenbrock"][2] == pytest.approx(found["trapezoidal"][2], rel=0.05)
    assert found["rk4"][2] < 1e-5
    for method in ("rosenbrock", "lsrt2"):
        assert np.log2(loop[method][-2] / loop[method][-1]) == pytest.approx(2.0, abs=0.1)
    assert found["corrected_predictor"][2] == pytest.approx(found["trapezoidal"][2], rel=0.05)
    assert found["corrected_predictor"] != found["corrected_predictor, first matrix"]


@pytest.mark.long
def test_exact_beams_of_more_elements_are_built(tmp_path: Path) -> None:
    written = quick(beam_kernels, tmp_path, "--model", "kirchhoff", "--method", "rattlie")
    beams = written["beams"]
    assert (written["model"], written["method"]) == ("kirchhoff", "rattlie")
    assert [beam["elements"] for beam in beams] == [3, 6]
    assert all(beam["runs"][0]["us per step"] > 0.0 for beam in beams)
    assert beam_kernels.exponent([2, 4, 8], [3.0, 12.0, 48.0]) == pytest.approx(2.0)


@pytest.mark.long
def test_beams_are_simulated_from_a_file_twice(tmp_path: Path) -> None:
    (beam,) = quick(beam_simulations, tmp_path)["beams"]
    first, second = (beam["runs"][0][case] for case in beam_simulations.CASES)
    assert beam["elements"] == 3 and 0.0 < second["CPU, s"] < first["CPU, s"]


@pytest.mark.long
def test_statics_of_examples_are_timed(tmp_path: Path) -> None:
    jobs = quick(statics, tmp_path)["jobs"]
    assert [job["job"] for job in jobs] == ["equilibrium", "linearize", "path t"]
    assert all(job["calls"] > 5 and 0.0 < job["Python, %"] < 100.0 for job in jobs)


@pytest.mark.long
def test_large_files_are_read_and_a_blade_is_linear(capsys: pytest.CaptureFixture[str]) -> None:
    assert large_files.main(["--quick"]) == 0
    cells = [[cell.strip() for cell in line.split("|")] for line in capsys.readouterr().out.splitlines()]
    seconds = {row[1]: float(row[3]) for row in cells if len(row) > 3 and row[1] in large_files.CASES}
    assert seconds.keys() == large_files.CASES.keys() and all(0.0 < value < 600.0 for value in seconds.values())


@pytest.mark.long
def test_bars_of_more_elements_are_built(tmp_path: Path) -> None:
    bars = quick(equal_elements, tmp_path)["bars"]
    assert [bar["elements"] for bar in bars] == [3, 6]
    assert all(bar["runs"][0]["statements"] > 100 for bar in bars)
