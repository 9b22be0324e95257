"""Motions prescribed by the caller of a simulator: polynomial pieces to targets at the ends of its steps."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.compiled.arguments import check_finite, check_name, numbers
from eomgen.errors import Problem, UsageError
from eomgen.formula.evaluate import symbols
from eomgen.system.motions import at_time, piece

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel

#: Position, rate and acceleration at the end of a call, or a function of t that gives them at the end of each step.
Target = ArrayLike | Callable[[float], ArrayLike]


class Motions:
    """The motions of a model under the control of one simulator.

    Attributes
    ----------
    columns : (k,) indices of all parameters of motions among the model's parameters
    reached : position, rate and acceleration, (3,), by name, at the end of the last step; without the motions
        whose last piece did not end there
    rough : whether a law that follows a motion may jump or bend
    """

    def __init__(self, model: CompiledModel) -> None:
        places = {name: index for index, name in enumerate(model.parameters)}
        motions = model.description.motions
        self._columns = {item.name: [places[parameter] for parameter in item.parameters] for item in motions}
        self.columns = np.array([index for columns in self._columns.values() for index in columns], dtype=int)
        self.reached: dict[str, Array] = {}
        ours = {parameter for item in motions for parameter in item.parameters}
        self.rough = any(
            not law.smooth and not ours.isdisjoint(symbol.name for symbol in symbols(law.formula))
            for law in model.description.laws
        )

    def __bool__(self) -> bool:
        return bool(self._columns)

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def now(self, name: str, p: Array, t: float) -> Array:
        """Return position, rate and acceleration, (3,), of a motion at parameters (np,) and a time in s. Values at the
        end of the last step, if kept in ``reached``, are returned as they are."""
        if name in self.reached:
            return self.reached[name]
        begin, *coefficients = p[self._columns[name]].tolist()
        return at_time(np.array(coefficients), t - begin)

    def between(self, t: Array, p: Array) -> RecordedMotions | None:
        """Return the motions between recorded rows at times (n,) with parameters (n, np); None if there are none."""
        return RecordedMotions(t, p, tuple(map(tuple, self._columns.values()))) if self._columns else None

    def check(self, targets: Mapping[str, Target] | None) -> Mapping[str, Target]:
        """Return the targets given for motions, unchanged, or an empty mapping for None. Raises UsageError for anything
        but a mapping from names of motions."""
        if targets is None:
            return {}
        if not isinstance(targets, Mapping):
            hint = 'motions={"lift": (position, rate, acceleration)}'
            fault = f"a mapping from the names of motions is needed, not {type(targets).__name__} [E2018]"
            raise UsageError(Problem("motions", fault, hint))
        for name in targets:
            check_name("motion", name, tuple(self._columns))
        return targets

    def begin(self, p: Array, t: float, duration: float, targets: Mapping[str, Target]) -> Array:
        """Return parameters (np,) with which all motions go from time t to their targets at t + `duration`, s, by
        quintics.

        `targets` has the targets by name. Motions with functions as targets keep their parameters, which ``go_on`` sets
        step by step; motions at rest without a target rest. `p` (np,) are the present parameters, which are not
        changed.

        Raises
        ------
        UsageError
            A target that is none, or a motion under way that has no target.
        """
        moved = p.copy()
        for name, columns in self._columns.items():
            if callable(target := targets.get(name)):
                continue
            start = self.now(name, p, t)
            if target is None and np.any(start[1:]):
                fault = f"it is under way, with a rate of {start[1]:.6g} and an acceleration of {start[2]:.6g}"
                hint = f"motions={{{name!r}: (position, rate, acceleration)}} at the end of the step"
                raise UsageError(Problem(f"motion {name}", f"{fault}, and has no target [E2019]", hint))
            end = start if target is None else read_target(name, target)
            moved[columns] = [t, *piece(start, end, duration)]
        return moved

    def go_on(self, p: Array, t: float, step: float, functions: Mapping[str, Target]) -> tuple[Array, dict[str, Array]]:
        """Return parameters (np,) for motions that follow functions over one step, and the targets at the end of the
        step.

        Each motion goes by a quintic from its values at time t to the position, rate and acceleration, (3,), that its
        function of t gives at t + step, s; the second result has these by name. `p` (np,) are the present parameters,
        not changed.
        """
        moved, ends = p.copy(), {}
        for name, function in functions.items():
            ends[name] = value_at(name, function, t + step)
            moved[self._columns[name]] = [t, *piece(self.now(name, p, t), ends[name], step)]
        return moved, ends

    def start(self, p: Array, t: float, targets: Mapping[str, Target]) -> Array:
        """Return parameters (np,) for motions that begin at given targets at time t in s, and keep the targets as
        ``reached``. `targets` has position, rate and acceleration by name, or functions of t evaluated at t. The
        acceleration stays constant until ``begin`` or ``go_on`` sets the next piece."""
        moved = p.copy()
        for name, target in targets.items():
            x, v, a = self.reached[name] = value_at(name, target, t)
            moved[self._columns[name]] = [t, x, v, 0.5 * a, 0.0, 0.0, 0.0]
        return moved

    def at_rest(self, p: Array) -> Array:
        """Return parameters (np,) for which all motions rest at the beginnings of their present pieces."""
        resting = p.copy()
        for columns in self._columns.values():
            resting[columns[2:]] = 0.0
        return resting

    def later(self, p: Array, delay: float) -> Array:
        """Return parameters (np,) with all motions delayed by a time in s."""
        moved = p.copy()
        moved[[columns[0] for columns in self._columns.values()]] += delay
        return moved


@dataclass(frozen=True, eq=False)
class RecordedMotions:
    """Motions between recorded rows, by the polynomials that meet the position, rate and acceleration of both rows.

    Attributes
    ----------
    t : (n,) s, increasing
    p : (n, np) parameters of the rows
    columns : places of the parameters of each motion
    """

    t: Array
    p: Array
    columns: tuple[tuple[int, ...], ...]

    def __call__(self, t: Array) -> Array:
        """Return parameters (..., np) at times (...) in s, by which each motion follows the polynomial between the rows
        around; before the first and after the last row motions are at rest."""
        at = np.asarray(t, dtype=float)
        last = len(self.t) - 1
        row = np.clip(np.searchsorted(self.t, at, side="right") - 1, 0, last)
        following = np.minimum(row + 1, last)
        result = np.broadcast_to(self.p[-1], (*at.shape, self.p.shape[1])).copy()
        for columns in self.columns:
            begin, *coefficients = self.p[:, columns].T
            ends = at_time(np.array(coefficients), self.t - begin)
            length = np.where(following > row, self.t[following] - self.t[row], 1.0)
            result[..., columns[0]] = self.t[row]
            result[..., columns[1:]] = np.moveaxis(piece(ends[:, row], ends[:, following], length), 0, -1)
        return result


def value_at(name: str, target: Target, t: float) -> Array:
    """Return position, rate and acceleration, (3,), from a target of the motion `name`: three numbers, or a function of
    t. Raises UsageError if the function fails, or for anything but three finite numbers."""
    if not callable(target):
        return read_target(name, target)
    try:
        value = target(t)
    except Exception as error:
        fault = f"the function failed at t = {t:.9g} s: {type(error).__name__}: {error} [E2020]"
        raise UsageError(Problem(f"motion {name}", fault)) from error
    return read_target(name, value, f" at t = {t:.9g} s")


def read_target(name: str, target: ArrayLike, when: str = "") -> Array:
    """Return a target of the motion `name` as a new array (3,): position, rate and acceleration. Raises UsageError for
    anything but three finite numbers; `when` is a phrase about the time for the message."""
    where = f"motion {name}"
    array = numbers(where, target)
    if array.shape != (3,):
        fault = f"its position, rate and acceleration{when} are needed, three numbers, not shape {array.shape} [E2021]"
        hint = "(x, v, a): joints that follow the motion need its derivatives; of a spline s: (s(t), s(t, 1), s(t, 2))"
        raise UsageError(Problem(where, fault, hint))
    check_finite(where, array)
    return array.copy()


def refuse_as_inputs(inputs: object, motions: Collection[str]) -> None:
    """Raise UsageError if `inputs` is a mapping of inputs that has the name of a motion."""
    for name in motions:
        if isinstance(inputs, Mapping) and name in inputs:
            fault = "this is a motion, which its caller gives with rate and acceleration from step to step [E2022]"
            hint = f"run = model.start(...), then run.step(motions={{{name!r}: (position, rate, acceleration)}})"
            raise UsageError(Problem(f"input {name}", fault, hint))
