"""Second derivatives of a weighted sum of the equations and outputs, along one direction: what adjoints of second
order take of each state.

    g = d (w . (M a + h + b - Q + B^T lam, zdot, Phi, B v + Phi_t, B a + g, outputs)) / d (q, v, a, z, lam, p),
    Hd = dg along d.

g by one reverse sweep, its change along d by one forward sweep over that (Griewank and Walther, Evaluating Derivatives
(2008), section 5.4), so the cost is a small multiple of that of the equations whatever the number of variables. In q
both are left-trivialised: first the gradient, then its change along d, which on rotations do not commute. Time is held,
as are inputs that a controller or a caller drives; given inputs and the base follow their laws.
"""

from __future__ import annotations

from collections.abc import Mapping

from eomgen.mechanics.derivation import Derivation
from eomgen.mechanics.kinematics.directions import Seeds, configuration_directions
from eomgen.mechanics.terms.linearization import constraint_accelerations
from eomgen.mechanics.terms.parameters import Partials
from eomgen.symbolic.calculus.partials import jacobian_vector, weighted_gradient
from eomgen.symbolic.operations import InputSymbol
from eomgen.symbolic.tape import ONE, ZERO, Ref, Tape
from eomgen.system.system import Block


def second_partials(derivation: Derivation) -> list[Block]:
    """Return Hd, (3 nv + nz + nl + np,): in q (left-trivialised), v, a, z, lam and p."""
    tape = derivation.tape
    values = _values(derivation)
    seeds, size = _directions(derivation)
    weights = [tape.input("weights", number) for number in range(len(values))]
    with tape.block("gradient of the weighted equations and outputs"):
        keys = {key: tape.input(key.block, key.index) if isinstance(key, InputSymbol) else key for key in seeds}
        adjoints = dict(zip(keys, weighted_gradient(tape, values, weights, list(keys.values())), strict=True))
        gradient = [ZERO] * size
        for key, tangent in seeds.items():
            for direction, ref in tangent.items():
                gradient[direction] = tape.add(gradient[direction], tape.mul(ref, adjoints[key]))
    with tape.block("its change along the direction"):
        changes = jacobian_vector(tape, gradient, {key: _along(tape, tangent) for key, tangent in seeds.items()})
    what = (
        "change along d of the gradient of w . (residual, zdot, Phi, rates and accelerations of constraints, outputs)"
    )
    return [Block("Hd", (size,), tuple(changes), what)]


def _values(derivation: Derivation) -> list[Ref]:
    """Return what is weighted, in the order of the weights."""
    (residual,) = derivation.residual()
    values = list(residual.refs)
    if derivation.scene.states:
        values += derivation.internal_rate()[0].refs
    if derivation.constraints is not None:
        values += [*derivation.constraint()[0].refs, *derivation.constraint_velocity()[0].refs]
        (B,), (g,) = derivation.constraint_jacobian(), derivation.constraint_bias()
        values += [row.ref for row in constraint_accelerations(derivation, B, g)]
    if derivation.scene.outputs:
        values += derivation.outputs()[0].refs
    return values


def _directions(derivation: Derivation) -> tuple[Seeds, int]:
    """Return tangents of all that varies, numbered as the components of Hd, and their number."""
    nv, nz = derivation.tree.nv, len(derivation.scene.states)
    nl = 0 if derivation.constraints is None else len(derivation.constraints.rows.all)
    seeds: Seeds = dict(configuration_directions(derivation.tree))
    first = nv
    for block, size in (("v", nv), ("a", nv), ("z", nz), ("lam", nl)):
        seeds |= {InputSymbol(block, k): {first + k: ONE} for k in range(size)}
        first += size
    parameters = Partials(derivation)
    for key, tangent in parameters.seeds.items():
        seeds[key] = {first + direction: ref for direction, ref in tangent.items()}
    return seeds, first + len(parameters.names)


def _along(tape: Tape, tangent: Mapping[int, Ref]) -> Ref:
    """Return the change of a quantity along the direction d."""
    total = ZERO
    for direction, ref in tangent.items():
        total = tape.add(total, tape.mul(ref, tape.input("direction", direction)))
    return total
