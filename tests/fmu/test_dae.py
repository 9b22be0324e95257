"""FMUs as differential-algebraic systems (FMI-LS-DAE): residuals against the model's terms, and IDA as an importer."""

from __future__ import annotations

import io
import zipfile
from functools import cache
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import fmpy
import fmpy.fmi3
import numpy as np
import pytest
from fmpy import validation
from sksundae import ida

import eomgen
from eomgen.cli import main
from eomgen.products.fmu.archive import packed
from eomgen.products.fmu.dae import MANIFEST
from eomgen.products.fmu.export import FmuFiles, fmu_files
from tests.fmu.importers import Unit, toolbox_findings
from tests.fmu.test_derivatives import random_state

EXAMPLES = Path(__file__).parents[2] / "examples"
SCENES = {
    "pendulum": EXAMPLES / "double_pendulum_on_shaking_base" / "scene.toml",
    "four_bar": EXAMPLES / "four_bar" / "scene.toml",
    "heavy_top": EXAMPLES / "heavy_top" / "se3.toml",
    "heavy_top_r3xso3": EXAMPLES / "heavy_top" / "r3xso3.toml",
}
Array = np.ndarray


@cache
def exported(name: str) -> FmuFiles:
    return fmu_files(SCENES[name], types="me", reference=False, profile="quick", dae=True)


@cache
def model_of(name: str) -> eomgen.Model:
    return eomgen.build(SCENES[name], profile="quick")


class System:
    """A reader of FMI-LS-DAE: F(t, y, y') = 0 with y = (states, algebraic variables), by the manifest and FMPy."""

    def __init__(self, folder: Path, *, switched: bool = True) -> None:
        described = fmpy.read_model_description(str(folder))
        root = ET.parse(folder / MANIFEST).getroot()
        structure = root.find("ModelStructure")
        assert root.tag == "fmiDAEManifest" and structure is not None
        by_reference = {variable.valueReference: variable for variable in described.modelVariables}

        def references(parent: Any, tag: str) -> list[int]:
            return [int(element.get("valueReference", "")) for element in parent.iter(tag)]

        self.rates = references(structure, "ContinuousStateDerivative")
        self.states = [by_reference[reference].derivative.valueReference for reference in self.rates]
        self.algebraic = references(root.find("AlgebraicVariables"), "AlgebraicVariable")
        self.residuals = references(structure, "Residual")
        (switch,) = references(root, "EnableDAEParameter")
        self.unit = Unit(folder, "me", start=False).fmu
        if switched:
            self.unit.enterConfigurationMode()
            self.unit.setBoolean([switch], [True])
            self.unit.exitConfigurationMode()
        assert self.unit.getBoolean([switch]) == [switched]
        self.unit.enterInitializationMode()
        self.unit.exitInitializationMode()
        self.unit.enterContinuousTimeMode()
        self.size = len(self.states)

    def get(self, references: list[int]) -> Array:
        """Return numbers by value references."""
        return np.array(self.unit.getFloat64(references))

    def start(self) -> tuple[Array, Array]:
        """Return y and y' at the start."""
        y = np.concatenate([self.get(self.states), self.get(self.algebraic)])
        return y, np.concatenate([self.get(self.rates), np.zeros(len(self.algebraic))])

    def at(self, t: float, y: Array) -> None:
        """Go to a time, states and algebraic variables."""
        self.unit.setTime(float(t))
        x = np.ascontiguousarray(y[: self.size])
        self.unit.setContinuousStates(x.ctypes.data_as(fmpy.fmi3.POINTER(fmpy.fmi3.c_double)), self.size)
        self.unit.setFloat64(self.algebraic, [float(value) for value in y[self.size :]])

    def residual(self, t: float, y: Array, rate: Array, out: Array) -> None:
        """Write F."""
        self.at(t, y)
        out[: self.size] = rate[: self.size] - self.get(self.rates)
        out[self.size :] = self.get(self.residuals)

    def jacobian(self, t: float, y: Array, rate: Array, out: Array, share: float, matrix: Array) -> None:
        """Write F_y + share F_y' by directional derivatives."""
        self.at(t, y)
        unknowns, knowns = [*self.rates, *self.residuals], [*self.states, *self.algebraic]
        for column, known in enumerate(knowns):
            matrix[:, column] = self.unit.getDirectionalDerivative(unknowns, [known], [1.0])
        matrix[: self.size] *= -1.0
        matrix[range(self.size), range(self.size)] += share


@cache
def folder_of(name: str) -> Path:
    from tempfile import mkdtemp

    folder = Path(mkdtemp(prefix="eomgen-dae-"))
    zipfile.ZipFile(io.BytesIO(packed(exported(name).files))).extractall(folder)
    return folder


@pytest.mark.long_cases("heavy_top")
@pytest.mark.slow
@pytest.mark.parametrize("name", ["pendulum", "heavy_top"])
def test_validators_accept_such_fmus(name: str, tmp_path: Path) -> None:
    file = tmp_path / "unit.fmu"
    file.write_bytes(packed(exported(name).files))
    assert validation.validate_fmu(str(file)) == []
    assert toolbox_findings(file) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", ["pendulum", "four_bar"])
