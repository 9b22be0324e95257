"""The C of examples with every feature: no warning, nothing for sanitizers to find, the same run as of the library that
users get by default, one meaning in four types."""

from __future__ import annotations

import csv
import io
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.codegen.convert import to_program
from eomgen.system.system import System
from tests.codegen.hand_made import call, compile_program
from tests.examples.covering import covering
from tests.oracles.evaluation import Array
from tests.oracles.states import random_states

ROOT = Path(__file__).parents[2]
#: Their C takes half a minute of the compiler and has nothing that the C of other scenes lacks.
COSTLY = {"misaligned_four_bar/scene.toml", "spin_up_beam/exact.toml"}
EVERY = sorted({str(path.relative_to(ROOT / "examples")) for path in (ROOT / "examples").glob("*/*.toml")} - COSTLY)
SCENES = covering(EVERY)
#: Their functions are of the kinds of smaller scenes, and take a minute of the compiler in four types.
LARGE = {
    "cable_net/scene.toml",
    "hanging_chain/scene.toml",
    "elastic_pendulum/scene.toml",
    "elastic_vehicle/full_car.toml",
    "unbalanced_shaft/scene.toml",
}
FOUR_TYPES = covering([scene for scene in EVERY if scene not in LARGE])
STRICT = ["-std=c99", "-O1", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]
SANITIZERS = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-fno-omit-frame-pointer"]
#: What a check of every pointer for null and its object's size finds, the sanitizer of addresses finds too, in a third
#: of the compiler's time; small examples are checked for alignment, and for what optimisers warn of.
LARGE_SANITIZERS = ["-O0", *SANITIZERS, "-fno-sanitize=null,object-size,alignment"]
#: Relative to the largest entry: a few hundred roundings of each type; lanes have the bits of double.
TOLERANCE = {"complex": 1e-12, "lanes": 0.0, "float": 2e-3}
STEPS = 25


@pytest.mark.slow
@pytest.mark.long_except("quarter_car_on_bump/scene.toml")
@pytest.mark.parametrize("scene", SCENES)
def test_the_folder_compiles_strictly_and_runs_under_sanitizers_as_python_does(scene: str, tmp_path: Path) -> None:
    path = ROOT / "examples" / scene
    folder = tmp_path / "c"
    eomgen.generate(path, folder)
    compiler = shutil.which("cc")
    assert compiler, "these tests need a C compiler called cc"
    sources = sorted(str(file) for file in folder.glob("*.c"))
    flags = [*STRICT, *(LARGE_SANITIZERS if scene in LARGE else SANITIZERS)]
    captured: dict[str, Any] = {"capture_output": True, "text": True, "timeout": 300}
    built = subprocess.run([compiler, *flags, *sources, "-o", str(tmp_path / "model"), "-lm"], check=False, **captured)
    assert built.returncode == 0, built.stderr
    loaded = eomgen.load(path)
    step = loaded.simulation.step
    run = subprocess.run([str(tmp_path / "model"), repr(STEPS * step), repr(step), "1"], check=False, **captured)
    assert run.returncode == 0, run.stderr
    rows = list(csv.reader(io.StringIO(run.stdout)))
    expected = eomgen.build(loaded, profile="fast").simulate(STEPS * step, step)
    assert expected.success, expected.message
    last = np.array([float(cell) for cell in rows[-1]][1 : 1 + expected.q.shape[1]])
    scale = max(1.0, float(np.abs(expected.q).max()))
    assert np.abs(last - expected.q[-1]).max() <= 1e-9 * scale


@pytest.mark.slow
@pytest.mark.long_except("active_quarter_car/scene.toml")
@pytest.mark.parametrize("scene", FOUR_TYPES)
def test_four_number_types_agree_on_every_function(scene: str, tmp_path: Path, rng: np.random.Generator) -> None:
    system = eomgen.derive(ROOT / "examples" / scene)
    check_four_number_types(system, _state(system, rng), tmp_path)


def check_four_number_types(system: System, state: dict[str, Array], folder: Path) -> None:
    """Compile a system as double, complex, lanes and float, and compare all its functions at a batch of states."""
    program = to_program(system)
    found = {}
    for real in ("double", *TOLERANCE):
        library = compile_program(program, folder / real, real=real)
        base = call(library, "base", state)[0] if "base" in system.functions else np.zeros((len(state["q"]), 19))
        inputs = {**state, "base": base}
        found[real] = {name: call(library, name, inputs) for name in system.functions}
    for real, tolerance in TOLERANCE.items():
        for name, outputs in found[real].items():
            for block, values in zip(found["double"][name], outputs, strict=True):
                scale = max(1.0, float(np.abs(block).max()))
                assert np.abs(values - block).max() <= tolerance * scale, f"{name} in {real}"


def _state(system: System, rng: np.random.Generator) -> dict[str, Array]:
    """Return five states near the initial one, where all that the scene's formulas say is smooth."""
    state = random_states(system, 5, rng) | {"lam": rng.normal(size=(5, max(1, len(system.multipliers))))}
    state["q"] = np.broadcast_to(np.array(system.initial_q), (5, system.nq)).copy()
    state["v"] = np.array(system.initial_v) + 0.1 * rng.normal(size=(5, system.nv))
    state["z"] = np.array(system.initial_z) + 0.1 * rng.normal(size=(5, system.nz))
    state.setdefault("u", np.zeros((5, 1)))
    state.setdefault("p", np.zeros((5, 1)))
    return state
