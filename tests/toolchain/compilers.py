"""Digits of all examples by compiler, in the profile ``reproducible``: ``python -m tests.toolchain.compilers
docs/compilers.md [EXAMPLE.toml ...]`` writes the table, or some rows of it, with every compiler of this machine.

Each example is stepped 200 times from its start by the library of each compiler, and by the stand-alone program
compiled to WebAssembly, which node runs.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import eomgen
from eomgen.toolchain.compiler import find_compiler, zig_program

ROOT = Path(__file__).parents[2]
STEPS = 200
#: Files that are no scenes of their own, or are sampled rather than stepped; runs of other programs are no examples.
_LEFT_OUT = (
    "driving_car/system/corner.toml",
    "sea_arm/links.toml",
    "density_field/system/density_field.toml",
    *(f"car/system/{part}.toml" for part in ("double_wishbone", "double_wishbone_on_bushings", "strut", "wheel")),
    *(f"car/system/{part}.toml" for part in ("front_axle", "front_axle_on_bushings", "rear_axle", "wishbone_parts")),
)
Motion = Mapping[str, np.ndarray[Any, np.dtype[np.float64]]]
#: Runs a program of WebAssembly with the arguments that follow its name.
NODE_SCRIPT = """
const { WASI } = require('wasi'), fs = require('fs');
const wasi = new WASI({ version: 'preview1', args: process.argv.slice(1), env: {} });
const module_ = new WebAssembly.Module(fs.readFileSync(process.argv[1]));
wasi.start(new WebAssembly.Instance(module_, wasi.getImportObject()));
"""
NODE = ("node", "--no-warnings", "-e", NODE_SCRIPT)


def examples() -> list[str]:
    """Return the scenes and Hamiltonian systems of all examples, below ``examples``."""
    files = (path.relative_to(ROOT / "examples").as_posix() for path in sorted((ROOT / "examples").rglob("*.toml")))
    return [name for name in files if name not in _LEFT_OUT and not name.startswith("verification/")]


def compilers() -> dict[str, str]:
    """Return the compilers of this machine as values of ``CC``, by name."""
    there = {name: path for name in ("gcc", "clang") if (path := shutil.which(name))}
    zig = zig_program()
    return there | ({} if zig is None else {"zig": f"{zig} cc"})


def motion(example: str) -> Motion:
    """Return the rows of the first steps of an example, by the compiler that ``CC`` names."""
    described = eomgen.load(ROOT / "examples" / example)
    model, settings = eomgen.build(described, profile="reproducible"), described.simulation
    solution: Any = model.simulate(
        min(settings.duration, STEPS * settings.step), settings.step, error_estimate=False, record_every=1
    )
    columns = {name: getattr(solution, name, None) for name in ("t", "q", "v", "p", "z")}
    return {name: np.asarray(value) for name, value in columns.items() if value is not None}


def motions(names: Iterable[str], compiler: str, folder: Path) -> dict[str, Motion | str]:
    """Return the motions of examples by a compiler, each from a process of its own, with a cache in a folder; the last
    line of its message if a process fails."""
    result: dict[str, Motion | str] = {}
    environment = {**os.environ, "CC": compiler, "EOMGEN_CACHE": str(folder / "cache"), "PYTHONPATH": str(ROOT)}
    for name in names:
        file = folder / "motion.npz"
        code = (
            "import sys, numpy; from tests.toolchain.compilers import motion;"
            " numpy.savez(sys.argv[2], **motion(sys.argv[1]))"
        )
        done = subprocess.run(
            [sys.executable, "-c", code, name, str(file)],
            cwd=ROOT,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode:
            result[name] = (done.stderr.splitlines() or [""])[-1]
        else:
            with np.load(file) as archive:
                result[name] = dict(archive)
    return result


def difference(first: Motion | str, second: Motion | str) -> str:
    """Return the first difference of two motions, empty if all bits are equal."""
    if isinstance(first, str) or isinstance(second, str):
        return first if isinstance(first, str) else str(second)
    for name, one in first.items():
        other = second[name]
        if one.shape != other.shape:
            return f"{one.shape[0]} rows of {name}, and {other.shape[0]}"
        apart = np.argwhere(one.view(np.uint64) != other.view(np.uint64))
        if len(apart):
            place = tuple(apart[0])
            return f"{name} in row {place[0]}: {one[place]!r}, {other[place]!r}"
    return ""


def printed(example: str, compiler: str, folder: Path, *, real: Sequence[str] = ()) -> list[str]:
    """Return the lines that the stand-alone program of a scene prints for the first steps.

    Parameters
    ----------
    compiler : command
    real : program that runs the result of the compiler
    """
    made = folder / "c"
    if not made.is_dir():
        eomgen.generate(ROOT / "examples" / example, made)
    command = json.loads((made / "manifest.json").read_text(encoding="utf-8"))["compile"].split()
    program = made / "program"
    output = ["-o", str(program), "-lm"]
    words = [*compiler.split(), *command[1 : command.index("-o")], *output]
    subprocess.run(words, cwd=made, check=True, capture_output=True)
    settings = eomgen.load(ROOT / "examples" / example).simulation
    arguments = [repr(min(settings.duration, STEPS * settings.step)), repr(settings.step), "1"]
    run = subprocess.run([*real, str(program), *arguments], capture_output=True, text=True, check=False)
    return run.stdout.splitlines()


def wasm_difference(example: str, folder: Path) -> str:
    """Return the first difference between the stand-alone programs of the first compiler and of WebAssembly."""
    native = printed(example, find_compiler().command[0], folder)
    zig = f"{zig_program()} cc -target wasm32-wasi"
    in_node = printed(example, zig, folder, real=NODE)
    if native == in_node and len(native) > 1:
        return ""
    for number, pair in enumerate(zip(native, in_node, strict=False)):
        for column, (one, other) in enumerate(zip(*(line.split(",") for line in pair), strict=False)):
            if one != other:
                return f"row {number}, column {column}: {one}, {other}"
    return f"{len(native)} rows, and {len(in_node)}"


def row(name: str, folder: Path) -> dict[str, str]:
    """Return the first difference of an example from the first compiler, empty without one, by compiler."""
    made = {kind: motions([name], compiler, folder)[name] for kind, compiler in compilers().items()}
    first = next(iter(made.values()))
    cells = {kind: difference(first, motion_) for kind, motion_ in made.items()}
    if "zig" in made and shutil.which("node"):
        own = folder / "program"
        own.mkdir()
        try:
            cells["wasm"] = wasm_difference(name, own)
        except (eomgen.EomgenError, AttributeError, KeyError, subprocess.CalledProcessError) as error:
            cells["wasm"] = "no stand-alone program" if isinstance(error, KeyError) else f"none: {error}"
        shutil.rmtree(own)
    return cells


#: Lines around the table on the page.
START, END = (
    "<!-- digits: made by python -m tests.toolchain.compilers docs/compilers.md -->\n",
    "<!-- end of digits -->\n",
)


def table(rows: Mapping[str, Mapping[str, str]]) -> list[str]:
    """Return the lines of the table, of rows by example of cells by compiler."""
    kinds = list(dict.fromkeys(kind for cells in rows.values() for kind in cells))
    lines = [f"| example | {' | '.join(kinds)} |", "|---|" + "---|" * len(kinds)]
    for name, cells in sorted(rows.items()):
        words = [cells.get(kind, "").replace("|", "/").replace("\n", " ") or "equal" for kind in kinds]
        lines.append(f"| {name.removesuffix('.toml')} | {' | '.join(words)} |")
    return lines


def rows_of(lines: Iterable[str]) -> dict[str, dict[str, str]]:
    """Return the rows of a table by example, each with its cells by compiler."""
    cells = [[cell.strip() for cell in line.strip().strip("|").split("|")] for line in lines if line.startswith("|")]
    return {f"{row[0]}.toml": dict(zip(cells[0][1:], row[1:], strict=True)) for row in cells[2:]}


def main(page: str, *names: str) -> int:
    """Write the table, row by row; of names only their rows, between those that are there."""
    text = Path(page).read_text(encoding="utf-8")
    before, _, rest = text.partition(START)
    there, _, after = rest.partition(END)
    rows = rows_of(there.splitlines()) if names else {}
    with tempfile.TemporaryDirectory() as folder:
        for name in names or examples():
            rows[name] = row(name, Path(folder))
            Path(page).write_text(
                before + START + "\n".join(["", *table(rows), "", ""]) + END + after, encoding="utf-8"
            )
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
