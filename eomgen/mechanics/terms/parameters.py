"""Partials in the tunable parameters, by forward differentiation of recorded terms.

    d(M a + h + b - Q + B^T lam) = Rp dp        d zdot = Fp dp        d outputs = Yp dp
    d Phi = Phip dp        d(B v + Phi_t) = Zp dp        d(B a + g) = Ap dp

Time, q, v, a, z and the multipliers are held, and so are inputs that a controller or a caller drives. Inputs that the
scene gives and the motion of the base follow their laws, in which parameters may be: heights of roads, amplitudes.
"""

from __future__ import annotations

from collections.abc import Sequence

from eomgen.mechanics.derivation import Derivation
from eomgen.mechanics.forces.symbols import input_signal
from eomgen.mechanics.kinematics.directions import Seeds
from eomgen.mechanics.terms.linearization import constraint_accelerations
from eomgen.mechanics.tree.base import base_law
from eomgen.symbolic.calculus.partials import forward_partials
from eomgen.symbolic.operations import InputSymbol
from eomgen.symbolic.scalar import Scalar
from eomgen.symbolic.tape import ONE, ZERO
from eomgen.system.system import Block


def parameter_partials(derivation: Derivation) -> list[Block]:
    """Return Rp, then Fp if there are internal states, then Phip, Zp and Ap if there are constraints."""
    partials = Partials(derivation)
    (r,) = derivation.residual()
    blocks = [partials.of(r.refs, "Rp", "d(M a + h + b - Q + B^T lam)")]
    if derivation.scene.states:
        rates = [rate.ref for rate in derivation.internal.rates()]
        blocks.append(partials.of(rates, "Fp", "d zdot"))
    if derivation.constraints is not None:
        (B,), (g,) = derivation.constraint_jacobian(), derivation.constraint_bias()
        accelerations = [row.ref for row in constraint_accelerations(derivation, B, g)]
        blocks += [
            partials.of(derivation.constraint()[0].refs, "Phip", "d Phi"),
            partials.of(derivation.constraint_velocity()[0].refs, "Zp", "d(B v + Phi_t)"),
            partials.of(accelerations, "Ap", "d(B a + g)"),
        ]
    return blocks


def output_parameter_partials(derivation: Derivation) -> list[Block]:
    """Return Yp, the partials of the named outputs."""
    return [Partials(derivation).of(derivation.outputs()[0].refs, "Yp", "d outputs")]


class Partials:
    """Differentiation along the tunable parameters, each a direction, in their order.

    Attributes
    ----------
    seeds : derivatives of the parameters, of inputs that the scene gives, and of the base struct
    """

    def __init__(self, derivation: Derivation) -> None:
        self.derivation = derivation
        self.names = [item.name for item in derivation.scene.parameters if item.tunable]
        self.seeds: Seeds = {InputSymbol("p", number): {number: ONE} for number in range(len(self.names))}
        scene, quantities = derivation.scene, derivation.quantities
        with derivation.tape.block("partials of prescribed motion in the parameters"):
            given = [(number, item) for number, item in enumerate(scene.inputs) if item.given]
            self._follow("u", [number for number, _ in given], [input_signal(quantities, item) for _, item in given])
            if scene.base is not None:
                law = base_law(derivation.algebra, scene.base, derivation.tree.parameters)
                self._follow("base", range(len(law)), law)

    def _follow(self, block: str, numbers: Sequence[int], laws: Sequence[Scalar]) -> None:
        """Let components of an input block change as their laws do."""
        tangents = forward_partials(self.derivation.tape, [law.ref for law in laws], self.seeds)
        self.seeds |= {
            InputSymbol(block, number): tangent for number, tangent in zip(numbers, tangents, strict=True) if tangent
        }

    def of(self, refs: Sequence[int], name: str, numerator: str) -> Block:
        """Return the partials of values, (values, np), as one block."""
        tape = self.derivation.tape
        with tape.block(f"partials in the parameters: {numerator}"):
            tangents = forward_partials(tape, refs, self.seeds)
        columns = range(len(self.names))
        entries = tuple(tangent.get(column, ZERO) for tangent in tangents for column in columns)
        return Block(name, (len(refs), len(columns)), entries, f"{numerator}/dp, p: {', '.join(self.names)}")
