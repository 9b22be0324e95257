"""Hamiltonian systems: from a file to motions, derivatives, C that stands alone, and mistakes."""

from __future__ import annotations

import json
import math
import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy
from scipy.integrate import solve_ivp

import eomgen
from eomgen.base.arrays import Array
from eomgen.cli import main
from eomgen.formula.evaluate import evaluate
from eomgen.products.fields.commands import _numbers, show
from eomgen.products.fields.documents.document import NamedNumber
from eomgen.products.fields.documents.reading import hamiltonian_from_data
from eomgen.products.fields.hamiltonian import model as hamiltonian_model
from eomgen.products.fields.hamiltonian.code import derive_hamiltonian, library_files, program_of
from eomgen.products.fields.hamiltonian.model import HamiltonianModel
from tests.hamiltonian.systems import rows_of_program, system

HENON_HEILES = system(
    "henon_heiles",
    "(p_x**2 + p_y**2)/2 + (x**2 + y**2)/2 + coupling*(x**2*y - y**3/3)",
    parameters={"coupling": 1.0},
    coordinates={"x": {"initial": [0.0, 0.4]}, "y": {"initial": [0.1, 0.2]}},
    outputs={"angular_momentum": "x*p_y - y*p_x"},
    simulation={"duration": 20.0, "step": 0.1},
)
#: A pendulum on a spring in polar coordinates: the kinetic part depends on the length.
SWINGING = system(
    "swinging",
    {
        "radial": "p_r**2/(2*m)",
        "turning": "p_phi**2/(2*m*r**2)",
        "spring": "k*(r - 1)**2/2 - m*g*r*cos(phi)",
    },
    parameters={"m": 1.0, "k": {"value": 40.0, "unit": "N/m"}, "g": 9.81},
    coordinates={"r": {"initial": [1.2, 0.0], "unit": "m"}, "phi": {"initial": [0.6, "m/2"]}},
    simulation={"duration": 2.0, "step": 0.01},
)
#: Three bodies in a plane, by repetition.
BODIES: dict[str, Any] = {
    "format": 1,
    "kind": "hamiltonian",
    "name": "bodies",
    "repeat": {
        "bodies": {
            "indices": {"i": 3},
            "parameters": {"m{i}": "{1 + i/2}"},
            "coordinates": {
                "x{i}": {"initial": ["{cos(2*i)}", "{0.3*sin(2*i)}"]},
                "y{i}": {"initial": ["{sin(2*i)}", "{0.3*cos(2*i)}"]},
            },
            "hamiltonian": {"kinetic_{i}": "(p_x{i}**2 + p_y{i}**2)/(2*m{i})"},
        },
        "pairs": {
            "indices": {"i": 3, "j": 3},
            "where": "i < j",
            "hamiltonian": {"pair_{i}_{j}": "-m{i}*m{j}/sqrt((x{i} - x{j})**2 + (y{i} - y{j})**2)"},
        },
    },
    "simulation": {"duration": 1.0, "step": 0.01},
}


@cache
def model(name: str) -> HamiltonianModel:
    data = {"henon_heiles": HENON_HEILES, "swinging": SWINGING, "bodies": BODIES}[name]
    made: Any = eomgen.build(data, profile="quick")
    assert isinstance(made, HamiltonianModel)
    return made


def _by_sympy(data: dict[str, Any]) -> tuple[sympy.Expr, list[sympy.Symbol], dict[sympy.Symbol, float]]:
    """Return H, the state and the parameters, from the same text by SymPy."""
    text = data["hamiltonian"]
    names = [*data["coordinates"], *(f"p_{name}" for name in data["coordinates"])]
    energy = sympy.sympify("+".join(text.values()) if isinstance(text, dict) else text)
    values = {name: entry["value"] if isinstance(entry, dict) else entry for name, entry in data["parameters"].items()}
    return energy, [sympy.Symbol(name) for name in names], {sympy.Symbol(key): item for key, item in values.items()}


