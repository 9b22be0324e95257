"""C of a Hamiltonian system: its functions, steps, a program of its own, and what Python loads."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from eomgen.codegen.convert import to_program
from eomgen.codegen.targets.c.interface import INTERFACE_CDEF
from eomgen.codegen.targets.c.target import compile_command, generate_interface, rendered
from eomgen.hamiltonian.derivation import derive_hamiltonian
from eomgen.hamiltonian.methods import Method
from eomgen.scene.hamiltonian.document import Hamiltonian

if TYPE_CHECKING:
    from eomgen.codegen.program import Program

#: Declarations of what Python calls.
CDEF = f"""\
{INTERFACE_CDEF}int eomgen_hamiltonian_run(const double *parameters, double step, long rows, long every, int kind,
    int count, const double *fractions, int compensated, double *state, double *record, long *counted);
"""
#: Iterations of an implicit midpoint step at most, and the change, in parts of the state, that may be rounding.
MOST_ITERATIONS, ROUNDING = 200, 1e-12


def program_of(document: Hamiltonian) -> Program:
    """Return the Program of a Hamiltonian system."""
    return to_program(derive_hamiltonian(document))


def library_files(document: Hamiltonian, program: Program) -> dict[str, str]:
    """Return all that a loadable library is compiled from."""
    prefix = program.prefix
    templates = {
        f"{prefix}.h": "c/hamiltonian/header.h.jinja",
        f"{prefix}_steps.c": "c/hamiltonian/steps.c.jinja",
        "exported.c": "c/hamiltonian/exported.c.jinja",
    }
    files = rendered(program, templates, **_extra(document))
    interface = generate_interface(program, files)
    interface["interface.h"] = interface["interface.h"].replace(INTERFACE_CDEF, CDEF)
    return files | interface


def folder_files(document: Hamiltonian, program: Program, method: Method) -> dict[str, str]:
    """Return the stand-alone folder: file name to text. The same system gives the same bytes."""
    prefix, run = program.prefix, document.simulation
    templates = {
        f"{prefix}.h": "c/hamiltonian/header.h.jinja",
        f"{prefix}_steps.c": "c/hamiltonian/steps.c.jinja",
        "main.c": "c/hamiltonian/main.c.jinja",
    }
    extra = _extra(document) | {
        "method": method,
        "names": [*(item.name for item in document.coordinates), *(item.momentum for item in document.coordinates)],
        "run": {
            "steps": round(run.duration / run.step),
            "step": run.step,
            "record_every": run.record_every,
            "compensated": run.compensated,
        },
    }
    files = rendered(program, templates, **extra)
    command = compile_command(program, sorted(name for name in files if name.endswith(".c")))
    readme = rendered(program, {"README.md": "c/hamiltonian/README.md.jinja"}, **extra, command=command)
    return files | {"README.md": readme["README.md"]}


def _extra(document: Hamiltonian) -> dict[str, Any]:
    return {
        "separable": document.separable,
        "momenta": [item.momentum for item in document.coordinates],
        "most_iterations": MOST_ITERATIONS,
        "rounding": ROUNDING,
    }
