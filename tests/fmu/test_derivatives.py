"""Directional and adjoint derivatives of FMUs against complex steps of the model's functions, for all unknowns and
knowns of the covering examples."""

from __future__ import annotations

import ctypes
import io
import zipfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.lie.product import update
from eomgen.products.fmu.archive import packed
from eomgen.products.fmu.export import FmuFiles, fmu_files
from tests.fmu.importers import Unit
from tests.fmu.oracle import Rates
from tests.mechanics.test_argument_derivatives import gimbal
from tests.models.c_laws import TYRE_LAW, wheel_scene

EXAMPLES = Path(__file__).parents[2] / "examples"
#: Scenes of the first tier: rotations, constraints with an input, parameters and a moving base.
QUICK = ("double_pendulum_on_shaking_base", "four_bar", "gimbal")
#: Internal states and jumps, contacts, samples, beams in a loop, rolling; poses, and positions with rotations. C of
#: version 2 is the same but for the interface.
SCENES = (
    *("active_quarter_car", "gear_with_backlash", "pi_servo", "elastic_slider_crank", "rattleback"),
    *("heavy_top/se3.toml", "heavy_top/r3xso3.toml"),
)
CASES = [(name, version) for name in QUICK for version in (2, 3)] + [(name, 3) for name in SCENES]
Array = np.ndarray


def scene_of(name: str) -> Any:
    if name == "gimbal":
        return gimbal()
    return EXAMPLES / name if name.endswith(".toml") else EXAMPLES / name / "scene.toml"


@cache
def exported(name: str, version: int) -> FmuFiles:
    return fmu_files(scene_of(name), version=version, reference=False, profile="quick")


@cache
def model_of(name: str) -> eomgen.Model:
    return eomgen.build(scene_of(name), profile="quick")


class Exchange(Unit):
    """An FMU in model exchange."""

    def __init__(self, made: FmuFiles, folder: Path, kind: str = "me", *, start: bool = True) -> None:
        folder.mkdir(exist_ok=True)
        zipfile.ZipFile(io.BytesIO(packed(made.files))).extractall(folder)
        super().__init__(folder, kind, start=start)
        self.interface, self.mode_is_continuous = made.interface, False

    def at(self, state: dict[str, Any]) -> None:
        """Go to a state in the mode of continuous time."""
        if self.mode_is_continuous:
            self.fmu.enterEventMode()
        self.mode_is_continuous = True
        given = [*self.interface.of("parameter"), *self.interface.of("input")]
        self.set({item.name: float(state["p" if item.kind == "parameter" else "u"][item.index]) for item in given})
        self.fmu.enterContinuousTimeMode()
        self.fmu.setTime(float(state["t"]))
        x = np.array([state[item.kind][item.index] for item in self.interface.states])
        self.fmu.setContinuousStates(x.ctypes.data_as(ctypes.POINTER(ctypes.c_double)), len(x))

    def values(self, references: list[int]) -> Array:
        """Return numbers by value references."""
        return np.array((self.fmu.getReal if self.version == 2 else self.fmu.getFloat64)(references))

    def directional(self, unknowns: list[int], knowns: list[int], seed: Array) -> Array:
        """Return J seed."""
        seeds = [float(number) for number in seed]
        if self.version == 2:
            return np.array(self.fmu.getDirectionalDerivative(unknowns, knowns, seeds))
        return np.array(self.fmu.getDirectionalDerivative(unknowns, knowns, seeds, len(unknowns)))

    def adjoint(self, unknowns: list[int], knowns: list[int], seed: Array) -> Array:
        """Return seed^T J."""
        return np.array(self.fmu.getAdjointDerivative(unknowns, knowns, [float(x) for x in seed], len(knowns)))


@pytest.fixture
def unit_of(tmp_path: Path) -> Iterator[Any]:
    made: list[Exchange] = []

    def unit(name: str, version: int) -> Exchange:
        made.append(Exchange(exported(name, version), tmp_path))
        return made[-1]

    yield unit
    for one in made:
        one.fmu.terminate()
        one.fmu.freeInstance()


