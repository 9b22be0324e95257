"""Constraints of SymPy's systems as rows of positions and velocities: scales, independent rows, and states that satisfy
the rows.

SymPy lists the rates of holonomic constraints among the constraints of velocities. Rows whose gradients in v depend on
gradients of earlier rows are rates or copies of these, and are left out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import sympy

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, field
from eomgen.base.rounding import COMPUTED, SUMMED, WRITTEN
from eomgen.errors import DescriptionError, Problem
from eomgen.products.sympy_mechanics.expressions import Expressions, basic
from eomgen.symbolic.calculus.partials import Seeds, forward_partials, jacobian_vector
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.operations import InputSymbol, Op
from eomgen.symbolic.scalar import Scalar
from eomgen.symbolic.tape import ONE, ZERO, Ref, Tape

#: Values of the input blocks in several states.
Samples = Sequence[Mapping[str, Array]]
#: Seed of the states at which pivots are chosen, and gradients and equalities are compared.
SEED = 1


@dataclass(frozen=True)
class KaneRows:
    """Independent constraints of a SymPy system, as references on the tape.

    Attributes
    ----------
    names : tuple of str
        Of the positions, then of the velocities.
    positions : tuple of references
        Phi(q, t).
    velocities : tuple of references
        psi(q, v, t), affine in v.
    sizes, extents : tuples of references
        Scales of each row, as of ``ConstraintRow``.
    left_out : tuple of str
        Positions that follow from other positions.
    """

    names: tuple[str, ...] = ()
    positions: tuple[Ref, ...] = field(default=(), repr=False)
    velocities: tuple[Ref, ...] = field(default=(), repr=False)
    sizes: tuple[Ref, ...] = field(default=(), repr=False)
    extents: tuple[Ref, ...] = field(default=(), repr=False)
    left_out: tuple[str, ...] = ()


class Constraints:
    """Holonomic constraints and constraints of velocities of a system, on the tape.

    Parameters
    ----------
    expressions : Expressions
    positions, velocities : sequences of expressions of SymPy
    q, v : sequences of Scalar
        Blocks of the coordinates and of the rates.
    angular : sequence of bool
        Which coordinates are angles.
    relations : sequence of references
        Further constraints of velocities, on the tape.
    """

    def __init__(
        self,
        expressions: Expressions,
        positions: Sequence[Any],
        velocities: Sequence[Any],
        q: Sequence[Scalar],
        v: Sequence[Scalar],
        angular: Sequence[bool],
        relations: Sequence[Ref] = (),
    ) -> None:
        """Record the constraints with rates and gradients. Raises DescriptionError if not linear in v."""
        self.expressions, self.angular, self.count = expressions, angular, len(q)
        self.tape, self.algebra = expressions.algebra.tape, expressions.algebra
        self.texts = [basic(item) for item in (*positions, *velocities)]
        self.q = q
        self.positions = [expressions(item).ref for item in positions]
        self.velocities = [*(expressions(item).ref for item in velocities), *relations]
        along: dict[Ref | InputSymbol, Ref] = {entry.ref: rate.ref for entry, rate in zip(q, v, strict=True)}
        along[InputSymbol("t", 0)] = ONE
        self.rates = jacobian_vector(self.tape, self.positions, along)
        seeds: list[Seeds] = [{item.ref: {index: ONE} for index, item in enumerate(block)} for block in (q, v)]
        self.slopes = forward_partials(self.tape, self.positions, seeds[0])
        self.slopes += forward_partials(self.tape, self.velocities, seeds[1])
        for number, row in enumerate(self.slopes[len(self.positions) :], 1):
            if any(symbol.block == "v" for symbol in self.tape.depends_on(row.values())):
                fault = f"the constraint of velocities number {number} is not linear in the rates [E2186]"
                raise DescriptionError(Problem(expressions.name, fault, "a(q, t) q.diff() + b(q, t)"))

    def met(self, start: Mapping[str, Array]) -> dict[str, Array]:
        """Return the state on the constraints to which Newton's corrections from a start lead; states are input blocks.

        Each correction is the smallest that solves the linear equations of the rows; q is corrected first, then v. The
        distance from the start is not limited.

        Raises
        ------
        DescriptionError
            If a row is still off by 1e-9 or more after 50 corrections.
        """
        state, count = dict(start), len(self.positions)
        # The rates of the positions have the gradients of the positions.
        for values, slopes, block in (
            (self.positions, self.slopes[:count], "q"),
            ([*self.rates, *self.velocities], self.slopes, "v"),
        ):
            refs = [*values, *(row.get(column, ZERO) for row in slopes for column in range(self.count))]
            size = np.inf if values else 0.0
            for _ in range(50):
                if not values or size < COMPUTED:
                    break
                results = evaluate(self.tape, refs, state)
                jacobian = results[len(values) :].reshape(len(values), -1)
                state[block] = state[block] - np.linalg.lstsq(jacobian, results[: len(values)], rcond=None)[0]
                size = float(np.abs(results[: len(values)]).max())
            if not size < COMPUTED:
                fault = f"the constraints are not met near the initial state: off by {size:.3g} [E1161]"
                hint = "an initial state nearer to the constraints"
                raise DescriptionError(Problem(self.expressions.name, fault, hint))
        return state

    def near(self, start: Mapping[str, Array]) -> list[Mapping[str, Array]]:
        """Return ``start``, which is not checked, and up to two random states nearby that satisfy the constraints, with
        fixed seed. States from which the corrections do not reach the constraints are left out."""
        random = np.random.default_rng(SEED)
        states = [start]
        for _ in range(2):
            moved = {block: start[block] + 0.05 * random.normal(size=self.count) for block in "qv"}
            try:
                states.append(self.met({**start, **moved}))
            except DescriptionError:  # the constraints bend more than the distance
                continue
        return states

    def rows(self, states: Sequence[Mapping[str, Array]]) -> KaneRows:
        """Return the independent rows, positions first, by gradients at several states; names of dropped positions,
        too."""
        refs = [row.get(column, ZERO) for row in self.slopes for column in range(self.count)]
        gradients = []
        for state in states:
            values = values_at(self.tape, refs, state)
            if np.all(np.isfinite(values)):  # elsewhere an angle may be singular
                gradients.append(values.reshape(len(self.slopes), self.count))
        row_numbers = _independent(np.array(gradients))
        count = len(self.positions)
        names = [f"holonomic {k + 1}: formula" for k in range(count)]
        names += [f"velocity {k + 1}: formula" for k in range(len(self.velocities))]
        scales = [self._scales(row) for row in row_numbers]
        return KaneRows(
            tuple(names[row] for row in row_numbers),
            tuple(self.positions[row] for row in row_numbers if row < count),
            tuple(self.velocities[row - count] for row in row_numbers if row >= count),
            tuple(size.ref for size, _ in scales),
            tuple(extent.ref for _, extent in scales),
            tuple(names[row] for row in range(count) if row not in row_numbers),
        )

    def _scales(self, row: int) -> tuple[Scalar, Scalar]:
        """Return for a row the sum of the magnitudes of the summands, and the change per radian, as Scalars."""
        algebra, of_velocity = self.algebra, row >= len(self.positions)
        turned = moved = algebra.zero
        for column, ref in self.slopes[row].items():
            slope = algebra.call(Op.ABS, Scalar(self.tape, ref))
            if self.angular[column]:
                turned = turned + slope
            moved = moved + slope * algebra.call(Op.ABS, self.q[column])
        extent = algebra.one if turned.is_zero else turned
        if of_velocity:
            return extent, extent
        parts = (self.expressions(item) for item in sympy.Add.make_args(self.texts[row]))
        return sum((algebra.call(Op.ABS, part) for part in parts), moved), extent


def _independent(gradients: Array) -> list[int]:
    """Return the numbers of the rows whose gradient does not depend on earlier gradients in at least one state.
    ``gradients`` has the shape (states, rows, n)."""
    kept: list[int] = []
    bases: list[list[Array]] = [[] for _ in gradients]
    for row in range(gradients.shape[1]):
        new = []
        for basis, of_state in zip(bases, gradients, strict=True):
            rest = of_state[row].copy()
            for direction in [*basis, *basis]:  # twice, for digits
                rest -= (direction @ rest) * direction
            if np.linalg.norm(rest) > WRITTEN * np.linalg.norm(of_state[row]):
                new.append((basis, rest / np.linalg.norm(rest)))
        for basis, direction in new:
            basis.append(direction)
        if new:
            kept.append(row)
    return kept


def angles(coordinates: Sequence[Any], expressions: Sequence[Any]) -> list[bool]:
    """Return for each coordinate whether it is within the argument of a sine, cosine or tangent in the expressions."""
    inside: set[Any] = set()
    for expression in map(basic, expressions):
        for function in expression.atoms(sympy.sin, sympy.cos, sympy.tan):
            inside |= function.args[0].atoms(sympy.Function)
    return [item in inside for item in coordinates]


def is_singular(matrices: Sequence[Array]) -> bool:
    """Return whether each of several symmetric inertia matrices (n, n) has a direction without inertia. Matrices that
    are not finite do not count; without any other matrix the result is True.
    """
    least = []
    for matrix in (item for item in matrices if np.all(np.isfinite(item))):
        scale = np.sqrt(np.maximum(np.diag(matrix), 0.0))
        scale = np.where(scale > 0.0, scale, 1.0)
        values = np.linalg.eigvalsh(matrix / np.outer(scale, scale))
        least.append(values[0] <= SUMMED * values[-1])
    return all(least)


def values_at(tape: Tape, refs: Sequence[Ref], blocks: Mapping[str, Array]) -> Array:
    """Return the values (n,) of references at input blocks; values are not finite in singular states."""
    with np.errstate(all="ignore"):
        return evaluate(tape, refs, blocks)
