"""Runs of generalized-alpha and kin made linear: matrices of the linearised steps between rows of a run, and the
start."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.integrators.families.family import LinearStep
from eomgen.lie.product import difference
from eomgen.products.derivatives.equations import StepEquations, rows_of
from eomgen.products.derivatives.linear_run import (
    DerivativeVariables,
    LinearPart,
    LinearRun,
    PartType,
    Start,
    undefined_derivatives,
)
from eomgen.products.derivatives.linear_steps import LinearSteps, StepMatrices, reactions, turning
from eomgen.products.derivatives.motion import ReplayedRun, RunSegment
from eomgen.products.derivatives.start import LinearizedStart, StateDirections, on_constraints
from eomgen.simulation.stepping.states import States, states_of


def step_matrices(
    equations: StepEquations,
    blocks: Mapping[str, Array],
    before: States,
    after: States,
    values: Mapping[str, Array],
    a: Array,
    coefficients: Sequence[Any],
    inverse_inertia: Array,
    B: Array | None = None,
) -> tuple[StepMatrices, Array]:
    """Return the matrices of n steps, and eta, (n, holonomic).

    Parameters
    ----------
    blocks : partials of the equations at the ends of the steps, of ``StepEquations.blocks``
    before, after : states at the starts and at the ends
    values : input blocks at the starts
    coefficients : the size of steps may be (n, 1)
    a : (n, nv) algorithmic accelerations at the starts; or (nv,) at the start of the first of consecutive steps
    inverse_inertia : (nv,) or (n, nv), W, by which multipliers of velocities move positions; empty if there are none
    B : of the constraints at the starts, if known
    """
    factors, count, nv, nh = equations.model.factors, len(before.t), equations.nv, equations.holonomic
    theta = difference(factors, before.q, after.q)
    matrices = dict(zip(("A", "T"), turning(factors, theta), strict=True)) | _equation_blocks(
        equations, blocks, nh if inverse_inertia.size else 0
    )
    if not (nh and inverse_inertia.size):
        none = {name: np.zeros((count, 0, 0)) for name in ("G", "N", "Np")}
        return matrices | none | {"reaction": np.zeros((count, 0))}, np.zeros((count, 0))
    if B is None:
        B = equations.of("constraint_jacobian", values)["B"]
    moved = _predicted_exponents(before, after, a, coefficients) - theta / coefficients[0]  # W B^T eta
    G, eta, reaction = reactions(B[:, :nh], inverse_inertia, moved)
    N, Np = equations.reaction_partials(values, eta)
    W = np.broadcast_to(inverse_inertia, (count, nv))[:, :, np.newaxis]
    N = np.multiply(N, W, out=N if N.flags.writeable else None)
    if any(Np.strides):
        Np = W * Np
    return matrices | {"G": G, "N": N, "Np": Np, "reaction": reaction}, eta


def _equation_blocks(equations: StepEquations, blocks: Mapping[str, Array], held: int) -> dict[str, Array]:
    """Return the matrices of steps from partials of the equations. With ``held`` 0 (index 3) the constraints on
    positions stand in place of their rates."""
    e, nh = blocks, equations.holonomic
    of_rates = {"Zq": e["Z"], "Zv": e["B"], "Zp": e["Zp"]}
    if held < nh:
        pairs = {"Zq": (e["B"], e["Z"]), "Zv": (np.zeros_like(e["B"]), e["B"]), "Zp": (e["Hp"], e["Zp"])}
        of_rates = {
            name: np.concatenate([holonomic[:, :nh], nonholonomic[:, nh:]], axis=1)
            for name, (holonomic, nonholonomic) in pairs.items()
        }
    of_residual = {name: e[name] for name in ("Rq", "Rv", "Ra", "Rz", "Rp")}
    internal = {name: -e[name] if equations.nz else e[name] for name in ("Fq", "Fv", "Fz", "Fp")}
    return of_residual | internal | of_rates | {"L": e["B"], "Hq": e["B"][:, :held], "Hp": e["Hp"][:, :held]}


def _predicted_exponents(before: States, after: States, a: Array, coefficients: Sequence[Any]) -> Array:
    """Return v + h ((1/2 - beta) a + beta a') of n steps, (n, nv), with algorithmic accelerations a and a'. `a` is (n,
    nv), or (nv,) at the start of the first of consecutive steps."""
    h, alpha_m, alpha_f, beta = coefficients[:4]
    weighted = (1.0 - alpha_f) * after.a + alpha_f * before.a
    if a.ndim == 1:
        a = np.concatenate([a[np.newaxis], weighted[:-1] / (1.0 - alpha_m)])
        share, behind = -alpha_m / (1.0 - alpha_m), 1
        while behind < len(a) and share:  # a prefix sum in doubling strides (Hillis and Steele 1986)
            a[behind:] = a[behind:] + share * a[:-behind]
            share, behind = share * share, 2 * behind
    reached = (weighted - alpha_m * a) / (1.0 - alpha_m)
    result: Array = before.v + h * ((0.5 - beta) * a + beta * reached)
    return result


@dataclass(frozen=True)
class AlphaPart(LinearPart):
    """A part of a run made linear.

    Attributes
    ----------
    matrices : of the steps between rows
    eta : (rows - 1, holonomic), multipliers of velocities in the steps
    """

    matrices: StepMatrices
    eta: Array


class StartedRun(LinearRun[PartType]):
    """A run of generalized-alpha with a linearised start.

    Attributes
    ----------
    along : changes of the start along the directions, on the constraints
    stages : the states with accelerations evaluated at the start, with the changes of these states
    inverse_inertia : W = 1/M_ii of the start, by which multipliers move positions; empty if there is none
    """

    def __init__(self, motion: ReplayedRun, start: Start, by: DerivativeVariables, rows: Sequence[int]) -> None:
        """Make the start of a run linear, with the tangents of the first row along the asked directions."""
        super().__init__(motion, start, by, rows)
        model, begun, method = self.run.model, motion.start, self.run.method.linear_step
        assert isinstance(method, LinearStep)  # for mypy
        self.coefficients = (self.run.grid.step, *method)
        holonomic = self.equations.holonomic
        self.inverse_inertia = begun.get("inverse_inertia", np.zeros(0)) if holonomic else np.zeros(0)
        eta = holonomic if self.inverse_inertia.size else 0
        self.linear = LinearSteps(model.functions.sizes, model.factors, self.coefficients, eta)
        first = self.equations.nv + self.equations.nz + holonomic
        #: Equations of a step among all: index 3 is without the rates of the constraints on positions.
        self.kept = np.delete(np.arange(first + self.equations.nl), slice(first, first + holonomic - eta))
        self.along = (
            on_constraints(self.beginning, self.asked, self.inverse_inertia) if model.multipliers else self.asked
        )
        self.stages = self.beginning.stages(self.equation_directions(self.along))
        self.state, self.record = self.beginning.tangents(self.equation_directions(self.along), self.stages)

    @cached_property
    def beginning(self) -> LinearizedStart:
        """The start of the run."""
        start, (_, alpha_m, alpha_f, *_) = self.motion.start, self.coefficients
        share = alpha_m - alpha_f if np.any(start["a"] != start["vdot"]) else 0.0
        return LinearizedStart(self, share)

    def equation_directions(self, along: StateDirections) -> StateDirections:
        """Return directions without motions of multipliers of velocities, which are not in the equations."""
        return StateDirections(along.dq, along.dv, along.dz, along.dp[: self.equations.parameters])


class AlphaRun(StartedRun[AlphaPart]):
    """A run of generalized-alpha without jumps, with linearised steps and start."""

    def linearise_part(self, part: RunSegment) -> AlphaPart:
        """Return a part of the run made linear. Raises NumericalError if partials are not finite."""
        states = states_of(part.rows, self.run.model)
        blocks = self.blocks(states, self.prescribe(states.t))
        both = self.equations.blocks(blocks)
        ends = rows_of(both, slice(1, None))
        finite = np.isfinite(ends["Rq"]).all(axis=(1, 2)) & np.isfinite(ends["Rv"]).all(axis=(1, 2))
        if not finite.all():
            t = float(states.t[1:][int(np.argmin(finite))])
            raise undefined_derivatives(self.run.model, f"at t = {t:.6g} s")
        before, after = States(*(array[:-1] for array in states)), States(*(array[1:] for array in states))
        step_data = part.memory, self.coefficients, self.inverse_inertia, both["B"][:-1]
        matrices, eta = step_matrices(self.equations, ends, before, after, rows_of(blocks, slice(None, -1)), *step_data)
        return AlphaPart(part.first, states, blocks, matrices, eta)

    def tangents(self, part: AlphaPart, dp: Array, state: Array) -> Array:
        return self.linear.tangents(part.matrices, dp, state, part.times)[0]

    def take_back(self, part: AlphaPart, direct: Array, state: Array, gradient: Array) -> tuple[Array, Array]:
        multipliers, ends = self.linear.adjoints(part.matrices, direct, state, gradient, part.times)
        rows = self.equations.rows
        if len(self.kept) == rows:
            return multipliers, ends
        whole = np.zeros((len(multipliers), rows, multipliers.shape[2]))
        whole[:, self.kept] = multipliers
        return whole, ends
