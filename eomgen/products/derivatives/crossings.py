"""Runs that pass a jump of the forces at a moment of their own: derivatives of steps lack the moment's motion.

A formula may jump when a coordinate passes a value, or with the sign of a velocity. Between two rows on different
sides of such a branch the place of the jump is found by bisection; if the equations differ just before and just after
it, and a direction of derivatives moves the argument there, derivatives of the run lack the part of the jump.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.rounding import COMPUTED, SUMMED, WRITTEN
from eomgen.errors import Problem, UsageError
from eomgen.formula.discontinuities import applications
from eomgen.formula.evaluate import comparisons, symbols
from eomgen.formula.nodes import Formula
from eomgen.lie import product
from eomgen.products.derivatives.equations import rows_of
from eomgen.products.derivatives.linear_run import LinearRun

if TYPE_CHECKING:
    from eomgen.system.branches import Branches

#: Symbols of formulas that do not move with the motion.
_GIVEN = frozenset({"time", "parameter", "number", "place"})


class CrossedJump(UsageError):
    """The run passes a jump of the forces at a moment that moves."""


class BranchCrossing(NamedTuple):
    """A branch whose sides are passed in time order.

    Attributes
    ----------
    row : of the run, before the crossing
    branch : number of the branch
    before, after : input blocks of both rows, (size,) each
    change : of the argument between both
    """

    row: int
    branch: int
    before: Mapping[str, Array]
    after: Mapping[str, Array]
    change: float


def check_crossings(run: LinearRun[Any], names: Sequence[str]) -> None:
    """Raise CrossedJump if a run passes a jump of the forces at a moment that directions move.

    Parameters
    ----------
    names : of the directions
    """
    model = run.run.model
    if model.branches is None or not any(map(_decided_by_motion, model.description.formulas)):
        return
    branches = model.branches()
    if not branches.branches:
        return
    jumps = [crossing for crossing in _crossings(run, branches) if _jumps(branches, crossing)]
    for crossing, shifts in zip(jumps, _shifts(run, branches, jumps), strict=True):
        if shifts.max(initial=0.0) > 1e-5:  # of a step
            t, moved = float(crossing.after["t"][0]), names[int(np.argmax(shifts))]
            by = branches.branches[crossing.branch].description
            lost = "which is in no derivative of the steps"
            fault = f"forces jump near t = {t:.6g} s by {by}, at a moment that {moved} moves, {lost} [E0571]"
            if crossing.change == 0.0:
                stays = f"the run stays at a jump of the forces by {by}, near t = {t:.6g} s"
                fault = f"{stays}, and {moved} moves it off, {lost} [E0572]"
            hint = "a smooth law in its place, tanh(x/0.01) for sign(x), or a run that does not come there"
            raise CrossedJump(Problem("sensitivities", fault, hint))


def _decided_by_motion(formula: Formula) -> bool:
    """Return whether a formula takes another value at once when a moving argument passes a number."""
    curves = applications(formula)
    jumping = [item.argument for item in curves if any(order <= 0 for _, order in item.curve.kinks())]
    decided = [*comparisons(formula), *jumping]
    return any(symbol.kind not in _GIVEN for formula in decided for symbol in symbols(formula))


def _crossings(run: LinearRun[Any], branches: Branches) -> list[BranchCrossing]:
    """Return the first 64 crossings in time: rows after which a branch changes side, or at which the state rests on it.
    Branches that depend on time and parameters alone are left out."""
    result: list[BranchCrossing] = []
    moving = [{symbol.block for symbol in branch.symbols} - {"t", "p"} for branch in branches.branches]
    for part in run.motion.forwards():
        rows, first, last = run.without_jumps(part)
        before, after = _tape_blocks(first), _tape_blocks(last)
        arguments = branches.arguments(before), branches.arguments(after)
        changed = branches.sides(arguments[0]) != branches.sides(arguments[1])
        changed |= (arguments[0] == 0.0) & (arguments[1] == 0.0)
        if part.first == 0:  # a start on a branch that the state leaves
            changed[0] &= (arguments[0][0] != 0.0) | (arguments[1][0] == 0.0)
        for k, branch in np.argwhere(changed).tolist():
            if moving[branch]:
                change = float(arguments[1][k, branch] - arguments[0][k, branch])
                row = part.first + int(rows[k])
                result.append(BranchCrossing(row, branch, rows_of(before, k), rows_of(after, k), change))
        if len(result) >= 64:
            break
    return result[:64]


def _jumps(branches: Branches, crossing: BranchCrossing) -> bool:
    """Return whether the equations differ on both sides of a branch, at the crossing found by bisection between rows.
    The two compared states are a part COMPUTED of the step away from it, since curves take arguments within rounding of
    a jump for the jump."""
    if crossing.change == 0.0:
        pair = [_aside(crossing.before, sign) for sign in (-1.0, 1.0)]
    else:
        low, high = 0.0, 1.0
        side = branches.sides(branches.arguments(crossing.before))[0, crossing.branch]
        while high - low > np.finfo(float).epsneg:
            middle = 0.5 * (low + high)
            there = branches.sides(branches.arguments(_between(crossing, middle)))[0, crossing.branch]
            low, high = (middle, high) if there == side else (low, middle)
        pair = [_between(crossing, max(low - COMPUTED, 0.0)), _between(crossing, min(high + COMPUTED, 1.0))]
    first, last = (branches.equations(values)[0] for values in pair)
    still = {name: 0.0 * array if name in ("a", "lam") else array for name, array in pair[0].items()}
    forces = np.abs(branches.equations(still)[0])
    return bool(np.any(np.abs(last - first) > WRITTEN * forces + SUMMED * forces.max(initial=0.0)))


def _shifts(run: LinearRun[Any], branches: Branches, jumps: Sequence[BranchCrossing]) -> Iterator[Array]:
    """Yield the shifts (directions,) of each jump's moment, in steps, if a direction changes by its full value.
    Parameters count by their values, other directions by 1."""
    if not jumps:
        return
    tangents = _tangents_at(run, {row for crossing in jumps for row in (crossing.row, crossing.row + 1)})
    p, chosen = run.equations.p, list(run.columns["p"])
    sizes = np.ones(run.size)
    sizes[: len(chosen)] = np.where(p[chosen] != 0.0, np.abs(p[chosen]), 1.0)
    for crossing in jumps:
        rates = np.zeros(run.size)
        for row, values in ((crossing.row, crossing.before), (crossing.row + 1, crossing.after)):
            for number in range(run.size):
                step = 1e-6 / max(1.0, float(np.max(np.abs(tangents[row][:, number]), initial=0.0)))
                pair = [
                    branches.arguments(_along(run, values, tangents[row][:, number], number, sign * step))
                    for sign in (-1.0, 1.0)
                ]
                rate = abs(float(pair[1][0, crossing.branch] - pair[0][0, crossing.branch])) / (2.0 * step)
                rates[number] = max(rates[number], rate)
        yield rates * sizes / max(abs(crossing.change), np.finfo(float).tiny)


def _tangents_at(run: LinearRun[Any], rows: set[int]) -> dict[int, Array]:
    """Return tangents (record, directions) at rows of a run."""
    state, result = run.state.copy(), {0: run.record}
    for part in map(run.linearise_part, run.motion.forwards()):
        record = run.tangents(part, run.along.dp, state)
        result |= {row: record[row - part.first - 1] for row in rows if 0 < row - part.first <= len(record)}
        if all(row in result for row in rows):
            break
    return result


def _along(
    run: LinearRun[Any], values: Mapping[str, Array], tangent: Array, direction: int, step: float
) -> dict[str, Array]:
    """Return the input blocks of a row, moved by `step` along a tangent (record,) and the parameters of direction
    number `direction`."""
    equations = run.equations
    model, nv, nz = equations.model, equations.nv, equations.nz
    dq, dv, da, dz, dlam = np.split(step * tangent, np.cumsum([nv, nv, nv, nz]))
    moved = {"q": product.update(model.factors, values["q"], dq)}
    if len(moved["q"]) < len(values["q"]):  # references of angles after the factors
        moved["q"] = np.concatenate([moved["q"], values["q"][len(moved["q"]) :]])
    for name, change in {"v": dv, "a": da, "z": dz, "lam": dlam}.items():
        moved[name] = values[name] + change
    dp = step * run.along.dp[: equations.parameters, direction]
    p, count = equations.p.copy(), len(equations.chosen)
    p[equations.chosen] += dp[:count]
    moved["p"] = p
    if "u" in values:
        u, followed = values["u"].copy(), model.input_values(float(values["t"][0]), parameters=p)
        follows_formula = [item.name not in run.run.signals.given for item in model.description.inputs]
        u[follows_formula] = np.asarray(followed)[follows_formula]
        if equations.driven:
            u += values["du"] @ dp[count:]
        moved["u"] = u
    return {**values, **moved}


def _tape_blocks(blocks: Mapping[str, Array]) -> dict[str, Array]:
    """Return input blocks with times as blocks of size 1."""
    return {name: array[:, np.newaxis] if name == "t" else array for name, array in blocks.items()}


def _between(crossing: BranchCrossing, share: float) -> dict[str, Array]:
    """Return input blocks on the line between both rows."""
    ends = ((name, array, crossing.after[name]) for name, array in crossing.before.items())
    return {name: array if name == "p" else array + share * (end - array) for name, array, end in ends}


def _aside(values: Mapping[str, Array], sign: float) -> dict[str, Array]:
    """Return input blocks with q, v and z moved by a small random amount, the same for each call, times `sign`."""
    draws = np.random.default_rng(0)
    moved = dict(values)
    for name in (name for name in values if name in ("q", "v", "z")):
        array = values[name]
        moved[name] = array + sign * COMPUTED * (1.0 + np.abs(array)) * draws.standard_normal(array.shape)
    return moved
