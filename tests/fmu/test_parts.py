"""Parts of scenes in FMUs: controllers in C, changed parameters and inputs, loops, events that end a run, refusals."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.products.fmu.export import fmu_files
from tests.fmu.importers import Unit, columns, recorded, run, written
from tests.models.scenes import PENDULUM_TOML
from tests.simulation.test_motions import cart
from tests.simulation.test_sampled_controllers import CALLED, CART, linked

EXAMPLES = Path(__file__).parents[2] / "examples"
STEP = 1e-3


def pushed() -> dict[str, Any]:
    """Return the pendulum with a push that the importer gives, and without other inputs."""
    data = tomllib.loads(PENDULUM_TOML)
    data["inputs"] = {"torque": {"unit": "N m"}}
    return data


@pytest.mark.slow
def test_controllers_in_c_step_in_the_fmu(tmp_path: Path) -> None:
    file = linked(tmp_path)
    fmu = written(eomgen.load(file), 3, method="rk4")
    model = eomgen.build(file, method="rk4")
    solution = model.simulate(0.3, STEP, error_estimate=False)
    rows = run(fmu, "CoSimulation", 0.3, STEP)
    for name, values in columns(solution, recorded(fmu)).items():
        assert np.array_equal(rows[name], values), name
    exchanged = run(fmu, "ModelExchange", 0.3, STEP, relative_tolerance=1e-10)
    last = np.searchsorted(exchanged["time"], solution.t + 0.1 * STEP) - 1
    fine = model.simulate(0.3, STEP, method="rk45", tolerance=1e-12, error_estimate=False)
    assert np.max(np.abs(exchanged["q.x"][last] - fine.q[:, 0])) < 1e-7


@pytest.mark.slow
@pytest.mark.parametrize("version", [2, 3])
def test_parameters_may_change_between_steps_of_any_length(version: int) -> None:
    """Steps of 2.5 ms are two whole steps and half of one, as ``advance`` of a simulator takes them."""
    unit = Unit(written(pushed(), version))
    simulator = eomgen.build(pushed()).start(step=STEP)
    for k in range(20):
        if k == 7:
            unit.set({"length": 0.27})
            simulator.set_parameters({"length": 0.27})
        unit.set({"torque": 0.1 * k})
        unit.fmu.doStep(k * 2.5e-3, 2.5e-3)
        simulator.advance(k * 2.5e-3 + 2.5e-3, {"torque": 0.1 * k})
        assert unit.get("q.hinge", "v.hinge", "angle") == [*simulator.q, *simulator.v, simulator.q[0]], k


@pytest.mark.slow
def test_inputs_are_linear_by_their_derivatives_in_fmi_2() -> None:
    """The bits of a table on the step grid, linear in between."""
    unit = Unit(written(pushed(), 2))
    table = np.array([0.3 * np.sin(40.0 * k * STEP) for k in range(31)])
    solution = eomgen.build(pushed()).simulate(0.03, STEP, inputs={"torque": table}, error_estimate=False)
    angles = unit.get("q.hinge")
    for k in range(30):
        unit.set({"torque": table[k]})
        slope = (table[k + 1] - table[k]) / STEP
        unit.fmu.setRealInputDerivatives([unit.places["torque"]], [1], [slope])
        unit.fmu.doStep(k * STEP, STEP)
        angles += unit.get("q.hinge")
    assert np.max(np.abs(np.array(angles) - solution.q[:, 0])) < 1e-15


@pytest.mark.slow
def test_an_event_that_stops_the_run_asks_the_importer_of_model_exchange_to_end() -> None:
    data = pushed()
    data["events"] = {"low": {"when": "q.hinge - 0.3", "action": "stop"}}
    stopped = eomgen.build(data).simulate(1.0, STEP, error_estimate=False)
    for version in (2, 3):
        rows = run(written(data, version), "ModelExchange", 1.0, STEP)
        assert stopped.t[-1] < 0.9 and abs(rows["time"][-1] - stopped.t[-1]) < 2 * STEP, version


@pytest.mark.slow
@pytest.mark.parametrize(("version", "kind"), [(2, "ModelExchange"), (3, "CoSimulation")])
def test_events_are_logged_in_their_category(version: int, kind: str) -> None:
    messages: list[tuple[bytes, bytes]] = []
    file = written(EXAMPLES / "bouncing_ball" / "scene.toml", version)
    run(file, kind, 0.5, 0.01, debug_logging=True, logger=lambda *words: messages.append(words[-2:]))
    (category, text) = messages[0]
    assert len(messages) == 1 and category == b"logEvents"
    assert text.startswith(b"the event bounce at t = 0.35231")


def test_parts_that_an_fmu_cannot_have_are_refused() -> None:
    refusals = [
        (tomllib.loads(CART + CALLED.replace("KEYS", "")), "functions of the caller give samples of a controller"),
        (cart("lift").scene, "the caller moves lift between steps, and FMI has no such motion"),
    ]
    for scene, fault in refusals:
        with pytest.raises(eomgen.ModelError, match=fault):
            fmu_files(scene, binary=False, reference=False)
