"""Operations of steps on values with first derivatives, in all steps of a part of a run side by side.

With U the unknowns, y state and parameters, G(U, y) = 0 the equations and E the end of the step,

    dE/dy = E_y - E_U G_U^-1 G_y.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.lie import numeric, product
from eomgen.lie.groups import group_named
from eomgen.lie.kernels import tangent_along
from eomgen.products.derivatives.equations import EquationPartials, rows_of, solve
from eomgen.products.derivatives.linear_run import LinearRun
from eomgen.products.derivatives.momenta import momenta
from eomgen.products.derivatives.motion import RunSegment
from eomgen.products.derivatives.steps import StepOperations, StepTerm
from eomgen.simulation.stepping.states import PrescribedInputs, States
from eomgen.solvers.regular_inertia import regular_inertia

#: Derivatives in some variables: a matrix for each step, or a multiple of the unit matrix.
Block = Array | float


@dataclass(frozen=True)
class Moved:
    """Values (n, size), and their derivatives in variables by name; of configurations left-trivialised."""

    value: Array
    along: Mapping[str, Block]

    def part(self, start: int, size: int) -> Moved:
        """Return some of the values, whose derivatives are matrices."""
        rows = slice(start, start + size)
        return Moved(self.value[:, rows], {name: _dense(block)[:, rows] for name, block in self.along.items()})


@dataclass(frozen=True)
class Instant(Moved):
    """Times (n, 1), with the inputs and the base then."""

    prescribed: PrescribedInputs


def multiply(factor: Block, block: Block) -> Block:
    """Return the product of two matrices, of which each may be a multiple of the unit matrix."""
    if isinstance(factor, float) or isinstance(block, float):
        return block if isinstance(factor, float) and factor == 1.0 else factor * block
    return factor @ block


def add(*terms: tuple[Block, Moved]) -> dict[str, Block]:
    """Return the derivatives of a sum of values times matrices."""
    total: dict[str, Block] = {}
    for factor, moved in terms:
        for name, block in moved.along.items():
            known, more = total.get(name), multiply(factor, block)
            if known is None:
                total[name] = more
            elif isinstance(known, float) == isinstance(more, float):
                total[name] = known + more
            else:
                size = (np.shape(known) or np.shape(more))[-1]
                total[name] = _dense(known, size) + _dense(more, size)
    return total


def _dense(block: Block, size: int = 1) -> Array:
    """Return matrices, of a multiple of the unit matrix with its size."""
    return block * np.eye(size) if isinstance(block, float) else block


@dataclass(frozen=True)
class StepEnds:
    """States at both ends of n consecutive steps, with partials at the n + 1 rows.

    Attributes
    ----------
    before, after : states
    at_start, at_end : inputs and base
    blocks : input blocks at the rows
    partials : of e at the rows
    forced : (n + 1, nv + nl, 2 nv + nz + parameters), changes of vdot and multipliers of the rows
    """

    before: States
    after: States
    at_start: PrescribedInputs
    at_end: PrescribedInputs
    blocks: dict[str, Array]
    partials: EquationPartials
    forced: Array


class LinearOperations(StepOperations[Moved]):
    """A step of a method in all steps of a part of a run side by side, with derivatives.

    Parameters
    ----------
    run : LinearRun
    part : of the run
    ends : states at both ends of the steps, with partials
    unknowns : values (n, size) of unknowns in the run, by name
    """

    def __init__(self, run: LinearRun[Any], part: RunSegment, ends: StepEnds, unknowns: Mapping[str, Array]) -> None:
        self.run, self.ends, self.of, self.factors = run, ends, run.equations, run.equations.model.factors
        self.memory, self.h, before = part.memory, run.run.grid.step, ends.before
        self.nv, self.nz, self.nl, self.count = run.equations.nv, run.equations.nz, run.equations.nl, len(before.t)
        self.sizes = {"q": self.nv, "v": self.nv, "z": self.nz, "p": run.equations.parameters}
        self.q, self.v, self.z = (Moved(getattr(before, name), {name: 1.0}) for name in "qvz")
        self.p, self.start = Moved(np.zeros((self.count, 0)), {"p": 1.0}), Instant(before.t, {}, ends.at_start)
        self.unknowns = {name: Moved(value, {name: 1.0}) for name, value in unknowns.items()}
        self.equations: list[Moved] = []
        self._turns = any(factor.group != "R" for factor in self.factors)
        self._last: tuple[Moved, Moved, dict[str, Array], EquationPartials] | None = None

    def sum(self, *terms: StepTerm[Moved]) -> Moved:
        factors = [term.factor * self.h**term.power for term in terms]
        moved = list(zip(factors, (term.value for term in terms), strict=True))
        return Moved(np.asarray(sum(factor * term.value for factor, term in moved)), add(*moved))

    def time(self, share: float) -> Instant:
        ends = self.ends
        if share == 1.0:
            return Instant(ends.after.t, {}, ends.at_end)
        t = ends.before.t + share * self.h
        return Instant(t, {}, self.run.prescribe(t)) if share else self.start

    def update(self, q: Moved, increment: Moved) -> Moved:
        theta = increment.value
        A, T = (f(self.factors, theta) for f in (product.transport, product.tangent)) if self._turns else (1.0, 1.0)
        return Moved(product.update(self.factors, q.value, theta), add((A, q), (T, increment)))

    def increment_rate(self, increment: Moved, v: Moved) -> Moved:
        if not self._turns:
            return v
        ad_theta, ad_v = (product.bracket_matrix(self.factors, moved.value) for moved in (increment, v))
        first = ad_theta @ v.value[:, :, np.newaxis]
        by_theta = -0.5 * ad_v - (ad_theta @ ad_v + product.bracket_matrix(self.factors, first[:, :, 0])) / 12.0
        by_v = np.eye(self.nv) + 0.5 * ad_theta + ad_theta @ ad_theta / 12.0
        return Moved((by_v @ v.value[:, :, np.newaxis])[:, :, 0], add((by_theta, increment), (by_v, v)))

    def cotangent(self, increment: Moved, momentum: Moved) -> Moved:
        if not self._turns:
            return momentum
        C = np.broadcast_to(np.eye(self.nv), (self.count, self.nv, self.nv)).copy()
        along = np.zeros_like(C)
        for factor in self.factors:
            if factor.group == "R":
                continue
            group, part, theta = group_named(factor.group, factor.v_size), factor.v, increment.value[:, factor.v]
            C[:, part, part] = np.swapaxes(numeric.tangent_inverse(group, theta), 1, 2)
            for k, unit in enumerate(np.eye(factor.v_size)):
                change = tangent_along(group, theta, unit, inverse=True)
                along[:, part, part.start + k] = np.einsum("nji,nj->ni", change, momentum.value[:, part])
        value = (C @ momentum.value[:, :, np.newaxis])[:, :, 0]
        return Moved(value, add((C, momentum), (along, increment)))

    def call(self, name: str, **state: Moved) -> Moved:
        nv, nz, nh = self.nv, self.nz, self.of.holonomic
        q, v, z, t = state["q"], state["v"], state.get("z", self.z), state.get("t", self.start)
        assert isinstance(t, Instant)  # for mypy
        if name == "momenta":
            return self._chain_rule(*momenta(self.of, self.blocks(q.value, v.value, z.value, t)), (q, v, z))
        values, e = self._evaluate(q, v, z, t)
        if name == "forward_dynamics":
            forced = self.ends.forced[:-1] if q is self.q and v is self.v else self.of.forced_changes(values, e)
            return self._chain_rule(values["a"], forced[:, :nv], (q, v, z))
        rows = {
            "internal_rate": slice(nv, nv + nz),
            "constraint": slice(nv + nz, nv + nz + nh),
            "constraint_velocity": slice(nv + nz + nh, None),
        }[name]
        J = e.by_variables[:, rows]
        if name == "internal_rate":
            return self._chain_rule(self.of.of(name, values)["zdot"], -J, (q, v, z))
        return self._chain_rule(np.zeros(J.shape[:2]), J, (q, v, z))  # only the derivatives are needed

    def blocks(self, q: Array, v: Array, z: Array, t: Instant) -> dict[str, Array]:
        """Return input blocks at states, with zeros for accelerations and multipliers."""
        none = np.zeros((self.count, self.nv)), np.zeros((self.count, self.nl))
        return self.run.blocks(States(t.value, q, v, *none, z), t.prescribed)

    def _evaluate(self, q: Moved, v: Moved, z: Moved, t: Instant) -> tuple[dict[str, Array], EquationPartials]:
        """Return input blocks and partials of the equations at states. Rows of the run have their own at both ends."""
        if self._last is not None and self._last[0] is q and self._last[1] is v:
            return self._last[2:]
        ends, at_start = self.ends, q is self.q and v is self.v
        if at_start or v is self.unknowns.get("v_next"):
            rows = slice(None, -1) if at_start else slice(1, None)
            values = rows_of(ends.blocks, rows)
            partials = EquationPartials(*(block[rows] for block in vars(ends.partials).values()))
        else:
            values = self.blocks(q.value, v.value, z.value, t)
            if not self.unknowns:
                values = self.of.with_accelerations(values)
            partials = self.of.partials(values)
        self._last = q, v, values, partials
        return values, partials

    def _chain_rule(self, value: Array, J: Array, arguments: Sequence[Moved]) -> Moved:
        """Return values with the derivatives J (n, size, ...) in q, v, z and the parameters."""
        blocks = np.split(J, np.cumsum([self.nv, self.nv, self.nz]), axis=2)
        return Moved(value, add(*zip(blocks, (*arguments, self.p), strict=True)))

    def balance(self, state: Mapping[str, Moved], impulse: Moved, *terms: StepTerm[Moved]) -> None:
        total, e = self.sum(*terms), self.ends.partials
        along = total.along
        if self.nl:  # impulses follow from the other terms
            at = slice(None, -1) if state["q"] is self.q else slice(1, None)
            B = e.Jv[at, -self.nl :]
            inertia = regular_inertia(e.Ja[at, : self.nv], B, np.ones(self.nv))
            by_inertia = np.linalg.solve(inertia, np.swapaxes(B, 1, 2))
            pushed = np.swapaxes(by_inertia, 1, 2) @ total.value[:, :, np.newaxis]
            impulses = solve(B @ by_inertia, pushed, self.ends.after.t)[:, :, 0]
            N, Np = self.of.reaction_partials(rows_of(self.ends.blocks, at), impulses)
            along = add((1.0, total), (N, state["q"]), (Np, self.p), (np.swapaxes(B, 1, 2), impulse))
        self.equations.append(Moved(total.value, along))

    def ends_with(self, q: Moved, v: Moved, z: Moved) -> None:
        self.end = q, v, z

    def transitions(self) -> Array:
        """Return the derivatives of q, v and z at the ends of the steps, (n, state, state and parameters)."""
        sizes = {name: moved.value.shape[1] for name, moved in self.unknowns.items()}
        end = [(moved.along, size) for moved, size in zip(self.end, (self.nv, self.nv, self.nz), strict=True)]
        result = self._matrix(end, self.sizes)
        if not sizes:
            return result
        equations = [(moved.along, moved.value.shape[1]) for moved in self.equations]
        right = self._matrix(equations, self.sizes)
        return result + self._matrix(end, sizes) @ solve(self._matrix(equations, sizes), right, self.ends.after.t)

    def _matrix(self, rows: Sequence[tuple[Mapping[str, Block], int]], columns: Mapping[str, int]) -> Array:
        """Return derivatives with their heights as one matrix for each step, with the variables ``columns``."""
        result, row = np.zeros((self.count, sum(size for _, size in rows), sum(columns.values()))), 0
        for along, height in rows:
            column = 0
            for name, width in columns.items():
                if name in along:
                    result[:, row : row + height, column : column + width] = _dense(along[name], width)
                column += width
            row += height
        return result
