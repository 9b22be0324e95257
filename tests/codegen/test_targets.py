"""The register of targets: C, and a language that another distribution brings: Python, functions only."""

from __future__ import annotations

import json
import runpy
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.cli import main
from eomgen.codegen.targets.register import targets

EXAMPLES = Path(__file__).parents[2] / "examples"
#: The whole of a target: names, expressions, statements and one file.
TARGET = """
import keyword
from eomgen.codegen.folder import MANIFEST, manifest
from eomgen.codegen.targets.c.naming import NAMES
from eomgen.codegen.targets.target import Names, Target

SIGNS = {"ADD": "+", "SUB": "-", "MUL": "*", "DIV": "/"}


def text(item):
    if isinstance(item, int):
        return f"x{item}" if item > 0 else f"(-x{-item})"
    kind, *rest = item
    if kind == "K":
        return repr(rest[0])
    if kind == "in":
        return f"{rest[0]}[{rest[1]}]"
    if kind == "neg":
        return f"(-{text(rest[0])})"
    parts = [text(part) for part in rest]
    return f" {SIGNS[kind]} ".join(parts).join("()") if kind in SIGNS else f"{kind.lower()}({', '.join(parts)})"


def lines(function):
    outputs = [output.argument for output in function.outputs]
    for part in function.parts:
        for statement in part.statements:
            data = statement.data
            if statement.kind == "let":
                yield f"x{data[0]} = {text(data[1])}"
            elif statement.kind in ("sincos", "angles"):
                for sine, cosine, angle in [data] if statement.kind == "sincos" else data[0]:
                    yield f"x{sine}, x{cosine} = sin({text(angle)}), cos({text(angle)})"
            elif statement.kind == "out":
                yield f"{outputs[data[0]]}[{data[1]}] = {text(data[2])}"
            elif statement.kind == "fill":
                yield f"{outputs[data[0]]}[:] = [0.0] * {data[1]}"
            elif statement.kind != "label":
                raise NotImplementedError(statement.kind)


def files(program):
    code = ["from math import cos, sin"]
    for function in program.functions:
        if function.same_as:
            code += ["", "", f"{function.name} = {function.same_as}"]
            continue
        code += ["", "", f"def {function.name}({', '.join(function.inputs)}):"]
        code += [f"    {output.argument} = [0.0] * {output.size}" for output in function.outputs]
        code += [f"    {line}" for line in lines(function)]
        code += [f"    return {', '.join(output.argument for output in function.outputs)}"]
    made = {f"{program.prefix}.py": "\\n".join(code) + "\\n"}
    return {**made, MANIFEST: manifest(program, made)}


def output(name, inputs):
    return f"{name}_" if keyword.iskeyword(name) or name in inputs else name


PYTHON = Target("python", "Python", Names(NAMES.model, NAMES.function, NAMES.member, output), files)
"""


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Install a distribution that gives a target, and return a folder for files."""
    (tmp_path / "into_python.py").write_text(TARGET.replace("\\\\n", "\\n"), encoding="utf-8")
    information = tmp_path / "into_python-1.0.dist-info"
    information.mkdir()
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: into-python\nVersion: 1.0\n", encoding="utf-8")
    (information / "entry_points.txt").write_text("[eomgen.targets]\npython = into_python:PYTHON\n", encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    targets.cache_clear()
    yield tmp_path
    targets.cache_clear()
    sys.modules.pop("into_python", None)


@pytest.mark.slow
def test_a_distribution_brings_a_target(installed: Path, rng: np.random.Generator) -> None:
    scene, folder = EXAMPLES / "four_bar" / "scene.toml", installed / "model"
    terms = ["mass", "coupling", "residual", "constraint", "constraint_jacobian"]
    assert main(["generate", str(scene), "--out", str(folder), "--target", "python", "--terms", ",".join(terms)]) == 0
    (code,) = folder.glob("*.py")
    assert json.loads((folder / "manifest.json").read_text())["files"] == [code.name, "manifest.json"]
    written, model = runpy.run_path(str(code)), eomgen.build(scene, terms, profile="quick")
    sizes = {"q": model.nq, "v": model.nv, "a": model.nv, "lam": len(model.multipliers)}
    for _ in range(5):
        blocks = {block: rng.normal(size=size) for block, size in sizes.items()}
        given = {**blocks, "p": model.parameter_array(), "t": [0.0]}
        for name in terms:
            inputs = model.functions.inputs(name)
            known = {{"lam": "multipliers"}.get(block, block): blocks[block] for block in inputs if block in blocks}
            expected = model.evaluate(name, **known)
            found = written[name](*(given[block] for block in inputs))
            for output, wanted in zip(found if isinstance(found, tuple) else (found,), expected.values(), strict=True):
                assert np.ravel(output) == pytest.approx(np.ravel(wanted), rel=1e-13, abs=1e-13)


def test_targets_that_there_are_not_and_those_that_clash_are_named(installed: Path) -> None:
    with pytest.raises(eomgen.UsageError, match="target: there is no target 'pyton'; try: python"):
        eomgen.generate({"format": 1}, installed / "out", target="pyton")
    targets.cache_clear()
    (installed / "into_python.py").write_text(TARGET.replace('Target("python"', 'Target("c"'), encoding="utf-8")
    sys.modules.pop("into_python", None)
    with pytest.raises(
        eomgen.UsageError, match="of the distribution into-python takes the name 'c', which another target has"
    ):
        eomgen.generate({"format": 1}, installed / "out", target="fortran")
