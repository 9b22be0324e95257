"""Functions that need more stack than threads have are called on one that has it."""

from __future__ import annotations

import ctypes
import subprocess
import threading
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import eomgen
from eomgen.codegen.convert import to_program
from eomgen.codegen.metadata import stack_bytes
from eomgen.integrators.families.register import method_named
from eomgen.integrators.stepper_data import method_data
from eomgen.mechanics.derive import derive
from eomgen.toolchain.large_stack import ENOUGH, LargeStackFunctions, thread_time_ns, with_stack

MEGABYTES = 40
DEEP = """
int deep(int megabytes)
{
    volatile char room[1 << 20];
    room[0] = (char)(megabytes % 2);
    return megabytes > 0 ? deep(megabytes - 1) + 1 + 0 * room[0] : 0 * room[0];
}
"""


def test_a_function_has_the_stack_that_it_needs(tmp_path: Path) -> None:
    (tmp_path / "deep.c").write_text(DEEP, encoding="utf-8")
    library = tmp_path / "deep.so"
    subprocess.run(["cc", "-O0", "-shared", "-fPIC", "-o", library, tmp_path / "deep.c"], check=True)
    before = threading.stack_size()
    lib = with_stack(ctypes.CDLL(str(library)), MEGABYTES << 20)
    assert lib.deep(MEGABYTES) == MEGABYTES
    assert threading.stack_size() == before


def test_small_libraries_are_called_directly() -> None:
    lib = SimpleNamespace()
    assert with_stack(lib, ENOUGH) is lib


def test_errors_come_out_where_the_function_was_called() -> None:
    def fails() -> None:
        raise MemoryError("no room")

    with pytest.raises(MemoryError, match="no room"):
        LargeStackFunctions(SimpleNamespace(eomgen_call=fails), 1 << 20).eomgen_call()


def test_sizes_are_asked_for_on_the_thread_that_asks() -> None:
    lib: Any = LargeStackFunctions(
        SimpleNamespace(eomgen_size=threading.get_ident, eomgen_run=threading.get_ident), 1 << 20
    )
    assert lib.eomgen_size() == threading.get_ident()
    assert lib.eomgen_run() != threading.get_ident()


def test_time_of_such_functions_counts_for_the_thread_that_calls() -> None:
    def busy() -> int:
        began = time.thread_time_ns()
        while time.thread_time_ns() - began < 5_000_000:
            pass
        return time.thread_time_ns() - began

    lib: Any = LargeStackFunctions(SimpleNamespace(eomgen_run=busy), 1 << 20)
    before = thread_time_ns()
    spent = lib.eomgen_run()
    assert thread_time_ns() - before >= spent >= 5_000_000


@pytest.mark.slow
def test_long_delays_have_the_stack_of_the_partials_of_their_states() -> None:
    builder = eomgen.SceneBuilder("delayed").body("cart", 2.0)
    builder.joint("rail", "prismatic", "base", "cart", axis=[1, 0, 0], stiffness=50.0, initial={"position": 0.1})
    builder.state("position", sample=0.002, formula="q.rail", delay=2.0).effort("servo", "rail", "-3 * position")
    system = derive(builder.build())
    program = to_program(system, method_data(method_named("generalized_alpha"), system, 1e-3))
    states = program.sizes["z"]
    assert states > 1000
    assert stack_bytes(program) > 8 * states**2 > ENOUGH
