"""FMUs of the covering examples, built from the sources: no warnings of the compiler, no findings of validators, the
bits of ``simulate`` in co-simulation, and model exchange against refined runs.

The C of both versions is the same but for the interface, so an example is exported in one version, in turn, and four
examples in both."""

from __future__ import annotations

import subprocess
import zipfile
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import fmpy
import numpy as np
import pytest

import eomgen
from eomgen.base.files import template_folder
from eomgen.products.fmu.binary import this_machine
from tests.examples.covering import covering
from tests.examples.test_gear_with_backlash import reference as gear_rows
from tests.fmu.importers import columns, recorded, run, toolbox_findings, written

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
#: Examples in both versions: a loop, events, a car and a sampled controller.
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
#: Examples in model exchange: jumps, samples, a loop, contacts, rolling, and rotations.
EXCHANGED = (
    *("active_quarter_car/scene.toml", "half_car_on_measured_road/scene.toml", "pi_servo/sampled.toml", ROUGH),
    *("four_bar/scene.toml", "rattleback/scene.toml", "jerk_limited_arm/scene.toml"),
)
in_turn = pytest.mark.parametrize(("name", "version"), UNITS)


@cache
def scene_of(name: str) -> eomgen.Scene:
    return eomgen.load(EXAMPLES / name)


@cache
def model_of(name: str) -> eomgen.Model:
    return eomgen.build(scene_of(name))


@cache
def file_of(name: str, version: int) -> Path:
    return library_of(sources_of(name, version), version, sharing=name in SHARING)


def library_of(folder: Path, version: int, *, sharing: bool = False) -> Path:
    """Return the folder of an FMU after its library was built from the sources, without a warning."""
    flags = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-O1", "-fPIC", "-shared"]
    flags += [f"-I{template_folder() / 'fmu' / f'fmi{version}'}", f"-DFMI{version}_OVERRIDE_FUNCTION_PREFIX"]
    flags += ["-Wno-restrict", "-Wno-unused-parameter"] if sharing else []
    identifier = fmpy.read_model_description(str(folder)).coSimulation.modelIdentifier
    library = folder / this_machine(version).library_path(version, identifier)
    library.parent.mkdir(parents=True)
    sources = sorted((folder / "sources").glob("*.c"))
    done = subprocess.run(["gcc", *flags, *sources, "-o", library, "-lm"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    return folder


def sources_of(name: str, version: int) -> Path:
    """Return a new folder of an FMU without a library."""
    return unpacked(written(scene_of(name), version, binary=False))


def unpacked(file: Path) -> Path:
    """Return the folder of an FMU without a library."""
    folder = file.with_suffix("")
    with zipfile.ZipFile(file) as archive:
        archive.extractall(folder)
    assert not (folder / "binaries").exists()
    return folder


@pytest.mark.slow
@pytest.mark.long_except(*SECOND)
@in_turn
def test_co_simulation_has_the_bits_of_simulate(name: str, version: int) -> None:
    simulation = scene_of(name).simulation
    end = min(simulation.duration, STEPS * simulation.step)
    rows = run(file_of(name, version), "CoSimulation", end, simulation.step)
    solution = model_of(name).simulate(end, record_every=1, error_estimate=False)
    known = columns(solution, recorded(file_of(name, version)))
    assert known and toolbox_findings(file_of(name, version).with_suffix(".fmu")) == []
    for column, values in known.items():
        assert np.array_equal(rows[column][: len(values)], values), column


@cache
def sizes_of(name: str, version: int) -> Mapping[str, float]:
    """Return the size of the motion, by columns."""
    solution = model_of(name).simulate(error_estimate=False)
    found = columns(solution, recorded(file_of(name, version)))
    return {column: max(1.0, float(np.max(np.abs(values)))) for column, values in found.items()}


def refined(name: str, version: int, end: float, interval: float) -> eomgen.Solution:
    """Return a run with rows at an interval, s: of order 4 in parts of the interval, known to a tenth of the error."""
    model = model_of(name)
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


@pytest.mark.slow
@pytest.mark.long_except(*SECOND)
@pytest.mark.parametrize(("name", "version"), [unit for unit in UNITS if unit.values[0] in EXCHANGED])
def test_model_exchange_meets_a_refined_run(name: str, version: int) -> None:
    simulation = scene_of(name).simulation
    interval = simulation.step
    end = min(simulation.duration, STEPS * interval)
    file = file_of(name, version)
    rows = run(file, "ModelExchange", end, interval, relative_tolerance=1e-10)
    times = np.asarray(rows["time"])
    if name == ROUGH:
        at, close = interval * np.arange(STEPS + 1), CLOSE_OF_ROUGH
        states = np.concatenate([np.zeros((1, 4)), gear_rows(at[1:])])
        known = dict(zip(("q.motor", "q.load", "v.motor", "v.load"), states.T, strict=True))
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
