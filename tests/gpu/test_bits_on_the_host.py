"""The text for the device, compiled for the host, has the bits of the C: functions on random states, and runs."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.gpu.host import Pair, same_bits
from tests.models.c_laws import TYRE_LAW, wheel_scene
from tests.models.library import scene

EXAMPLES = Path(__file__).parents[2] / "examples"
SAMPLES, STEPS = 3, 20
#: A witness of each kind: file of ``examples`` or of the library, method, number type.
WITNESSES: dict[str, tuple[str, dict[str, Any]]] = {
    "tree": ("arm", {"method": "rk4"}),
    "loop": ("four_bar/scene", {"method": "generalized_alpha"}),
    "events and a base that moves": ("bouncing_ball/scene", {}),
    "internal states": ("pi_servo/scene", {}),
    "samples of a controller": ("pi_servo/sampled", {}),
    "curves": ("quarter_car_on_bump/scene", {}),
    "tunable parameters": ("shear_frame_with_pendulum/scene", {}),
    "series": ("oscillator", {"method": "taylor"}),
    "float": ("double_pendulum", {"real": "float", "method": "rk45"}),
}
WHEEL = """format = 1
name = "wheel"
[bodies.disc]
mass = 1
inertia = { xx = 1, yy = 1, zz = 1 }
[joints.turn]
type = "revolute"
parent = "base"
child = "disc"
axis = [0, 0, 1]
"""


@pytest.fixture(scope="module")
def pair_of(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Pair]:
    """Return a function that compiles a witness once."""

    @cache
    def made(kind: str) -> Pair:
        file, options = WITNESSES[kind]
        return Pair(scene(file), tmp_path_factory.mktemp("pair"), **options)

    return made


def assert_equal_functions(pair: Pair, rng: np.random.Generator) -> None:
    """Compare each function on random states: rows, columns, both, and one sample for all."""
    for name, kernel in pair.kernels.items():
        inputs = pair.inputs(kernel, rng, SAMPLES)
        one = {block: np.repeat(array[:1], SAMPLES, 0) for block, array in inputs.items()}
        expected = pair.by_c(kernel, inputs)
        cases = [(expected, ["rows"], "rows"), (expected, ["columns", "rows"], "columns")]
        for outputs, layouts, out in [*cases, (pair.by_c(kernel, one), ["broadcast"], "columns")]:
            made = pair.by_kernel(name, inputs, layouts, out)
            assert all(map(same_bits, outputs, made)), (name, layouts)


def assert_equal_runs(pair: Pair, steps: int) -> None:
    """Compare status, number of rows, and rows."""
    (status, rows, numbers), (other_status, other_rows, other_numbers) = pair.runs(steps)
    assert (other_status, other_rows) == (status, rows)
    assert rows > 0 and same_bits(numbers, other_numbers)


@pytest.mark.parametrize("kind", WITNESSES)
def test_kernels_have_the_bits_of_the_functions_in_c(
    pair_of: Callable[[str], Pair], kind: str, rng: np.random.Generator
) -> None:
    assert_equal_functions(pair_of(kind), rng)


@pytest.mark.parametrize("kind", WITNESSES)
def test_runs_have_the_bits_of_runs_in_c_and_the_bytes_of_the_manifest(
    pair_of: Callable[[str], Pair], kind: str
) -> None:
    pair = pair_of(kind)
    assert_equal_runs(pair, STEPS)
    sizes = {"state": pair.device.eg_bytes(0), "workspace": pair.device.eg_bytes(1)}
    assert pair.thread_bytes == sizes


def test_laws_in_c_are_part_of_the_text(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator
) -> None:
    monkeypatch.chdir(tmp_path)
    pair = Pair(wheel_scene(TYRE_LAW, tmp_path), tmp_path, method="rk4")
    assert_equal_functions(pair, rng)
    assert_equal_runs(pair, STEPS)


def test_functions_of_formulas_in_float_have_the_bits_of_the_c(tmp_path: Path, rng: np.random.Generator) -> None:
    """On the host both take the C library's; on a card CUDA's take its place."""
    words = ("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "sqrt", "abs", "log")
    values = {word: f"{word}(0.1 + 0.05 * q.turn**2)" for word in words}
    values |= {"power": "(2 + q.turn)**0.3", "angle": "atan2(v.turn, q.turn)"}
    file = "".join(f'{word} = {{ formula = "{formula}" }}\n' for word, formula in values.items())
    (tmp_path / "scene.toml").write_text(f"{WHEEL}[outputs]\n{file}", encoding="utf-8")
    pair = Pair(tmp_path / "scene.toml", tmp_path, real="float", terms=["outputs"])
    assert pair.kernels["wheel_outputs_kernel"]["outputs"][0]["size"] == len(values)
    assert_equal_functions(pair, rng)


def test_kernels_for_rows_have_the_bits_of_the_functions(tmp_path: Path, rng: np.random.Generator) -> None:
    pair = Pair(scene("active_vehicle/scene"), tmp_path, level="-O0", terms=["partials"])
    assert [name for name in pair.kernels if "_rows_" in name] == ["active_vehicle_partials_rows_kernel"]
    assert_equal_functions(pair, rng)


@pytest.mark.slow
@pytest.mark.long_cases("cable_net", "elastic_pendulum", "hanging_chain", "misaligned_four_bar", "unbalanced_shaft")
@pytest.mark.parametrize("name", sorted(path.parent.name for path in EXAMPLES.glob("*/scene.toml")))
def test_examples_have_the_bits_of_the_c(name: str, tmp_path: Path, rng: np.random.Generator) -> None:
    """Without optimisation, which changes no bit and takes most of the time."""
    pair = Pair(EXAMPLES / name / "scene.toml", tmp_path, level="-O0")
    assert_equal_functions(pair, rng)
    assert_equal_runs(pair, STEPS)
