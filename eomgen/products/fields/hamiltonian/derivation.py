"""From a Hamiltonian to a System: energies, gradient, Hessian-vector product, drift and kick on one tape.

Momenta stand in the block ``v`` of the System. A Hamiltonian that is T(p) + V(q) by its terms has the functions
``drift`` (dT/dp, of momenta alone) and ``kick`` (-dV/dq, of coordinates alone): with the other half of the state held,
each is the exact motion of its part of H.
"""

from __future__ import annotations

from functools import reduce

from eomgen.errors import ModelError, Problem
from eomgen.formula.evaluate import symbols
from eomgen.formula.nodes import Formula, Symbol
from eomgen.formula.recording import record
from eomgen.lie.product import Factor
from eomgen.products.fields.documents.document import DEPENDENCES, Hamiltonian, Parameter
from eomgen.symbolic.calculus.partials import gradient, jacobian_vector
from eomgen.symbolic.operations import InputSymbol
from eomgen.symbolic.scalar import Algebra, Scalar
from eomgen.symbolic.tape import Ref, Tape
from eomgen.system.system import Block, Facts, Function, Quantity, System

STATE = ("p", "q", "v")


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
    known |= {item.name: value for item, value in zip(document.coordinates, q, strict=True)}
    known |= {item.momentum: value for item, value in zip(document.coordinates, v, strict=True)}

    def recorded(key: str, formula: Formula) -> Scalar:
        def resolve(symbol: Symbol) -> Scalar:
            return known[symbol.name]

        try:
            return record(algebra, formula, resolve)
        except ModelError as error:
            raise ModelError([Problem(key, problem.what, problem.hint) for problem in error.problems]) from None

    parts = dict.fromkeys(DEPENDENCES, algebra.zero)
    for term in document.terms:
        parts[term.dependence] += recorded(f"{document.name} (hamiltonian.{term.name})", term.formula)
    whole = reduce(lambda left, right: left + right, parts.values())
    states = [item.ref for item in (*q, *v)]
    slopes = gradient(tape, whole.ref, states)
    along: dict[Ref | InputSymbol, Ref] = dict(zip(states, (item.ref for item in (*dq, *dv)), strict=True))
    products = jacobian_vector(tape, slopes, along)
    functions = [
        _function(
            "hamiltonian",
            "energies",
            STATE,
            Block(
                "energy", (3,), tuple(part.ref for part in parts.values()), "kinetic, potential and coupled part of H"
            ),
        ),
        _function(
            "gradient",
            "gradient of H",
            STATE,
            Block("dH_dq", (n,), tuple(slopes[:n]), "by coordinates"),
            Block("dH_dp", (n,), tuple(slopes[n:]), "by momenta"),
        ),
        _function(
            "hessian_product",
            "product of the Hessian of H with a direction, a of coordinates and j of momenta",
            ("p", "q", "v", "a", "j"),
            Block("along_q", (n,), tuple(products[:n]), "change of dH/dq"),
            Block("along_p", (n,), tuple(products[n:]), "change of dH/dp"),
        ),
    ]
    if document.outputs:
        y = tuple(recorded(f"{document.name} (outputs.{item.name})", item.formula).ref for item in document.outputs)
        functions.append(_function("observed", "outputs", STATE, Block("y", (len(y),), y, "outputs")))
    if document.separable:
        functions += [
            _function("drift", "rates of coordinates, dT/dp", ("p", "v"), Block("qdot", (n,), tuple(slopes[n:]))),
            _function("kick", "rates of momenta, -dV/dq", ("p", "q"), Block("pdot", (n,), _negative(slopes[:n]))),
        ]
    return System(
        document.name,
        tape,
        tuple(Factor("R", item.name, k, 1, k, 1) for k, item in enumerate(document.coordinates)),
        {function.name: function for function in functions},
        tuple(Quantity(item.name, item.value, 1, item.unit, _described(item)) for item in document.parameters),
        (),
        tuple(Quantity(item.name, unit=item.unit) for item in document.outputs),
        (),
        tuple(item.position for item in document.coordinates),
        tuple(item.momentum_value for item in document.coordinates),
        tuple(range(-1, n - 1)),
        angular=(False,) * n,
        facts=Facts(constant_mass=True, velocity_forces=False, smooth=True, moving_base=False, conservative=True),
        description=document.description,
    )


def _described(item: Parameter) -> str:
    """Return the description of a parameter, and the parameters that it follows in files, and not in a struct of C."""
    leaders = [] if item.formula is None else sorted({symbol.name for symbol in symbols(item.formula)})
    rule = f"it follows {', '.join(leaders)} in files, not here" if leaders else ""
    return "; ".join(text for text in (item.description, rule) if text)


def _function(name: str, description: str, inputs: tuple[str, ...], *blocks: Block) -> Function:
    return Function(name, description, inputs, blocks)


def _negative(refs: list[Ref]) -> tuple[Ref, ...]:
    return tuple(-ref if ref else ref for ref in refs)
