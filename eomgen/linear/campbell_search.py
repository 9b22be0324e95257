"""The search for a Campbell diagram: modes followed over values of a parameter, and crossings with orders.

Modes are followed from speed to speed by their shapes and frequencies, so that curves cross as they do; crossings are
then found on the model itself (Brent 1973), not between the points of the diagram.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from scipy.optimize import brentq, linear_sum_assignment

from eomgen.base.arrays import Array
from eomgen.base.progress import Progress
from eomgen.errors import EomgenError, ModelError, NumericalError, Problem
from eomgen.linear.campbell import Campbell, Crossing
from eomgen.linear.linearization import Linearization

Complex = NDArray[np.complex128]
#: Relative accuracy of critical speeds.
_ACCURACY = 1e-12
#: An orbit with a ratio of axes below this is a line: it whirls in no sense.
_LINE = 1e-6
#: Eigenvalues that differ by less than this part are one of several modes.
_EQUAL = 1e-9
#: Modes that are more unlike than this are followed over a value between.
_UNLIKE = 0.5
#: So often an interval is halved for that.
_DEPTH = 4
#: Values that a diagram has at the least.
_FEWEST = 2
#: A number within a warning.
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


@dataclass(frozen=True)
class _Oscillations:
    """Oscillating modes at one value: eigenvalues (m,), weighted shapes of length one (rows, m), whirl (m,)."""

    eigenvalues: Complex
    shapes: Complex
    whirl: NDArray[np.int_]
    stability: str


class _Doubts:
    """Warnings of the linear models at many values; warnings with the same text are merged."""

    def __init__(self, parameter: str) -> None:
        self.parameter = parameter
        self.caught: dict[str, list[tuple[float, warnings.WarningMessage]]] = {}

    def add(self, value: float, caught: Sequence[warnings.WarningMessage]) -> None:
        """Keep the warnings at one value."""
        for item in caught:
            self.caught.setdefault(_NUMBER.sub("#", str(item.message)), []).append((value, item))

    def warn(self, stacklevel: int) -> None:
        """Warn once in the same words, with the range of values."""
        for kind in self.caught.values():
            at = sorted({value for value, _ in kind})
            among = f"at {len(at)} values of {self.parameter} from {at[0]:.6g} to {at[-1]:.6g}"
            first = f"at {self.parameter} = {kind[0][0]:.6g}"
            text = f"Campbell diagram: {among}, {first} for instance" if len(at) > 1 else f"Campbell diagram: {first}"
            warnings.warn(f"{text}: {kind[0][1].message}", kind[0][1].category, stacklevel=stacklevel)


def _alike(texts: Sequence[str]) -> list[list[str]]:
    """Return texts that differ in numbers alone, together."""
    kinds: dict[str, list[str]] = {}
    for text in texts:
        kinds.setdefault(_NUMBER.sub("#", text), []).append(text)
    return list(kinds.values())


def campbell(
    parameter: str,
    unit: str,
    values: Sequence[float],
    linearized: Callable[[float, Linearization | None], Linearization],
    orders: Sequence[float] = (),
    pairs: Sequence[tuple[str, str]] = (),
    report: Progress | None = None,
) -> Campbell:
    """Return the oscillations over values of a parameter.

    Parameters
    ----------
    linearized : callable
        From a value, and the linear model at the value before it, to the linear model there.
    orders : multiples of the values
    pairs : pairs of outputs or states that are deflections along two axes, the second a quarter turn from the first in
        the sense of the spin; whirl is the sense in which they orbit
    report : called with the part of the work that is done: half is for the values, half for crossings if there are
        orders

    Ctrl-C keeps the values and crossings found so far, if there are two values.

    Values at which there is no linear model are left out with a warning, as long as two are kept.

    Raises
    ------
    EomgenError
        Errors of ``linearized`` if the call is wrong, or if fewer than two values have a linear model: with the
        first value at which it did.
    """

    doubts = _Doubts(parameter)

    def at(value: float, before: Linearization | None) -> Linearization:
        try:
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always")
                model = linearized(value, before)
            doubts.add(value, caught)
            return model
        except EomgenError as error:
            problems = [
                Problem(f"at {parameter} = {value:.6g}: {p.where}".rstrip(": "), p.what, p.hint) for p in error.problems
            ]
            raise type(error)(problems) from None

    nodes: list[_Node] = []
    failures: dict[float, ModelError | NumericalError] = {}
    all_steps = (2 if orders else 1) * len(values)

    def look_at_values() -> None:
        for number, value in enumerate(map(float, values), 1):
            try:
                model = at(value, nodes[-1].model if nodes else None)
                node = _Node(value, model, _oscillations(model, pairs, value), wanted=True)
                nodes.extend([*_between(nodes[-1], node, at, pairs, _DEPTH), node] if nodes else [node])
            except (ModelError, NumericalError) as error:
                failures[value] = error
            if report is not None:
                report(number, all_steps)

    interrupted = False
    try:
        look_at_values()
    except KeyboardInterrupt:
        if sum(node.wanted for node in nodes) < _FEWEST:
            raise
        interrupted = True
    if failures and sum(node.wanted for node in nodes) < _FEWEST:
        raise next(iter(failures.values()))
    for kind in _alike([str(failure) for failure in failures.values()]):
        more = f", and {len(kind) - 1} more values for the same reason" if len(kind) > 1 else ""
        warnings.warn(f"Campbell diagram: left out: {kind[0]}{more}", RuntimeWarning, stacklevel=4)
    columns, count = _followed(nodes)
    oscillations = [node.oscillations for node in nodes]
    eigenvalues = np.full((len(oscillations), count), complex(np.nan, np.nan))
    whirl = np.zeros((len(oscillations), count), dtype=int)
    for row, (item, numbers) in enumerate(zip(oscillations, columns, strict=True)):
        eigenvalues[row, numbers], whirl[row, numbers] = item.eigenvalues, item.whirl
    order_of_modes = np.argsort([column[~np.isnan(column)][0].imag for column in eigenvalues.T], kind="stable")
    eigenvalues, whirl = eigenvalues[:, order_of_modes], whirl[:, order_of_modes]
    places = {int(old): new for new, old in enumerate(order_of_modes)}

    def crossing(order: float, row: int, number: int) -> Crossing | None:
        """Return the crossing between two values, found on the model itself."""
        ends = [(oscillations[place], columns[place].index(number)) for place in (row, row + 1)]
        last: dict[str, Any] = {}

        def excess(value: float) -> float:
            here = _oscillations(at(value, nodes[row].model), pairs, value)
            nearest = int(np.argmin(sum(_costs(end, here)[k] for end, k in ends)))
            last.update(value=value, eigenvalue=here.eigenvalues[nearest], whirl=here.whirl[nearest])
            return float(here.eigenvalues[nearest].imag - order * abs(value))

        low, high = nodes[row].value, nodes[row + 1].value
        try:
            if np.sign(excess(low)) == np.sign(excess(high)):
                return None  # another mode is nearer there
            speed = float(brentq(excess, low, high, xtol=_ACCURACY * max(abs(low), abs(high)), rtol=_ACCURACY))
            excess(speed)
        except (ModelError, NumericalError) as error:
            warnings.warn(f"Campbell diagram: a crossing with {order:g}x is left out: {error}", RuntimeWarning, 5)
            return None
        word = {1: "forward", -1: "backward"}.get(int(last["whirl"]), "")
        return Crossing(order, speed, float(last["eigenvalue"].imag), places[number], word)

    candidates: list[tuple[float, int, int]] = []
    for order in orders:
        for old, new in places.items():
            above = eigenvalues[:, new].imag - order * np.abs([node.value for node in nodes])
            with np.errstate(invalid="ignore"):
                changes = np.flatnonzero((above[1:] <= 0.0) != (above[:-1] <= 0.0))
            for place in changes.tolist():
                if not np.isnan(above[place : place + 2]).any():
                    candidates.append((float(order), place, old))
    crossings: list[Crossing | None] = []
    try:
        for number, candidate in enumerate(() if interrupted else candidates, 1):
            crossings.append(crossing(*candidate))
            if report is not None:
                report(len(values) + len(values) * number // len(candidates), all_steps)
    except KeyboardInterrupt:
        interrupted = True
    doubts.warn(stacklevel=5)
    kept = sorted((item for item in crossings if item is not None), key=lambda item: (item.order, item.speed))
    wanted = [row for row, node in enumerate(nodes) if node.wanted]
    given = np.array([nodes[row].value for row in wanted])
    stability = tuple(oscillations[row].stability for row in wanted)
    eigenvalues, whirl = eigenvalues[wanted], whirl[wanted]
    left_out = {value: str(failure) for value, failure in failures.items()}
    multiples = tuple(map(float, orders))
    return Campbell(
        parameter, unit, given, eigenvalues, whirl, multiples, tuple(kept), stability, left_out, interrupted
    )


def _oscillations(lin: Linearization, pairs: Sequence[tuple[str, str]], value: float) -> _Oscillations:
    modes = lin.modes()
    kept = np.flatnonzero(modes.oscillating)
    eigenvalues = modes.eigenvalues[kept]
    shapes = modes.weights[:, np.newaxis] * modes.shapes[:, kept]
    area, size = np.zeros(len(kept)), np.zeros(len(kept))
    if pairs:
        rows = lin.state_space().output_rows([name for pair in pairs for name in pair])
        deflections = rows @ modes.state_shapes[:, kept]
        for together in _multiple(eigenvalues, modes.uncertainty[kept]):
            turned = _circular(shapes[:, together], deflections[:, together])
            shapes[:, together], deflections[:, together] = (
                shapes[:, together] @ turned,
                deflections[:, together] @ turned,
            )
        first, second = deflections[::2], deflections[1::2]
        # x = cos t, y = sin t has the amplitudes 1 and -i
        area = -np.sum((first.conj() * second).imag, axis=0)
        size = np.sum(np.abs(first) ** 2 + np.abs(second) ** 2, axis=0)
    sense = np.where(np.abs(area) > _LINE * size, np.sign(area), 0.0) * np.sign(value)
    lengths = np.linalg.norm(shapes, axis=0)
    return _Oscillations(
        eigenvalues, shapes / np.where(lengths > 0.0, lengths, 1.0), sense.astype(int), modes.stability
    )


def _multiple(eigenvalues: Complex, uncertainty: Array) -> list[list[int]]:
    """Return the numbers of eigenvalues that are equal but for rounding, a list for each value of several modes."""
    groups: list[list[int]] = []
    for k, value in enumerate(eigenvalues):
        for group in groups:
            known = group[0]
            if abs(value - eigenvalues[known]) <= max(
                _EQUAL * abs(value), float(uncertainty[k]), float(uncertainty[known])
            ):
                group.append(k)
                break
        else:
            groups.append([k])
    return [group for group in groups if len(group) > 1]


def _circular(shapes: Complex, deflections: Complex) -> Complex:
    """Return combinations of modes of one eigenvalue, (m, m), with orbits of largest enclosed area in either sense.

    Any combination of them is a mode, and its sense is arbitrary: the diagonalisation of the form of the enclosed area
    in the measure of kinetic energy are the circular ones, if there are any, one in each sense.
    """
    first, second = deflections[::2], deflections[1::2]
    of_energy = shapes.conj().T @ shapes
    of_area = 0.5j * (first.conj().T @ second - second.conj().T @ first)
    try:
        return np.asarray(scipy.linalg.eigh(of_area, of_energy)[1])
    except np.linalg.LinAlgError:  # equal shapes, as of internal states
        return np.eye(shapes.shape[1], dtype=np.complex128)


@dataclass(frozen=True)
class _Node:
    """A value of the parameter with its model; unwanted values only help to follow modes."""

    value: float
    model: Linearization
    oscillations: _Oscillations
    wanted: bool


def _costs(before: _Oscillations, now: _Oscillations) -> Array:
    """Return the dissimilarity of modes (m,) before and (k,) now, (m, k): by shapes, frequencies and whirl."""
    likeness = np.abs(before.shapes.conj().T @ now.shapes) ** 2
    distance = np.abs(before.eigenvalues[:, np.newaxis] - now.eigenvalues)
    sizes = np.abs(before.eigenvalues)[:, np.newaxis] + np.abs(now.eigenvalues)
    opposite = before.whirl[:, np.newaxis] * now.whirl < 0
    return np.asarray((1.0 - likeness) + 4.0 * distance / sizes + opposite)


def _between(
    low: _Node,
    high: _Node,
    at: Callable[[float, Linearization | None], Linearization],
    pairs: Sequence[tuple[str, str]],
    depth: int,
) -> list[_Node]:
    """Return the nodes between two by which modes can be told apart; none if they are near enough, or if there is
    no linear model between them."""
    costs = _costs(low.oscillations, high.oscillations)
    rows, chosen = linear_sum_assignment(costs)
    if depth == 0 or np.all(costs[rows, chosen] < _UNLIKE):
        return []
    middle = 0.5 * (low.value + high.value)
    try:
        model = at(middle, low.model)
    except (ModelError, NumericalError):
        return []
    node = _Node(middle, model, _oscillations(model, pairs, middle), wanted=False)
    below = _between(low, node, at, pairs, depth - 1)
    return [*below, node, *_between(node, high, at, pairs, depth - 1)]


def _followed(nodes: Sequence[_Node]) -> tuple[list[list[int]], int]:
    """Return the columns of the modes of each node, and how many columns there are."""
    columns: list[list[int]] = []
    count = 0
    for place, node in enumerate(nodes):
        now = node.oscillations
        numbers: dict[int, int] = {}
        if place:
            rows, chosen = linear_sum_assignment(_costs(nodes[place - 1].oscillations, now))
            numbers = {int(k): columns[-1][int(row)] for row, k in zip(rows, chosen, strict=True)}
        for k in range(len(now.eigenvalues)):
            if k not in numbers:
                numbers[k] = count
                count += 1
        columns.append([numbers[k] for k in range(len(now.eigenvalues))])
    return columns, count
