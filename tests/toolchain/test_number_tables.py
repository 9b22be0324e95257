"""Other numbers in the tables of compiled libraries."""

from __future__ import annotations

import ctypes
import sys
from array import array
from pathlib import Path

import pytest

from eomgen.toolchain.compiler import Compiler, compile_library, find_compiler
from eomgen.toolchain.number_tables import keeps_tables, with_tables

CODE = """
extern const double lengths[3] __attribute__((visibility("hidden")));
const double lengths[3] = { 0.3, 0.4, 0.5 };
extern const double end[1] __attribute__((visibility("hidden")));
const double end[1] = { 0.5 };
extern const double again[1] __attribute__((visibility("hidden")));
const double again[1] = { 0.7 };
extern const double same[1] __attribute__((visibility("hidden")));
const double same[1] = { 0.7 };
"""
READS = """
extern const double lengths[], end[], again[], same[];
__attribute__((visibility("default"))) double number(int k)
{
    return k < 3 ? lengths[k] : k == 3 ? end[0] : k == 4 ? again[0] : same[0];
}
"""


def _numbers(library: Path) -> list[float]:
    function = ctypes.CDLL(str(library)).number
    function.restype = ctypes.c_double
    return [function(k) for k in range(6)]


@pytest.mark.skipif(sys.platform != "linux", reason="libraries are changed there alone")
@pytest.mark.parametrize("level", ["-O0", "-O2"])
def test_a_changed_library_reads_the_new_numbers(level: str, tmp_path: Path) -> None:
    compiler = find_compiler()
    assert keeps_tables(compiler) or compiler.is_zig
    files = [tmp_path / "numbers.c", tmp_path / "reads.c"]
    for file, text in zip(files, (CODE, READS), strict=True):
        file.write_text(text, encoding="utf-8")
    compile_library(compiler, files, tmp_path / "made.so", (level,))
    assert _numbers(tmp_path / "made.so") == [0.3, 0.4, 0.5, 0.5, 0.7, 0.7]
    tables = [([0.3, 0.4, 0.5], [0.3, 7.0, 1e-300]), ([0.5], [-0.25]), ([0.7], [0.8]), ([0.7], [0.9])]
    changed = with_tables((tmp_path / "made.so").read_bytes(), tables)
    assert changed is not None
    (tmp_path / "changed.so").write_bytes(changed)
    assert _numbers(tmp_path / "changed.so") == [0.3, 7.0, 1e-300, -0.25, 0.8, 0.9]


def test_a_table_that_cannot_be_told_from_others_is_left_to_a_compiler() -> None:
    library = array("d", [1.5, 2.5, 0.0, 2.5]).tobytes()
    assert with_tables(library, [([2.5], [3.5])]) is None
    assert with_tables(library, [([4.5], [3.5])]) is None
    assert with_tables(library, [([1.5, 2.5], [1.0, 3.0]), ([2.5], [4.0])]) == array("d", [1, 3, 0, 4]).tobytes()
    assert with_tables(library, [([2.5], [4.0]), ([1.5, 2.5], [1.0, 3.0])]) == array("d", [1, 3, 0, 4]).tobytes()
    assert with_tables(b"no" + library, [([1.5], [3.5])]) is None  # a table begins at a multiple of 8


@pytest.mark.parametrize("command", [("cc", "-flto"), ("gcc", "-O2", "-flto=auto"), ("zig", "cc")])
def test_an_optimisation_at_the_link_may_copy_numbers_into_functions(command: tuple[str, ...]) -> None:
    assert not keeps_tables(Compiler(command, Path(command[0])))


def test_a_table_of_zeros_is_not_taken_for_the_room_between_tables() -> None:
    library = array("d", [1.5, 0.0, 0.0, 2.5]).tobytes()  # the second number may be room
    assert with_tables(library, [([1.5], [3.5]), ([0.0], [4.5]), ([2.5], [5.5])]) is None
    found = with_tables(library, [([1.5], [3.5]), ([0.0, 2.5], [4.5, 5.5])])
    assert found == array("d", [3.5, 0.0, 4.5, 5.5]).tobytes()
