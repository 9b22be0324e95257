"""Model exchange: nominal values of states, and corrections of drifted states that follow the importer's tolerance."""

from __future__ import annotations

import ctypes

import numpy as np
import pytest

import eomgen
from tests.fmu.importers import Unit, recorded, run, written
from tests.fmu.test_calls import EXAMPLES, VERSIONS, file_of, unit_of

#: What a correction logs.
CORRECTED = "positions and velocities are back on the constraints"


def nominals(unit: Unit) -> list[float]:
    """Return the nominal values of the states."""
    numbers = (ctypes.c_double * sum(name.startswith("der(") for name in unit.places))()
    unit.fmu.getNominalsOfContinuousStates(numbers, len(numbers))
    return list(numbers)


@pytest.mark.slow_cases("3")
@pytest.mark.parametrize("version", VERSIONS)
def test_nominal_values_of_positions_follow_stiffness_and_inertia(version: int) -> None:
    unit = unit_of("quarter_car", version, "me")
    wheel, body = 0.1 / np.sqrt((160000.0 + 16000.0) / 36.0), 0.1 / np.sqrt(16000.0 / 240.0)
    assert np.allclose(nominals(unit), [wheel, body, 0.1, 0.1], rtol=1e-12)
    unit.fmu.reset()
    if version == 2:  # FMI 3.0 has them from the initialization on
        assert nominals(unit) == [0.1] * 4


@pytest.mark.slow
def test_nominal_values_of_quaternions_are_of_half_the_angle() -> None:
    assert nominals(unit_of("free_spinning_body", 3, "me")) == [*[0.05] * 4, *[0.1] * 9]


class Loop(Unit):
    """The four-bar linkage in continuous time, with one coordinate off the constraints."""

    def __init__(self, version: int, tolerance: float | None = None) -> None:
        super().__init__(file_of("four_bar", version), "me", start=False)
        if version == 2:
            self.fmu.setupExperiment(tolerance=tolerance, startTime=0.0)
            self.fmu.enterInitializationMode()
        else:
            self.fmu.enterInitializationMode(tolerance=tolerance)
        self.fmu.exitInitializationMode()
        self.continuous()
        self.start = self.x.copy()

    def asks(self, off: float) -> bool:
        """Return whether a step that ends off the constraints by about this distance asks for an event, and take it."""
        self.x[:] = self.start
        self.x[1] += off
        self.fmu.setContinuousStates(self.pointer, len(self.x))
        asked = bool(self.fmu.completedIntegratorStep()[0])
        if asked:
            self.fmu.enterEventMode()
            self.update()
            assert self.messages[-1] == f"{CORRECTED} at t = 0 s"
            self.fmu.enterContinuousTimeMode()
            self.fmu.getContinuousStates(self.pointer, len(self.x))
            assert 0.0 < np.max(np.abs(self.x - self.start)) < 3.0 * off
        return asked


@pytest.mark.parametrize("version", VERSIONS)
def test_corrections_follow_the_tolerance_of_the_importer(version: int) -> None:
    plain = Loop(version)
    assert [plain.asks(off) for off in (1e-10, 1e-7)] == [False, True]
    coarse = Loop(version, 1e-5)
    assert [coarse.asks(off) for off in (1e-7, 1e-6, 1e-3)] == [False, False, True]
    rough = Loop(version, 0.1)
    assert [rough.asks(off) for off in (1e-5, 1e-2)] == [False, True]


@pytest.mark.parametrize("version", VERSIONS)
def test_a_coarse_integration_is_not_corrected_at_each_step(version: int) -> None:
    loop = Loop(version)
    for _ in range(12):
        assert not loop.asks(0.0)
    asked = [loop.asks(1e-7) for _ in range(40)]
    assert asked[0] and sum(asked) <= 4, asked
    state = loop.state()
    assert not loop.asks(1e-7)
    loop.go_back(state)
    assert all(loop.asks(1e-2) for _ in range(20))  # however often: none is left alone


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [1e-4, 1e-6, 1e-8])
def test_loops_have_few_events_and_stay_on_the_constraints(tolerance: float) -> None:
    file, messages = file_of("four_bar", 3), list[str]()
    scene = eomgen.load(EXAMPLES / "four_bar" / "scene.toml")
    end = scene.simulation.duration
    rows = run(
        file,
        "ModelExchange",
        end,
        scene.simulation.step,
        relative_tolerance=tolerance,
        logger=lambda *arguments: messages.append(arguments[-1].decode()),
        debug_logging=True,
    )
    corrections = [message for message in messages if message.startswith(CORRECTED)]
    assert len(corrections) < 0.01 * end / scene.simulation.step, len(corrections)
    model = eomgen.build(scene)
    q = np.stack([np.asarray(rows[name], float) for name in recorded(file) if name.startswith("q.")], axis=1)
    assert np.max(np.abs(model.evaluate("constraint", q)["Phi"])) < 100.0 * tolerance


@pytest.mark.slow
def test_drives_alone_are_constraints() -> None:
    """A mass on a carriage that is driven by s sin t: x'' + w^2 x = s sin t by the carriage's motion."""
    s, w, x_0 = 0.1, 10.0, 0.1
    bodies = {"carriage": {"mass": 1.0}, "mass": {"mass": 2.0}}
    slides = {"type": "prismatic", "axis": [1, 0, 0]}
    joints = {
        "drive": slides | {"parent": "base", "child": "carriage", "drive": f"{s} * sin(t)"},
        "slide": slides
        | {"parent": "carriage", "child": "mass", "stiffness": 2.0 * w**2, "initial": {"position": x_0}},
    }
    scene = eomgen.load({"format": 1, "name": "driven", "bodies": bodies, "joints": joints})
    rows = run(written(scene, 3), "ModelExchange", 1.0, 0.01, relative_tolerance=1e-9)
    t, forced = np.asarray(rows["time"]), s / (w**2 - 1.0)
    expected = x_0 * np.cos(w * t) + forced * (np.sin(t) - np.sin(w * t) / w)
    assert np.max(np.abs(rows["q.slide"] - expected)) < 1e-6 * x_0
