"""The search for a Campbell diagram: modes followed over values of a parameter, and crossings with orders.

Modes are followed from speed to speed by shapes and frequencies, so that curves may cross; crossings are then found on
the model (Brent 1973), not by interpolation in the diagram.
"""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from scipy.optimize import brentq, linear_sum_assignment

from eomgen.base.arrays import Array, Complex
from eomgen.base.data import dataclass
from eomgen.base.progress import Progress
from eomgen.base.rounding import COMPUTED, SUMMED, WRITTEN
from eomgen.errors import ModelError, NumericalError
from eomgen.products.linear.campbell_plot import Campbell, Crossing
from eomgen.products.linear.eigenvalue_loci import MergedWarnings
from eomgen.products.linear.linearization import Linearization

#: Circular part of the motion, in the mean over the values, below which a mode has no sense of whirl by multiblade
#: coordinates: collective modes and modes of the support have a little of it, in either sense.
_MINOR = 0.1
#: Modes that are more unlike than this are followed over a value between, unless their shapes differ by less than the
#: second number and all other modes are more unlike by the first.
_UNLIKE, _SAME_SHAPE = 0.5, 0.25


@dataclass(frozen=True)
class _Oscillations:
    """Oscillating modes at one value: eigenvalues (m,), weighted shapes of length one (rows, m), whirl (m,), circular
    part of the motion (m,), from 0 to 1."""

    eigenvalues: Complex
    shapes: Complex
    whirl: NDArray[np.int_]
    circular: Array
    stability: str


