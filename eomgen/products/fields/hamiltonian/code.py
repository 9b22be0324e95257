"""C of a Hamiltonian system: its functions, steps, a program of its own, and the library for Python."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from eomgen.codegen.convert import to_program
from eomgen.codegen.targets.c.interface import INTERFACE_CDEF
from eomgen.codegen.targets.c.target import compile_command, generate_interface, rendered
from eomgen.integrators.families.adaptive import AFTER_FAILURE, MOST_GROWTH, MOST_REDUCTION, MOST_STEPS, SAFETY
from eomgen.products.fields.documents.document import Hamiltonian
from eomgen.products.fields.hamiltonian.derivation import derive_hamiltonian
from eomgen.products.fields.hamiltonian.methods import Method, krylov

if TYPE_CHECKING:
    from eomgen.codegen.program import Program

#: Declarations of the functions called from Python.
CDEF = f"""\
{INTERFACE_CDEF}int eomgen_hamiltonian_run(const double *parameters, double step, long rows, long every, int more,
    int kind, int count, const double *fractions, int stages, const double *coefficients, double tolerance,
    int compensated, double *work, double *state, double *record, long *counted);
"""
#: Iterations of an implicit step at most, the change, relative to the state, that may be rounding, and by how much a
#: second change has to be smaller: if it is not, Newton's method takes over.
MOST_ITERATIONS, ROUNDING, SLOW = 200, 1e-12, 0.3
#: Turns of its linear equations, and the part of the residual that is left.
CYCLES, LINEAR = 6, 1e-10
#: Of Newton's method: corrections at most, halvings of one, the correction below which none is refused, and the error
#: that is expected to be left, both in parts of the state.
MOST_CORRECTIONS, HALVINGS, NEAR, SOLVED = 40, 8, 1e-7, 1e-16

#: The part of the largest size that counts as the size of a smaller component, and the smallest of a pair's own steps,
#: in steps of the grid.
COARSE, SMALLEST = 1e-6, 1e-13


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
            "tolerance": run.tolerance,
        },
    }
    files = rendered(program, templates, **extra)
    command = compile_command(program, sorted(name for name in files if name.endswith(".c")))
    readme = rendered(program, {"README.md": "c/hamiltonian/README.md.jinja"}, **extra, command=command)
    return files | {"README.md": readme["README.md"]}


def _following_starts(document: Hamiltonian) -> list[str]:
    """Return the coordinates and momenta whose values at the start are formulas of parameters in the file."""
    items = document.coordinates
    positions = [item.name for item in items if item.position_formula is not None]
    return positions + [item.momentum for item in items if item.momentum_formula is not None]


def _extra(document: Hamiltonian) -> dict[str, Any]:
    return {
        "separable": document.separable,
        "momenta": [item.momentum for item in document.coordinates],
        "following_starts": _following_starts(document),
        "most_iterations": MOST_ITERATIONS,
        "rounding": ROUNDING,
        "slow": SLOW,
        "krylov": krylov(len(document.coordinates)),
        "cycles": CYCLES,
        "linear": LINEAR,
        "most_newton": MOST_CORRECTIONS,
        "halvings": HALVINGS,
        "near": NEAR,
        "solved": SOLVED,
        "coarse": COARSE,
        "safety": SAFETY,
        "after_failure": AFTER_FAILURE,
        "most_growth": MOST_GROWTH,
        "most_reduction": MOST_REDUCTION,
        "most_attempts": MOST_STEPS,
        "smallest": SMALLEST,
    }