@pytest.mark.parametrize("data", [HENON_HEILES, SWINGING], ids=lambda data: data["name"])
def test_energy_gradient_and_hessian_products_are_those_of_sympy(data: dict[str, Any]) -> None:
    compiled = model(data["name"])
    energy, state, values = _by_sympy(data)
    here = [0.7, -0.4, 0.35, 0.9]
    known = {**values, **dict(zip(state, here, strict=True))}
    q, p = here[:2], here[2:]
    assert compiled.energy(q, p) == pytest.approx(float(energy.subs(known)), rel=1e-14)
    slopes = [float(energy.diff(x).subs(known)) for x in state]
    np.testing.assert_allclose(np.concatenate(compiled.gradient(q, p)), slopes, rtol=1e-13, atol=1e-15)
    direction = np.array([0.3, -1.1, 0.8, 0.25])
    hessian = np.array(sympy.hessian(energy, state).subs(known), float)
    found = np.concatenate(compiled.hessian_product(q, p, direction[:2], direction[2:]))
    np.testing.assert_allclose(found, hessian @ direction, rtol=1e-13, atol=1e-14)
    flow = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.eye(2), np.zeros((2, 2))]]) @ hessian
    assert compiled.largest_frequency(q, p) == pytest.approx(np.abs(np.linalg.eigvals(flow)).max(), rel=1e-12)


def test_many_states_are_evaluated_at_once_and_parameters_change() -> None:
    compiled = model("henon_heiles")
    states = np.random.default_rng(1).normal(size=(5, 4))
    q, p = states[:, :2], states[:, 2:]
    every = compiled.energy(q, p)
    assert every.shape == (5,)
    np.testing.assert_array_equal(every, [compiled.energy(*pair) for pair in zip(q, p, strict=True)])
    free = compiled.energy(q, p, {"coupling": 0.0})
    np.testing.assert_allclose(free, (q**2 + p**2).sum(axis=1) / 2, rtol=1e-14)


def reference(compiled: HamiltonianModel, t_end: float) -> Array:
    """Return the state at the end of the motion from the start of the file, by SciPy."""
    n = compiled.n

    def rate(_: float, state: Array) -> Array:
        dq, dp = compiled.gradient(state[:n], state[n:])
        return np.concatenate([dp, -dq])

    start = [item.value for item in compiled.document.states]
    return np.asarray(solve_ivp(rate, (0, t_end), start, method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1])


@pytest.mark.parametrize(
    ("name", "method", "first", "order", "step"),
    [
        ("henon_heiles", "leapfrog", "drift", 2, 0.1),
        ("henon_heiles", "bcss3", "kick", 2, 0.1),
        ("henon_heiles", "omf4", "drift", 4, 0.2),
        ("henon_heiles", "omf4", "kick", 4, 0.2),
        ("henon_heiles", "yoshida6", "kick", 6, 0.2),
        ("henon_heiles", "implicit_midpoint", "drift", 2, 0.1),
        ("henon_heiles", "creutz_gocksch4_3", "drift", 4, 0.4),
        ("swinging", "implicit_midpoint", "drift", 2, 0.01),
        ("swinging", "suzuki4", "drift", 4, 0.04),
        ("swinging", "yoshida6", "drift", 6, 0.04),
        ("bodies", "omf4", "drift", 4, 0.05),
        ("bodies", "leapfrog", "kick", 2, 0.02),
    ],
)
def test_motions_have_the_order_of_the_method(name: str, method: str, first: str, order: int, step: float) -> None:
    compiled, t_end = model(name), {"henon_heiles": 8.0, "swinging": 0.8, "bodies": 1.0}[name]
    exact, errors = reference(compiled, t_end), []
    for h in (step, step / 2):
        run = compiled.simulate(t_end, h, method=method, first=first)
        assert run.success, run.message
        errors.append(float(np.abs(np.concatenate([run.q[-1], run.p[-1]]) - exact).max()))
    assert math.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.3)


