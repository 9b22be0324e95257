"""Small Systems on hand-made tapes, and their compilation as the package does it, in a cache of the test's own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.codegen.convert import to_program
from eomgen.codegen.metadata import interface_layout
from eomgen.codegen.program import Program
from eomgen.codegen.targets.c.interface import INTERFACE_CDEF
from eomgen.codegen.targets.c.target import generate_files, generate_interface
from eomgen.lie.product import Factor
from eomgen.symbolic.operations import Op
from eomgen.symbolic.tape import Tape
from eomgen.system.system import Block, Facts, Function, Quantity, System
from eomgen.toolchain.builder import Builder
from eomgen.toolchain.cache import Cache
from eomgen.toolchain.library import Library


def make_system(name: str, tape: Tape, functions: Sequence[Function], **changes: object) -> System:
    """Return a System of two coordinates around the functions of a tape."""
    data: dict[str, object] = {
        "name": name,
        "tape": tape,
        "factors": (Factor("R", "first", 0, 1, 0, 1), Factor("R", "second", 1, 1, 1, 1)),
        "functions": {function.name: function for function in functions},
        "parameters": (Quantity("mass", 2.0, unit="kg"), Quantity("length", 0.5, unit="m", description="of the rod")),
        "inputs": (),
        "outputs": (),
        "bodies": ("first", "second"),
        "initial_q": (0.1, 0.2),
        "initial_v": (0.3, -0.4),
        "dof_parent": (-1, 0),
        "facts": Facts(constant_mass=False, velocity_forces=False, smooth=True, moving_base=False),
    }
    return System(**{**data, **changes})  # type: ignore[arg-type]


def pendulum() -> System:
    """Return a double pendulum of point masses: mass matrix, coupling and energies, with shared sines and cosines."""
    tape = Tape()
    m, length = tape.input("p", 0), tape.input("p", 1)
    q = [tape.input("q", k) for k in range(2)]
    v = [tape.input("v", k) for k in range(2)]
    with tape.block("relative angle of the rods"):
        between = tape.sub(q[0], q[1])
        c, s = tape.call(Op.COS, between), tape.call(Op.SIN, between)
    with tape.block("inertia"):
        inertia = tape.mul(m, tape.mul(length, length))
        off = tape.mul(inertia, c)
        mass = (tape.mul(tape.constant(2.0), inertia), off, off, inertia)
    with tape.block("coupling"):
        h = (
            tape.mul(tape.mul(inertia, s), tape.mul(v[1], v[1])),
            -tape.mul(tape.mul(inertia, s), tape.mul(v[0], v[0])),
        )
    functions = [
        Function("mass", "inertia matrix", ("p", "q"), (Block("M", (2, 2), mass),)),
        Function("coupling", "nonlinear inertia terms", ("p", "q", "v"), (Block("h", (2,), h),)),
    ]
    return make_system("pendulum", tape, functions)


def compile_program(
    program: Program,
    folder: Path,
    *,
    real: str = "double",
    profile: str = "quick",
    mode: str | None = None,
    file_limit: int = 10**9,
) -> Library:
    """Return the library of a Program; its text is the cache key."""
    return compile_files(program, generate_files(program, file_limit=file_limit), folder, real, profile, mode)


def compile_files(
    program: Program,
    files: Mapping[str, str],
    folder: Path,
    real: str = "double",
    profile: str = "quick",
    mode: str | None = None,
) -> Library:
    """Return the library of a Program from its stand-alone folder."""
    files = {**files, **generate_interface(program, files)}
    builder = Builder(profile, real, mode, Cache(folder))
    return builder.build("".join(files.values()).encode(), files, INTERFACE_CDEF, interface_layout(program))


def compile_system(system: System, folder: Path, **options: Any) -> Library:
    return compile_program(to_program(system), folder, **options)


def call(library: Library, name: str, inputs: Mapping[str, Any]) -> list[NDArray[Any]]:
    """Evaluate a function for one sample, or for as many as the inputs have rows, and return its outputs by sample."""
    function = library.layout["functions"][library.index[name]]
    arrays = [np.ascontiguousarray(np.atleast_1d(inputs[block]), dtype=library.dtype) for block in function["inputs"]]
    counts = [len(array) for array in arrays if array.ndim == 2]
    outputs = [np.full(((counts or [1])[0], output["size"]), np.nan, library.dtype) for output in function["outputs"]]
    library.call(name, arrays, outputs)
    return outputs if counts else [output[0] for output in outputs]
