"""Minimal coordinates of model exchange: loops, ball joints, absolute coordinates and rolling against refined runs,
changes of coordinates, states without a solution, and scenes without minimal coordinates."""

from __future__ import annotations

import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu

import eomgen
from eomgen.errors import ModelError, UsageError
from eomgen.products.fmu.export import fmu_files
from tests.fmu.importers import DISCARD, Unit, columns, recorded, run, toolbox_findings, written
from tests.models.scenes import PENDULUM_TOML

EXAMPLES = Path(__file__).parents[2] / "examples"
#: A loop of hinges; a pose; a body whose position and rotation are apart; a ball joint in a loop; a stone that rolls;
#: elastic bars in a loop.
SCENES = (
    "four_bar/scene.toml",
    "heavy_top/se3.toml",
    "heavy_top/r3xso3.toml",
    "slider_crank_spatial/scene.toml",
    "rattleback/scene.toml",
    "elastic_slider_crank/scene.toml",
)
#: Errors of CVode at 1e-10, relative to the largest magnitude of a column, and at least 1 of its unit.
CLOSE = 5e-8
#: What the log has of each new choice.
CHOICE = "the independent coordinate along "


@cache
def model_of(name: str) -> eomgen.Model:
    return eomgen.build(EXAMPLES / name)


@cache
def minimal_of(name: str, version: int = 3) -> Path:
    return written(eomgen.load(EXAMPLES / name), version, minimal=True)


def unit_of(name: str, version: int) -> Unit:
    """Return an FMU of minimal coordinates in continuous time."""
    unit = Unit(minimal_of(name, version), "me")
    unit.continuous()
    return unit


@pytest.mark.long_except_every(3)
@pytest.mark.long_cases("elastic_slider_crank/scene.toml")
@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_minimal_coordinates_meet_a_refined_run(name: str) -> None:
    scene, model, file = eomgen.load(EXAMPLES / name), model_of(name), minimal_of(name)
    assert validate_fmu(str(file)) == [] and toolbox_findings(file) == []
    description = fmpy.read_model_description(str(file))
    freedoms = model.nv - len(model.multipliers)
    holonomic = model.evaluate("constraint", model.initial_q)["Phi"].size
    assert description.numberOfContinuousStates == model.nv - holonomic + freedoms
    assert "minimal coordinates" in description.description
    interval = scene.simulation.step
    end = 40 * interval
    rows = run(file, "ModelExchange", end, interval, relative_tolerance=1e-10)
    solution = model.simulate(end, interval / 16, method="rk4_partitioned", record_every=16, error_estimate=False)
    last = np.searchsorted(rows["time"], solution.t + 1e-3 * interval) - 1
    known = columns(solution, recorded(file))
    assert {column[:2] for column in known} >= {"q.", "v."}
    for column, values in known.items():
        off = np.max(np.abs(rows[column][last] - values))
        assert off <= CLOSE * max(1.0, np.max(np.abs(values))), (column, off)
    q = np.stack([np.asarray(rows[label], float) for label in model.q_names], axis=1)
    times = np.asarray(rows["time"], float)
    assert np.max(np.abs(model.evaluate("constraint", q, t=times)["Phi"])) < 1e-13


@pytest.mark.slow
def test_other_coordinates_are_chosen_where_the_present_ones_become_bad() -> None:
    """The slider stands still where the crank is stretched: there its position says nothing on the crank."""
    name = "slider_crank_spatial/scene.toml"
    scene, messages = eomgen.load(EXAMPLES / name), list[str]()
    file, interval = minimal_of(name), scene.simulation.step
    end = 400 * interval
    note = {"logger": lambda *arguments: messages.append(arguments[-1].decode()), "debug_logging": True}
    rows = run(file, "ModelExchange", end, interval, relative_tolerance=1e-10, **note)
    chosen = [message.removeprefix(CHOICE).split()[0] for message in messages if message.startswith(CHOICE)]
    assert chosen[0] == "v.shaft" and "v.guide" in chosen and 3 <= len(chosen) < 20
    solution = model_of(name).simulate(end, interval / 8, method="rk4_partitioned", record_every=8)
    last = np.searchsorted(rows["time"], solution.t + 1e-3 * interval) - 1
    for column, values in columns(solution, model_of(name).q_names).items():
        assert np.max(np.abs(rows[column][last] - values)) < 1e-7, column


@pytest.mark.slow_cases("3")
@pytest.mark.parametrize("version", [pytest.param(2, marks=pytest.mark.slow), 3])
def test_states_hold_the_independent_coordinates(version: int) -> None:
    unit = unit_of("four_bar/scene.toml", version)
    names = [name for name in unit.places if name.startswith(("minimal.", "q.", "v."))]
    assert [name for name in names if "minimal" in name] == ["minimal.q[0]", "minimal.v[0]"]
    assert unit.messages == [f"{CHOICE}v.drive at t = 0 s", "the independent velocity v.drive at t = 0 s"]
    assert unit.get("minimal.q[0]", "minimal.v[0]") == unit.get("q.drive", "v.drive") == unit.x.tolist()
    unit.refuses("q.drive follows from the independent coordinates", lambda: unit.set({"q.drive": 1.0}))
    state = unit.state()
    unit.x += [0.3, -2.0]
    unit.fmu.setContinuousStates(unit.pointer, 2)
    first = unit.get(*names)
    assert first[names.index("q.drive")] == unit.x[0]
    unit.go_back(state)
    assert unit.get(*names) != first
    unit.fmu.setContinuousStates(unit.pointer, 2)
    assert unit.get(*names) == first
    unit.go_back(state)
    unit.set({"minimal.q[0]": unit.x[0], "minimal.v[0]": unit.x[1]})
    assert unit.get(*names) == first


@pytest.mark.slow
@pytest.mark.parametrize("version", [2, 3])
def test_states_without_a_solution_are_discarded(version: int) -> None:
    unit = unit_of("heavy_top/se3.toml", version)
    inside, far = unit.x.tolist(), unit.x.tolist()
    far[1] += 10.0  # farther from the pivot than the body is long
    assert unit.rates(far) == DISCARD
    assert unit.messages[-1] == "at t = 0 s the dependent coordinates have no solution for these independent ones"
    unit.refuses("the dependent coordinates have no solution", lambda: unit.get("q.top[4]"))
    assert unit.rates(inside) == 0


def test_scenes_without_minimal_coordinates_are_refused() -> None:
    plain: dict[str, Any] = {"binary": False, "reference": False, "minimal": True}
    with pytest.raises(ModelError, match="of a scene without constraints are minimal already; try: no option"):
        fmu_files(tomllib.loads(PENDULUM_TOML), **plain)
    with pytest.raises(UsageError, match="minimal coordinates are states of model exchange; try: types with me"):
        fmu_files(EXAMPLES / SCENES[0], types="cs", **plain)
    with pytest.raises(UsageError, match="has all coordinates as states; try: dae or minimal alone"):
        fmu_files(EXAMPLES / SCENES[0], dae=True, **plain)
