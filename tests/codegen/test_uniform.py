"""One signature for all functions: a driver in C, written once, serves models that have little in common."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.base.arrays import Array
from eomgen.cli import main
from eomgen.codegen.targets.c.uniform import MEANINGS
from eomgen.errors import UsageError
from eomgen.system.system import INPUT_BLOCKS

EXAMPLES = Path(__file__).parents[2] / "examples"
DRIVER = Path(__file__).with_name("uniform_driver.c")
STRICT = ["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror", "-Wshadow", "-O2", "-ffp-contract=off"]
STEP = 1e-3


def compiled(folder: Path, *flags: str) -> dict[str, Any]:
    """Compile the driver with a folder, without a warning, and return the manifest."""
    manifest: dict[str, Any] = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    sources = sorted(str(file) for file in folder.glob("*.c") if file.name != "main.c")
    model = f"-DMODEL={manifest['uniform']['model']}"
    command = ["cc", *STRICT, *flags, model, f"-I{folder}", str(DRIVER), *sources, "-o", str(folder / "driver"), "-lm"]
    subprocess.run(command, check=True)
    return manifest


def answers(folder: Path, given: dict[str, Array], *words: str) -> tuple[dict[str, tuple[int, Array]], Array]:
    """Return status and numbers of each function at the given arrays, and the rows of a motion."""
    rows = [
        f"{INPUT_BLOCKS.index(block)} {place} {number:.17g}\n"
        for block, values in given.items()
        for place, number in enumerate(np.atleast_1d(values))
    ]
    ended = subprocess.run(
        [str(folder / "driver"), *words], input="".join(rows), capture_output=True, text=True, check=True
    )
    functions, motion = {}, []
    for line in ended.stdout.splitlines():
        first, *rest = line.split(",")
        if first[0].isalpha():
            functions[first] = (int(rest[0]), np.array([float(number) for number in rest[1:]]))
        else:
            motion.append([float(number) for number in (first, *rest)])
    return functions, np.array(motion)


def given_to(model: eomgen.Model, manifest: dict[str, Any]) -> dict[str, Array]:
    """Return numbers for all arrays but the inputs of a model, off the initial state."""
    random = np.random.default_rng(36)
    sizes = {item["name"]: item["size"] for item in manifest["uniform"]["arguments"]}
    return {
        "t": np.array(0.3),
        "p": model.parameter_array() * (1.0 + 0.01 * random.uniform(size=sizes.get("p", 0))),
        "q": model.integrate(model.initial_q, 0.05 * random.normal(size=model.nv)),
        **{name: random.normal(size=sizes.get(name, 0)) for name in ("v", "a", "z", "lam")},
    }


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "held"), [("double_pendulum_on_shaking_base", False), ("four_bar", False), ("active_vehicle", True)]
)
def test_a_driver_written_once_serves_every_model(name: str, held: bool, tmp_path: Path) -> None:
    scene = EXAMPLES / name / "scene.toml"
    files = eomgen.generate(scene, tmp_path, method="rk4" if name != "four_bar" else None, uniform=True)
    manifest = compiled(tmp_path)
    assert {file.name for file in files} >= {"eomgen_uniform.h", manifest["uniform"]["header"]}
    method = "rk4" if name != "four_bar" else None
    model = eomgen.build(scene, method=method, profile="reproducible")
    given = given_to(model, manifest)
    words = ["u"] if held else []
    u = np.linspace(0.5, 1.0, manifest["sizes"]["u"])
    results, motion = answers(tmp_path, given | ({"u": u} if held else {}), "20", repr(STEP), *words)
    functions = model.functions
    filled = dict(given)
    if "inputs" in functions:
        (filled["u"],) = functions("inputs", filled)
    if held:
        filled["u"] = u
    if "base" in functions:
        (filled["base"],) = functions("base", filled)
    assert set(results) == set(manifest["uniform"]["functions"]) == set(manifest["functions"])
    for function, of_manifest in manifest["uniform"]["functions"].items():
        status, values = results[function]
        assert status == 0 and len(values) == of_manifest["size"]
        expected = functions(function, {block: filled[block] for block in of_manifest["reads"]})
        for output, array in zip(of_manifest["outputs"], expected, strict=True):
            assert tuple(output["shape"]) == array.shape
            part = values[output["first"] : output["first"] + output["size"]]
            np.testing.assert_allclose(
                part, array.ravel(), rtol=1e-13, atol=1e-13 * max(1.0, np.abs(array).max(initial=0.0))
            )
    inputs = dict(zip(model.inputs, u.tolist(), strict=True)) if held else None
    parameters = dict(zip(model.parameters, given["p"].tolist(), strict=True))
    run = model.simulate(20 * STEP, STEP, method=method, inputs=inputs, parameters=parameters, error_estimate=False)
    outputs = [np.reshape(run.outputs[key], (len(run.t), -1)) for key in run.outputs]
    np.testing.assert_allclose(motion, np.column_stack([run.t, run.q, run.v, run.z, *outputs]), rtol=1e-10, atol=1e-10)


@pytest.mark.slow
def test_arrays_that_are_missing_are_told_and_floats_compile(tmp_path: Path) -> None:
    scene = {
        "format": 1, "name": "cart", "inputs": {"push": {"unit": "N"}}, "bodies": {"b": {"mass": 2.0}},
        "joints": {"x": {"type": "prismatic", "parent": "base", "child": "b", "axis": [1, 0, 0]}},
        "efforts": {"motor": {"joint": "x", "effort": "push"}}, "outputs": {"place": {"formula": "q.x"}},
    }  # fmt: skip  # a table
    eomgen.generate(scene, tmp_path / "c", uniform=True, real="float")
    manifest = compiled(tmp_path / "c")
    results, _ = answers(tmp_path / "c", {})
    assert results["forward_dynamics"][0] == -100  # no formula for the input, and no array
    assert results["mass"][0] == 0
    results, motion = answers(tmp_path / "c", {"u": np.array([3.0])}, "2", "0.5", "u")
    assert results["forward_dynamics"][1].tolist() == [1.5]
    np.testing.assert_allclose(motion[:, :2], [[0.0, 0.0], [0.5, 0.1875], [1.0, 0.75]], atol=1e-12)
    arguments = manifest["uniform"]["arguments"]
    assert {item["name"]: item["size"] for item in arguments} == {"t": 1, "q": 1, "v": 1, "a": 1, "u": 1}
    compiled(tmp_path / "c", "-DEOMGEN_REAL_FLOAT")
    results, _ = answers(tmp_path / "c", {"u": np.array([3.0])}, "2", "0.5", "u")
    assert results["forward_dynamics"][1].tolist() == [1.5]


def test_the_common_header_describes_all_arrays() -> None:
    assert tuple(MEANINGS) == tuple(INPUT_BLOCKS)


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["--only", "controller"], 2, "uniform: uniform belongs to the whole machine, and only the controller"),
        (["--target", "julia"], 2, "julia"),
    ],
)  # fmt: skip  # a table
def test_parts_without_this_signature_refuse(
    arguments: list[str], code: int, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene = str(EXAMPLES / "four_bar" / "scene.toml")
    assert main(["generate", scene, "--uniform", "--out", str(tmp_path / "c"), *arguments]) == code
    assert message in capsys.readouterr().err


def test_folders_in_other_languages_have_no_uniform_signature(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"uniform: one signature is written in C, not in .*; try: target c"):
        eomgen.generate(EXAMPLES / "four_bar" / "scene.toml", tmp_path / "c", target="casadi", uniform=True)