def test_a_run_says_energies_outputs_and_what_it_cost() -> None:
    run = model("henon_heiles").simulate(method="suzuki4", record_every=7)
    assert run.message == "reached t = 20 in 200 steps"
    assert run.t[-1] == 20.0 and len(run.t) == 30 and run.t[1] == pytest.approx(0.7)
    assert (run.stats["steps"], run.stats["gradients"]) == (200, 1000)
    np.testing.assert_allclose(run.energy["kinetic"], (run.p**2).sum(axis=1) / 2, rtol=1e-14)
    np.testing.assert_allclose(run.energy["total"], model("henon_heiles").energy(run.q, run.p), rtol=1e-15)
    by_hand = run.q[:, 0] * run.p[:, 1] - run.q[:, 1] * run.p[:, 0]
    np.testing.assert_allclose(run.outputs["angular_momentum"], by_hand, rtol=1e-13, atol=1e-16)
    assert 0 < run.energy_error < 1e-5
    assert "coupled" not in run.energy
    swinging = model("swinging").simulate(0.1, method="implicit_midpoint")
    turning = swinging.p[:, 1] ** 2 / (2 * swinging.q[:, 0] ** 2)
    np.testing.assert_allclose(swinging.energy["coupled"], turning, rtol=1e-13)
    assert swinging.stats["gradients"] == swinging.stats["iterations"] + 10 >= 30  # one at the start of each step
    assert swinging.stats["products"] == 0  # iteration alone
    assert swinging.p[0, 1] == 0.5  # a formula of parameters


def test_repetition_makes_the_bodies_and_the_pairs() -> None:
    document = hamiltonian_from_data(BODIES)
    assert [item.name for item in document.parameters] == ["m0", "m1", "m2"]
    assert [term.name for term in document.terms if term.dependence == "potential"] == [
        "pair_0_1", "pair_0_2", "pair_1_2",
    ]  # fmt: skip
    assert document.separable
    run = model("bodies").simulate()
    momentum = run.p[:, 0::2].sum(axis=1)
    np.testing.assert_allclose(momentum, momentum[0], atol=1e-14)


@pytest.mark.slow
def test_a_long_chain_is_a_loop() -> None:
    """A thousand cells with cubic springs: the functions are as long as those of a few, and sum up as NumPy does."""
    cells = 1000
    chain: Any = {
        "format": 1,
        "kind": "hamiltonian",
        "name": "chain",
        "parameters": {"alpha": 0.25},
        "repeat": {
            "cells": {
                "indices": {"i": cells},
                "coordinates": {"x{i}": {"initial": ["{0.1*sin(0.3*i)}", 0.0]}},
                "hamiltonian": {"kinetic_{i}": "p_x{i}**2/2"},
            },
            "springs": {
                "indices": {"i": [1, cells - 1]},
                "hamiltonian": {"spring_{i}": "(x{i} - x{i - 1})**2/2 + alpha*(x{i} - x{i - 1})**3/3"},
            },
        },
    }
    compiled: Any = eomgen.build(chain, profile="quick")
    assert all(function["operations"] < 60 for function in compiled.library.layout["functions"])
    q, p = np.random.default_rng(3).normal(size=(2, cells))
    stretch = np.diff(q)
    assert compiled.energy(q, p) == pytest.approx((p @ p + stretch @ stretch) / 2 + (stretch**3).sum() / 12, rel=1e-12)
    pull = stretch + 0.25 * stretch**2
    np.testing.assert_allclose(compiled.gradient(q, p)[0], -np.diff(pull, prepend=0.0, append=0.0), atol=1e-13)
    np.testing.assert_array_equal(compiled.gradient(q, p)[1], p)


