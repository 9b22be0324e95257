"""First and second derivatives of a term in all of its arguments, as nonzeros: Jacobian, and Hessian of a weighted sum.

With w the weights and f the values of the term, the Hessian is the symmetric matrix of second derivatives of w . f at
the origin of local coordinates: q exp(dq) in each factor of the configuration, and sums in v, a, z, lam, u, p and t. By
one reverse sweep, and forward sweeps over that (Griewank and Walther, Evaluating Derivatives (2008), section 5.4).

Derivatives X_i along the left-trivialised directions of a rotation or a pose do not commute, X_i X_j - X_j X_i = [X_i,
X_j]. In the coordinates of the exponential, f(q exp(d)) = f + d_i X_i f + 1/2 d_i d_j X_i X_j f + ..., so the Hessian
is the symmetric part, 1/2 (X_i X_j + X_j X_i) f. Directions of different factors, and of other arguments, commute.

Columns are in the order of ``ARGUMENTS``. A moving base follows its law in t and p; all inputs are independent, also
inputs that the scene gives.
"""

from __future__ import annotations

from collections.abc import Sequence

from eomgen.mechanics.kinematics.directions import Seeds, configuration_directions
from eomgen.mechanics.scene_tape import Derivation
from eomgen.mechanics.terms.implicit_step import Entries, nonzeros
from eomgen.mechanics.tree.base import base_law
from eomgen.symbolic.calculus.partials import forward_partials, gradient_along
from eomgen.symbolic.operations import InputSymbol
from eomgen.symbolic.tape import ONE, ZERO, Ref
from eomgen.system.system import Block
from eomgen.system.terms import ARGUMENTS


def derivative_blocks(derivation: Derivation, name: str, blocks: Sequence[Block]) -> list[Block]:
    """Return the nonzeros of the term ``name``: the Jacobian or the Hessian of the values in ``blocks``.

    Nonzeros are column by column, rows ascending: the order of compressed columns.
    """
    values = [ref for block in blocks for ref in block.refs]
    seeds, size = _directions(derivation)
    entries = (_hessian if name.endswith("_hessian") else _jacobian)(derivation, values, seeds, size)
    by_columns = {(column, row): ref for (row, column), ref in entries.items()}
    block = nonzeros(derivation, name, by_columns, name)
    derivation.patterns[name] = tuple((row, column) for column, row in derivation.patterns[name])
    return [block]


def _directions(derivation: Derivation) -> tuple[Seeds, int]:
    """Return tangents of all arguments, numbered in the order of ``ARGUMENTS``, and their number."""
    tape, scene, tree = derivation.tape, derivation.scene, derivation.tree
    rows = 0 if derivation.constraints is None else len(derivation.constraints.rows.all)
    tunable = sum(item.tunable for item in scene.parameters)
    sizes = {"q": tree.nv, "v": tree.nv, "a": tree.nv, "z": len(scene.states), "lam": rows}
    sizes |= {"u": len(scene.inputs), "p": tunable, "t": 1}
    seeds: Seeds = dict(configuration_directions(tree))
    law: Seeds = {}
    first = tree.nv
    for block in ARGUMENTS[1:]:
        own: Seeds = {InputSymbol(block, k): {first + k: ONE} for k in range(sizes[block])}
        seeds |= own
        law |= own if block in ("p", "t") else {}
        first += sizes[block]
    if scene.base is not None:
        with tape.block("partials of the motion of the base"):
            values = [value.ref for value in base_law(derivation.algebra, scene.base, tree.parameters)]
            tangents = forward_partials(tape, values, law)
        seeds |= {InputSymbol("base", k): tangent for k, tangent in enumerate(tangents) if tangent}
    return seeds, first


def _jacobian(derivation: Derivation, values: Sequence[Ref], seeds: Seeds, size: int) -> Entries:
    """Return the nonzeros of the Jacobian of values by (row, column)."""
    with derivation.tape.block("Jacobian in all arguments"):
        tangents = forward_partials(derivation.tape, values, seeds)
    return {(row, column): ref for row, tangent in enumerate(tangents) for column, ref in tangent.items()}


def _hessian(derivation: Derivation, values: Sequence[Ref], seeds: Seeds, size: int) -> Entries:
    """Return the nonzeros of the lower triangle of the Hessian of weights . values by (row, column)."""
    tape = derivation.tape
    weights = [tape.input("weights", number) for number in range(len(values))]
    with tape.block("gradient of the weighted sum"):
        gradient = gradient_along(tape, values, weights, seeds, size)
    with tape.block("Hessian of the weighted sum"):
        changes = forward_partials(tape, gradient, seeds)
        entries = {
            (row, column): ref
            for row, tangent in enumerate(changes)
            for column, ref in tangent.items()
            if column <= row and abs(ref) != ZERO
        }
        half = tape.constant(0.5)
        for factor in derivation.tree.factors:
            own = range(factor.v_start, factor.v_start + factor.v_size)
            if factor.group == "R":
                continue
            for row in own:
                for column in range(factor.v_start, row):
                    there, back = (changes[i].get(j, ZERO) for i, j in ((row, column), (column, row)))
                    entries[row, column] = tape.mul(half, tape.add(there, back))
    return {place: ref for place, ref in entries.items() if abs(ref) != ZERO}