def random_state(model: eomgen.Model, rng: np.random.Generator) -> dict[str, Any]:
    """Return a state near the start; quaternions have other lengths than one."""
    q = update(model.factors, model.initial_q, rng.uniform(-0.2, 0.2, model.nv))
    for factor in model.factors:
        if factor.group != "R":
            q[factor.q_start : factor.q_start + 4] *= rng.uniform(0.9, 1.1)
    state = {"q": q, "v": model.initial_v + 0.3 * rng.normal(size=model.nv), "t": np.array(0.3)}
    state["z"] = model.initial_z + 0.1 * rng.normal(size=model.nz)
    p = model.parameter_array()
    modes = np.array([name.startswith("mode_") for name in model.parameters], dtype=bool)
    limits = (p == 0.0) & ~modes  # equal ones meet at a kink
    state["p"] = np.where(limits, 0.1, p) * rng.uniform(0.95, 1.05, len(p))
    return {**state, "u": rng.normal(size=model.nu)}


def pairs(made: FmuFiles) -> tuple[list[int], list[int], list[tuple[str, int]]]:
    """Return references of all unknowns and knowns, and the knowns as components of states."""
    interface = made.interface
    unknowns = [x.reference for kind in ("der_q", "der_v", "der_z", "output") for x in interface.of(kind)]
    blocks = {"time": "t", "parameter": "p", "input": "u", "q": "q", "v": "v", "z": "z"}
    items = [item for kind in blocks for item in interface.of(kind)]
    return unknowns, [x.reference for x in items], [(blocks[x.kind], x.index) for x in items]


def check_dependencies(made: FmuFiles, unknowns: list[int], knowns: list[int], jacobian: Array) -> None:
    """Hold the dependencies of the model description to a Jacobian: no nonzero is left out."""
    interface = made.interface
    kinds = {item.reference: item.kind for item in interface.variables}
    listed = {item.reference: item.dependencies for item in (*interface.outputs, *interface.derivatives)}
    for row, unknown in enumerate(unknowns):
        own = listed[unknown]
        named = [known for known in knowns if interface.version == 3 or kinds[known] != "parameter"]
        missing = [
            known for known in named if jacobian[row, knowns.index(known)] and own is not None and known not in own
        ]
        assert not missing, (interface.variables[unknown].name, [interface.variables[k].name for k in missing])


@pytest.mark.slow
@pytest.mark.long_except("double_pendulum_on_shaking_base-3", "gimbal-3", "gimbal-2", "active_quarter_car-3")
@pytest.mark.parametrize(("name", "version"), CASES, ids=[f"{name}-{version}" for name, version in CASES])
def test_derivatives_are_those_of_complex_steps(
    name: str, version: int, unit_of: Any, rng: np.random.Generator
) -> None:
    unit, model = unit_of(name, version), model_of(name)
    unknowns, knowns, places = pairs(exported(name, version))
    rates = Rates(model, [item.index for item in unit.interface.of("input")])
    continuous = [item.index for item in unit.interface.of("z")]
    states = sum(factor.q_size for factor in model.factors) + model.nv
    rows = [*range(states), *(states + index for index in continuous)]
    for _ in range(2):
        state = random_state(model, rng)
        unit.at(state)
        values, of_outputs = rates(state)
        expected_values = np.concatenate([values[rows], of_outputs]).real
        scale = np.max(np.abs(expected_values), initial=1.0)
        assert np.max(np.abs(unit.values(unknowns) - expected_values)) <= 1e-11 * scale
        first, second = rates.jacobian(state, places)
        expected = np.concatenate([first[rows], second])
        found = np.stack([unit.directional(unknowns, [known], np.ones(1)) for known in knowns], axis=1)
        assert np.max(np.abs(found - expected)) <= 1e-12 * np.max(np.abs(expected))
        check_dependencies(exported(name, version), unknowns, knowns, found)
        seed, weights = rng.normal(size=len(knowns)), rng.normal(size=len(unknowns))
        along = unit.directional(unknowns, knowns, seed)
        assert np.max(np.abs(along - found @ seed)) <= 1e-12 * np.max(np.abs(expected))
        if version == 3:
            back = unit.adjoint(unknowns, knowns, weights)
            assert abs(back @ seed - weights @ along) <= 1e-13 * (np.abs(weights) @ np.abs(found) @ np.abs(seed))


