"""Directional and adjoint derivatives of FMUs against complex steps of the model's functions, for all unknowns and
knowns of the covering examples."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import fmpy
import fmpy.fmi2
import fmpy.fmi3
import numpy as np
import pytest

import eomgen
from eomgen.lie.product import update
from eomgen.products.fmu.archive import packed
from eomgen.products.fmu.export import FmuFiles, fmu_files
from tests.examples.covering import covering
from tests.fmu.oracle import Rates
from tests.mechanics.test_argument_derivatives import gimbal
from tests.models.c_laws import TYRE_LAW, wheel_scene

EXAMPLES = Path(__file__).parents[2] / "examples"
#: Scenes of the first tier: rotations, constraints with an input, parameters and a moving base.
QUICK = ("double_pendulum_on_shaking_base", "four_bar", "gimbal")
SCENES = covering(sorted(path.parent.relative_to(EXAMPLES).as_posix() for path in EXAMPLES.rglob("scene.toml")), QUICK)
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


class Unit:
    """An FMU in model exchange, through FMPy."""

    def __init__(self, made: FmuFiles, folder: Path, *, leave: bool = True) -> None:
        self.interface, self.version = made.interface, made.interface.version
        zipfile.ZipFile(io.BytesIO(packed(made.files))).extractall(folder)
        described = fmpy.read_model_description(str(folder))
        exchange = described.modelExchange
        keys = {"guid": described.guid, "unzipDirectory": str(folder), "modelIdentifier": exchange.modelIdentifier}
        kind = fmpy.fmi2.FMU2Model if self.version == 2 else fmpy.fmi3.FMU3Model
        self.unit = kind(**keys, instanceName="one")
        self.unit.instantiate()
        if self.version == 2:
            self.unit.setupExperiment(startTime=0.0)
        self.unit.enterInitializationMode()
        if leave:
            self.unit.exitInitializationMode()
        self.continuous = False

    def at(self, state: dict[str, Any]) -> None:
        """Go to a state in the mode of continuous time."""
        unit = self.unit
        if self.continuous:
            unit.enterEventMode()
        self.continuous = True
        parameters = self.interface.of("parameter")
        inputs = self.interface.of("input")
        self.set([item.reference for item in parameters], [state["p"][item.index] for item in parameters])
        self.set([item.reference for item in inputs], [state["u"][item.index] for item in inputs])
        unit.enterContinuousTimeMode()
        unit.setTime(float(state["t"]))
        x = np.array([state[item.kind][item.index] for item in self.interface.states])
        pointer = x.ctypes.data_as(fmpy.fmi3.POINTER(fmpy.fmi3.c_double))
        unit.setContinuousStates(pointer, len(x))

    def set(self, references: list[int], values: list[float]) -> None:
        """Set numbers by value references."""
        if references:
            (self.unit.setReal if self.version == 2 else self.unit.setFloat64)(references, [float(v) for v in values])

    def get(self, references: list[int]) -> Array:
        """Return numbers by value references."""
        values = (self.unit.getReal if self.version == 2 else self.unit.getFloat64)(references)
        return np.array(values)

    def directional(self, unknowns: list[int], knowns: list[int], seed: Array) -> Array:
        """Return J seed."""
        seeds = [float(number) for number in seed]
        if self.version == 2:
            return np.array(self.unit.getDirectionalDerivative(unknowns, knowns, seeds))
        return np.array(self.unit.getDirectionalDerivative(unknowns, knowns, seeds, len(unknowns)))

    def adjoint(self, unknowns: list[int], knowns: list[int], seed: Array) -> Array:
        """Return seed^T J."""
        return np.array(self.unit.getAdjointDerivative(unknowns, knowns, [float(x) for x in seed], len(knowns)))


@pytest.fixture
def unit_of(tmp_path: Path) -> Iterator[Any]:
    made: list[Unit] = []

    def unit(name: str, version: int) -> Unit:
        made.append(Unit(exported(name, version), tmp_path))
        return made[-1]

    yield unit
    for one in made:
        one.unit.terminate()
        one.unit.freeInstance()


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


#: In absolute coordinates, poses and positions with rotations.
ABSOLUTE = ("heavy_top/se3.toml", "heavy_top/r3xso3.toml")
#: Examples whose C takes ten seconds and more to derive and compile.
LARGE = ("cable_net", "misaligned_four_bar", "unbalanced_shaft")
#: Larger scenes in version 3 alone: C of version 2 is the same but for the interface.
CASES = [(name, version) for name in (*SCENES, *ABSOLUTE, "gimbal") for version in ((2, 3) if name in QUICK else (3,))]


@pytest.mark.long_cases("four_bar-3")
@pytest.mark.slow_cases("gimbal-3")
@pytest.mark.long_except_every(27)
@pytest.mark.slow_except(*(f"{name}-3" for name in QUICK))
@pytest.mark.long_cases(*(f"{name}-3" for name in LARGE))
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
        assert np.max(np.abs(unit.get(unknowns) - expected_values)) <= 1e-11 * scale
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
    zipfile.ZipFile(io.BytesIO(packed(made.files))).extractall(tmp_path)
    described = fmpy.read_model_description(str(tmp_path))
    unit = fmpy.fmi3.FMU3Slave(
        guid=described.guid,
        unzipDirectory=str(tmp_path),
        modelIdentifier=described.coSimulation.modelIdentifier,
        instanceName="slave",
    )
    unit.instantiate()
    unit.enterInitializationMode()
    unit.exitInitializationMode()
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
    unknowns, knowns, _ = pairs(unit.interface and exported("double_pendulum_on_shaking_base", 3))
    for wrong in ((knowns[:1], knowns[:1]), (unknowns[:1], unknowns[:1]), (unknowns[:1], [9999])):
        with pytest.raises(Exception, match="fmi3GetDirectionalDerivative"):
            unit.directional(*wrong, np.ones(1))


@pytest.mark.slow_cases("2")
@pytest.mark.parametrize("version", [2, 3])
def test_derivatives_during_the_initialization(version: int, tmp_path: Path) -> None:
    """Of start values without constraints; a start with constraints is assembled at the end of the initialization."""
    found = {}
    for name in ("double_pendulum_on_shaking_base", "four_bar"):
        folder = tmp_path / name
        folder.mkdir()
        one = Unit(exported(name, version), folder, leave=False)
        unknowns, knowns, _ = pairs(exported(name, version))
        try:
            if name == "four_bar":
                with pytest.raises(Exception, match=f"fmi{version}GetDirectionalDerivative"):
                    one.directional(unknowns, knowns[:1], np.ones(1))
                continue
            for stage in ("before", "after"):
                found[stage] = [one.directional(unknowns, [known], np.ones(1)).tolist() for known in knowns]
                if stage == "before":
                    one.unit.exitInitializationMode()
        finally:
            one.unit.freeInstance()
    assert found["before"] == found["after"]


@pytest.mark.long
@pytest.mark.slow
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
        folder = tmp_path / str(number)
        folder.mkdir()
        one = Unit(made, folder)
        one.at(state)
        unknowns, knowns, _ = pairs(made)
        jacobians.append(np.stack([one.directional(unknowns, [known], np.ones(1)) for known in knowns], axis=1))
        one.unit.freeInstance()
    assert np.max(np.abs(jacobians[0] - jacobians[1])) <= 1e-12 * np.max(np.abs(jacobians[1]))
