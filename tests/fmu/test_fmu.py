"""FMUs of a pendulum: held inputs, the bytes of the archive, names and units, mistakes in options."""

from __future__ import annotations

import tomllib
import zipfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest

import eomgen
from eomgen.products.fmu.export import fmu_files
from tests.fmu.importers import Unit, messages_of, names_of, written
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
    unit = Unit(file_of(3))
    rows = unit.get("q.hinge")
    for k in range(round(END / STEP)):
        unit.set({"push": 0.3 if k * STEP > 0.05 - 1e-9 else 0.0})
        unit.fmu.doStep(k * STEP, STEP)
        rows += unit.get("q.hinge")
    assert np.array_equal(rows, held)
    assert not np.array_equal(held, stepped(lambda _: 0.0))


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
    file = eomgen.fmu(stuck(0.2), tmp_path / "stuck.fmu", types="cs", profile="quick")
    assert UNRESOLVED in "; ".join(messages_of(file, "CoSimulation", 0.01, output_interval=0.01))