def campbell(
    parameter: str,
    unit: str,
    values: Sequence[float],
    linearized: Callable[[float, Linearization | None], Linearization],
    orders: Sequence[float] = (),
    pairs: Sequence[tuple[str, str]] = (),
    report: Progress | None = None,
    reference: tuple[float, Linearization] | None = None,
) -> Campbell:
    """Return the oscillations of linear models over values of a parameter, with crossings with orders.

    Values at which there is no linear model are left out with a warning, as long as two are kept. Ctrl-C keeps the
    values and crossings found so far, if there are two values.

    Parameters
    ----------
    parameter, unit : str
        Name and unit of the parameter (a speed of rotation).
    values : sequence of float
        Values of the parameter, increasing.
    linearized : callable
        From a value, and the linear model at the previous value, to the linear model at this value.
    orders : multiples of the values
    pairs : pairs of outputs or states that are deflections along two axes, the second a quarter turn from the first in
        the sense of the spin; whirl is the sense of the orbit
    report : called with the part of the work that is done: half is for the values, half for crossings if there are
        orders
    reference : value, and the linear model whose modes number the modes of the diagram

    Raises
    ------
    EomgenError
        Errors of ``linearized`` if the call is wrong, or if fewer than two values have a linear model: with the first
        value that has one.
    """
    search = _CrossingSearch(parameter, linearized, pairs, values)
    all_steps = (2 if orders else 1) * len(values)
    interrupted = False
    try:
        for number, value in enumerate(map(float, values), 1):
            search.look_at(value)
            if report is not None:
                report(number, all_steps)
    except KeyboardInterrupt:
        if search.wanted_count < 2:
            raise
        interrupted = True
    if search.failures and search.wanted_count < 2:
        raise next(iter(search.failures.values()))
    for value, failure in search.failures.items():
        search.doubts.add(value, f"left out: {failure}", RuntimeWarning)
    curves = _FollowedModes.through(search.nodes)
    candidates = () if interrupted else curves.candidates(orders)
    crossings: list[Crossing] = []
    try:
        for number, candidate in enumerate(candidates, 1):
            crossings += search.crossing(*candidate, curves, stacklevel=5)
            if report is not None:
                report(len(values) + len(values) * number // len(candidates), all_steps)
    except KeyboardInterrupt:
        interrupted = True
    search.doubts.warn(stacklevel=5)
    kept = tuple(sorted(crossings, key=lambda item: (item.order, item.speed)))
    wanted = [row for row, node in enumerate(search.nodes) if node.wanted]
    chosen = np.array([search.nodes[row].value for row in wanted])
    stability = tuple(search.nodes[row].oscillations.stability for row in wanted)
    left_out = {value: str(failure) for value, failure in search.failures.items()}
    eigenvalues, whirl, multiples = curves.eigenvalues[wanted], curves.whirl[wanted], tuple(map(float, orders))
    numbers = () if reference is None else _numbers(curves, search, *reference)
    return Campbell(
        parameter, unit, chosen, eigenvalues, whirl, multiples, kept, stability, left_out, interrupted, numbers
    )


def _numbers(curves: _FollowedModes, search: _CrossingSearch, value: float, model: Linearization) -> tuple[int, ...]:
    """Return a number for each mode of a diagram, (modes,): the number, from 1 on, of the same mode in a table of
    modes. The table belongs to the linear model `model` at the parameter's value `value`; modes are followed from the
    nearest node of the search. Modes that the model lacks come last. Empty for a model with other coordinates."""
    row = int(np.argmin(np.abs(curves.values - value)))
    near = search.nodes[row]
    if near.model.coordinates != model.coordinates:
        return ()
    node = search.node(value, model, wanted=False)
    path = [near, *search.between(near, node), node]
    first, *_, last = _mode_columns(path)[0]
    modes = model.modes()
    of_model = dict(zip(last, (np.flatnonzero(modes.oscillating) + 1).tolist(), strict=True))
    known = {curves.modes[row][k]: of_model[mode] for k, mode in enumerate(first) if mode in of_model}
    more = itertools.count(len(modes) + 1)
    return tuple(known[mode] if mode in known else next(more) for mode in range(curves.eigenvalues.shape[1]))


class _CrossingSearch:
    """Oscillations at values of a parameter, and crossings of oscillations with orders, by linear models at any value.
    ``nodes`` are the values with their models in order, ``failures`` the errors by value without a model."""

    def __init__(
        self,
        parameter: str,
        linearized: Callable[[float, Linearization | None], Linearization],
        pairs: Sequence[tuple[str, str]],
        values: Sequence[float],
    ) -> None:
        self.linearized, self.pairs = linearized, pairs
        self.doubts = MergedWarnings("Campbell diagram", parameter, values)
        self.nodes: list[_Node] = []
        self.failures: dict[float, ModelError | NumericalError] = {}

    @property
    def wanted_count(self) -> int:
        """Number of values of the caller that have a linear model."""
        return sum(node.wanted for node in self.nodes)

    def at(self, value: float, before: Linearization | None) -> Linearization:
        """Return the linear model at a value. Raises EomgenError with the value in the message."""
        with self.doubts.at(value):
            return self.linearized(value, before)

    def node(self, value: float, model: Linearization, *, wanted: bool) -> _Node:
        """Return the node of a value with a linear model."""
        return _Node(value, model, _oscillations(model, self.pairs, value), wanted)

    def look_at(self, value: float) -> None:
        """Append the node of a value, after nodes at intermediate values that are needed to follow modes from the last
        node. A ModelError or a NumericalError of the linear model is kept in ``failures`` instead."""
        nodes = self.nodes
        try:
            node = self.node(value, self.at(value, nodes[-1].model if nodes else None), wanted=True)
            nodes.extend([*self.between(nodes[-1], node), node] if nodes else [node])
        except (ModelError, NumericalError) as error:
            self.failures[value] = error

    def between(self, low: _Node, high: _Node, depth: int = 4) -> list[_Node]:
        """Return the nodes at intermediate values between two nodes that are needed to follow modes, by bisection. None
        are needed if each mode has one clear continuation. None are returned without a linear model in between, or at
        `depth` 0, the number of halvings left."""
        if depth == 0 or _tracks_modes(low.oscillations, high.oscillations):
            return []
        middle = 0.5 * (low.value + high.value)
        try:
            model = self.at(middle, low.model)
        except (ModelError, NumericalError):
            return []
        node = self.node(middle, model, wanted=False)
        return [*self.between(low, node, depth - 1), node, *self.between(node, high, depth - 1)]

    def crossing(self, order: float, row: int, mode: int, curves: _FollowedModes, stacklevel: int) -> list[Crossing]:
        """Return a list with the crossing of a mode with an order between two neighbouring nodes, refined on the model.
        `row` is the number of the lower node, `mode` the column in `curves`. The list is empty if another mode is
        nearer, or, with a warning, if there is no linear model in between."""
        low, high = self.nodes[row : row + 2]
        ends = [(self.nodes[neighbour].oscillations, curves.column(neighbour, mode)) for neighbour in (row, row + 1)]
        last: dict[str, Any] = {}

        def excess(value: float) -> float:
            here = _oscillations(self.at(value, low.model), self.pairs, value)
            nearest = int(np.argmin(sum(_costs(end, here)[k] for end, k in ends)))
            last.update(value=value, eigenvalue=here.eigenvalues[nearest], whirl=here.whirl[nearest])
            return float(here.eigenvalues[nearest].imag - order * abs(value))

        try:
            if np.sign(excess(low.value)) == np.sign(excess(high.value)):
                return []  # another mode is nearer there
            accuracy = SUMMED * max(abs(low.value), abs(high.value))
            speed = float(brentq(excess, low.value, high.value, xtol=accuracy, rtol=SUMMED))
            excess(speed)
        except (ModelError, NumericalError) as error:
            text = f"Campbell diagram: a crossing with {order:g}x is left out: {error} [W0029]"
            warnings.warn(text, RuntimeWarning, stacklevel)
            return []
        whirls = bool(np.any(curves.whirl[:, mode]))
        word = {1: "forward", -1: "backward"}.get(int(last["whirl"]) if whirls else 0, "")
        return [Crossing(order, speed, float(last["eigenvalue"].imag), mode, word)]


@dataclass(frozen=True)
class _FollowedModes:
    """Modes followed over nodes: values (nodes,), complex eigenvalues in 1/s and whirl (nodes, modes); not a number if
    a node lacks a mode. Modes are in the order of their frequency at the first node that has them."""

    values: Array
    eigenvalues: Complex
    whirl: NDArray[np.int_]
    #: For each node the modes of its oscillations, in order.
    modes: Sequence[Sequence[int]]

    @classmethod
    def through(cls, nodes: Sequence[_Node]) -> _FollowedModes:
        """Return the followed modes through nodes in order; whirl is zero at nodes that lack the mode, and for modes
        with hardly any circular motion of blades in the mean over the nodes."""
        columns, count = _mode_columns(nodes)
        eigenvalues = np.full((len(nodes), count), complex(np.nan, np.nan))
        whirl, circular = np.zeros((len(nodes), count), dtype=int), np.zeros((len(nodes), count))
        for row, (node, numbers) in enumerate(zip(nodes, columns, strict=True)):
            eigenvalues[row, numbers], whirl[row, numbers] = node.oscillations.eigenvalues, node.oscillations.whirl
            circular[row, numbers] = node.oscillations.circular
        present = ~np.isnan(eigenvalues.real)
        whirl[:, np.sum(circular, axis=0) < _MINOR * np.sum(present, axis=0)] = 0
        order = np.argsort([column[~np.isnan(column)][0].imag for column in eigenvalues.T], kind="stable")
        places = np.argsort(order).tolist()
        modes = [[places[number] for number in numbers] for numbers in columns]
        return cls(np.array([node.value for node in nodes]), eigenvalues[:, order], whirl[:, order], modes)

    def column(self, row: int, mode: int) -> int:
        """Return the place of a mode among the oscillations of a node."""
        return self.modes[row].index(mode)

    def candidates(self, orders: Sequence[float]) -> list[tuple[float, int, int]]:
        """Return triples (order, node, mode) for which angular frequency - order |value| changes sign between a node
        and the next."""
        result: list[tuple[float, int, int]] = []
        for order in orders:
            for mode, eigenvalues in enumerate(self.eigenvalues.T):
                above = eigenvalues.imag - order * np.abs(self.values)
                with np.errstate(invalid="ignore"):
                    changes = np.flatnonzero((above[1:] <= 0.0) != (above[:-1] <= 0.0))
                result += [(float(order), k, mode) for k in changes.tolist() if not np.isnan(above[k : k + 2]).any()]
        return result


def _oscillations(lin: Linearization, pairs: Sequence[tuple[str, str]], value: float) -> _Oscillations:
    """Return the oscillating modes of a linear model, with shapes of length 1 and the sense of whirl. The sense, 1
    forward, -1 backward or 0, is the sense of the orbit in the planes of the deflection `pairs`, by default of the
    model's multiblade pairs, relative to the sign of `value`, the speed. Modes of a multiple eigenvalue are combined
    into circular modes first."""
    modes = lin.modes()
    of_blades = () if pairs or lin.multiblade is None else lin.multiblade.pairs
    pairs = pairs or of_blades
    kept = np.flatnonzero(modes.oscillating)
    eigenvalues = modes.eigenvalues[kept]
    shapes = modes.weights[:, np.newaxis] * modes.shapes[:, kept]
    area, size = np.zeros(len(kept)), np.zeros(len(kept))
    if pairs:
        rows = lin.state_space().output_rows([name for pair in pairs for name in pair])
        deflections = rows @ modes.state_shapes[:, kept]
        for together in _multiple(eigenvalues, modes.uncertainty[kept]):
            turned = _circular(shapes[:, together], deflections[:, together])
            for amplitudes in (shapes, deflections):
                amplitudes[:, together] = amplitudes[:, together] @ turned
        first, second = deflections[::2], deflections[1::2]
        # x = cos t, y = sin t has the amplitudes 1 and -i
        area = -np.sum((first.conj() * second).imag, axis=0)
        size = np.sum(np.abs(first) ** 2 + np.abs(second) ** 2, axis=0)
    seen = np.abs(area) > np.maximum(WRITTEN * size, 1e-16)
    sense = np.where(seen, np.sign(area), 0.0) * np.sign(value)
    lengths = np.linalg.norm(shapes, axis=0)
    shapes = shapes / np.where(lengths > 0.0, lengths, 1.0)
    circular = np.ones(len(kept))
    if of_blades:
        cosine, sine = (shapes[[lin.names.measured.index(pair[k]) for pair in of_blades]] for k in (0, 1))
        circular = 2.0 * np.abs(np.sum((cosine.conj() * sine).imag, axis=0))
    return _Oscillations(eigenvalues, shapes, sense.astype(int), circular, modes.stability)


def _multiple(eigenvalues: Complex, uncertainty: Array) -> list[list[int]]:
    """Return the numbers of eigenvalues that are equal but for rounding: a list for each value of two modes or more.
    `uncertainty` (m,) is the rounding error of each eigenvalue."""
    groups: list[list[int]] = []
    for k, value in enumerate(eigenvalues):
        for group in groups:
            known = group[0]
            if abs(value - eigenvalues[known]) <= max(COMPUTED * abs(value), uncertainty[k], uncertainty[known]):
                group.append(k)
                break
        else:
            groups.append([k])
    return [group for group in groups if len(group) > 1]


def _circular(shapes: Complex, deflections: Complex) -> Complex:
    """Return combinations of modes of one eigenvalue, (m, m), with orbits of largest enclosed area in either sense.
    `shapes` (rows, m) are weighted, `deflections` (2 pairs, m) alternate between the first and the second axis. The
    columns of the result are coefficients of the modes. Any combination of these modes is a mode, with an arbitrary
    sense of whirl: the diagonalisation of the form of the enclosed area in the measure of kinetic energy gives the
    circular modes, if any, one in each sense. The unit matrix if shapes are dependent."""
    first, second = deflections[::2], deflections[1::2]
    of_energy = shapes.conj().T @ shapes
    of_area = 0.5j * (first.conj().T @ second - second.conj().T @ first)
    try:
        return np.asarray(scipy.linalg.eigh(of_area, of_energy)[1])
    except np.linalg.LinAlgError:  # equal shapes, as of internal states
        return np.eye(shapes.shape[1], dtype=np.complex128)


@dataclass(frozen=True)
class _Node:
    """A value of the parameter and the model there; additional values between the requested values only help to follow
    modes."""

    value: float
    model: Linearization
    oscillations: _Oscillations
    wanted: bool


def _unlike_shapes(before: _Oscillations, now: _Oscillations) -> Array:
    """Return the dissimilarity of the shapes of modes (m,) before and (k,) now, (m, k), from 0 to 1."""
    return np.asarray(1.0 - np.abs(before.shapes.conj().T @ now.shapes) ** 2)


def _costs(before: _Oscillations, now: _Oscillations) -> Array:
    """Return the dissimilarity of modes (m,) before and (k,) now, (m, k): by shapes, frequencies and whirl."""
    distance = np.abs(before.eigenvalues[:, np.newaxis] - now.eigenvalues)
    sizes = np.abs(before.eigenvalues)[:, np.newaxis] + np.abs(now.eigenvalues)
    opposite = before.whirl[:, np.newaxis] * now.whirl < 0
    return np.asarray(_unlike_shapes(before, now) + 4.0 * distance / sizes + opposite)


def _tracks_modes(before: _Oscillations, now: _Oscillations) -> bool:
    """Return whether each mode has one clear continuation from the oscillations `before` to the oscillations `now`."""
    costs = _costs(before, now)
    pairs = linear_sum_assignment(costs)
    pair_costs = costs[pairs]
    if np.all(pair_costs < _UNLIKE):
        return True
    costs[pairs] = np.inf
    others = np.minimum(costs.min(axis=1, initial=np.inf)[pairs[0]], costs.min(axis=0, initial=np.inf)[pairs[1]])
    clear = (_unlike_shapes(before, now)[pairs] < _SAME_SHAPE) & (others - pair_costs > _UNLIKE)
    return bool(np.all((pair_costs < _UNLIKE) | clear))


def _mode_columns(nodes: Sequence[_Node]) -> tuple[list[list[int]], int]:
    """Return for each node the columns of its oscillating modes in the diagram, and the number of columns. Modes of
    neighbouring nodes are assigned to each other by the least sum of dissimilarities; a mode without a predecessor has
    a new column."""
    columns: list[list[int]] = []
    more = itertools.count()
    for number, node in enumerate(nodes):
        now = node.oscillations
        numbers: dict[int, int] = {}
        if number:
            rows, chosen = linear_sum_assignment(_costs(nodes[number - 1].oscillations, now))
            numbers = {int(k): columns[-1][int(row)] for row, k in zip(rows, chosen, strict=True)}
        columns.append([numbers[k] if k in numbers else next(more) for k in range(len(now.eigenvalues))])
    return columns, next(more)
