"""FMUs of the covering examples, built from the sources: no warnings of the compiler, no findings of validators, the
bits of ``simulate`` in co-simulation, and model exchange against refined runs.

The C of both versions is the same but for the interface, so an example is exported in one version, in turn, and four
examples in both."""

from __future__ import annotations

import subprocess
import zipfile
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from fmpy import sharedLibraryExtension
from fmpy.validation import validate_fmu
from scipy.integrate import solve_ivp

import eomgen
from eomgen.base.files import template_folder
from eomgen.products.fmu.binary import platform_folder
from tests.examples.covering import covering
from tests.fmu.importers import Rows, columns, recorded, run, toolbox_findings, written
from tests.fmu.test_linking import rebuilt_by_bd2cmake, rebuilt_by_fmpy

Array = np.ndarray
EXAMPLES = Path(__file__).parents[2] / "examples"
#: Their shared functions read and write different elements of one array, or have an argument that only others of their
#: kind need: gcc warns of both.
SHARING = ("misaligned_four_bar/scene.toml",)
#: Steps of the scene in a run of co-simulation.
STEPS = 40
#: Errors of model exchange by CVode at 1e-10, relative to the size of the motion: of a column the largest magnitude in
#: the scene's whole run, and at least 1 of its unit.
CLOSE = 1e-8
#: Forces jump where teeth meet and part, and model exchange has no events there.
ROUGH, CLOSE_OF_ROUGH = "gear_with_backlash/scene.toml", 5e-8
#: Of SciPy.
PRECISE: Any = {"rtol": 3e-14, "atol": 1e-15, "max_step": 1e-3}
#: Too stiff for explicit steps: the scene's implicit method, of order 2, in sixteenths of an interval.
STIFF = ("misaligned_four_bar/scene.toml",)
#: Examples in both versions: a loop, events, a car and a sampled controller. Other builders build their sources, too.
BOTH = ("four_bar/scene.toml", "bouncing_ball/scene.toml", "active_vehicle/scene.toml", "pi_servo/sampled.toml")
EVERY = [
    *sorted(path.relative_to(EXAMPLES).as_posix() for path in EXAMPLES.glob("*/scene.toml")),
    *("pi_servo/sampled.toml", "heavy_top/joint_coordinates.toml", "heavy_top/r3xso3.toml", "heavy_top/se3.toml"),
]
SCENES = covering(EVERY, also=BOTH)
#: Examples and their versions.
UNITS = [
    pytest.param(name, version, id=f"{version}-{name}")
    for place, name in enumerate(EVERY)
    for version in ((2, 3) if name in BOTH else (2 + place % 2,))
    if name in SCENES
]
#: Units of the second tier, of both versions, with rows of a table and with samples.
SECOND = ("2-active_quarter_car/scene.toml", "3-half_car_on_measured_road/scene.toml", "3-pi_servo/sampled.toml")
in_turn = pytest.mark.parametrize(("name", "version"), UNITS)


@cache
def scene_of(name: str) -> eomgen.Scene:
    return eomgen.load(EXAMPLES / name)


@cache
def model_of(name: str) -> eomgen.Model:
    return eomgen.build(scene_of(name))


