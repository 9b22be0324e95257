"""The emitted folder: same bytes always, compiles under strict flags, runs without Python, overwrites nothing of
others."""

from __future__ import annotations

import errno
import io
import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import IO

import pytest

from eomgen.base.files import temporary_file
from eomgen.codegen.convert import to_program
from eomgen.codegen.folder import write_folder
from eomgen.codegen.targets.c.target import generate_files, generate_interface
from eomgen.errors import FileError
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.operations import Op
from eomgen.symbolic.tape import Tape
from eomgen.system.system import Block, Function, Quantity, System
from tests.codegen.hand_made import make_system, pendulum

STRICT = ["-std=c99", "-O1", "-Wall", "-Wextra", "-Wpedantic", "-Wshadow", "-Wstrict-prototypes", "-Werror"]
HOSTILE = [
    "*/ int x; /*",
    'a"b',
    "a\\",
    "double",
    "??/",
    "é",
    "a b",
    "a_b",
    "a.b",
    "p",
    "K(1)",
    "#define",
    "{{ 7*7 }}",
    "%s\n#error",
]


def hostile() -> System:
    tape = Tape()
    refs = []
    for k, name in enumerate(HOSTILE):
        with tape.block(name):
            refs.append(tape.mul(tape.input("p", k), tape.call(Op.SIN, tape.input("q", 0))))
    parameters = tuple(Quantity(name, 0.5 + k, unit=name, description=name) for k, name in enumerate(HOSTILE))
    function = Function("f", HOSTILE[0], ("p", "q", "v"), (Block("q", (len(refs),), tuple(refs), HOSTILE[0]),))
    return make_system("hostile", tape, [function], parameters=parameters, description=HOSTILE[0], notes=tuple(HOSTILE))


def compile_and_run(folder: Path, *flags: str) -> str:
    cc = shutil.which("cc") or "gcc"
    sources = sorted(str(path) for path in folder.glob("*.c"))
    subprocess.run(
        [cc, *STRICT, *flags, *sources, "-o", str(folder / "program"), "-lm"], check=True, capture_output=True
    )
    return subprocess.run([str(folder / "program")], check=True, capture_output=True, text=True).stdout


@pytest.mark.parametrize(
    "flags",
    [
        ["-fsanitize=address,undefined", "-fno-sanitize-recover"],
        ["-DEOMGEN_REAL_FLOAT"],
        ["-DEOMGEN_REAL_COMPLEX"],
        ["-DEOMGEN_REAL_LANES", "-Wno-psabi"],
    ],
)
@pytest.mark.parametrize("make", [pendulum, hostile])
def test_folder_stands_alone_under_strict_flags(make, flags: list[str], tmp_path: Path) -> None:
    system = make()
    folder = write_folder(generate_files(to_program(system)), tmp_path / "model")
    lines = [line.split(",") for line in compile_and_run(folder, *flags).splitlines()]
    printed = {name: [float(x) for x in values] for name, *values in lines}
    point = {"p": [parameter.value for parameter in system.parameters], "q": system.initial_q, "v": system.initial_v}
    tolerance = 1e-6 if "-DEOMGEN_REAL_FLOAT" in flags else 1e-14
    for function in system.functions.values():
        values = printed[f"{function.name}.{function.outputs[0].name}"]
        assert values == pytest.approx(list(evaluate(system.tape, function.refs, point)), rel=tolerance)


def test_hostile_names_reach_no_file_unmangled() -> None:
    program = to_program(hostile())
    files = generate_files(program)
    files |= generate_interface(program, files)
    manifest = json.loads(files.pop("manifest.json"))  # strings of JSON, which no compiler reads
    assert [item["name"] for item in manifest["quantities"]["parameters"]] == [item.name for item in program.parameters]
    # those are C anyway, or legal members
    telling = [word for word in HOSTILE if word not in ("double", "p", "#define", "a_b")]
    for name, text in files.items():
        code = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL) if name.endswith((".c", ".h")) else text
        code = re.sub(r'"[\w.,()\[\]]*"', '""', code)  # names such as q.arm[2] are legal in strings
        found = [
            word for word in telling if word in code and (name.endswith((".c", ".h")) or "*/" in word or "{{" in word)
        ]
        assert not found, name
        assert " 49" not in code, f"{name}: a name was rendered as a template"
    members = [parameter.member for parameter in program.parameters]
    assert len(set(members)) == len(HOSTILE)


#: Names that a caller may have: those that headers of ours once took from him among them.
CALLER = """
#include <complex>
#include <cstdio>
#include "model/pendulum.h"
using namespace std;
using std::real;
static double K(double x) { return 2.0 * x; }
int main() {
    pendulum_parameters p;
    pendulum_default_parameters(&p);
    double q[PENDULUM_NQ] = {0.5}, M[PENDULUM_NV * PENDULUM_NV] = {0.0};
    pendulum_mass(MASS_ARGUMENTS);
    printf("%.17g %g", M[0], K(real(complex<double>(1.5, 2.0))));
}
"""


