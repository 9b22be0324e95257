"""Functions for CasADi: values and derivatives of the compiled C as CasADi sees them, and the written folder."""

from __future__ import annotations

import ctypes
import json
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

import eomgen
from eomgen.cli import main

EXAMPLES = Path(__file__).parents[2] / "examples"
SCENE = EXAMPLES / "double_pendulum_on_shaking_base" / "scene.toml"
Array = np.ndarray
FUNCTIONS = ["inverse_dynamics", "forward_dynamics", "outputs", "step"]


@cache
def functions() -> Any:
    return eomgen.casadi(SCENE, profile="quick")


@cache
def model() -> eomgen.Model:
    return eomgen.build(SCENE, profile="quick")


def derivatives(function: Any, point: list[Array], weights: Array, *, sparse: bool = False) -> Any:
    """Return the Jacobian, and the Hessian of weights . function, in all inputs, by CasADi: arrays, or its matrices."""
    sizes = [len(part) for part in point]
    y, w = ca.MX.sym("y", sum(sizes)), ca.MX.sym("w", len(weights))
    value = function(*ca.vertsplit(y, np.cumsum([0, *sizes]).tolist()))
    made = ca.Function("made", [y, w], [ca.jacobian(value, y), ca.hessian(ca.dot(w, value), y)[0]])
    matrices = made(np.concatenate(point), weights)
    return matrices if sparse else tuple(np.array(matrix) for matrix in matrices)