def test_a_step_beyond_the_limit_is_said_and_a_run_that_fails_keeps_what_it_had() -> None:
    compiled = model("henon_heiles")
    run = compiled.simulate(3.0, 3.0, method="leapfrog", initial={"x": 0.0, "y": 0.0, "p_x": 1e-3, "p_y": 0.0})
    assert "step times largest frequency is 3 at the start, and leapfrog is stable up to 2; try:" in run.message
    assert compiled.largest_frequency([0.3, 0.1], [0.2, 0.4]) == pytest.approx(np.sqrt(1 + 2 * np.hypot(0.3, 0.1)))
    limit = 2 / np.sqrt(1 + 2 * np.hypot(0.3, 0.1))
    for step, said in ((0.99 * limit, False), (1.01 * limit, True)):
        at = {"x": 0.3, "y": 0.1}
        message = compiled.simulate(step, step, method="leapfrog", initial=at).message
        assert ("step times largest frequency" in message) is said
    away = compiled.simulate(100.0, 0.5, method="leapfrog", initial={"y": 3.0, "p_y": 2.0})
    assert not away.success
    assert away.message.startswith("stopped after t = ")
    assert "a value became infinite or not a number" in away.message
    assert np.isfinite(away.q).all() and len(away.t) == len(away.q) > 1
    escaping = system("escaping", "p_x*(x**2 + 1)", coordinates={"x": {"initial": [0.5, 1.0]}})
    # m = x0 + h/2 (m^2 + 1) has no real root
    stiff: Any = eomgen.build(escaping, profile="quick").simulate(1.0, 1.0)
    assert not stiff.success
    text = "the equations of an implicit step were not solved by Newton's method; try: a step smaller than 1"
    assert text in stiff.message


def test_rows_of_a_run_that_fails_are_those_of_a_shorter_one() -> None:
    options: dict[str, Any] = {"method": "leapfrog", "record_every": 3, "initial": {"y": 3.0, "p_y": 2.0}}
    away = model("henon_heiles").simulate(100.5, 0.5, **options)
    assert not away.success and away.stats["steps"] == 3 * (len(away.t) - 1) > 0
    shorter = model("henon_heiles").simulate(away.t[-1], 0.5, **options)
    assert shorter.message.startswith("reached t = ") and "H, which nothing changes, goes from" in shorter.message
    np.testing.assert_array_equal(shorter.q, away.q)


@pytest.mark.parametrize("first", ["drift", "kick"])
def test_a_step_is_that_of_the_formula(first: str) -> None:
    h, q, p = 0.3, np.array([0.0, 0.1]), np.array([0.4, 0.2])

    def force(q: Array) -> Array:
        return np.array([-q[0] - 2 * q[0] * q[1], -q[1] - q[0] ** 2 + q[1] ** 2])

    if first == "drift":
        q = q + h / 2 * p
        p = p + h * force(q)
        q = q + h / 2 * p
    else:
        p = p + h / 2 * force(q)
        q = q + h * p
        p = p + h / 2 * force(q)
    run = model("henon_heiles").simulate(h, h, method="leapfrog", first=first)
    np.testing.assert_allclose(np.concatenate([run.q[-1], run.p[-1]]), [*q, *p], rtol=1e-14, atol=1e-16)


