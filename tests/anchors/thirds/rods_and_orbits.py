"""Third solutions of runs: the same machine by SciPy from equations written for it, to judge which program is off."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]


def _solved(rates: Callable[[float, Array], Array], start: Array, times: Array) -> Array:
    """Return the states (times, n) of an initial value problem to 1e-12."""
    end = max(float(times[-1]), 1e-9)
    solution = solve_ivp(rates, (0.0, end), start, "DOP853", t_eval=times, rtol=1e-12, atol=1e-13)
    return np.asarray(solution.y.T)


def falling_rod(across: int, length: float = 2.0, inertia: float = 0.1) -> Callable[[Array], Mapping[str, Array]]:
    """Return the motion of a rod of 1 kg that falls from the horizontal about an axis through its end, as a function of
    times; ``across`` is the world axis along which it lies at the start."""

    def motion(times: Array) -> Mapping[str, Array]:
        gravity = 9.80665
        turning = gravity * length / (length**2 + inertia)
        angle, rate = _solved(lambda _, y: np.array([y[1], turning * np.cos(y[0])]), np.zeros(2), times).T
        acceleration = turning * np.cos(angle)
        along, down = np.array([np.cos(angle), -np.sin(angle)]), np.array([-np.sin(angle), -np.cos(angle)])
        place, speed = length * along, length * rate * down
        pull = length * acceleration * down - length * rate**2 * along
        planes = {"place": place, "speed": speed, "acceleration": pull, "reaction": -pull - [[0.0], [gravity]]}
        result = {name: np.zeros((len(times), 3)) for name in planes}
        for name, (first, second) in planes.items():
            result[name][:, across], result[name][:, 2] = first, second
        return result

    return motion


def held_rod(times: Array) -> Mapping[str, Array]:
    """Return the motion of a rod of 1 kg on a hinge with a spring of 200 N m/rad and a damper of 10 N m s/rad."""
    gravity, length = 9.80665, 2.0

    def change(angle: Any, rate: Any) -> Any:
        return (-gravity * length * np.cos(angle) - 200.0 * angle - 10.0 * rate) / (length**2 + 0.1)

    angle, rate = _solved(lambda _, y: np.array([y[1], change(*y)]), np.zeros(2), times).T
    rest = np.zeros_like(angle)
    along = np.column_stack([np.cos(angle), rest, np.sin(angle)])
    across = np.column_stack([-np.sin(angle), rest, np.cos(angle)])
    pull = length * (change(angle, rate)[:, None] * across - rate[:, None] ** 2 * along)
    reaction = -pull - [0.0, 0.0, gravity]
    return {
        "place": length * along,
        "speed": length * rate[:, None] * across,
        "acceleration": pull,
        "reaction": reaction,
    }


def orbits(times: Array) -> Mapping[str, Array]:
    """Return two orbits about a point with mu = 1 m^3/s^2."""
    result: dict[str, Array] = {}
    for name, start in {"circle": [0, 0.6, 0, 1, 0, 0], "ellipse": [0.6, 0.6, 0, 0.6, 0, 0]}.items():
        states = _solved(
            lambda _, y: np.concatenate([y[3:], -y[:3] / np.linalg.norm(y[:3]) ** 3]), np.array(start, float), times
        )
        result |= {name: states[:, :3], f"{name}_speed": states[:, 3:]}
    return result


def inclined_slide(times: Array) -> Mapping[str, Array]:
    """Return the motion of a body of 1 kg that slides from rest along (0, 1, 1), and the force on it."""
    along, down = np.array([0.0, 1.0, 1.0]) / np.sqrt(2.0), np.array([0.0, 0.0, -9.80665])
    acceleration = np.tile((down @ along) * along, (len(times), 1))
    place = np.array([3.0, 2.0, 3.0]) + 0.5 * times[:, None] ** 2 * acceleration
    speed = times[:, None] * acceleration
    return {"place": place, "speed": speed, "acceleration": acceleration, "reaction": down - acceleration}


#: Third solutions by the names that rows of ``runs*.toml`` give.
RODS_AND_ORBITS: Mapping[str, Callable[[Array], Mapping[str, Array]]] = {
    "rod along x": falling_rod(0),
    "rod along y": falling_rod(1),
    "held rod": held_rod,
    "inclined slide": inclined_slide,
    "orbits": orbits,
}
