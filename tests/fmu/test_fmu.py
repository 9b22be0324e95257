"""FMUs of a pendulum: validated by FMPy, run as co-simulation to the bits of ``simulate``, and as model exchange."""

from __future__ import annotations

import tomllib
import zipfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import fmpy
import fmpy.fmi2
import fmpy.fmi3
import fmpy.util
import numpy as np
import pytest
from fmpy.validation import validate_fmu

import eomgen
from eomgen.products.fmu.export import fmu_files
from tests.fmu.importers import columns, names_of, recorded, run, written
from tests.models.doubtful_scenes import UNRESOLVED, stuck
from tests.models.scenes import PENDULUM_TOML

STEP, END = 1e-3, 0.2


@cache
def pendulum() -> eomgen.Scene:
    """Return the pendulum with a torque that the importer gives, and a formula for its base."""
    data = tomllib.loads(PENDULUM_TOML)
    data["inputs"]["push"] = {"unit": "N m"}
    data["efforts"]["hand"] = {"joint": "hinge", "effort": "push"}
    return eomgen.load(data)


@cache
def file_of(version: int) -> Path:
    return written(pendulum(), version)


@cache
def model() -> eomgen.Model:
    return eomgen.build(pendulum())


@pytest.mark.slow
@pytest.mark.parametrize("version", [pytest.param(2, marks=pytest.mark.slow), 3])
def test_co_simulation_has_the_bits_of_simulate(version: int) -> None:
    file = file_of(version)
    assert validate_fmu(str(file)) == []
    rows = run(file, "CoSimulation", END, STEP)
    solution = model().simulate(END, STEP, error_estimate=False)
    for name, values in columns(solution, recorded(file)).items():
        assert np.array_equal(rows[name], values), name


@pytest.mark.long_cases("3")
@pytest.mark.slow_cases("3")
@pytest.mark.parametrize("version", [pytest.param(2, marks=pytest.mark.slow), 3])
def test_model_exchange_meets_a_refined_run(version: int) -> None:
    rows = run(file_of(version), "ModelExchange", END, 1e-2, relative_tolerance=1e-11)
    solution = model().simulate(END, 1e-2, method="taylor", tolerance=1e-13, error_estimate=False)
    for name, values in columns(solution, recorded(file_of(version))).items():
        assert np.max(np.abs(rows[name] - values)) <= 1e-8, name


def test_inputs_of_the_importer_are_held_over_steps() -> None:
    """A push of 0.3 N m from 0.05 s on: the same bits as in a run whose caller steps."""

    def stepped(changed: Callable[[float], float]) -> np.ndarray[Any, Any]:
        simulator = model().start(step=STEP)
        rows = [simulator.q[0]]
        for k in range(round(END / STEP)):
            simulator.step({"push": changed(k * STEP)})
            rows.append(simulator.q[0])
        return np.array(rows)

    held = stepped(lambda t: 0.3 if t > 0.05 - 1e-9 else 0.0)
    with_signal = _stepped_fmu(file_of(3), lambda t: 0.3 if t > 0.05 - 1e-9 else 0.0)
    assert np.array_equal(with_signal, held)
    assert not np.array_equal(held, stepped(lambda _: 0.0))


def _opened(file: Path) -> tuple[Any, Any]:
    """Return a loaded FMU of FMI 3.0, initialised for co-simulation, and value references by name."""
    unzipped = fmpy.extract(str(file))
    description = fmpy.read_model_description(unzipped)
    loaded = fmpy.fmi3.FMU3Slave(
        guid=description.guid,
        unzipDirectory=unzipped,
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="one",
    )
    loaded.instantiate()
    loaded.enterInitializationMode(startTime=0.0)
    loaded.exitInitializationMode()
    return loaded, {item.name: item.valueReference for item in description.modelVariables}


def _stepped_fmu(file: Path, signal: Callable[[float], float]) -> np.ndarray[Any, Any]:
    loaded, places = _opened(file)
    rows = loaded.getFloat64([places["q.hinge"]])
    for k in range(round(END / STEP)):
        loaded.setFloat64([places["push"]], [signal(k * STEP)])
        loaded.doStep(k * STEP, STEP)
        rows += loaded.getFloat64([places["q.hinge"]])
    loaded.terminate()
    loaded.freeInstance()
    return np.array(rows)


