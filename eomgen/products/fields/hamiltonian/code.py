"""From a Hamiltonian to a System and its C: energies, gradient, Hessian-vector product, drift and kick on one tape;
functions, steps, a program of its own, and the library for Python.

Momenta stand in the block ``v`` of the System. A Hamiltonian that is T(p) + V(q) by its terms has the functions
``drift`` (dT/dp, of momenta alone) and ``kick`` (-dV/dq, of coordinates alone): with the other half of the state held,
drift and kick are the exact motions of T and of V.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from typing import TYPE_CHECKING, Any

from eomgen.codegen.convert import to_program
from eomgen.codegen.targets.c.interface import INTERFACE_CDEF
from eomgen.codegen.targets.c.target import compile_command, generate_interface, render_files
from eomgen.formula.evaluate import symbols
from eomgen.integrators.families.adaptive import CONTROL
from eomgen.lie.product import Factor
from eomgen.products.fields.documents.document import DEPENDENCES, Hamiltonian
from eomgen.products.fields.documents.recording import record_at
from eomgen.products.fields.hamiltonian.methods import Method, krylov
from eomgen.symbolic.calculus.partials import gradient, jacobian_vector
from eomgen.symbolic.operations import InputSymbol, Op
from eomgen.symbolic.scalar import Algebra
from eomgen.symbolic.tape import Ref, Tape
from eomgen.system.system import Block, Facts, Function, Quantity, System

if TYPE_CHECKING:
    from eomgen.codegen.program import Program


STATE = ("p", "q", "v")
#: Descriptions in the C.
_PARTS = "kinetic, potential and coupled part of H"
_PRODUCT = "product of the Hessian of H with a direction, a of coordinates and j of momenta"


def derive_hamiltonian(document: Hamiltonian) -> System:
    """Return the functions of a Hamiltonian system.

    ``hamiltonian`` (kinetic, potential and coupled part), ``gradient`` (dH/dq and dH/dp), ``hessian_product`` (of the
    Hessian of H with a direction, in blocks ``a`` for coordinates and ``j`` for momenta), ``observed`` if
    there are outputs, and ``drift`` and ``kick`` if H is separable.

    Raises
    ------
    ModelError
        A term without a finite value in any state.
    """
    tape, n = Tape(reciprocals=True), len(document.coordinates)
    algebra = Algebra(tape)
    q, v, dq, dv = (algebra.block(block, n) for block in ("q", "v", "a", "j"))
    values = algebra.block("p", len(document.parameters))
    known = {item.name: value for item, value in zip(document.parameters, values, strict=True)}
    known |= {item.name: value for item, value in zip(document.states, (*q, *v), strict=True)}

    parts = dict.fromkeys(DEPENDENCES, algebra.zero)
    for term in document.terms:
        key = f"{document.name} (hamiltonian.{term.name})"
        parts[term.dependence] += record_at(key, algebra, term.formula, known)
    whole = reduce(lambda left, right: left + right, parts.values())
    tape.lengths |= _divisors(tape, whole.ref)
    states = [item.ref for item in (*q, *v)]
    slopes = gradient(tape, whole.ref, states)
    along: dict[Ref | InputSymbol, Ref] = dict(zip(states, (item.ref for item in (*dq, *dv)), strict=True))
    products = jacobian_vector(tape, slopes, along)
    energies = tuple(part.ref for part in parts.values())

    def halves(refs: Sequence[Ref], *named: tuple[str, str]) -> tuple[Block, ...]:
        parts = zip(named, (refs[:n], refs[n:]), strict=True)
        return tuple(Block(name, (n,), tuple(part), described) for (name, described), part in parts)

    by_state = halves(slopes, ("dH_dq", "by coordinates"), ("dH_dp", "by momenta"))
    along_state = halves(products, ("along_q", "change of dH/dq"), ("along_p", "change of dH/dp"))
    functions = [
        Function("hamiltonian", "energies", STATE, (Block("energy", (3,), energies, _PARTS),)),
        Function("gradient", "gradient of H", STATE, by_state),
        Function("hessian_product", _PRODUCT, (*STATE, "a", "j"), along_state),
    ]
    if document.outputs:
        outputs = [(f"{document.name} (outputs.{item.name})", item.formula) for item in document.outputs]
        y = tuple(record_at(key, algebra, formula, known).ref for key, formula in outputs)
        functions.append(Function("observed", "outputs", STATE, (Block("y", (len(y),), y, "outputs"),)))
    if document.separable:
        rates = (
            Block("qdot", (n,), tuple(slopes[n:])),
            Block("pdot", (n,), tuple(-ref if ref else ref for ref in slopes[:n])),
        )
        functions.append(Function("drift", "rates of coordinates, dT/dp", ("p", "v"), rates[:1]))
        functions.append(Function("kick", "rates of momenta, -dV/dq", ("p", "q"), rates[1:]))
    return _system(document, tape, functions)


def _divisors(tape: Tape, energy: Ref) -> set[int]:
    """Return the nodes of divisors in sums and products of the energy with this reference: H has no finite value if one
    is 0."""
    divisors, seen, pending = set[int](), set[int](), [abs(energy)]
    while pending:
        node = pending.pop()
        if node in seen:
            continue
        seen.add(node)
        if tape.op[node] in (Op.ADD, Op.SUB, Op.MUL):
            pending += map(abs, tape.operands(node))
        elif tape.op[node] is Op.DIV:
            pending.append(abs(tape.a[node]))
            divisors.add(abs(tape.b[node]))
    return divisors


def _system(document: Hamiltonian, tape: Tape, functions: Sequence[Function]) -> System:
    """Return a System with these functions, whose velocities are the momenta, with a factor R for each coordinate."""
    n, parameters = len(document.coordinates), []
    for item in document.parameters:  # formulas are of files, and a struct of C has none
        leaders = [] if item.formula is None else sorted({symbol.name for symbol in symbols(item.formula)})
        rule = f"it follows {', '.join(leaders)} in files, not here" if leaders else ""
        described = "; ".join(text for text in (item.description, rule) if text)
        parameters.append(Quantity(item.name, item.value, 1, item.unit, described))
    return System(
        document.name,
        tape,
        tuple(Factor("R", item.name, k, 1, k, 1) for k, item in enumerate(document.coordinates)),
        {function.name: function for function in functions},
        tuple(parameters),
        (),
        tuple(Quantity(item.name, unit=item.unit) for item in document.outputs),
        (),
        tuple(item.value for item in document.coordinates),
        tuple(item.value for item in document.momenta),
        tuple(range(-1, n - 1)),
        angular=(False,) * n,
        facts=Facts(constant_mass=True, velocity_forces=False, smooth=True, moving_base=False, conservative=True),
        description=document.description,
    )


#: Declarations of the functions called from Python.
CDEF = f"""\
{INTERFACE_CDEF}int eomgen_hamiltonian_run(const double *parameters, double step, long rows, long every, int more,
    int kind, int count, const double *fractions, int stages, const double *coefficients, double tolerance,
    int compensated, double *work, double *state, double *record, long *counted);