@pytest.mark.slow_cases("four_bar")
@pytest.mark.parametrize("name", ["double_pendulum_on_shaking_base", "four_bar"])
def test_derivatives_at_communication_points(name: str, tmp_path: Path) -> None:
    """Of the state at the end of a step, whose accelerations come from the method."""
    made, model = exported(name, 3), model_of(name)
    unit = Exchange(made, tmp_path, "cs").fmu
    for k in range(3):
        unit.doStep(currentCommunicationPoint=0.01 * k, communicationStepSize=0.01)
    unknowns, knowns, places = pairs(made)
    before = unit.getFloat64(unknowns)
    state: dict[str, Any] = {"q": np.zeros(len(model.initial_q)), "v": np.zeros(model.nv), "z": np.zeros(model.nz)}
    for item in made.interface.states:
        (state[item.kind][item.index],) = unit.getFloat64([item.reference])
    state |= {"t": np.array(unit.getFloat64([0])[0]), "p": model.parameter_array(), "u": np.zeros(model.nu)}
    rates = Rates(model, [item.index for item in made.interface.of("input")])
    expected = np.concatenate(rates.jacobian(state, places))
    found = [unit.getDirectionalDerivative(unknowns, [known], [1.0], len(unknowns)) for known in knowns]
    assert np.max(np.abs(np.transpose(found) - expected)) <= 1e-12 * np.max(np.abs(expected))
    assert unit.getFloat64(unknowns) == before
    unit.terminate()
    unit.freeInstance()


def test_references_that_are_no_unknowns_or_knowns_are_named(unit_of: Any) -> None:
    unit = unit_of("double_pendulum_on_shaking_base", 3)
    unknowns, knowns, _ = pairs(exported("double_pendulum_on_shaking_base", 3))
    for wrong in ((knowns[:1], knowns[:1]), (unknowns[:1], unknowns[:1]), (unknowns[:1], [9999])):
        with pytest.raises(Exception, match="fmi3GetDirectionalDerivative"):
            unit.directional(*wrong, np.ones(1))


@pytest.mark.slow
@pytest.mark.parametrize("version", [2, 3])
def test_derivatives_during_the_initialization(version: int, tmp_path: Path) -> None:
    """Of start values without constraints; a start with constraints is assembled at the end of the initialization."""
    loop, plain = "four_bar", "double_pendulum_on_shaking_base"
    one = Exchange(exported(loop, version), tmp_path / loop, start=False)
    unknowns, knowns, _ = pairs(exported(loop, version))
    one.fmu.enterInitializationMode()
    with pytest.raises(Exception, match=f"fmi{version}GetDirectionalDerivative"):
        one.directional(unknowns, knowns[:1], np.ones(1))
    one = Exchange(exported(plain, version), tmp_path / plain, start=False)
    unknowns, knowns, _ = pairs(exported(plain, version))
    one.fmu.enterInitializationMode()
    before = [one.directional(unknowns, [known], np.ones(1)).tolist() for known in knowns]
    one.fmu.exitInitializationMode()
    assert before == [one.directional(unknowns, [known], np.ones(1)).tolist() for known in knowns]


@pytest.mark.long
def test_derivatives_through_a_law_in_c(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator
) -> None:
    monkeypatch.chdir(tmp_path)
    jacobians = []
    model = eomgen.build(wheel_scene(None), profile="quick")
    state = random_state(model, rng)
    state["v"] = model.initial_v + np.array([0.1, 15.0, 0.2, 0.05, 50.0])
    for number, scene in enumerate((wheel_scene(TYRE_LAW, tmp_path), wheel_scene(None))):
        made = fmu_files(scene, types="me", reference=False, profile="quick")
        one = Exchange(made, tmp_path / str(number))
        one.at(state)
        unknowns, knowns, _ = pairs(made)
        jacobians.append(np.stack([one.directional(unknowns, [known], np.ones(1)) for known in knowns], axis=1))
    assert np.max(np.abs(jacobians[0] - jacobians[1])) <= 1e-12 * np.max(np.abs(jacobians[1]))
