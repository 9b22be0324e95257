"""Documents of equations: their expressions have the numbers of compiled functions, and their LaTeX is whole."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import sympy
from click.testing import CliRunner

import eomgen
from eomgen.base.data import replace
from eomgen.cli import commands, main
from eomgen.products.pages.latex import TERMS, document, equations, typeset_symbols, with_symbols
from eomgen.system.system import BASE_LAYOUT

EXAMPLES = Path(eomgen.__file__).parents[1] / "examples"
SCENES = ["four_bar", "double_pendulum_on_shaking_base", "pi_servo", "spherical_pendulum"]


def values_at(parts: dict, state: dict) -> dict[str, np.ndarray]:
    """Return the terms of a document in JSON at a state: tables have the order of arrays."""
    blocks = {"Coordinates": "q", "Velocities": "v", "Parameters": "p", "Inputs": "u", "Internal states": "z"}
    names = {"t": state["t"]}
    for title, block in blocks.items():
        rows = parts["definitions"].get(title, [])
        names |= {row["name"]: value for row, value in zip(rows, state[block], strict=bool(rows))}
    axes = [(field, axis) for field, size, _ in BASE_LAYOUT for axis in ("wxyz" if size == 4 else "xyz")]
    names |= {f"base_{field}_{axis}": value for (field, axis), value in zip(axes, state["base"], strict=True)}
    reads = {name: getattr(sympy, name) for name in ("Min", "Max", "Piecewise")}

    def number(text: str) -> float:
        symbols = {name: sympy.Symbol(name) for name in names}
        expression = sympy.sympify(text, locals={**reads, **symbols})
        return float(expression.subs({symbols[name]: value for name, value in names.items()}))

    for name, text in parts["shared"]:
        names[name] = number(text)
    return {
        name: np.array([[number(entry) for entry in row] for row in term["entries"]])
        for name, term in parts["terms"].items()
    }


@pytest.mark.long_cases("four_bar")
@pytest.mark.parametrize("name", SCENES)
def test_expressions_have_the_numbers_of_the_compiled_model(name: str) -> None:
    """At a random state, with all fixed parameters as symbols."""
    path = EXAMPLES / name / "scene.toml"
    done = CliRunner().invoke(commands, ["latex", str(path), "--symbols", "--json"], standalone_mode=False)
    assert done.exit_code == 0, done.output
    scene = eomgen.load(path)
    scene = replace(scene, parameters=tuple(replace(item, tunable=True) for item in scene.parameters))
    model = eomgen.build(scene, profile="quick")
    rng = np.random.default_rng(7)
    q, v, z, u = (rng.normal(size=size) for size in (model.nq, model.nv, model.nz, model.nu))
    for factor in model.factors:
        if factor.q_size > 1:
            q[factor.q_start : factor.q_start + 4] /= np.linalg.norm(q[factor.q_start : factor.q_start + 4])
    state = {"q": q, "v": v, "z": z, "u": u, "t": 0.7, "base": model.base(0.7)}
    parameters = json.loads(done.stdout)["definitions"].get("Parameters", [])
    state["p"] = list(model.parameters.values())
    assert all(item["value"] in (None, value) for item, value in zip(parameters, state["p"], strict=True))
    given = {"q": q, "t": 0.7, "parameters": None}
    inputs = {"u": u} if model.nu else {}
    states = {"z": z} if model.nz else {}
    found = values_at(json.loads(done.stdout), state)
    wanted = {
        "mass": lambda: model.mass(q),
        "coupling": lambda: model.coupling(q, v),
        "base_motion": lambda: model.base_motion(q, v, 0.7),
        "force": lambda: model.force(q, v, 0.7, **inputs, **states),
        "internal_rate": lambda: model.internal_rates(q, v, z, 0.7, **inputs),
        "constraint": lambda: model.evaluator.call("constraint", **given)[0],
        "constraint_jacobian": lambda: model.evaluator.call("constraint_jacobian", **given)[0],
    }
    assert {"mass", "coupling", "force"} <= found.keys() <= TERMS.keys()
    for term, value in found.items():
        expected = np.reshape(wanted[term](), value.shape)
        assert value == pytest.approx(expected, rel=1e-11, abs=1e-11 * max(1.0, np.max(np.abs(expected)))), term


@pytest.mark.parametrize("name", SCENES)
def test_documents_are_whole(name: str, tmp_path: Path) -> None:
    """Environments, braces and mathematics are closed, lines are short, every symbol is defined, LaTeX takes it."""
    path = EXAMPLES / name / "scene.toml"
    done = CliRunner().invoke(commands, ["latex", str(path), "--out", str(tmp_path)], standalone_mode=False)
    assert done.exit_code == 0, done.output
    (file,) = tmp_path.iterdir()
    text = file.read_text(encoding="utf-8")
    assert file.name == f"{eomgen.load(path).name}.tex"
    open_now: list[str] = []
    for kind, environment in re.findall(r"\\(begin|end)\{([a-z]+\*?)\}", text):
        if kind == "begin":
            open_now.append(environment)
        else:
            assert open_now.pop() == environment
    assert not open_now
    plain = re.sub(r"\\[{}$]", "", text)
    assert plain.count("{") == plain.count("}") and plain.count("$") % 2 == 0
    assert text.count(r"\left") == text.count(r"\right")
    assert {r"\documentclass", r"\begin{document}", "Inertia matrix", "Generalized force"} <= {
        part for part in (r"\documentclass", r"\begin{document}", "Inertia matrix", "Generalized force") if part in text
    }
    for environment in re.findall(r"\\begin\{align\*\}\n(.*?)\n\\end\{align\*\}", text, re.DOTALL):
        for line in environment.split(" \\\\\n"):
            assert line.count("&") == 1
    if shutil.which("pdflatex"):
        words = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", file.name]
        assert subprocess.run(words, cwd=tmp_path, capture_output=True, check=False).returncode == 0


@pytest.mark.slow
def test_long_expressions_are_named_and_broken() -> None:
    system, described = with_symbols(eomgen.load(EXAMPLES / "robot_arm" / "scene.toml"))
    parts = equations(system, described)
    assert parts.shared
    numbered = [symbol.name for symbol, _ in parts.shared]
    assert numbered == [f"w_{index + 1}" for index in range(len(numbered))]
    known = {item.name for items in parts.definitions.values() for item in items}
    for symbol, value in parts.shared:
        assert {entry.name for entry in value.free_symbols} <= known
        known.add(symbol.name)
    longest = max(
        len(str(term)) for matrix in parts.terms.values() for entry in matrix for term in sympy.Add.make_args(entry)
    )
    assert longest < 200
    text = document(system, parts)
    assert max(map(len, text.splitlines())) < 2000


def test_names_are_typeset_apart() -> None:
    names = ["theta2", "theta_2", "m_cart", "k", "q_elbow", "lam_0", "a&b", "base_omega_x", "stiffness"]
    made = typeset_symbols(names)
    assert len(set(made.values())) == len(names)
    assert made["m_cart"] == r"m_{\mathrm{cart}}" and made["stiffness"] == r"\mathrm{stiffness}"
    assert made["theta2"] == r"\mathtt{theta2}" and made["theta_2"] == r"\mathtt{theta\_2}"
    assert made["lam_0"] == r"\lambda_{1}" and made["base_omega_x"] == r"\omega_{B,x}"


def test_a_file_is_not_made_a_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["latex", str(EXAMPLES / SCENES[0] / "scene.toml"), "--out", str(tmp_path / "paper.tex")]) == 7
    assert f"and .tex is the ending of a file; try: the folder {tmp_path / 'paper'}" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