@pytest.mark.parametrize("name", ["inverse_dynamics", "forward_dynamics"])
def test_values_and_derivatives_are_those_of_the_model(name: str, rng: np.random.Generator) -> None:
    function = functions()[name]
    blocks = {"q": rng.normal(size=2), "v": rng.normal(size=2), "a": rng.normal(size=2)}
    blocks |= {"p": model().parameter_array() * 1.3, "t": np.array([0.7])}
    taken = function.name_in()
    point = [blocks[block] for block in taken]
    given = {block: blocks[block] for block in ("q", "v", "a") if block in taken}
    given |= {"t": 0.7, "parameters": blocks["p"]}
    weights = rng.normal(size=2)
    jacobian, hessian = derivatives(function, point, weights)
    assert np.array(function(*point)).ravel() == pytest.approx(getattr(model(), name)(**given), rel=1e-14)
    assert jacobian == pytest.approx(model().derivatives(name, **given), rel=1e-14)
    expected = model().hessian(name, weights, **given)
    assert hessian == pytest.approx(expected, rel=1e-13, abs=1e-14)
    assert function.jacobian().nnz_out() == len(model().sparsity(name).rows)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_jacobians_and_derivatives_along_directions_are_differentiated_again(
    name: str, rng: np.random.Generator
) -> None:
    """By ``jac_jac_``, ``fwd1_`` and ``jac_fwd1_``, against the Hessians of all rows and the Jacobian."""
    function = functions()[name]
    sizes, rows = [function.size1_in(k) for k in range(function.n_in())], function.size1_out(0)
    y, along = ca.MX.sym("y", sum(sizes)), ca.MX.sym("along", sum(sizes))
    value = function(*ca.vertsplit(y, np.cumsum([0, *sizes]).tolist()))
    jacobian, forward = ca.jacobian(value, y), ca.jtimes(value, y, along)
    outputs = [jacobian, forward, ca.jacobian(ca.vec(jacobian), y), ca.jacobian(forward, y)]
    outputs += [ca.hessian(value[row], y)[0] for row in range(rows)]
    point, direction = rng.normal(size=sum(sizes)), rng.normal(size=sum(sizes))
    first, moved, of_jacobian, of_forward, *hessians = map(
        np.array, ca.Function("made", [y, along], outputs)(point, direction)
    )
    second = np.stack(hessians)
    assert moved.ravel() == pytest.approx(first @ direction, rel=1e-13, abs=1e-13)
    in_rows = of_jacobian.reshape(sum(sizes), rows, sum(sizes)).transpose(1, 0, 2)
    assert in_rows == pytest.approx(second, rel=1e-13, abs=1e-13)
    assert of_forward == pytest.approx(second @ direction, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_jacobian_and_a_hessian_are_one_call_each(name: str) -> None:
    """By the penalty that ``casadi.external`` gets: by default CasADi calls ``fwd1_`` for each column."""
    function = functions()[name]
    sizes = [function.size1_in(k) for k in range(function.n_in())]
    y, w = ca.MX.sym("y", sum(sizes)), ca.MX.sym("w", function.size1_out(0))
    value = function(*ca.vertsplit(y, np.cumsum([0, *sizes]).tolist()))
    first = ca.Function("first", [y], [ca.jacobian(value, y)])
    second = ca.Function("second", [y, w], [ca.hessian(ca.dot(w, value), y)[0]])
    called = [[inner.name() for inner in made.find_functions()] for made in (first, second)]
    assert called == [[f"jac_{function.name()}"], [f"jac_adj1_{function.name()}"]]


@pytest.mark.long
def test_a_folder_compiles_strictly_and_takes_null_for_zeros_and_for_no_result(tmp_path: Path) -> None:
    folder = tmp_path / "c"
    assert main(["generate", str(SCENE), "--target", "casadi", "--out", str(folder)]) == 0
    manifest = json.loads((folder / "manifest.json").read_text())
    assert sorted(path.name for path in folder.iterdir()) == manifest["files"]
    command = manifest["compile"].split()
    strict = [command[0], "-Wall", "-Wextra", "-Wpedantic", "-Werror", *command[1:]]
    subprocess.run(strict, check=True, cwd=folder)
    library = folder / command[command.index("-o") + 1]
    symbols = [item["symbol"] for item in manifest["casadi"]]
    assert [symbol.partition("_casadi_")[2] for symbol in symbols] == FUNCTIONS
    name = symbols[1]
    shared = ctypes.CDLL(str(library))
    work = (ctypes.c_longlong * 4)()
    getattr(shared, f"jac_{name}_work")(*(ctypes.byref(work, 8 * k) for k in range(4)))
    inputs, outputs, _, memory = work
    arguments, results = (ctypes.c_void_p * inputs)(), (ctypes.c_void_p * outputs)()
    places = (ctypes.c_double * memory)()
    call = getattr(shared, f"jac_{name}")
    assert call(arguments, results, None, places, 0) == 0  # nothing given, nothing asked
    by_q = (ctypes.c_double * 4)()
    results[0] = ctypes.addressof(by_q)
    time = (ctypes.c_double * 1)(0.2)
    parameters = (ctypes.c_double * 1)(*model().parameter_array())
    arguments[2], arguments[3] = ctypes.addressof(parameters), ctypes.addressof(time)
    assert call(arguments, results, None, places, 0) == 0
    expected = model().derivatives("forward_dynamics", [0.0, 0.0], [0.0, 0.0], t=0.2, of=["q"])
    np.testing.assert_allclose(np.reshape(list(by_q), (2, 2)).T, expected, rtol=1e-14)
    direction, along = (ctypes.c_double * 2)(0.3, -0.4), (ctypes.c_double * 2)()
    given, asked = (ctypes.c_void_p * 9)(*arguments[:5], ctypes.addressof(direction)), (ctypes.c_void_p * 1)()
    asked[0] = ctypes.addressof(along)
    assert getattr(shared, f"fwd1_{name}")(given, asked, None, places, 0) == 0
    np.testing.assert_allclose(list(along), expected @ list(direction), rtol=1e-13)
    readme = (folder / "README.md").read_text()
    assert manifest["compile"] in readme and all(f"`{symbol}`" in readme for symbol in symbols)


def test_a_library_is_compiled_once(monkeypatch: pytest.MonkeyPatch) -> None:
    functions()
    monkeypatch.setattr("eomgen.products.optimisers.casadi_functions.generate", None)
    assert list(eomgen.casadi(model(), profile="quick")) == FUNCTIONS


def test_mistakes_are_answered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    empty = "terms: a list of functions is needed, and this one is empty; try: forward_dynamics; all of the scene"
    no_list = "terms are a list of names, not {}; try: terms=["
    for terms, text in (
        (["mass"], "terms: the target casadi writes functions with derivatives, and 'mass' has none; try: one of inv"),
        ([], empty),
        (iter(()), empty),
        ("mass", no_list.format("the text 'mass'")),
        (3, no_list.format("3")),
        (["constraint"], "terms: double_pendulum_on_shaking_base has none of the functions that the terms name; try: "),
    ):
        for call in (eomgen.casadi, lambda scene, terms: eomgen.generate(scene, tmp_path, terms, target="casadi")):
            with pytest.raises(eomgen.UsageError) as of_list:
                call(SCENE, terms)
            assert str(of_list.value).startswith(f"usage error: {text}"), of_list.value
    with pytest.raises(eomgen.UsageError, match="steps of trapezoidal are made of other terms; try: terms with inver"):
        eomgen.generate(SCENE, tmp_path / "c", ["forward_dynamics"], "trapezoidal", target="casadi")
    with pytest.raises(eomgen.UsageError, match="there is no CasADi function 'steps'; try: step"):
        functions()["steps"]
    monkeypatch.setitem(sys.modules, "casadi", None)
    with pytest.raises(eomgen.UsageError, match=r"casadi is not installed; try: pip install 'eomgen\[casadi\]'"):
        eomgen.casadi(SCENE)
