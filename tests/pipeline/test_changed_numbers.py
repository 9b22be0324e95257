"""Models that differ in numbers alone share the objects of their sources."""

from __future__ import annotations

import copy
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.codegen.scheduling import scheduler
from eomgen.codegen.targets.c import target
from eomgen.errors import ToolchainError
from eomgen.pipeline import structures
from eomgen.pipeline.model import Model
from eomgen.pipeline.pipeline import build_in
from eomgen.toolchain import compiler
from eomgen.toolchain.compiler import find_compiler

EXAMPLES = Path(__file__).parents[2] / "examples"
Change = Callable[[dict[str, Any]], None]


@pytest.fixture
def compiled(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the sources that are compiled."""
    names: list[str] = []
    original = compiler.compile_object

    def compile_object(program: object, source: Path, *rest: Any) -> object:
        names.append(source.name)
        return original(program, source, *rest)  # type: ignore[arg-type]

    monkeypatch.setattr(compiler, "compile_object", compile_object)
    return names


def _other_mass(scene: dict[str, Any]) -> None:
    scene["bodies"]["rod"]["mass"] = 0.7310


def _mass_of_a_power_of_two(scene: dict[str, Any]) -> None:
    scene["bodies"]["rod"]["mass"] = 16.0  # stays in the text of divisions alone


def _other_start(scene: dict[str, Any]) -> None:
    scene["joints"]["swing"]["initial"]["position"] = 0.4321


PENDULUM: dict[str, Any] = {
    "format": 1,
    "name": "pair",
    "gravity": [0, 0, -10],
    "bodies": {"rod": {"mass": 1.7, "center_of_mass": [0.31, 0.02, -0.5], "inertia": [0.2, 0.21, 0.013]}},
    "joints": {
        "swing": {"type": "revolute", "parent": "base", "child": "rod", "axis": [0, 1, 0], "initial": {"position": 0.3}}
    },
    "simulation": {"step": 1e-3, "duration": 0.1},
}


def _bits(model: Model) -> dict[str, bytes]:
    """Return the bytes of all functions at random arguments, and of the state after some steps."""
    random = np.random.default_rng(1)
    bits = {}
    for function in model.library.layout["functions"]:
        inputs = [random.random(size) for size in function["input_sizes"]]
        outputs = [np.zeros(output["size"]) for output in function["outputs"]]
        model.library.call(function["name"], inputs, outputs)
        bits[function["name"]] = b"".join(output.tobytes() for output in outputs)
    solution = model.simulate(20 * model.description.simulation.step, error_estimate=False)
    return bits | {"run": solution.q.tobytes() + solution.v.tobytes()}


def _texts(model: Model) -> dict[str, str]:
    """Return all texts of a library but for the commands, which name folders."""
    files = [file for file in model.library.folder.iterdir() if file.suffix in (".c", ".h", ".md", ".json")]
    return {file.name: file.read_text(encoding="utf-8") for file in files if file.name != "entry.json"}


@pytest.mark.slow
@pytest.mark.parametrize("change", [_other_mass, _mass_of_a_power_of_two, _other_start])
def test_a_changed_number_compiles_and_schedules_nothing(
    change: Change, compiled: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = build_in(tmp_path, eomgen.load(PENDULUM), method="generalized_alpha", profile="quick")
    assert {"pair.c", "pair_step.c", "pair_numbers.c", "interface.c"} <= set(compiled)
    compiled.clear()
    scene = copy.deepcopy(PENDULUM)
    change(scene)
    scheduled: list[object] = []
    schedule = scheduler.schedule
    monkeypatch.setattr(
        scheduler, "schedule", lambda *given, **options: scheduled.append(given) or schedule(*given, **options)
    )
    second = build_in(tmp_path, eomgen.load(scene), method="generalized_alpha", profile="quick")
    assert compiled == []
    assert not scheduled
    assert second.library.digest != first.library.digest
    assert second.library.fingerprint != first.library.fingerprint
    elsewhere = build_in(tmp_path / "elsewhere", eomgen.load(scene), method="generalized_alpha", profile="quick")
    assert _bits(second) == _bits(elsewhere) != _bits(first)
    assert _texts(second) == _texts(elsewhere)


@pytest.mark.skipif(sys.platform == "win32", reason="the compiler is a script of the shell")
@pytest.mark.slow_cases("reproducible", "instant")
@pytest.mark.parametrize("profile", ["quick", "reproducible", "instant"])
def test_a_changed_mass_needs_no_compiler(profile: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "compiler"
    program.write_text(
        f'#!/bin/sh\n[ -f {tmp_path}/broken ] && exit 1\nexec {" ".join(find_compiler().command)} "$@"\n',
        encoding="utf-8",
    )
    program.chmod(0o700)
    monkeypatch.setenv("CC", str(program))
    if profile == "instant":  # the engine is compiled with the first model of all
        build_in(tmp_path, eomgen.load({**PENDULUM, "name": "other"}), profile=profile).finish_compilation()
    first = build_in(tmp_path, eomgen.load(PENDULUM), method="generalized_alpha", profile=profile)
    first.finish_compilation()
    (tmp_path / "broken").touch()
    scene = copy.deepcopy(PENDULUM)
    _other_mass(scene)
    second = build_in(tmp_path, eomgen.load(scene), method="generalized_alpha", profile=profile)
    second.finish_compilation()
    mass = scene["bodies"]["rod"]["mass"]
    expected = 0.21 + mass * (0.31**2 + 0.5**2)
    assert second.mass(np.array([0.3]))[0, 0] == pytest.approx(expected, rel=1e-14)
    assert first.mass(np.array([0.3]))[0, 0] == pytest.approx(0.21 + 1.7 * (0.31**2 + 0.5**2), rel=1e-14)
    with pytest.raises(ToolchainError):
        build_in(tmp_path / "elsewhere", eomgen.load(scene), method="generalized_alpha", profile=profile)


@pytest.mark.slow
def test_a_changed_structure_compiles_the_functions_that_have_it(compiled: list[str], tmp_path: Path) -> None:
    build_in(tmp_path, eomgen.load(PENDULUM), method="generalized_alpha", profile="quick")
    compiled.clear()
    scene = copy.deepcopy(PENDULUM)
    scene["bodies"]["rod"]["center_of_mass"] = [0, 0, -0.5]
    model = build_in(tmp_path, eomgen.load(scene), method="generalized_alpha", profile="quick")
    assert {"pair.c", "pair_numbers.c"} <= set(compiled)
    assert "interface.c" not in compiled
    [torque] = model.evaluate("residual", np.array([0.2]), v=np.zeros(1), a=np.array([3.0])).values()
    assert torque[0] == pytest.approx((0.21 + 1.7 * 0.25) * 3.0 + 1.7 * 10.0 * 0.5 * np.sin(0.2))


@pytest.mark.long_cases("elastic_slider_crank-fast")
@pytest.mark.parametrize(
    ("example", "profile"),
    [
        pytest.param("four_bar", "fast", marks=pytest.mark.slow),
        pytest.param("elastic_slider_crank", "fast", marks=pytest.mark.slow),
    ],
)
def test_tables_give_the_bits_of_numbers_in_the_text(
    example: str, profile: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = EXAMPLES / example / "scene.toml"
    tables = _bits(build_in(tmp_path / "tables", scene, profile=profile))
    written = target.written_library

    def in_text(program: Any, bytecode: Path, **_: object) -> object:
        return written(program, bytecode)

    monkeypatch.setattr(target, "written_library", in_text)
    monkeypatch.setattr(structures, "structure_of", lambda *_: None)
    literals = build_in(tmp_path / "literals", scene, profile=profile)
    assert not list(literals.library.folder.glob("*_numbers.c"))
    assert tables == _bits(literals)
