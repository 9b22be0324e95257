"""Derivatives by a ladder of central differences, each entry with its own error bar, and by complex steps; bounds of
rounding errors, and kinks that invalidate differences.

The bar of an entry is the change of the difference between neighbouring steps, plus round-off divided by the step.
Round-off is measured by the scatter at the smallest steps, and is the last place of the function's largest number at
least. So cancellation inside the functions widens the bars by itself, and so does truncation at too large steps
(Ridders 1982 estimates in this way, too). One-sided differences that do not meet as steps shrink show a kink.

Differences at steps that agree with one another, but not with differences at smaller steps, have stepped across a
feature of the function and do not count. Derivatives of laws in files, if differences, are known to the relative step.

Exact comparisons (complex steps, second derivations) may differ by 1e-11 of the largest entry of its row or
column, if that is smaller, by 1e-13 of the largest entry of its state and of the differentiated function, which may
cancel along a direction, and by 100 times the effect of rounding of the
arguments on the closed form: that is measured, and is the condition. Terms of a complex step may cancel to a closed
form without terms, 0 for instance: of entries that differ by more, the effect on the complex step counts, too.
Comparisons with differences may differ by 1e-7 and 1e-9 besides, and by 10 error bars.

At kinks and jumps, a derivative on one side is the common value of complex steps and the closed form there, and these
must agree; if operands of a choice are equal, or a derivative is unbounded, each may take a side: the closed form must
then lie between the derivatives on both sides, or agree with differences.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, SupportsIndex

import numpy as np

from eomgen.base.data import dataclass, replace
from eomgen.base.messages import first_of
from eomgen.products.studies.verification.claims.claim import (
    COLUMNS,
    COMPLEX_STEP,
    Array,
    Blocks,
    Claim,
    Engine,
    move_state,
    spread,
)
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.external import Call
from eomgen.symbolic.operations import Op
from eomgen.symbolic.tape import Ref
from eomgen.system.system import System

#: Steps, largest first, in the units of the directions.
LADDER = 10.0 ** (-0.5 * np.arange(23))
#: From here on steps are so small that differences scatter by round-off only.
_SCATTER = int(np.flatnonzero(LADDER < 5e-8)[0])


@dataclass(frozen=True)
class ClaimAtStates:
    """A claim (a closed form and its derivation by differentiation) at S states.

    Attributes
    ----------
    engine, tape : the compiled functions, and functions that take complex numbers
    state, names : blocks of the states by name, (S, size) each, and the name of each state
    """

    claim: Claim
    engine: Engine
    tape: Engine
    state: Blocks
    names: tuple[str, ...] = ()

    def source(self, state: Blocks) -> Array:
        """Return the differentiated function of the claim at other states."""
        assert self.claim.source is not None  # for mypy: only claims that are compared with differences come here
        return self.claim.source(self.engine, state)

    @property
    def rates(self) -> dict[str, Array]:
        """The directions of differentiation."""
        assert self.claim.directions is not None  # as above
        return self.claim.directions(self.state)

    def one(self, number: SupportsIndex) -> dict[str, Array]:
        """Return the blocks of one state."""
        return {name: array[number] for name, array in self.state.items()}

    def combine(self, by_direction: Array) -> Array:
        """Return derivatives (..., count, n) in the form of the claim, (..., R, C)."""
        derivatives = np.swapaxes(by_direction, -1, -2)
        return self.claim.combine(self.engine, self.state, derivatives) if self.claim.combine else derivatives


@dataclass(frozen=True)
class Differences:
    """Finite differences of one closed form at states (S), entry by entry (R, C).

    Attributes
    ----------
    ladder : (K, S, R, C), by step; NaN if a state leaves the function's domain
    best : (S, R, C) the difference at the step of the smallest bar
    bar : (S, R, C) error bar of the best difference; infinite if no step gives a number
    step : (S, R, C) that step
    kink : (S, R, C) whether one-sided differences do not meet
    kink_step : (S, R, C) the step at which that was found
    """

    ladder: Array
    best: Array
    bar: Array
    step: Array
    kink: Array
    kink_step: Array


def differences(at: ClaimAtStates) -> Differences:
    """Return central differences of the claim's function at its states, each with the best step and an error bar. The
    ladder of steps, the bars and the search for kinks follow the description of this module."""
    (central, sided), floor = _difference_quotients(at), _ROUNDING * _source_size(at)  # smaller changes go unnoticed
    with np.errstate(all="ignore"):
        change = np.abs(np.diff(central, axis=0))
        scatter = np.nan_to_num(np.max(change[_SCATTER:] * _by_step(LADDER[_SCATTER + 1 :], change), axis=0), nan=0.0)
        between = np.maximum(change[:-1], change[1:])
        measured, least = (rounding / _by_step(LADDER[1:-1], between) for rounding in (scatter, floor))
    bars = between + measured + least
    # a step below rounding
    unnoticed = (central == 0.0) & np.maximum.accumulate(np.nan_to_num(np.abs(central)) > 0.0, axis=0)
    known = np.isfinite(bars) & np.isfinite(central[1:-1]) & ~unnoticed[1:-1]
    # by measured rounding alone: the last place of a large row would hide features of small rows
    finer = _as_finer(np.where(known, central[1:-1], 0.0), np.where(known, between + measured, np.inf))
    bars = np.where(known & finer, bars, np.inf)
    chosen = np.argmin(bars, axis=0)[np.newaxis]
    bar = np.take_along_axis(bars, chosen, axis=0)[0]
    best = np.take_along_axis(central, chosen + 1, axis=0)[0]
    kink, kink_step = _kinks(sided, scatter, np.max(np.abs(np.where(np.isfinite(best), best, 0.0)), initial=0.0))
    return Differences(central, best, bar, LADDER[1:-1][chosen[0]], kink, kink_step)


def _as_finer(value: Array, bars: Array) -> Array:
    """Return whether a difference (K, ...) agrees with the differences at all smaller steps, within the error bars;
    steps across a regularisation, as of dry friction, agree with each other only."""
    low, high = value - BARS * bars, value + BARS * bars
    before = np.full((1, *value.shape[1:]), np.inf)
    least = np.concatenate([np.minimum.accumulate(high[:0:-1], axis=0)[::-1], before])
    most = np.concatenate([np.maximum.accumulate(low[:0:-1], axis=0)[::-1], -before])
    return np.asarray((high >= most) & (low <= least))


def _by_step(steps: Array, like: Array) -> Array:
    return steps.reshape(-1, *(1,) * (like.ndim - 1))


def _kinks(sided: Array, scatter: Array, size: float) -> tuple[Array, Array]:
    """Return whether one-sided differences do not meet, (S, R, C), and the smallest step that shows the kink, (S, R,
    C). `sided` (2, K, S, R, C) are backward and forward differences by step, `scatter` (S, R, C) is the measured
    rounding of the function, `size` the largest derivative. Gaps are compared at steps by a factor of 100."""
    gap = np.abs(sided[1] - sided[0])
    noise = 40.0 * scatter / _by_step(LADDER, gap)
    telling = np.where(noise <= 1e-4 * max(size, 1e-300), np.arange(len(LADDER)).reshape(-1, *(1,) * scatter.ndim), -1)
    at = np.max(telling, axis=0)[np.newaxis]
    near, far = (np.take_along_axis(gap, np.maximum(at - apart, 0), axis=0)[0] for apart in (0, 4))
    kink = (at[0] >= 4) & (near > 1e-3 * size) & (near > 0.3 * far)
    return kink, LADDER[np.maximum(at[0], 0)]


def _difference_quotients(at: ClaimAtStates) -> tuple[Array, Array]:
    """Return central differences (K, S, R, C) at K steps, and backward and forward differences (2, K, S, R, C)."""
    rates, around = at.rates, spread(at.state)
    here = at.source(at.state)[..., np.newaxis, :]
    central, backward, forward = [], [], []
    with np.errstate(all="ignore"):
        for step in LADDER.tolist():
            above, below = (at.source(move_state(at.engine, around, rates, by)) for by in (step, -step))
            central.append(at.combine((above - below) / (2.0 * step)))
            backward.append(at.combine((here - below) / step))
            forward.append(at.combine((above - here) / step))
    return np.stack(central), np.stack([np.stack(backward), np.stack(forward)])


def complex_steps(at: ClaimAtStates, *, offset: float = 0.0) -> Array:
    """Return the derivatives of a claim's source by complex steps on the tape, (S, R, C), at a real offset from the
    states."""
    on_tape = replace(at, engine=at.tape)
    with np.errstate(all="ignore"):
        values = on_tape.source(move_state(at.tape, spread(at.state), at.rates, offset + 1j * COMPLEX_STEP))
        return at.combine(values.imag / COMPLEX_STEP)


def between_sides(at: ClaimAtStates, value: Array, sizes: EntrySizes) -> Array:
    """Return the entries (S, R, C) that lie between the derivatives on both sides of a state, or equal one of them."""
    sides = [complex_steps(at, offset=step) for step in (-_CLOSE, _CLOSE)]
    with np.errstate(all="ignore"):
        return np.asarray(
            (value >= np.minimum(*sides) - sizes.differences) & (value <= np.maximum(*sides) + sizes.differences)
        )


#: Error bars by which differences may be wrong.
BARS = 10.0
#: Rounding of an argument, in units of the last place.
_ROUNDING = 2.0 * float(np.finfo(float).eps)


@dataclass(frozen=True)
class EntrySizes:
    """Sizes by which errors of S states are judged: entries by row and column (1 or S, R, C), whole states (S, 1, 1),
    the differentiated function (S, 1, 1), and effects of rounded arguments (S, R, C).

    ``of_laws``: relative step of differences in laws, to which their derivatives are known; 0 without such laws.
    """

    entry: Array
    state: Array
    source: Array
    condition: Array
    of_laws: float = 0.0

    @property
    def exact(self) -> Array:
        """By how much two exact derivations may differ, as the module says."""
        known = 1e-13 * np.maximum(self.state, self.source)
        return np.asarray((1e-11 + self.of_laws) * self.entry + known + 100.0 * self.condition)

    @property
    def differences(self) -> Array:
        """The same of finite differences, but for their error bars."""
        return np.asarray(1e-7 * self.entry + 1e-9 * self.state + self.exact)


def sizes_of(at: ClaimAtStates, value: Array, rng: np.random.Generator) -> EntrySizes:
    largest = np.max(np.abs(value), axis=(-2, -1), initial=0.0)
    if at.claim.size is not None:
        largest = np.maximum(largest, at.claim.size(at.engine, at.state))
    largest = np.maximum(np.where(np.isfinite(largest), largest, 0.0), 1e-3 * np.max(largest, initial=0.0))
    whole = np.where(largest > 0.0, largest, 1.0)[:, np.newaxis, np.newaxis]
    if value.shape[-1] > 1:
        rows, columns = np.max(np.abs(value), axis=(0, 2)), np.max(np.abs(value), axis=(0, 1))
        entry = np.minimum(rows[:, np.newaxis], columns)[np.newaxis]
    else:
        entry = whole
    source = np.zeros(1) if at.claim.source is None or at.claim.combine is not None else _source_size(at)
    near = _perturbed_values(at, lambda perturbed: perturbed.claim.value(perturbed.engine, perturbed.state), rng)
    return EntrySizes(entry, whole, source, _effect_of_rounding(near, value, np.maximum(whole, source)))


def with_rounding_of_complex_steps(
    sizes: EntrySizes, at: ClaimAtStates, exact: Array, rng: np.random.Generator
) -> EntrySizes:
    """Return the sizes with the rounding of complex steps, whose terms may cancel to a closed form without terms."""
    whole = np.maximum(sizes.state, sizes.source)
    condition = _effect_of_rounding(_perturbed_values(at, complex_steps, rng), exact, whole)
    return replace(sizes, condition=np.maximum(sizes.condition, condition))


def _effect_of_rounding(near: Iterable[Array], here: Array, whole: Array) -> Array:
    """Return the largest change from the values `here` (S, R, C) to the values in `near`, for arguments changed by
    rounding. Changes above 1e-7 of `whole` take another branch at a kink, which is not rounding, and count as zero; the
    size of a derivative that is 0 is its rounding alone, and `whole` the size of the function."""
    effect = np.zeros(here.shape)
    with np.errstate(all="ignore"):
        for value in near:
            change = np.abs(value - here)
            effect = np.maximum(effect, np.where(np.isfinite(change), change, 0.0))
    return np.where(effect < 1e-7 * whole, effect, 0.0)


def _source_size(at: ClaimAtStates) -> Array:
    """Return the size of the differentiated function in each state, (S, 1, 1)."""
    with np.errstate(all="ignore"):
        source = np.abs(at.source(at.state))
    largest: Array = np.max(np.where(np.isfinite(source), source, 0.0), axis=-1, initial=0.0)
    return largest[:, np.newaxis, np.newaxis]


def _perturbed_values(
    at: ClaimAtStates, value: Callable[[ClaimAtStates], Array], rng: np.random.Generator
) -> Iterator[Array]:
    """Yield four times the result of `value` at the claim's states with all numbers changed at random by possible
    rounding."""
    reach = np.ones(at.state["v"].shape)
    for factor in at.engine.factors:
        if factor.group == "R":
            reach[..., factor.v] = np.maximum(np.abs(at.state["q"][..., factor.q]), 1.0)
    for _ in range(4):
        relative = {
            name: array * (1.0 + _ROUNDING * rng.uniform(-1.0, 1.0, array.shape))
            for name, array in at.state.items()
            if name != "q"
        }
        turned = move_state(at.engine, at.state, {"q": reach * rng.uniform(-1.0, 1.0, reach.shape)}, _ROUNDING)
        yield value(replace(at, state={**turned, **relative}))


#: Distance from a kink within which differences have no digits.
_CLOSE = 1e-8


class Remarks:
    """Remarks on a closed form, each with the names of the states to which it applies."""

    def __init__(self) -> None:
        self._states: dict[tuple[str, str], dict[str, None]] = {}

    def add(self, state: str, remark: str, of: str = "") -> None:
        """Note a remark at a state, and the formula at fault, if any."""
        self._states.setdefault((remark, of), {})[state] = None

    @property
    def texts(self) -> tuple[str, ...]:
        """One sentence for each remark with its states, and the first four formulas at fault in parentheses."""
        alike: dict[tuple[str, tuple[str, ...]], list[str]] = {}
        for (remark, of), where in self._states.items():
            alike.setdefault((remark, tuple(where)), []).append(of)
        texts = []
        for (remark, states), formulas in alike.items():
            named = f" ({first_of(formulas, 4)})" if formulas[0] else ""
            texts.append(f"{remark} at {', '.join(states)}{named}")
        return tuple(texts)


def non_smooth_entries(
    at: ClaimAtStates,
    operations: NonSmoothOperations,
    value: Array,
    finite: Array,
    by_differences: Differences,
    sizes: EntrySizes,
    remarks: Remarks,
) -> Array:
    """Return the entries (S, R, C) for which a nearby kink or jump of a formula explains that differences do not agree.
    Looked at are entries whose difference deviates, has no digits, or shows a kink. Each formula at fault is added to
    `remarks`, and so are differences without digits. `value` (S, R, C) is the closed form, `finite` whether it is
    finite."""
    with np.errstate(all="ignore"):
        off = np.abs(by_differences.best - value) > BARS * by_differences.bar + sizes.differences
    vague = finite & ~(by_differences.bar <= 1e-2 * sizes.state)
    odd = off | vague | by_differences.kink
    non_smooth = np.zeros(value.shape, bool)
    if not odd.any():
        return non_smooth
    rates = at.rates
    count = max(rate.shape[-2] for rate in rates.values())
    for k in np.flatnonzero(odd.any(axis=(-2, -1))):
        seen: dict[tuple[int, float], list[str]] = {}
        for row, column in np.argwhere(odd[k]):
            entry = (k, row, column)
            kink_step = by_differences.kink_step[entry] if by_differences.kink[entry] else _CLOSE
            step = float(by_differences.step[entry] if off[entry] else kink_step)
            decided: list[str] = []
            for direction in [int(column)] if at.claim.combine is None else range(count):
                if (direction, step) not in seen and len(seen) < COLUMNS:
                    seen[direction, step] = _changed_branches(at, operations, rates, k, direction, step)
                decided += seen.get((direction, step), [])
            non_smooth[entry] = bool(decided)
            for operation in decided:
                remarks.add(at.names[k], "not smooth", operation)
        if (vague[k] & ~non_smooth[k]).any():
            remarks.add(at.names[k], "differences have no digits")
    return non_smooth


def _changed_branches(
    at: ClaimAtStates, operations: NonSmoothOperations, rates: Blocks, k: SupportsIndex, direction: int, step: float
) -> list[str]:
    """Return the operations that take another branch a step before or after state number ``k``."""
    here = at.one(k)
    of_state = {name: rate[k] if rate.ndim == 3 else rate for name, rate in rates.items()}
    along = {name: rate[min(direction, len(rate) - 1)] for name, rate in of_state.items()}
    before, after = (move_state(at.engine, here, along, by) for by in (-step, step))
    return operations.decisions([before, here, after])


_BY_SIGN = {Op.ABS: "abs", Op.SIGN: "sign", Op.SELECT: "select"}
_BY_ORDER = {Op.MIN: "min", Op.MAX: "max", Op.LT: "comparison", Op.LE: "comparison"}  # a > b is b < a on the tape
_KINKS = _BY_SIGN | _BY_ORDER
#: Functions whose derivative is unbounded at some argument inside the domain or at its edge, and the distance from that
#: argument.
_UNBOUNDED: dict[Op, tuple[str, Callable[[Array, Array], Array]]] = {
    Op.SQRT: ("sqrt", lambda x, _: np.abs(x)),
    Op.POW: ("power", lambda x, _: np.abs(x)),
    Op.LOG: ("log", lambda x, _: np.abs(x)),
    Op.ASIN: ("asin", lambda x, _: np.abs(np.abs(x) - 1.0)),
    Op.ACOS: ("acos", lambda x, _: np.abs(np.abs(x) - 1.0)),
    Op.ATAN2: ("atan2", np.hypot),
    Op.DIV: ("division", lambda _, y: np.abs(y)),
}


@dataclass(frozen=True)
class NonSmoothOperations:
    """Operations with kinks, jumps or unbounded derivatives on the tape (the list of elementary operations) of a
    system. ``functions`` are the names of the functions whose operations count."""

    system: System
    functions: tuple[str, ...]

    def decisions(self, states: Sequence[Blocks]) -> list[str]:
        """Return the operations that take different branches at the given states, as texts such as ``abs in LABEL``.

        Curves are ``curve NAME in LABEL``; equal texts are listed once. A state exactly on an edge counts as a branch.

        Parameters
        ----------
        states : of mappings from block to array (size,)
        """
        nodes = [(node, op) for node, op in self._live() if op in _KINKS or op is Op.CURVE]
        values = [self._operands(nodes, state) for state in states]
        result: list[str] = []
        for number, (node, op) in enumerate(nodes):
            taken = {self._decision(node, op, operands[number]) for operands in values}
            if len(taken) > 1:
                result.append(
                    self._operation_name(f"curve {self._curve(node).name}" if op is Op.CURVE else _KINKS[op], node)
                )
        return list(dict.fromkeys(result))

    def step_of_laws(self) -> float:
        """Return the largest relative step of differences that give derivatives of laws in files; 0 without such
        laws."""
        orders = [0]
        for node, op in self._live():
            call = self.system.tape.maps[self.system.tape.a[node]] if op is Op.MAP else None
            if isinstance(call, Call):
                exact = bool(call.function.code.slopes) and not call.function.parameters
                orders.append(len(call.columns) + 1 - exact)
        return float(np.finfo(float).eps) ** (1.0 / (max(orders) + 2.0)) if max(orders) else 0.0

    def edges(self, state: Blocks) -> list[tuple[str, str]]:
        """Return pairs (remark, operation) for the operations that are exactly on an edge at a state. These are choices
        between equal operands, ``not smooth``, and functions with an unbounded derivative, ``unbounded derivative``."""
        nodes = [(node, op) for node, op in self._live() if op in _KINKS and op is not Op.SELECT]
        result = [
            ("not smooth", self._operation_name(_KINKS[op], node))
            for (node, op), operands in zip(nodes, self._operands(nodes, state), strict=True)
            if self._decision(node, op, operands) == 0.0
        ]
        return list(dict.fromkeys([*result, *(("unbounded derivative", text) for text in self.singular(state))]))

    def kinks_and_jumps(self) -> list[str]:
        """Return the operations that have a kink or jump somewhere, near a state or not, as text; without curves."""
        return list(dict.fromkeys(self._operation_name(_KINKS[op], node) for node, op in self._live() if op in _KINKS))

    def singular(self, state: Blocks) -> list[str]:
        """Return the functions whose derivative is unbounded at the argument in this state, as texts such as ``sqrt in
        LABEL``."""
        nodes = [(node, op) for node, op in self._live() if op in _UNBOUNDED]
        result = []
        for (node, op), operands in zip(nodes, self._operands(nodes, state), strict=True):
            name, distance = _UNBOUNDED[op]
            if not float(distance(operands[0], operands[-1])) > 1e-12:
                result.append(self._operation_name(name, node))
        return list(dict.fromkeys(result))

    def _operation_name(self, operation: str, node: int) -> str:
        return f"{operation} in {self.system.tape.label(node) or 'the scene'}"

    def _live(self) -> Iterator[tuple[int, Op]]:
        tape = self.system.tape
        refs = [ref for name in self.functions for ref in self.system.functions[name].refs]
        yield from ((node, tape.op[node]) for node in tape.live(refs))

    def _operands(self, nodes: Sequence[tuple[int, Op]], state: Blocks) -> list[Array]:
        """Return for each (node, operation) an array (2,) of the first and the last operand's value at a state. Of
        ``select`` both numbers are the condition, of a curve both are the argument."""
        tape, refs = self.system.tape, list[Ref]()
        for node, op in nodes:
            operands = (tape.a[node],) if op is Op.CURVE else tape.operands(node)
            refs += [operands[0], operands[0] if op is Op.SELECT else operands[-1]]
        if not refs:
            return []
        needed = {symbol.block for symbol in tape.depends_on(refs)} or {"q"}
        with np.errstate(all="ignore"):
            values = evaluate(tape, refs, {name: state[name] for name in needed})
        return list(values.reshape(-1, 2))

    def _curve(self, node: int) -> Any:
        tape = self.system.tape
        return tape.curves[tape.b[node]][0]

    def _decision(self, node: int, op: Op, operands: Array) -> float:
        """Return the branch that an operation takes."""
        if op is Op.CURVE:
            return float(np.searchsorted(np.asarray(self._curve(node).breaks), operands[0], side="right"))
        return float(np.sign(operands[0] if op in _BY_SIGN else operands[0] - operands[1]))
