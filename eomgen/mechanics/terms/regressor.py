"""Terms of the linear form of inverse dynamics: tau = Y pi + tau0."""

from __future__ import annotations

from eomgen.mechanics.derivation import Derivation
from eomgen.mechanics.dynamics.regressor import parameter_values, regressor, without_linear_parameters
from eomgen.mechanics.dynamics.separated import generalized
from eomgen.mechanics.forces.applied import applied_loads
from eomgen.mechanics.linear_parameters import linear_parameters
from eomgen.system.system import Block


def regressor_blocks(derivation: Derivation) -> list[Block]:
    """Return Y, (nv, parameters), and tau0, (nv,): springs, inputs and all forces by formulas, with their sign in
    tau."""
    scene, tree, quantities = derivation.scene, derivation.tree, derivation.quantities
    rows = regressor(scene, tree, derivation.motion, quantities)
    names = [item.name for item in linear_parameters(scene)]
    derivation.energies()  # which formulas of forces may name
    loads = applied_loads(without_linear_parameters(scene), tree, quantities)
    zero = (tree.algebra.zero_vector, tree.algebra.zero_vector)
    wrenches = generalized(tree, [zero if load is None else load for load in loads.wrenches], "other forces")
    left = [-(x + y) for x, y in zip(wrenches, loads.efforts, strict=True)]
    description = f"tau per unit of {', '.join(names)}"
    return [
        derivation.block("Y", (tree.nv, len(names)), [value for row in rows for value in row], description),
        derivation.block("tau0", (tree.nv,), left, "what of tau no parameter of the regressor is a factor of"),
    ]


def regressor_parameters(derivation: Derivation) -> list[Block]:
    """Return pi, (parameters,): the values of the parameters in the scene."""
    scene = derivation.scene
    result = parameter_values(derivation.algebra, scene, derivation.constant)
    names = ", ".join(item.name for item in linear_parameters(scene))
    return [derivation.block("pi", (len(result),), result, names)]