def test_states_of_the_fmu_are_copies(rng: np.random.Generator) -> None:
    """Motions that go back and forth, and that go on from bytes in another instance, have the same bits."""
    loaded, places = _opened(file_of(3))
    wanted = [places[name] for name in ("q.hinge", "v.hinge", "tip[0]")]
    steps = 40
    plain = []
    for k in range(steps):
        loaded.doStep(k * STEP, STEP)
        plain.append(loaded.getFloat64(wanted))
    loaded.reset()
    loaded.enterInitializationMode(startTime=0.0)
    loaded.exitInitializationMode()
    done, other = 0, _opened(file_of(3))[0]
    while done < steps:
        kept = loaded.getFMUState()
        ahead = int(rng.integers(1, 5))
        for k in range(done, done + ahead):
            loaded.doStep(k * STEP, STEP)
        if rng.random() < 0.5:
            loaded.setFMUState(kept)
            other_state = other.deserializeFMUState(loaded.serializeFMUState(kept))
            other.setFMUState(other_state)
            other.doStep(done * STEP, STEP)
            assert other.getFloat64(wanted) == plain[done]
            other.freeFMUState(other_state)
        else:
            done += ahead
            if done <= steps:
                assert loaded.getFloat64(wanted) == plain[done - 1]
        loaded.freeFMUState(kept)
    with pytest.raises(Exception, match="fmi3DeserializeFMUState"):
        other.deserializeFMUState(bytes(10))


def test_the_archive_has_the_same_bytes_each_time_and_no_headers() -> None:
    files = fmu_files(pendulum(), binary=False, reference=False).files
    assert files == fmu_files(pendulum(), binary=False, reference=False).files
    assert not [name for name in files if "fmi3Functions" in name]
    assert {"modelDescription.xml", "sources/buildDescription.xml", "documentation/index.html"} <= files.keys()
    names = zipfile.ZipFile(file_of(3)).namelist()
    assert names[0] == "modelDescription.xml" and any(name.startswith("binaries/") for name in names)


def test_names_units_and_start_values_are_those_of_the_scene() -> None:
    description = fmpy.read_model_description(str(file_of(3)))
    by_name = {item.name: item for item in description.modelVariables}
    assert names_of(file_of(3), "parameter") == ["length", "shake"] and names_of(file_of(3), "input") == ["push"]
    assert (by_name["length"].unit, by_name["length"].variability) == ("m", "tunable")
    assert by_name["der(v.hinge)"].unit == "rad/s^2" and by_name["torque"].causality == "local"
    assert by_name["der(v.hinge)"].derivative is by_name["v.hinge"]
    depends = {item.variable.name: {known.name for known in item.dependencies} for item in description.derivatives}
    state = {"q.hinge", "v.hinge"}
    assert depends == {"der(q.hinge)": {"v.hinge"}, "der(v.hinge)": state | {"push", "time", "length", "shake"}}


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"version": 1}, "version: there is no version '1' of FMI here; try: 2 or 3"),
        ({"types": ["ce"]}, "types: there is no type 'ce'; try: one of me, cs"),
        ({"types": ","}, "types: an FMU without model exchange and co-simulation has no use; try: me, cs"),
        ({"version": "2.1"}, "version: there is no version '2.1' of FMI here; try: 2 or 3"),
        ({"version": "2.0", "arrays": True}, "arrays: FMI 2.0 has scalars alone; try: version 3"),
        ({"version": 2, "dae": True}, "dae: differential-algebraic systems are a layer over model exchange of FMI 3.0"),
        ({"inputs": ["pull"]}, "inputs: the scene has no input 'pull'; try: one of torque, push"),
    ],
)
def test_mistakes_in_options_are_named(options: dict[str, Any], message: str) -> None:
    with pytest.raises(eomgen.UsageError) as caught:
        fmu_files(pendulum(), **options)
    assert message in str(caught.value)


@pytest.mark.slow
def test_friction_that_steps_do_not_resolve_is_told_by_the_log(tmp_path: Path) -> None:
    messages: list[str] = []
    file = eomgen.fmu(stuck(0.2), tmp_path / "stuck.fmu", types="cs", profile="quick")
    options = {"debug_logging": True, "logger": lambda *words: messages.append(words[-1].decode())}
    fmpy.simulate_fmu(str(file), stop_time=0.01, output_interval=0.01, **options)
    assert UNRESOLVED in "; ".join(messages)
