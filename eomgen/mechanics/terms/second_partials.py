"""Second derivatives of a weighted sum of equations and outputs along one direction, for second-order adjoints.

    g = d (w . (M a + h + b - Q + B^T lam, zdot, Phi, B v + Phi_t, B a + g, outputs)) / d (q, v, a, z, lam, p, u),
    Hd = dg along d.

g by one reverse sweep, its change along d by one forward sweep over that (Griewank and Walther, Evaluating Derivatives
(2008), section 5.4), so the cost is a small multiple of the cost of the equations for any number of variables. In q
both are left-trivialised: first the gradient, then its change along d; on rotations the two do not commute. Time is
held; given inputs and the base follow their laws in p, and u adds to the given inputs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from eomgen.mechanics.derivation import Derivation
from eomgen.mechanics.kinematics.directions import Seeds, configuration_directions
from eomgen.mechanics.terms.linearization import constraint_accelerations
from eomgen.mechanics.terms.parameters import Partials
from eomgen.symbolic.calculus.partials import jacobian_vector, weighted_gradient
from eomgen.symbolic.operations import InputSymbol
from eomgen.symbolic.tape import ONE, ZERO, Ref, Tape
from eomgen.system.second_blocks import SecondBlocks, second_blocks
from eomgen.system.system import Block


def second_partials(derivation: Derivation) -> list[Block]:
    """Return Hd, in the parts of ``SecondBlocks.direction``."""
    tape = derivation.tape
    values_by_name = _values(derivation)
    blocks = _blocks(derivation, values_by_name)
    values = [ref for name in blocks.weights for ref in values_by_name[name]]
    seeds, size = _directions(derivation, blocks), sum(blocks.direction.values())
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
    description = (
        "change along d of the gradient of w . (residual, zdot, Phi, rates and accelerations of constraints, outputs)"
    )
    return [Block("Hd", (size,), tuple(changes), description)]


def _values(derivation: Derivation) -> dict[str, Sequence[Ref]]:
    """Return the weighted rows (residual, rates, constraints, outputs) by the names of ``SecondBlocks.weights``."""
    (residual,) = derivation.residual()
    result: dict[str, Sequence[Ref]] = {"r": residual.refs, **dict.fromkeys(("zdot", "Phi", "w", "wdot", "y"), ())}
    if derivation.scene.states:
        result["zdot"] = derivation.internal_rate()[0].refs
    if derivation.constraints is not None:
        result["Phi"], result["w"] = derivation.constraint()[0].refs, derivation.constraint_velocity()[0].refs
        (B,), (g,) = derivation.constraint_jacobian(), derivation.constraint_bias()
        result["wdot"] = [row.ref for row in constraint_accelerations(derivation, B, g)]
    if derivation.scene.outputs:
        result["y"] = derivation.outputs()[0].refs
    return result


def _blocks(derivation: Derivation, values: Mapping[str, Sequence[Ref]]) -> SecondBlocks:
    scene = derivation.scene
    return second_blocks(
        nv=derivation.tree.nv,
        nz=len(scene.states),
        nu=len(scene.inputs),
        holonomic=len(values["Phi"]),
        rows=len(values["w"]),
        outputs=len(values["y"]),
        parameters=sum(item.tunable for item in scene.parameters),
    )


def _directions(derivation: Derivation, blocks: SecondBlocks) -> Seeds:
    """Return tangents of all that varies, numbered as the components of Hd."""
    places = blocks.places("direction")
    seeds: Seeds = dict(configuration_directions(derivation.tree))
    for block in ("v", "a", "z", "lam"):
        seeds |= {InputSymbol(block, k): {place: ONE} for k, place in enumerate(_numbers(places[block]))}
    of_parameters = places["p"].start
    for key, tangent in Partials(derivation).seeds.items():
        seeds[key] = {of_parameters + direction: ref for direction, ref in tangent.items()}
    for k, place in enumerate(_numbers(places["u"])):
        seeds[InputSymbol("u", k)] = {**seeds.get(InputSymbol("u", k), {}), place: ONE}
    return seeds


def _numbers(place: slice) -> range:
    return range(place.start, place.stop)


def _along(tape: Tape, tangent: Mapping[int, Ref]) -> Ref:
    """Return the change of a quantity along the direction d."""
    total = ZERO
    for direction, ref in tangent.items():
        total = tape.add(total, tape.mul(ref, tape.input("direction", direction)))
    return total
