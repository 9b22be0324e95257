"""FMUs of every example, in both versions, built from the sources by FMPy: no findings of validators, the bits of
``simulate`` in co-simulation, and model exchange against refined runs."""

from __future__ import annotations

import zipfile
from functools import cache
from pathlib import Path

import fmpy.build
import numpy as np
import pytest
from fmpy.validation import validate_fmu

import eomgen
from tests.fmu.importers import columns, recorded, run, toolbox_findings, written
from tests.fmu.test_linking import rebuilt_by_bd2cmake

EXAMPLES = Path(__file__).parents[2] / "examples"
SCENES = sorted(path.relative_to(EXAMPLES).as_posix() for path in EXAMPLES.glob("*/scene.toml"))
SCENES += ["pi_servo/sampled.toml", "heavy_top/joint_coordinates.toml", "heavy_top/r3xso3.toml", "heavy_top/se3.toml"]
#: Steps of the scene in a run of co-simulation.
STEPS = 40
#: Errors of model exchange by CVode at 1e-10, relative to the largest magnitude of a column, and at least 1: of
#: positions, and of velocities, which have larger derivatives.
CLOSE = {"q": 1e-8, "v": 2e-7}
#: Scenes with forces that bend sharply, in which constant steps lose their order.
ROUGH = ("gear_with_backlash/scene.toml",)
#: Too stiff for explicit steps: the scene's implicit method, of order 2, in sixteenths of an interval.
STIFF = ("misaligned_four_bar/scene.toml",)


@cache
def scene_of(name: str) -> eomgen.Scene:
    return eomgen.load(EXAMPLES / name)


@cache
def model_of(name: str) -> eomgen.Model:
    return eomgen.build(scene_of(name))


@cache
def file_of(name: str, version: int) -> Path:
    """Return the folder of an FMU whose library FMPy has built from the sources."""
    file = written(scene_of(name), version, binary=False)
    folder = file.with_suffix("")
    with zipfile.ZipFile(file) as archive:
        archive.extractall(folder)
    assert not (folder / "binaries").exists()
    fmpy.build.build_platform_binary(folder, configuration="Debug")
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("version", [2, 3])
def test_validators_have_no_findings(name: str, version: int) -> None:
    file = written(scene_of(name), version, binary=False)
    assert validate_fmu(str(file)) == []
    assert toolbox_findings(file) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("version", [2, 3])
def test_co_simulation_has_the_bits_of_simulate(name: str, version: int) -> None:
    simulation = scene_of(name).simulation
    end = min(simulation.duration, STEPS * simulation.step)
    rows = run(file_of(name, version), "CoSimulation", end, simulation.step)
    solution = model_of(name).simulate(end, record_every=1, error_estimate=False)
    known = columns(solution, recorded(file_of(name, version)))
    assert known
    for column, values in known.items():
        assert np.array_equal(rows[column][: len(values)], values), column


@pytest.mark.long
@pytest.mark.parametrize("name", SCENES)
def test_a_second_builder_makes_libraries_with_the_same_bits(name: str, tmp_path: Path) -> None:
    with zipfile.ZipFile(written(scene_of(name), 3, binary=False)) as archive:
        archive.extractall(tmp_path)
    rebuilt_by_bd2cmake(tmp_path)
    step = scene_of(name).simulation.step
    rows, others = (run(file, "CoSimulation", 5 * step, step) for file in (tmp_path, file_of(name, 3)))
    assert len(rows) == 6 and all(np.array_equal(rows[column], others[column]) for column in recorded(tmp_path))


def refined(name: str, end: float, interval: float) -> eomgen.Solution:
    """Return a run with rows at an interval, s: of order 4 in parts of the interval, known to 1e-9."""
    model = model_of(name)
    if name in ROUGH:
        return model.simulate(end, interval, method="rk45", tolerance=1e-11, error_estimate=False)
    if name in STIFF:
        return model.simulate(end, interval / 16, record_every=16, error_estimate=False)
    method = "rk4_partitioned" if model.multipliers else "rk4"
    one, other = (
        model.simulate(end, interval / parts, method=method, record_every=parts, error_estimate=False)
        for parts in (8, 16)
    )
    assert np.max(np.abs(one.q - other.q)) <= 1e-9 * max(1.0, np.max(np.abs(other.q)))
    return other


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("version", [pytest.param(2, marks=pytest.mark.long), 3])  # both have the same equations
def test_model_exchange_meets_a_refined_run(name: str, version: int) -> None:
    simulation = scene_of(name).simulation
    interval = simulation.step
    end = min(simulation.duration, STEPS * interval)
    rows = run(file_of(name, version), "ModelExchange", end, interval, relative_tolerance=1e-10)
    times = np.asarray(rows["time"])
    solution = refined(name, end, interval)
    last = np.searchsorted(times, solution.t + 1e-3 * interval) - 1  # of rows at one time, after events
    states = [column for column in recorded(file_of(name, version)) if column.startswith(("q.", "v."))]
    assert states
    for column, values in columns(solution, states).items():
        off = np.max(np.abs(rows[column][last] - values))
        assert off <= CLOSE[column[0]] * max(1.0, np.max(np.abs(values))), (column, off)