"""
#: Numbers of the steps, by their names in the templates.
NUMBERS = {
    # iterations of an implicit step at most; the change, relative to the state, that may be rounding; and the ratio of
    # successive changes above which Newton's method takes over
    **{"most_iterations": 200, "rounding": 1e-12, "slow": 0.3},
    # cycles of the linear equations, and the part of the residual that is left
    **{"cycles": 6, "linear": 1e-10},
    # of Newton's method: corrections at most, halvings of one, the correction below which none is refused, and the
    # error that is expected to be left, both in parts of the state
    **{"most_newton": 40, "halvings": 8, "near": 1e-7, "solved": 1e-16},
    # the part of the largest size that counts as the size of a smaller component, and the smallest of a pair's own
    # steps, in steps of the grid
    **{"coarse": 1e-6, "smallest": 1e-13},
    **{"safety": CONTROL.safety, "after_failure": CONTROL.after_failure, "most_attempts": CONTROL.most_steps},
    **{"most_growth": CONTROL.most_growth, "most_reduction": CONTROL.most_reduction},
}


def program_of(document: Hamiltonian) -> Program:
    """Return the Program of a Hamiltonian system."""
    return to_program(derive_hamiltonian(document))


def library_files(document: Hamiltonian, program: Program) -> dict[str, str]:
    """Return the files, name to text, that a library for Python is compiled from: C of the system, steps, and
    interface."""
    files = _files_with(program, "exported.c", **_extra(document))
    interface = generate_interface(program, files)
    interface["interface.h"] = interface["interface.h"].replace(INTERFACE_CDEF, CDEF)
    return files | interface


def folder_files(document: Hamiltonian, program: Program, method: Method) -> dict[str, str]:
    """Return the files of a folder of C that stands alone, name to text, with a main program that makes the file's run
    by ``method``. The same system gives the same bytes."""
    run = document.simulation
    extra = _extra(document) | {
        "method": method,
        "names": [item.name for item in document.states],
        "run": {**vars(run), "steps": round(run.duration / run.step)},
    }
    files = _files_with(program, "main.c", **extra)
    command = compile_command(program, sorted(name for name in files if name.endswith(".c")))
    return files | render_files(program, {"README.md": "fields/hamiltonian/README.md.jinja"}, **extra, command=command)


def _files_with(program: Program, last: str, **extra: Any) -> dict[str, str]:
    """Return the header, the C of the steps, and the file ``last``, which calls the steps, as texts by name; ``extra``
    are further names of the templates."""
    names = {f"{program.prefix}.h": "header.h", f"{program.prefix}_steps.c": "steps.c", last: last}
    templates = {name: f"fields/hamiltonian/{template}.jinja" for name, template in names.items()}
    return render_files(program, templates, **extra)


def _extra(document: Hamiltonian) -> dict[str, Any]:
    return {
        "separable": document.separable,
        "momenta": [item.name for item in document.momenta],
        # coordinates and momenta whose values at the start are formulas of parameters in the file
        "following_starts": [item.name for item in document.states if item.formula is not None],
        "krylov": krylov(len(document.coordinates)),
        **NUMBERS,
    }
