"""Formulas of parameters in files follow the parameters of a run: derived parameters and starts."""

from __future__ import annotations

import json
import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.cli import main
from eomgen.products.fields.documents.reading import hamiltonian_from_data
from eomgen.products.fields.hamiltonian.model import HamiltonianModel
from tests.hamiltonian.systems import system
from tests.models.toml_text import toml_text

#: An oscillator whose stiffness follows from its frequency, which follows from its period; its start follows as well.
OSCILLATOR = system(
    "derived_oscillator",
    "p_x**2/(2*m) + k*x**2/2",
    parameters={
        "m": 1.5,
        "period": 2.0,
        "w": "2*pi/period",
        "k": {"value": "m*w**2", "unit": "N/m"},
        "amplitude": 0.3,
        "unused": "1/3",
    },
    coordinates={"x": {"initial": ["amplitude", "m*w*amplitude/2"]}},
    outputs={"phase": "atan2(p_x/(m*w), x)"},
    simulation={"duration": 1.0, "step": 0.01, "method": "kahan_li8"},
)


@cache
def oscillator() -> HamiltonianModel:
    return eomgen.build(OSCILLATOR)


def expected(changes: dict[str, float]) -> dict[str, float]:
    """Return the parameters of a run by arithmetic of its own."""
    m, period = changes.get("m", 1.5), changes.get("period", 2.0)
    w = changes.get("w", 2 * math.pi / period)
    k = changes.get("k", m * w**2)
    amplitude = changes.get("amplitude", 0.3)
    return {"m": m, "period": period, "w": w, "k": k, "amplitude": amplitude, "unused": changes.get("unused", 1 / 3)}


@pytest.mark.parametrize("seed", range(12))
def test_a_run_with_other_parameters_is_the_motion_of_these(seed: int) -> None:
    """Against the closed form, whichever parameters are given, derived ones too, and whichever part of the start."""
    random = np.random.default_rng(seed)
    changes = {name: float(random.uniform(0.5, 3.0)) for name in expected({}) if random.random() < 0.4}
    initial = {name: float(random.normal()) for name in ("x", "p_x") if random.random() < 0.3}
    run = oscillator().simulate(parameters=changes, initial=initial, error_estimate=False)
    values = expected(changes)
    assert run.metadata["parameters"] == pytest.approx(values, rel=1e-15)
    x = initial.get("x", values["amplitude"])
    p = initial.get("p_x", values["m"] * values["w"] * values["amplitude"] / 2)
    w = math.sqrt(values["k"] / values["m"])
    exact = x * np.cos(w * run.t) + p / (values["m"] * w) * np.sin(w * run.t)
    assert run.q[:, 0] == pytest.approx(exact, abs=1e-9)
    energy = p**2 / (2 * values["m"]) + values["k"] * x**2 / 2
    assert run.energy["total"][0] == pytest.approx(energy, rel=1e-13)
    assert oscillator().energy([x], [p], changes) == pytest.approx(energy, rel=1e-13)
    assert run.outputs["phase"][0] == pytest.approx(math.atan2(p / (values["m"] * values["w"]), x), rel=1e-12)


def test_the_file_as_it_stands_keeps_its_numbers() -> None:
    assert oscillator().parameters == pytest.approx(expected({}), rel=1e-15)
    with pytest.raises(eomgen.UsageError, match="these are the defaults, which do not change; try"):
        oscillator().parameters["m"] = 2.0


def test_a_start_follows_the_energy(tmp_path: Path) -> None:
    """The start of the example is a formula of its energy; the command line, its summary and Python agree."""
    energy = 1 / 12
    file = Path(__file__).parents[2] / "examples/henon_heiles/system/henon_heiles.toml"
    options = ["simulate", str(file), "--set", f"energy={energy}", "--t-end", "1", "--out", str(tmp_path), "--no-plots"]
    assert main(options) == 0
    summary = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))
    assert summary["parameters"]["energy"] == energy
    by_command = np.load(tmp_path / "solution.npz")
    run = eomgen.build(file).simulate(1.0, parameters={"energy": energy})
    assert run.energy["total"][0] == pytest.approx(energy, rel=1e-13)
    np.testing.assert_array_equal(by_command["x"], run.q[:, run.metadata["names"]["q"].index("x")])


def test_formulas_without_a_value_are_named() -> None:
    text = r"parameters: the parameter w, 2 \* 3.14159265 / period, has no finite real value with per"
    with pytest.raises(eomgen.UsageError, match=text):
        oscillator().simulate(parameters={"period": 0.0})
    assert oscillator().simulate(0.1, parameters={"period": 0.0, "w": 1.0}).success


def test_a_start_without_a_value_is_named() -> None:
    file = Path(__file__).parents[2] / "examples/henon_heiles/system/henon_heiles.toml"
    model = eomgen.build(file)
    with pytest.raises(eomgen.UsageError, match=r"the start of p_x, .*, has no finite real value with coupling = 1"):
        model.simulate(1.0, parameters={"energy": -1.0})
    assert model.simulate(1.0, parameters={"energy": -1.0}, initial={"p_x": 0.1}).success


def test_the_c_says_what_does_not_follow_there(tmp_path: Path) -> None:
    eomgen.generate(hamiltonian_from_data(OSCILLATOR), tmp_path)
    header = (tmp_path / "derived_oscillator.h").read_text(encoding="utf-8")
    assert "/* k (N/m): it follows m, w in files, not here */" in header
    assert "In files, and not here, these follow the parameters: x, p_x. */" in header.replace("\n *", "")


@pytest.mark.parametrize("verb", ["simulate", "info", "generate"])
@pytest.mark.parametrize(
    ("setting", "text"),
    [
        ("omf5", "there is no method 'omf5' of Hamiltonian systems; try: omf4"),
        ("", 'the method has no name; try: method = "omf4", or no key'),
        ("yoshida14", "there is no recursion of leapfrogs of order 14 with 1"),
    ],
)
def test_a_method_of_a_file_is_named_with_its_line(
    verb: str, setting: str, text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "star.toml"
    star = Path(__file__).parents[2] / "examples/henon_heiles/system/henon_heiles.toml"
    content = star.read_text(encoding="utf-8").replace('method = "omf4"', f'method = "{setting}"')
    file.write_text(content, encoding="utf-8")
    line = content[: content.index("method =")].count("\n") + 1
    options = [] if verb == "info" else ["--out", str(tmp_path / "out")]
    assert main([verb, str(file), *options]) == eomgen.DescriptionError.exit_code
    assert f"star.toml:{line} (simulation.method): {text}" in capsys.readouterr().err
    if setting == "yoshida14":
        assert main([verb, str(file), *options, "--method", "leapfrog"]) == 0


def test_an_empty_method_of_a_call_is_refused() -> None:
    with pytest.raises(eomgen.UsageError, match="a method is called by its name, not ''; try: \"omf4\", or no"):
        oscillator().simulate(method="")


def test_a_hamiltonian_run_prints_the_parameters_that_it_changes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    parameters = {"m": {"value": 0.5, "unit": "kg"}, "k": 2.0}
    data = {**OSCILLATOR, "parameters": parameters, "coordinates": {"x": {"initial": [0.2, 0], "unit": "m"}}}
    data = {**data, "outputs": {}, "simulation": {"duration": 0.1, "step": 0.01}}
    Path("system.toml").write_text(toml_text(data), encoding="utf-8")
    assert main(["simulate", "system.toml", "--set", "m=0.25", "--no-plots", "--out", "run"]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "parameter m 0.25 kg, in the scene 0.5" in told
    assert "parameter k" not in told