def test_parts_of_a_run_are_one_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs come back between so many steps, so that the keyboard is heard, and sums keep what they have lost."""
    options: dict[str, Any] = {"record_every": 20, "compensated": True, "method": "omf4"}
    whole = model("henon_heiles").simulate(1000.0, **options)
    monkeypatch.setattr(hamiltonian_model, "_SECONDS_AT_ONCE", 0.0)
    parts = model("henon_heiles").simulate(1000.0, **options)
    np.testing.assert_array_equal(whole.p, parts.p)
    assert whole.stats["gradients"] == parts.stats["gradients"]


def test_a_model_is_built_with_a_method_for_its_runs() -> None:
    made: Any = eomgen.build(HENON_HEILES, method="bcss3", profile="quick")
    assert made.simulate(1.0).metadata["method"] == "bcss3"
    assert model("henon_heiles").simulate(1.0).metadata["method"] == "omf4"
    assert model("swinging").simulate(0.1).metadata["method"] == "gauss6"


def test_signs_of_brackets_are_those_of_their_terms() -> None:
    data = changed(hamiltonian="p_x**2/2 + p_y**2/2 - (-(x**2 - y) - 3*(x + p_x)/coupling)")
    document = hamiltonian_from_data(data)
    assert document.separable and len(document.terms) == 6
    x, y, p_x, p_y, coupling = 0.3, 0.7, -0.4, 0.9, 2.0
    known = {"x": x, "y": y, "p_x": p_x, "p_y": p_y, "coupling": coupling}
    parts = dict.fromkeys(("kinetic", "potential"), 0.0)
    for term in document.terms:
        parts[term.dependence] += evaluate(term.formula, lambda symbol: known[symbol.name])
    assert parts["kinetic"] == pytest.approx(p_x**2 / 2 + p_y**2 / 2 + 3 * p_x / coupling, rel=1e-14)
    assert parts["potential"] == pytest.approx(x**2 - y + 3 * x / coupling, rel=1e-14)


def test_info_says_the_terms_the_functions_and_the_method(capsys: pytest.CaptureFixture[str]) -> None:
    """As JSON, and the same as a table, of a separable system and of one that is not."""
    document = hamiltonian_from_data(HENON_HEILES)
    show(document, "leapfrog", as_json=True)
    told = json.loads(capsys.readouterr().out)
    assert told["separable"] is True and told["coupled"] == [] and told["outputs"] == ["angular_momentum"]
    assert told["terms"] == {"kinetic": 2, "potential": 4} and told["parameters"] == {"coupling": 1.0}
    second = {"name": "y", "momentum": "p_y", "position": 0.1, "momentum_value": 0.2, "unit": "", "momentum_unit": ""}
    assert told["coordinates"][1] == second
    assert told["method"] == {"name": "leapfrog", "order": 2, "gradients": 1, "stability_limit": pytest.approx(2.0)}
    counts = derive_hamiltonian(document).counts
    assert {name: entry["flops"] for name, entry in told["functions"].items()} == {
        name: count.flops for name, count in counts.items()
    }
    show(document, None, as_json=False)
    table = " ".join(capsys.readouterr().out.split())
    assert table.startswith(
        "henon_heiles coordinates name = x, momentum = p_x, position = 0, momentum_value = 0.4 name = y,"
    )
    assert f"kick rates of momenta, -dV/dq {counts['kick'].flops}" in table and "name = omf4 order = 4" in table
    show(hamiltonian_from_data(SWINGING), None, as_json=False)
    table = " ".join(capsys.readouterr().out.split())
    assert "separable False" in table and "coupled turning" in table and "k = 40" in table


def test_numbers_of_the_command_line_have_the_unit_of_their_label() -> None:
    items = [NamedNumber("length", 1.0, "m"), NamedNumber("w", 2.0)]
    assert _numbers("--set", ["length=250 mm", "w=-3"], items) == {"length": 0.25, "w": -3.0}
    with pytest.raises(eomgen.UsageError, match="w has no unit in the file, so '2 N/m' could be anything; try: the n"):
        _numbers("--set", ["w=2 N/m"], items)


def test_its_c_stands_alone_and_gives_the_same_rows(tmp_path: Path) -> None:
    folder = tmp_path / "c"
    names = {file.name for file in eomgen.generate(HENON_HEILES, folder, method="suzuki4")}  # type: ignore[arg-type]
    assert {"henon_heiles.h", "henon_heiles.c", "henon_heiles_steps.c", "main.c", "README.md"} <= names
    rows = rows_of_program(folder, "30", "0.1", "10")
    run = model("henon_heiles").simulate(3.0, method="suzuki4", record_every=10)
    np.testing.assert_allclose(rows[:, 1:5], np.hstack([run.q, run.p]), rtol=1e-12)
    np.testing.assert_allclose(rows[:, 5], run.energy["total"], rtol=1e-13)


@pytest.mark.slow
def test_the_command_line_takes_such_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "system.toml"
    file.write_text(
        'format = 1\nkind = "hamiltonian"\nname = "oscillator"\nhamiltonian = "p_x**2/2 + w**2*x**2/2"\n'
        "[parameters]\nw = 2.0\n[coordinates]\nx = { initial = [1.0, 0.0] }\n"
    )
    out = tmp_path / "run"
    arguments = ["simulate", str(file), "--out", str(out), "--t-end", "1", "--step", "0.05", "--set", "w=1"]
    assert main([*arguments, "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["final"]["x"] == pytest.approx(math.cos(1.0), abs=1e-7)
    assert {"solution.npz", "solution.csv", "motion.png", "summary.json"} <= {item.name for item in out.iterdir()}
    assert main(["info", str(file), "--method", "leapfrog", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["method"]["stability_limit"] == pytest.approx(2.0)
    assert main(["linearize", str(file)]) == 3
    assert "this is a Hamiltonian system, and this command or function is for mechanical" in capsys.readouterr().err
    assert main([*arguments, "--rho-inf", "0.5"]) == 2
    assert "rho_inf belongs to mechanical scenes" in capsys.readouterr().err
    assert main([*arguments, "--tolerance", "1e-6", "--method", "rk45", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["tolerance"] == 1e-6


def test_python_takes_such_files_by_the_same_verbs(tmp_path: Path) -> None:
    document: Any = eomgen.load(HENON_HEILES)  # type: ignore[arg-type]
    assert document.separable and document.momenta[0].name == "p_x"
    assert list(eomgen.derive(document).functions)[:3] == ["hamiltonian", "gradient", "hessian_product"]
    with pytest.raises(eomgen.UsageError, match="henon_heiles is a Hamiltonian system, and this is for mechanical"):
        eomgen.extremes(document)
    with pytest.raises(
        eomgen.UsageError, match="terms belongs to mechanical scenes, and henon_heiles is a Hamiltonian"
    ):
        eomgen.build(document, ["mass"])


def test_definitions_of_copies_stand_in_their_terms() -> None:
    copies = {
        "indices": {"i": 3, "j": 3},
        "where": "i < j",
        "definitions": {"d{i}_{j}": "x{i} - x{j}"},
        "hamiltonian": {"pair_{i}_{j}": "d{i}_{j}**2 + 1/d{i}_{j}**2"},
    }
    coordinates = {f"x{i}": {"initial": [float(i), 0.0]} for i in range(3)}
    terms = {"kinetic": "p_x0**2 + p_x1**2 + p_x2**2"}
    document = hamiltonian_from_data(system("pairs", terms, coordinates=coordinates, repeat={"distances": copies}))
    assert document.separable and [term.dependence for term in document.terms].count("potential") == 6


#: Definitions in any order, of coordinates, of momenta and of both, and the formulas with definitions in place.
DEFINED: dict[str, Any] = {
    "definitions": {
        "e": "drive + well",
        "well": "exp(-r2)*coupling",
        "r2": "x**2 + y**2",
        "drive": "cosh(p_x) + p_y**2",
    },
    "hamiltonian": {"both": "e", "more": "sqrt(1 + r2)"},
    "outputs": {"share": "well + sin(well)"},
}
WRITTEN: dict[str, Any] = {
    "hamiltonian": {
        "both": "(cosh(p_x) + p_y**2) + exp(-(x**2 + y**2))*coupling",
        "more": "sqrt(1 + (x**2 + y**2))",
    },
    "outputs": {"share": "exp(-(x**2 + y**2))*coupling + sin(exp(-(x**2 + y**2))*coupling)"},
}


@pytest.mark.slow
def test_a_definition_is_evaluated_once_under_its_name_in_the_c() -> None:
    """A definition of coordinates and momenta is split, so that H stays separable, and equal formulas have the same
    bits."""
    defined, written = (eomgen.build(changed(**data), profile="quick") for data in (DEFINED, WRITTEN))
    assert isinstance(defined, HamiltonianModel) and isinstance(written, HamiltonianModel)
    assert defined.document.separable and not defined.document.notes
    counts = [derive_hamiltonian(made.document).counts for made in (defined, written)]
    assert counts[0] == counts[1]
    state = [0.3, -0.7], [0.2, 0.4]
    assert defined.energy(*state) == pytest.approx(written.energy(*state), rel=1e-15)
    runs = [made.simulate(2.0, 0.1) for made in (defined, written)]
    np.testing.assert_allclose(runs[0].q, runs[1].q, rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(runs[0].outputs["share"], runs[1].outputs["share"], rtol=1e-13)
    program = program_of(defined.document)
    text = library_files(defined.document, program)[f"{program.prefix}.c"]
    assert all(f"/* Definition {name} */" in text for name in ("well", "r2", "drive"))
    assert "well_value" in text and "r2_value" in text
    (observed,) = re.findall(r"\nvoid \w+_observed\(.*?\n}", text, re.DOTALL)
    assert observed.count("EG_EXP(") == 1


def test_definitions_that_no_formula_mentions_are_noted() -> None:
    document = hamiltonian_from_data(changed(definitions={"spare": "2*x", "kept": 0.5}, outputs={"a": "kept*x"}))
    assert document.notes == ("the definition spare changes nothing: no formula mentions it",)
    assert document.definitions == {"spare": "2*x", "kept": "0.5"}


def changed(**changes: Any) -> dict[str, Any]:
    return {**HENON_HEILES, **changes}


def chained(count: int, formula: str) -> dict[str, Any]:
    """Return the system with definitions within one another."""
    return changed(definitions={f"d{k}": formula.replace("d", f"d{k - 1}") if k else "x + y" for k in range(count)})


START = {"initial": [0, 0]}
POLAR = {"coordinates": {"x": {**START, "momentum": "p", "masss": 1}, "y": START}, "outputs": {"momentum": "p + p_y"}}


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (changed(hamiltonian="p_x**2/2 + z"), r"\(hamiltonian\): .*'z'"),
        (changed(hamiltonian="p_x**2/2 + t*x"), r"\(hamiltonian\): .*H does not depend on time"),
        (changed(hamiltonian="p_x**2/2 + x"), "neither y nor p_y is in H, so both stay as they are"),
        (changed(hamiltonian=""), "the Hamiltonian is missing"),
        (changed(hamiltonian={"a": 2, "b": ["x"]}), r"\(hamiltonian.b\): a number or a formula is needed here"),
        (
            changed(hamiltonian="p**2/2 + x + y"),
            r'unknown name .p. .*try: p_x for the momentum of x, or momentum = "p"',
        ),
        (changed(coordinates={"x": {"initial": [1, "inf"]}, "y": START}), "'inf'"),
        (
            changed(coordinates={"x": {"initial": ["1 m", 2]}, "y": START}),
            r"units are not read .*; try: the number alone;",
        ),
        (changed(coordinates={}), "there is no coordinate"),
        (changed(hamiltonian="p**2/2 + p_y**2/2 + x*y", **POLAR), "the key 'masss' is unknown here"),
        (changed(parameters={"coupling": 1.0, "x": 2.0}), "the name x is given twice"),
        (changed(parameters={"coupling": 1.0, "t": 2.0}), "t is the time"),
        (changed(parameters={"coupling": [2.0], "half": "coupling/2"}), "not a list; try: coupling = 2.0"),
        (changed(name="2x"), "is not legal"),
        (changed(kind="hamiltonain"), r"'hamiltonain' is not known here; try: kind = \"hamiltonian\""),
        (changed(definitions={"a": "b + 1", "b": "2*a"}), r"\(definitions.b\): the definition a mentions itself"),
        (changed(definitions={"a": "p + x", "b": "2*a"}), r"\(definitions.a\): unknown name 'p' [^\n]*$"),
        (
            changed(definitions={"m": 2}, parameters={"coupling": "m + 1"}),
            r"\(parameters.coupling\): .*; try: the formula of m",
        ),
        (changed(definitions={"x": "y"}), r"the name x is given twice, in \[coordinates\] too; try: another name$"),
        (changed(definitions={"sin": "y"}), r"\(definitions.sin\): the name sin is a word of formulas; try: sin_value"),
        (changed(definitions={"a": "sqrt("}), r"\(definitions.a\): "),
        (chained(200, "sin(d)"), r"the formula has 150 operations in 151 levels, .*; try: shorter definitions, or"),
        (chained(17, "d + d*x"), r"the formula has \d+ operations in \d+ levels, of"),
        (changed(simulation={"tolerance": 1e-6}), 'a tolerance belongs to rk45, .*; try: method = "rk45"'),
        (
            changed(simulation={"tolerance": 0.5, "method": "rk45"}),
            r"\(simulation.tolerance\): 0\.5 is out of range here",
        ),
        (changed(simulation=3), r"\(simulation\): a table is needed here, not 3; try: \[simulation\]"),
    ],
)
def test_mistakes_in_files_have_one_clear_message(data: dict[str, Any], text: str) -> None:
    with pytest.raises(eomgen.DescriptionError, match=text) as caught:
        eomgen.load(data)  # type: ignore[arg-type]
    assert len(caught.value.problems) == 1


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"method": "rk5"}, "there is no method 'rk5' of Hamiltonian systems"),
        ({"method": "leapfrg"}, "try: leapfrog"),
        ({"method": "bcss2"}, "method: the method bcss2 was removed; try: bcss3"),
        ({"method": "Velocity-Verlet"}, 'try: leapfrog, which first="kick" begins with a kick'),
        ({"method": "ias15"}, "try: gauss12 or kahan_li8, or rk45, which chooses its steps"),
        ({"t_end": 1e10, "step": 1e-300}, r"inf steps of 1e-300 would lead to 1e\+10; 1e\+15 are"),
        ({"t_end": 1e300}, r"1e\+301 steps of 0\.1 .*; try: a step of 1e\+285 or more, or an earlier end"),
        ({"first": "swing"}, "a step begins with a drift or a kick, not with 'swing'"),
        ({"tolerance": 1e-6}, r'omf4 takes equal steps, and .* to rk45; try: method="rk45"'),
        ({"method": "rk45", "tolerance": 0.0}, r"the tolerance must lie in 1e-14\.\.0\.1, not 0"),
        ({"t_end": 1.05, "step": 0.1}, r"1\.05 is not a whole number of steps of 0\.1; try: an end"),
        ({"t_end": -1.0}, r"steps of 0\.1 lead away from -1; try: a step of -0\.1"),
        ({"step": 0.0}, "a finite step other than 0 is needed"),
        ({"record_every": 0}, "a whole number from 1 on is needed, not 0"),
        ({"parameters": {"couplin": 1}}, "there is no parameter 'couplin'; try: coupling"),
        ({"initial": {"z": 1}}, "there is no coordinate or momentum 'z'"),
        ({"initial": {"q": [1.0, 2.0], "y": 3}}, "the name y is given twice, in the array q too; try: one"),
        ({"initial": {"q": [1.0]}}, r"q has shape \(1,\), and finite numbers of shape \(2,\)"),
        ({"t_end": 1e12, "step": 1e-3}, r"1e\+15 rows of 4 numbers would take .* GB; try: record_every="),
    ],
)
def test_mistakes_in_calls_have_one_clear_message(options: dict[str, Any], text: str) -> None:
    with pytest.raises(eomgen.UsageError, match=text):
        model("henon_heiles").simulate(**options)


def test_states_and_methods_that_a_system_cannot_have() -> None:
    with pytest.raises(eomgen.UsageError, match=r"an array of a state has shape \(5,\)"):
        model("henon_heiles").energy(np.zeros(5), np.zeros(5))
    with pytest.raises(eomgen.UsageError, match="H is -inf at the start"):
        model("bodies").simulate(initial={"x1": math.cos(0), "y1": 0.0})
    with pytest.raises(eomgen.UsageError, match=r"omf4 needs H = T\(p\) \+ V\(q\), and turning depends on coordinates"):
        model("swinging").simulate(method="omf4")


@pytest.mark.parametrize(("kinetic", "noted"), [("", True), ("kinetic + ", False)])
def test_a_coordinate_without_its_momentum_in_h_is_noted(kinetic: str, noted: bool) -> None:
    definitions = {"kinetic": "p_x**2/4", "potential": "4*x**2"}
    data = system(
        "oscillator",
        f"{kinetic}potential",
        coordinates={"x": {"initial": [0.1, 0.0]}},
        definitions=definitions,
        outputs={"energy": "kinetic + potential"},
    )
    note = "hamiltonian: H does not depend on p_x, so x never moves; try: a kinetic energy, p_x**2/(2*m), in H"
    assert hamiltonian_from_data(data).notes == ((note,) if noted else ())
