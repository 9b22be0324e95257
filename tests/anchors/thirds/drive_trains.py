"""Third solutions of drive trains with dry friction: inertias that stick are one inertia until they break loose."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]
#: In place of the sign of a slip: there is no dry friction.
FREE = 2
#: Added to functions whose roots are sought, since some of them start at zero.
ABOVE = 1e-13


@dataclass(frozen=True)
class Shaft:
    """Inertias in a row with a torque between each two, of dry friction or given.

    Attributes
    ----------
    inertias : array
        Of n inertias; infinite for the ground.
    outer : function of the time
        Torques on them.
    inner : function of angles and speeds
        Torques between each two, on the second one, without dry friction.
    level : function of the time
        Torques of sliding friction between each two.
    peak : float
        Factor of the level at which a part breaks loose.
    jumps : sequence of float
        Instants at which torques jump.
    """

    inertias: Array
    outer: Callable[[float], Array]
    inner: Callable[[Array, Array], Array]
    level: Callable[[float], Array]
    peak: float
    jumps: Sequence[float]

    def forces(self, time: float, state: Array, slips: Sequence[int]) -> tuple[Array, Array]:
        """Return the accelerations and the torques between each two, for signs of their slips (0: both stick)."""
        count = len(self.inertias)
        outer = self.outer(time)
        between = self.inner(state[:count], state[count:]) - np.array(slips) * self.level(time)
        accelerations, first = np.zeros(count), 0
        for last in range(count):
            if last < count - 1 and slips[last] == 0:
                continue
            group = slice(first, last + 1)
            pushed = outer[group].sum() + (between[first - 1] if first else 0.0)
            pushed -= between[last] if last < count - 1 else 0.0
            accelerations[group] = pushed / self.inertias[group].sum()
            for inside in range(first, last):
                before = between[inside - 1] if inside else 0.0
                between[inside] = before + outer[inside] - self.inertias[inside] * accelerations[inside]
            first = last + 1
        return accelerations, between

    def motion(self, start: Array, slips: Sequence[int], times: Array) -> Array:
        """Return the states (times, angles and speeds) of a run."""
        now, state, signs = 0.0, start, list(slips)
        rows: list[Array] = []
        while now < times[-1]:
            until = min([float(times[-1]), *(jump for jump in self.jumps if jump > now)])
            run: Any = self._until_a_switch(now, until, state, tuple(signs))
            happened = [(found[0], place) for place, found in enumerate(run.t_events) if len(found)]
            end, place = min(happened, default=(until, -1))
            first = now if rows else -1.0
            rows += [run.sol(time) for time in times[(times > first) & (times <= end)]]
            now, state = end, run.sol(end)
            if place >= 0:
                signs[place] = self._switched(now, state, signs, place)
        return np.array(rows)

    def _until_a_switch(self, now: float, until: float, state: Array, signs: Sequence[int]) -> object:
        count = len(self.inertias)
        before_jump = until - 1e-13

        def rates(time: float, y: Array) -> Array:
            return np.append(y[count:], self.forces(min(time, before_jump), y, signs)[0])

        watch = [self._watched(place, signs, before_jump) for place in range(count - 1)]
        return solve_ivp(rates, (now, until), state, "DOP853", dense_output=True, events=watch, rtol=1e-11, atol=1e-12)

    def _watched(self, place: int, signs: Sequence[int], before_jump: float) -> Callable[[float, Array], float]:
        count = len(self.inertias)

        def value(time: float, state: Array) -> float:
            time = min(time, before_jump)
            if signs[place] == FREE:
                return 1.0
            if signs[place]:
                return float((state[count + place + 1] - state[count + place]) * signs[place]) + ABOVE
            return float(self.peak * self.level(time)[place] - abs(self.forces(time, state, signs)[1][place])) + ABOVE

        value.terminal, value.direction = True, -1.0  # type: ignore[attr-defined]
        return value

    def _switched(self, time: float, state: Array, signs: Sequence[int], place: int) -> int:
        held = [0 if index == place else sign for index, sign in enumerate(signs)]
        torque = self.forces(time, state, held)[1][place]
        if signs[place] and abs(torque) <= self.peak * self.level(time)[place]:
            return 0
        return -int(np.sign(torque))


def coupled_clutches(times: Array) -> Mapping[str, Array]:
    """Return four inertias of 1 kg m^2 with three clutches."""
    shaft = Shaft(
        inertias=np.ones(4),
        outer=lambda time: np.array([10.0 * np.sin(10 * np.pi * time), 0.0, 0.0, 0.0]),
        inner=lambda angles, speeds: np.zeros(3),
        level=lambda time: 10.0 * np.array([max(0.0, np.cos(0.4 * np.pi * time)), time >= 0.4, time >= 0.9]),
        peak=1.1,
        jumps=[0.4, 0.9],
    )
    states = shaft.motion(np.array([0.0, 0.0, 0.0, 0.0, 10.0, 0.0, 0.0, 0.0]), [-1, -1, -1], times)
    angles, speeds = states[:, :4], states[:, 4:]
    return {
        "angle": angles[:, :1],
        "rate": speeds[:, :1],
        "slips": np.diff(angles),
        "slip_rates": np.diff(speeds),
    }


def clutch_and_brake(times: Array) -> Mapping[str, Array]:
    """Return a motor, a clutch, a small inertia, a spring with a damper, and a load with a brake to the ground."""
    shaft = Shaft(
        inertias=np.array([1.0, 0.05, 1.0, np.inf]),
        outer=lambda time: np.array([200.0 * np.sin(100.0 * time) * (time < 0.5), 0.0, 0.0, 0.0]),
        inner=lambda angles, speeds: np.array([0.0, 160.0 * (angles[1] - angles[2]) + speeds[1] - speeds[2], 0.0]),
        level=lambda time: np.array([80.0, 0.0, 800.0 * (time >= 0.5)]),
        peak=1.0,
        jumps=[0.5],
    )
    states = shaft.motion(np.array([0.0, 0.0, 0.0, 0.0, 100.0, 90.0, 90.0, 0.0]), [-1, FREE, -1], times)
    angles, speeds = states[:, :4], states[:, 4:]
    return {
        "angle": angles[:, :1],
        "rate": speeds[:, :1],
        "slip": np.diff(angles)[:, :1],
        "slip_rate": np.diff(speeds)[:, :1],
        "spring": np.diff(angles)[:, 1:2],
        "spring_rate": np.diff(speeds)[:, 1:2],
    }


FRICTION: Mapping[str, Callable[[Array], Mapping[str, Array]]] = {
    "clutch and brake": clutch_and_brake,
    "coupled clutches": coupled_clutches,
}