@cache
def file_of(name: str, version: int) -> Path:
    """Return the folder of an FMU whose library is built from the sources, without a warning."""
    folder = sources_of(name, version)
    flags = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-O1", "-fPIC", "-shared"]
    flags += [f"-I{template_folder() / 'fmu' / f'fmi{version}'}", f"-DFMI{version}_OVERRIDE_FUNCTION_PREFIX"]
    flags += ["-Wno-restrict", "-Wno-unused-parameter"] if name in SHARING else []
    identifier = fmpy.read_model_description(str(folder)).coSimulation.modelIdentifier
    library = folder / "binaries" / platform_folder(version) / f"{identifier}{sharedLibraryExtension}"
    library.parent.mkdir(parents=True)
    sources = sorted((folder / "sources").glob("*.c"))
    done = subprocess.run(["gcc", *flags, *sources, "-o", library, "-lm"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    return folder


def sources_of(name: str, version: int) -> Path:
    """Return a new folder of an FMU without a library."""
    file = written(scene_of(name), version, binary=False)
    folder = file.with_suffix("")
    with zipfile.ZipFile(file) as archive:
        archive.extractall(folder)
    assert not (folder / "binaries").exists()
    return folder


@pytest.mark.slow
@pytest.mark.long_except(*SECOND)
@in_turn
def test_validators_have_no_findings(name: str, version: int) -> None:
    file = file_of(name, version).with_suffix(".fmu")
    assert validate_fmu(str(file)) == []
    assert toolbox_findings(file) == []


@pytest.mark.slow
@pytest.mark.long_except(*SECOND)
@in_turn
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
@pytest.mark.parametrize("name", BOTH)
@pytest.mark.parametrize(("version", "build"), [(2, rebuilt_by_fmpy), (3, rebuilt_by_fmpy), (3, rebuilt_by_bd2cmake)])
def test_other_builders_make_libraries_with_the_same_bits(
    name: str, version: int, build: Callable[[Path], None]
) -> None:
    folder = sources_of(name, version)
    build(folder)
    step = scene_of(name).simulation.step
    rows, known = (run(file, "CoSimulation", 5 * step, step) for file in (folder, file_of(name, version)))
    assert len(rows) == 6 and all(np.array_equal(rows[column], known[column]) for column in recorded(folder))


@cache
def sizes_of(name: str, version: int) -> Mapping[str, float]:
    """Return the size of the motion, by columns."""
    solution = model_of(name).simulate(error_estimate=False)
    found = columns(solution, recorded(file_of(name, version)))
    return {column: max(1.0, float(np.max(np.abs(values)))) for column, values in found.items()}


def refined(name: str, version: int, end: float, interval: float) -> eomgen.Solution:
    """Return a run with rows at an interval, s: of order 4 in parts of the interval, known to a tenth of the error."""
    model = model_of(name)
    if name in STIFF:
        return model.simulate(end, interval / 64, record_every=64, error_estimate=False)
    method = "rk4_partitioned" if model.multipliers else "rk4"
    one, other = (
        model.simulate(end, interval / parts, method=method, record_every=parts, error_estimate=False)
        for parts in (16, 32)
    )
    names, sizes = recorded(file_of(name, version)), sizes_of(name, version)
    coarse = columns(one, names)
    for column, values in columns(other, names).items():
        assert np.max(np.abs(coarse[column] - values)) <= 0.1 * CLOSE * sizes[column], column
    return other


def gear_rows(times: Array) -> Rows:
    """Return the motion of the gear with backlash in pieces, between times at which teeth meet or part, by SciPy."""
    play, stiffness, damping, motor, drum = np.deg2rad(0.6), 8e3, 4.0, 2e-3, 0.05

    def torque(x: Array, flank: int) -> float:
        twist, rate = x[0] / 3.0 - x[1], x[2] / 3.0 - x[3]
        return float(stiffness * (twist - flank * play / 2) + damping * rate) if flank else 0.0

    def rate(t: float, x: Array, flank: int) -> list[float]:
        teeth = torque(x, flank)
        return [x[2], x[3], (1.5 * np.sin(40.0 * t) - teeth / 3.0) / motor, (teeth - 0.1 * x[3]) / drum]

    def meeting(flank: int) -> Any:
        def root(t: float, x: Array, now: int) -> float:
            return float(flank * (x[0] / 3.0 - x[1]) - play / 2)

        root.direction, root.terminal = 1.0, True  # type: ignore[attr-defined]
        return root

    def parting(t: float, x: Array, flank: int) -> float:
        return flank * torque(x, flank)

    parting.direction, parting.terminal = -1.0, True  # type: ignore[attr-defined]
    flank, states, begin, x = 0, [np.zeros(4)], 0.0, np.zeros(4)
    while len(states) < len(times):
        events = [parting] if flank else [meeting(1), meeting(-1)]
        piece = solve_ivp(
            rate, (begin, times[-1]), x, "DOP853", times[len(states) :], args=(flank,), events=events, **PRECISE
        )
        states += list(piece.y.T)
        if piece.status == 1:
            which = next(k for k, found in enumerate(piece.t_events) if len(found))
            begin, x = float(piece.t_events[which][0]), piece.y_events[which][0]
            flank = 0 if flank else 1 - 2 * which
    q = np.array(states)
    return dict(zip(("q.motor", "q.load", "v.motor", "v.load"), q.T, strict=True)) | {"twist": q[:, 0] / 3.0 - q[:, 1]}


@pytest.mark.slow
@pytest.mark.long_except(*SECOND)
@in_turn
def test_model_exchange_meets_a_refined_run(name: str, version: int) -> None:
    simulation = scene_of(name).simulation
    interval = simulation.step
    end = min(simulation.duration, STEPS * interval)
    file = file_of(name, version)
    rows = run(file, "ModelExchange", end, interval, relative_tolerance=1e-10)
    times = np.asarray(rows["time"])
    if name == ROUGH:
        known, close = gear_rows(interval * np.arange(STEPS + 1)), CLOSE_OF_ROUGH
        at = interval * np.arange(STEPS + 1)
    else:
        solution = refined(name, version, end, interval)
        known, close, at = columns(solution, recorded(file)), CLOSE, solution.t
    # rows of simulate are before samples of their time and after events, and importers have no row before the first
    last = np.searchsorted(times, at + 1e-3 * interval)[1:] - 1
    first = np.searchsorted(times, at - 1e-3 * interval)[1:]
    assert {column[:2] for column in known} >= {"q.", "v."}
    for column, values in known.items():
        off = [np.abs(rows[column][row] - values[1:]) for row in (first, last)]
        assert np.max(np.minimum(*off)) <= close * sizes_of(name, version)[column], (column, np.max(np.minimum(*off)))