def test_headers_serve_cpp_and_take_no_names_of_the_caller(tmp_path: Path) -> None:
    compiler = shutil.which("c++")
    assert compiler is not None, "the test needs a C++ compiler"
    program = to_program(pendulum())
    folder = write_folder(generate_files(program), tmp_path / "model")
    arguments = ", ".join({"p": "&p"}.get(block, block) for block in (*program.function("mass").inputs, "M"))
    source = tmp_path / "use.cpp"
    source.write_text(CALLER.replace("MASS_ARGUMENTS", arguments), encoding="utf-8")
    strict = ["-Wall", "-Wextra", "-Wpedantic", "-Werror"]
    subprocess.run(
        ["cc", "-std=c99", *strict, "-c", str(folder / "pendulum.c"), "-o", str(tmp_path / "model.o")], check=True
    )
    objects = [str(source), str(tmp_path / "model.o"), "-o", str(tmp_path / "use"), "-lm"]
    subprocess.run([compiler, "-std=c++17", *strict, *objects], check=True)
    printed = subprocess.run([str(tmp_path / "use")], capture_output=True, text=True, check=True).stdout.split()
    assert float(printed[0]) > 0.0
    assert printed[1] == "3"


@pytest.mark.parametrize(
    "header", sorted((Path(__file__).parents[2] / "generated").glob("*/*.h")), ids=lambda path: path.name
)
def test_headers_of_steppers_use_no_short_names(header: Path) -> None:
    code = re.sub(r"/\*.*?\*/", "", header.read_text(encoding="utf-8"), flags=re.DOTALL)
    public = re.sub(r"#if defined\(EOMGEN_SHORT_NAMES\).*?#endif", "", code, flags=re.DOTALL)
    assert not re.findall(r"\breal\b|\bK\(", public)


def test_numbers_round_trip_through_the_text() -> None:
    tape = Tape()
    values = [0.1, 1e-310, 1.7976931348623157e308, 1 / 3, 2**-1074, 123456789.125]
    refs = tuple(tape.constant(value) for value in values)
    function = Function("f", "", ("q",), (Block("y", (len(refs),), refs),))
    text = generate_files(to_program(make_system("one", tape, [function])))["one.c"]
    found = [float(line.split("K(")[1].split(")")[0]) for line in text.splitlines() if line.strip().startswith("y[")]
    assert found == values


def test_writing_again_replaces_and_removes_its_own_files(tmp_path: Path) -> None:
    files = generate_files(to_program(pendulum()))
    manifest = json.dumps({"generator": "eomgen", "files": [*files, "old.c"]})
    folder = write_folder({**files, "manifest.json": manifest}, tmp_path / "model")
    (folder / "old.c").write_text("old", encoding="utf-8")
    (folder / "notes.txt").write_text("mine", encoding="utf-8")
    write_folder(files, folder)
    assert sorted(path.name for path in folder.iterdir()) == sorted([*files, "notes.txt"])
    assert (folder / "pendulum.c").read_text(encoding="utf-8") == files["pendulum.c"]


class FullDisk(io.FileIO):
    """A file that takes no bytes."""

    def write(self, _: object) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")


@pytest.mark.parametrize("earlier", [False, True])
def test_a_full_disk_leaves_the_folder_as_it_was(
    earlier: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target, files = tmp_path / "model", generate_files(to_program(pendulum()))
    if earlier:
        write_folder(files, target)
    opened: list[Path] = []

    def third_is_full(path: Path) -> IO[bytes] | FullDisk:
        opened.append(path)
        file = temporary_file(path)
        return file if len(opened) < 3 else FullDisk(file.name, "wb")

    monkeypatch.setattr("eomgen.codegen.folder.temporary_file", third_is_full)
    with pytest.raises(FileError, match=r"cannot write .*model: No space left on device; try: another folder"):
        write_folder(dict.fromkeys(files, "changed"), target)
    assert len(opened) == 3
    assert {path.name: path.read_text("utf-8") for path in tmp_path.rglob("*") if path.is_file()} == (
        files if earlier else {}
    )
    assert target.exists() == earlier


def test_a_folder_of_someone_else_is_left_alone(tmp_path: Path) -> None:
    thesis = tmp_path / "thesis"
    thesis.mkdir()
    (thesis / "main.c").write_text("precious", encoding="utf-8")
    with pytest.raises(
        FileError, match=r"not written by eomgen .* nothing was overwritten; try: a new or empty folder"
    ):
        write_folder(generate_files(to_program(pendulum())), thesis)
    assert [(path.name, path.read_text(encoding="utf-8")) for path in thesis.iterdir()] == [("main.c", "precious")]
    with pytest.raises(FileError, match="is a file, not a folder"):
        write_folder({}, thesis / "main.c")


def test_a_manifest_cannot_remove_files_elsewhere(tmp_path: Path) -> None:
    outside = tmp_path / "outside.txt"
    outside.write_text("stay", encoding="utf-8")
    folder = tmp_path / "model"
    folder.mkdir()
    (folder / "manifest.json").write_text(
        json.dumps({"generator": "eomgen", "files": ["../outside.txt"]}), encoding="utf-8"
    )
    write_folder(generate_files(to_program(pendulum())), folder)
    assert outside.read_text(encoding="utf-8") == "stay"


def test_a_function_that_equals_another_has_outputs_of_its_own_shape() -> None:
    """Packed nonzeros of a full matrix are the same numbers as the matrix: one calls the other, and is a vector."""
    tape = Tape()
    refs = tuple(tape.mul(tape.input("q", k % 2), tape.constant(2.0 + k)) for k in range(6))
    whole = Function("whole", "a matrix", ("q",), (Block("B", (2, 3), refs),))
    packed = Function("packed", "its nonzeros", ("q",), (Block("B", (6,), refs),))
    program = to_program(make_system("twice", tape, [whole, packed]))
    assert program.function("packed").same_as == "whole"
    assert [output.shape for name in ("whole", "packed") for output in program.function(name).outputs] == [(2, 3), (6,)]
