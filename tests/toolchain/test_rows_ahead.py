"""Fetches of rows in the C of lanes: each line of each row once, between statements, and other text stays."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.compiled.functions import LANES_VARIABLE
from eomgen.pipeline.model import Model
from eomgen.toolchain.cffi_build import SOURCE, companion_files
from eomgen.toolchain.rows_ahead import with_fetches

EXAMPLES = Path(__file__).parents[2] / "examples"

FETCH = r"    EG_(FETCH|CLAIM)\((\d+), rows\[(\d)\]\);\n"
CALL = """static int call_sum(long count)
{
            rows[0] = (const char *)(inputs[0] + next * strides[0]);
            rows[1] = (const char *)(inputs[2] + next * strides[2]);
            rows[2] = (const char *)(outputs[0] + here * 40);
}
"""
FUNCTION = {
    "name": "sum",
    "inputs": ["q", "t", "v"],
    "input_sizes": [40, 1, 40],
    "outputs": [{"argument": "tau", "size": 40}],
}


def part(number: int, arguments: str, statements: int) -> str:
    lines = [f"    const real x{k} = v[{k}] * K(2.0);" for k in range(statements)]
    return "\n".join([f"EG_NOINLINE void m_sum_part{number}({arguments})", "{", "    int i;", *lines, "}", ""])


def fetched(text: str) -> list[tuple[str, int, int]]:
    return [(kind, int(row), int(line)) for kind, line, row in re.findall(FETCH, text)]


def test_every_line_of_every_row_is_fetched_once_and_between_statements() -> None:
    texts = [
        part(1, "const real *q, const real *v, real *restrict w", 60),
        part(2, "real *restrict w, real *restrict tau", 60),
    ]
    made = with_fetches(texts, CALL, FUNCTION, "m")
    kinds = ("FETCH", "FETCH", "CLAIM")
    assert fetched("".join(made)) == [(kinds[row], row, line) for row in range(3) for line in range(40)]
    assert len(fetched(made[0])) == 60
    assert not re.search(f"{FETCH}{FETCH}", made[0])
    assert "rows = (const char *const volatile *)((const double *)(q - 0) - 16);" in made[0]
    assert "rows = (const char *const volatile *)((const double *)(tau - 80) - 16);" in made[1]
    without = [re.sub(rf"{FETCH}|    const char \*const volatile .*\n", "", text) for text in made]
    assert without == texts


@pytest.mark.parametrize(("sizes", "statements"), [((20, 20, 20), 100), ((40, 40, 40), 50), ((40, 40, 40), 0)])
def test_short_rows_and_rows_that_are_longer_than_the_function_are_left_to_the_processor(
    sizes: tuple[int, int, int], statements: int
) -> None:
    function = FUNCTION | {"input_sizes": [sizes[0], 1, sizes[1]], "outputs": [{"argument": "tau", "size": sizes[2]}]}
    texts = [part(1, "const real *q, real *restrict tau", statements)]
    assert with_fetches(texts, CALL, function, "m") == texts


def test_parts_without_a_block_and_other_functions_are_left_alone() -> None:
    texts = [
        part(1, "const real *q", 60),
        part(2, "real *restrict w", 30),
        part(1, "const real *q", 60).replace("m_sum", "m_other"),
    ]
    made = with_fetches(texts, CALL, FUNCTION, "m")
    assert len(fetched(made[0])) == 80
    assert made[1:] == texts[1:]


@pytest.fixture(scope="module")
def vehicle() -> Model:
    return eomgen.build(EXAMPLES / "active_vehicle" / "scene.toml", ["partials"], method=None)


@pytest.mark.long
def test_fetches_stay_within_the_rows(vehicle: Model, tmp_path: Path) -> None:
    """Fetches, made reads of a byte, touch rows of the next samples and of these samples alone."""
    layout = vehicle.library.layout
    number, function = next((k, item) for k, item in enumerate(layout["functions"]) if item["name"] == "partials")
    files = companion_files(vehicle.library.folder, layout, "partials")
    sizes = [size for size, name in zip(function["input_sizes"], function["inputs"], strict=True)]
    blocks = [size for size, name in zip(sizes, function["inputs"], strict=True) if name not in ("p", "t", "base")]
    results = [output["size"] for output in function["outputs"]]
    assert len(fetched(files[SOURCE])) == sum(blocks) + sum(results)
    reads = files[SOURCE].replace(
        "__builtin_prefetch((row) + (k) * EG_LANES * 8, to_write);",
        "touched += *(const volatile char *)((row) + (k) * EG_LANES * 8);",
    )
    assert reads != files[SOURCE]
    for name, text in files.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    (tmp_path / SOURCE).write_text("static int touched;\n" + reads + DRIVER, encoding="utf-8")
    flags = ["-std=c99", "-O1", "-Wno-psabi", "-fsanitize=address", "-fno-sanitize-recover", "-DEOMGEN_REAL_LANES"]
    flags += [f"-D{name}={','.join(map(str, of))}" for name, of in (("INPUT_SIZES", sizes), ("RESULT_SIZES", results))]
    flags.append(f"-DFUNCTION={number}")
    users = sorted(name for name in files if name.endswith(".c"))
    command = [str(shutil.which("gcc") or shutil.which("cc")), *flags, *users, "-lm", "-o", "run"]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    done = subprocess.run([tmp_path / "run"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[:2000]


#: Batches whose length is no multiple of the lanes, in arrays of exactly their size.
DRIVER = (Path(__file__).parent / "rows_ahead.c").read_text(encoding="utf-8")


@pytest.mark.long
def test_lanes_of_a_function_with_fetches_have_the_bits_of_one_state(
    vehicle: Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = np.random.default_rng(3)
    sizes = vehicle.functions.sizes
    for count in (64, 1003):
        blocks = {"q": np.asarray(vehicle.initial_q) + source.uniform(-0.1, 0.1, (count, sizes["q"]))}
        blocks |= {name: source.uniform(-1.0, 1.0, (count, sizes[size])) for name, size in (("v", "v"), ("a", "v"))}
        blocks |= {"t": np.zeros(count), "u": np.zeros((count, sizes["u"])), "p": vehicle.parameter_array()}
        blocks = {name: blocks[name] for name in vehicle.functions.inputs("partials")}
        results = []
        for choice in ("now", "off"):
            monkeypatch.setenv(LANES_VARIABLE, choice)
            results.append(vehicle.functions("partials", blocks))
        assert all(one.tobytes() == other.tobytes() for one, other in zip(*results, strict=True))