def test_unswitched_fmus_solve_for_the_same_algebraic_variables(name: str) -> None:
    switched, plain = (System(folder_of(name), switched=flag) for flag in (True, False))
    for references in (plain.states, plain.algebraic, plain.rates):
        assert plain.get(references).tolist() == switched.get(references).tolist()
    scale = np.max(np.abs(plain.get(plain.algebraic)))
    assert np.max(np.abs(switched.get(switched.residuals))) <= 1e-12 * scale
    with pytest.raises(Exception, match="fmi3SetFloat64"):
        plain.unit.setFloat64(plain.algebraic[:1], [0.0])
    with pytest.raises(Exception, match="fmi3GetDirectionalDerivative"):
        plain.unit.getDirectionalDerivative(plain.residuals[:1], plain.states[:1], [1.0])
    with pytest.raises(Exception, match="fmi3EnterConfigurationMode"):
        plain.unit.enterConfigurationMode()


@pytest.mark.slow
@pytest.mark.long_except("pendulum", "four_bar")
@pytest.mark.parametrize("name", SCENES)
def test_residuals_are_the_terms_of_the_model(name: str, rng: np.random.Generator) -> None:
    system, model = System(folder_of(name)), model_of(name)
    interface = exported(name).interface
    for _ in range(3):
        state = random_state(model, rng)
        for factor in model.factors:
            if factor.group != "R":
                quaternion = state["q"][factor.q_start : factor.q_start + 4]
                quaternion /= np.linalg.norm(quaternion)
        state["t"] = 0.3
        a, multipliers = rng.normal(size=model.nv), rng.normal(size=len(model.multipliers))
        x = [state[item.kind][item.index] for item in interface.states]
        system.at(0.3, np.array([*x, *a, *multipliers]))
        names = ("residual", "constraint_acceleration") if model.multipliers else ("inverse_dynamics",)
        functions = model.in_complex(names)
        known = {key: np.asarray(value, complex) for key, value in state.items()}
        known |= {"a": a.astype(complex), "lam": multipliers.astype(complex), "t": np.array(0.3 + 0j)}
        known["p"] = model.parameter_array().astype(complex)
        if "base" in functions:
            known["base"] = functions("base", {key: known[key] for key in functions.inputs("base")})[0]
        own = [functions(key, {block: known[block] for block in functions.inputs(key)})[0].real for key in names]
        expected = np.concatenate([values.ravel() for values in own])
        assert np.max(np.abs(system.get(system.residuals) - expected)) <= 1e-13 * np.max(np.abs(expected))
        unknowns, knowns = [*system.rates, *system.residuals], [*system.states, *system.algebraic]
        seed, weights = rng.normal(size=len(knowns)), rng.normal(size=len(unknowns))
        along = np.array(system.unit.getDirectionalDerivative(unknowns, knowns, list(seed)))
        back = np.array(system.unit.getAdjointDerivative(unknowns, knowns, list(weights), len(knowns)))
        assert abs(along @ weights - back @ seed) <= 1e-13 * np.linalg.norm(along) * np.linalg.norm(weights) * 10
        step = 1e-6
        ends = []
        for sign in (1.0, -1.0):
            system.at(0.3, np.array([*x, *a, *multipliers]) + sign * step * seed)
            ends.append(system.get(unknowns))
        difference = (ends[0] - ends[1]) / (2 * step)
        assert np.max(np.abs(difference - along)) <= 1e-7 * np.max(np.abs(along))


@pytest.mark.long_cases("heavy_top-0.5")
@pytest.mark.slow
@pytest.mark.parametrize(("name", "end"), [("four_bar", 0.2), ("heavy_top", 0.5)])
def test_ida_integrates_as_the_model_does(name: str, end: float) -> None:
    system, model = System(folder_of(name)), model_of(name)
    y, rate = system.start()
    count = len(system.algebraic)
    solver = ida.IDA(
        system.residual,
        rtol=1e-11,
        atol=1e-11,
        algebraic_idx=list(range(system.size, system.size + count)),
        jacfn=system.jacobian,
        max_num_steps=100_000,
    )
    times = np.linspace(0.0, end, 6)
    solution = solver.solve(times, y, rate)
    assert solution.success, solution.message
    run = model.simulate(end, end / 5, method="rk45_partitioned", tolerance=1e-12, error_estimate=False)
    q = run.q[:, : system.size - model.nv - model.nz]
    assert np.max(np.abs(solution.y[:, : q.shape[1]] - q)) <= 1e-7


def test_the_command_writes_the_layer(tmp_path: Path) -> None:
    file = tmp_path / "pendulum.fmu"
    arguments = ["fmu", str(SCENES["pendulum"]), "--dae", "--no-binary", "--no-reference", "-o", str(file)]
    assert main(arguments) == 0
    assert MANIFEST in zipfile.ZipFile(file).namelist()
