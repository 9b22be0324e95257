"""Third solutions of runs with impacts and dry friction: pieces between events, each by SciPy's DOP853 to 1e-12."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]


class Change(NamedTuple):
    """A change of the state at the root of a function of the state that falls through zero."""

    root: Callable[[Array], float]
    after: Callable[[Array], Array]


def _pieces(rates: Callable[[Array], Array], start: Array, changes: Sequence[Change], times: Array) -> Array:
    """Return states at times of a motion that changes suddenly, (times, n)."""
    result, now, state = np.zeros((len(times), len(start))), 0.0, start
    while True:
        roots: list[Callable[[float, Array], float]] = []
        for change in changes:

            def root(_: float, y: Array, change: Change = change) -> float:
                return change.root(y)

            root.terminal, root.direction = True, -1.0  # type: ignore[attr-defined]
            roots.append(root)
        solution = solve_ivp(
            lambda _, y: rates(y),
            (now, max(float(times[-1]), 1e-9)),
            state,
            "DOP853",
            dense_output=True,
            events=roots,
            rtol=1e-12,
            atol=1e-13,
            max_step=0.05,  # a longer one may jump over two roots
        )
        within = (times >= now) & (times <= solution.t[-1])
        if within.any() and solution.sol:
            result[within] = solution.sol(times[within]).T
        if solution.status == 0:
            return result
        number = next(i for i, found in enumerate(solution.t_events or ()) if len(found))
        now, state = float(solution.t[-1]), changes[number].after(solution.y[:, -1])


def _signals(states: Array, **columns: int | list[int]) -> Mapping[str, Array]:
    return {name: np.reshape(states[:, column], (len(states), -1)) for name, column in columns.items()}


def bouncing_ball(times: Array) -> Mapping[str, Array]:
    """Return a ball that keeps 0.9 of its speed at each impact."""
    floor = Change(lambda y: y[0], lambda y: np.array([0.0, -0.9 * y[1]]))
    states = _pieces(lambda y: np.array([y[1], -9.81]), np.array([1.0, 0.0]), [floor], times)
    return _signals(states, height=0, speed=1)


def compliant_ball(times: Array) -> Mapping[str, Array]:
    """Return a ball between a floor with a spring and a roof; the third number says whether it presses the floor."""

    def rates(y: Array) -> Array:
        return np.array([y[1], -9.81 + 100.0 * (0.1 - y[0]) * y[2], 0.0])

    changes = [
        Change(lambda y: y[0] - 0.1 if y[2] < 0.5 else 1.0, lambda y: np.array([0.1, y[1], 1.0])),
        Change(lambda y: 0.1 - y[0] if y[2] > 0.5 else 1.0, lambda y: np.array([0.1, y[1], 0.0])),
        Change(lambda y: 0.7 - y[0] if y[1] > 0.0 else 1.0, lambda y: np.array([0.7, -y[1], y[2]])),
    ]
    return _signals(_pieces(rates, np.array([1.0, 0.0, 0.0]), changes, times), height=0, speed=1)


def friction_oscillator(times: Array) -> Mapping[str, Array]:
    """Return an oscillator with dry friction; the third number is the sense of its motion, 0 if it sticks."""

    def rates(y: Array) -> Array:
        return np.array([y[1], -(y[0] + y[2]), 0.0]) if y[2] else np.zeros(3)

    def after(y: Array) -> Array:
        return np.array([y[0], 0.0, 0.0 if abs(y[0]) <= 1.0 else -np.sign(y[0])])

    turn = Change(lambda y: y[1] * y[2] if y[2] else 1.0, after)
    return _signals(_pieces(rates, np.array([12.0, 6.0, 1.0]), [turn], times), place=0, speed=1)


def rocking_block(times: Array) -> Mapping[str, Array]:
    """Return a block that falls on frictionless corners, each impact along the gradient of the height of its corner."""
    inertia = 1.25 / 12.0

    def corner(side: float) -> Change:
        def height(y: Array) -> float:
            return float(y[1] - side * 0.1 * np.sin(y[2]) - 0.05 * np.cos(y[2]))

        def after(y: Array) -> Array:
            lever = -side * 0.1 * np.cos(y[2]) + 0.05 * np.sin(y[2])
            impulse = -1.8 * (y[4] + lever * y[5]) / (1.0 + lever**2 / inertia)
            return np.asarray(y + np.array([0.0, 0.0, 0.0, 0.0, impulse, lever * impulse / inertia]))

        return Change(height, after)

    start = np.array([0.03349364905389041, 0.5580127018922193, np.pi / 3.0, 0.0, 0.0, 0.0])
    states = _pieces(lambda y: np.array([*y[3:], 0.0, -9.81, 0.0]), start, [corner(1.0), corner(-1.0)], times)
    return _signals(states, place=[0, 1], angle=2, speed=[3, 4], rate=5)


#: Third solutions by the names that rows of ``runs*.toml`` give.
IMPACTS: Mapping[str, Callable[[Array], Mapping[str, Array]]] = {
    "bouncing ball": bouncing_ball,
    "compliant ball": compliant_ball,
    "friction oscillator": friction_oscillator,
    "rocking block": rocking_block,
}
