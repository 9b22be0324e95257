"""A solution in pandas, xarray and MATLAB's files: the same numbers, by name, with units; models that are pickled."""

from __future__ import annotations

import pickle
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

import eomgen
from tests.models.scenes import flyer, pendulum


@pytest.mark.slow
def test_pandas_has_every_column_and_its_unit() -> None:
    run = pendulum().simulate(0.05, 1e-3)
    frame = run.to_pandas()
    assert list(frame.columns) == [name for name in run.columns() if name != "t"]
    assert frame.index.name == "t" and np.array_equal(frame.index, run.t)
    assert np.array_equal(frame["output.tip[2]"], run.outputs["tip"][:, 2])
    units = frame.attrs["units"]
    assert [units[name] for name in ("q.hinge", "v.hinge", "a.hinge", "output.tip[0]", "energy.total")] == [
        "rad", "rad/s", "rad/s^2", "m", "J",
    ]  # fmt: skip  # beside the names
    assert frame.attrs["message"] == run.message


@pytest.mark.slow
def test_xarray_names_components() -> None:
    run = flyer().simulate(0.02, 1e-3)
    data = run.to_xarray()
    assert np.array_equal(data["q"].sel(q_component="q.slide"), run.columns()["q.slide"])
    assert str(data["q_units"].sel(q_component="q.slide").values) == "m"
    assert np.array_equal(data["energy.kinetic"], run.energy["kinetic"]) and data["t"].attrs["units"] == "s"
    tip = pendulum().simulate(0.02, 1e-3).to_xarray()["output.tip"]
    assert tip.dims == ("t", "tip_component") and tip.attrs["units"] == "m"


def test_matlab_reads_the_same_numbers(tmp_path: Path) -> None:
    run = pendulum().simulate(0.05, 1e-3)
    stored = loadmat(run.save(tmp_path / "run.mat"), simplify_cells=True)
    assert np.array_equal(stored["t"], run.t) and np.array_equal(stored["q"].ravel(), run.q.ravel())
    assert np.array_equal(stored["outputs"]["tip"], run.outputs["tip"])
    assert np.array_equal(stored["energy"]["total"], run.energy["total"])
    assert stored["names"]["q"] == "q.hinge" and stored["units"]["v"] == "rad/s" and stored["message"] == run.message
    assert stored["units"]["outputs"]["tip"] == "m" and stored["units"]["energy"]["total"] == "J"
    assert stored["units"]["inputs"]["torque"] == "N m" and "events" not in stored


@pytest.mark.slow
def test_matlab_reads_the_events_of_a_run(tmp_path: Path) -> None:
    model = eomgen.build(Path(__file__).parents[2] / "examples" / "bouncing_ball" / "scene.toml", profile="quick")
    run = model.simulate(1.5, 1e-3)
    assert run.events is not None and len(run.events) > 1
    stored = loadmat(run.save(tmp_path / "run.mat"), simplify_cells=True)["events"]
    assert stored["names"].tolist() == list(run.events.names) and stored["counts"] == dict(run.events.counts)
    assert np.array_equal(stored["t"], run.events.t) and np.array_equal(stored["v_before"], run.events.v_before)


@pytest.mark.parametrize("package", ["pandas", "xarray"])
def test_a_package_that_is_missing_is_named(package: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    run = pendulum().simulate(0.0)
    with pytest.raises(
        eomgen.UsageError, match=f"to_{package}: {package} is not installed; try: pip install {package}"
    ):
        getattr(run, f"to_{package}")()


def test_models_travel_by_their_scene() -> None:
    model = pendulum()
    again = pickle.loads(pickle.dumps(model))
    assert again is not model and again.terms == model.terms
    assert np.array_equal(again.simulate(0.1, 1e-3).q, model.simulate(0.1, 1e-3).q)


def test_inputs_of_a_run_are_in_its_solution(tmp_path: Path) -> None:
    model = pendulum()
    of_scene = model.simulate(0.05, 1e-3)
    assert np.allclose(of_scene.inputs["torque"], 0.2 * np.sin(3.0 * of_scene.t), atol=1e-15)
    driven = model.simulate(0.05, 1e-3, inputs={"torque": lambda t: 1.0 + t})
    assert np.array_equal(driven.inputs["torque"], 1.0 + driven.t)
    stored = eomgen.Solution.load(driven.save(tmp_path / "run.npz"))
    assert np.array_equal(stored.columns()["input.torque"], 1.0 + driven.t)
    assert stored.units()["input.torque"] == "N m"
    assert np.array_equal(pickle.loads(pickle.dumps(driven)).inputs["torque"], 1.0 + driven.t)
    attached = model.attach(stored, inputs={"torque": lambda t: 1.0 + t})
    assert np.array_equal(attached.inputs["torque"], stored.inputs["torque"])
    with pytest.raises(eomgen.UsageError, match="there is no input 'torqe'; try: torque"):
        driven.inputs["torqe"]
