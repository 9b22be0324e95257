"""Long tables: bytes in a file of their own, once for all that use them, with the numbers of Python."""

from __future__ import annotations

import math
import re
import shutil
import struct
import subprocess
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.codegen.program import ProgramCurve
from eomgen.codegen.targets.c.tables import LARGE, curve_tables
from tests.codegen.test_render import STRICT

ROWS = 1500
X = np.cumsum(0.5 + 0.4 * np.sin(np.arange(ROWS)))
X -= X[0]
Y = np.sin(0.37 * X) * 10.0 ** (3.0 * np.cos(0.01 * X))


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("long")
    shutil.copy(Path(__file__).parent / "long_tables.toml", folder / "scene.toml")
    np.savetxt(folder / "push.csv", np.stack([X, Y], axis=1), delimiter=",", fmt="%.17g")
    return folder / "scene.toml"


@pytest.mark.slow
def test_a_table_of_three_is_compiled_once_and_the_folder_stands_alone(scene: Path, tmp_path: Path) -> None:
    eomgen.generate(scene, tmp_path / "c", method="rk4")
    curves, tables = ((tmp_path / "c" / f"cart_{name}.c").read_text() for name in ("curves", "tables"))
    functions = re.findall(r"^real cart_curve\d+\(", curves, re.M)
    assert len(functions) == 5
    used = re.findall(r"= \{ (\w+), (\w+)(?:\[0\])?, \d+, \d+,", curves)
    long, short = [table for rows, table in used if rows == "NULL"], [rows for rows, _ in used if rows != "NULL"]
    assert len(long) == 3 and len(set(long)) == 2  # a spline twice, and lines
    assert len(short) == 2 and len(set(short)) == 1
    assert tables.count("const unsigned char") == 2
    assert tables.isascii() and max(map(len, tables.split("\n"))) <= 120
    sources = sorted(str(path) for path in (tmp_path / "c").glob("*.c"))
    program = str(tmp_path / "program")
    subprocess.run([shutil.which("cc") or "gcc", *STRICT, *sources, "-o", program, "-lm"], check=True)
    command = [program, "5", "1e-2", "500"]
    last = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()[-1]
    run = eomgen.build(scene, method="rk4", profile="reproducible").simulate(5.0, 1e-2)
    assert [float(value) for value in last.split(",")][1:3] == pytest.approx([run.q[-1, 0], run.v[-1, 0]], rel=1e-12)


def test_every_byte_is_what_a_compiler_reads_of_it(tmp_path: Path) -> None:
    """All 256 bytes, in every place of a double; the neighbour of an octal escape may be a digit."""
    bits = [int.from_bytes(bytes((byte + 37 * k) % 256 for k in range(8)), "little") for byte in range(256)]
    numbers = [struct.unpack("<d", struct.pack("<Q", one))[0] for one in bits]
    numbers = [value for value in numbers if not math.isnan(value)]
    numbers += [-0.0, 5e-324, float.fromhex("0x1.fffffffffffffp1023"), 0.1] * LARGE
    rows = tuple(zip(*[iter(numbers[: 7 * (LARGE // 7 + 1)])] * 7, strict=True))
    (table,) = curve_tables([ProgramCurve("all", rows, "hold", 0.0, 0.0)])
    assert table.is_packed and not table.is_shared
    source, program = tmp_path / "bytes.c", tmp_path / "bytes"
    source.write_text(
        f"#include <stdio.h>\nstatic const unsigned char table[][{table.size}] = {{\n{table.text}\n}};\n"
        "int main(void)\n{\n"
        "    size_t k;\n    for (k = 0; k < sizeof table / sizeof table[0]; ++k)\n"
        "        fwrite(table[k], 1, sizeof table[0] - 1, stdout);\n    return 0;\n}\n"
    )
    subprocess.run([shutil.which("cc") or "gcc", *STRICT, str(source), "-o", str(program)], check=True)
    written = subprocess.run([str(program)], check=True, capture_output=True).stdout
    assert written == np.array(rows, dtype="<f8").tobytes()
