"""Water on hulls that are wholly below its surface: slices with forces, and the inertia of the water."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tests.oracles.interpreter.jets import Jet
from tests.oracles.interpreter.machine import Motion, unit

if TYPE_CHECKING:
    from tests.oracles.interpreter.equations import State

Array = NDArray[Any]
Data = Mapping[str, Any]


#: Added in squares to velocities of water in drag, m/s.
SLOW = 1e-3


@dataclass(frozen=True)
class Slice:
    """A slice of a hull: place in its body, force of the water at rest of the body, added masses with projections."""

    body: str
    r: Array
    force: Array
    added: list[tuple[float, Array]]
    couple: Array | None = None

    def quantity(self, motion: Motion) -> Jet:
        return motion.poses[self.body].at(self.r)


class Water:
    """Velocity and acceleration under regular waves of first order in deep water, with Wheeler's stretching."""

    def __init__(self, data: Data, name: str, value: Any, gravity: Array, level: float) -> None:
        entry = data.get("waves", {}).get(name)
        self.waves, self.level = [], level
        if entry is not None:
            self.level, self.stretched = value(entry.get("level", 0.0)), entry.get("stretching", "wheeler") == "wheeler"
            for wave in entry["regular"]:
                omega, heading = 2 * math.pi / value(wave["period"]), value(wave.get("heading", 0.0))
                k = omega**2 / np.linalg.norm(gravity)
                self.waves.append((value(wave["amplitude"]), omega, k, heading, value(wave.get("phase", 0.0))))

    def motion(self, x: Array, t: float) -> tuple[Array, Array]:
        u, a = np.zeros(3), np.zeros(3)
        phases = [k * (x[0] * math.cos(b) + x[1] * math.sin(b)) - w * t + p for _, w, k, b, p in self.waves]
        surface = sum(wave[0] * math.cos(th) for wave, th in zip(self.waves, phases, strict=True))
        z = x[2] - self.level - (surface if self.waves and self.stretched else 0.0)
        for (A, w, k, b, _), th in zip(self.waves, phases, strict=True):
            speed = A * w * math.exp(k * z)
            level = np.array([math.cos(b), math.sin(b), 0.0])
            up = np.array([0.0, 0.0, 1.0])
            u += speed * (math.cos(th) * level + math.sin(th) * up)
            a += speed * w * (math.sin(th) * level - math.cos(th) * up)
        return u, a


def slices(state: State) -> Iterator[Slice]:
    """Slices of hulls that are wholly under water."""
    value, values = state.machine.value, state.machine.values
    for entry in state.data.get("hulls", {}).values():
        start, end, body = values(entry["start"]), values(entry["end"]), entry["body"]
        count, length = entry.get("stations", 8), float(np.linalg.norm(end - start))
        diameter, rho = value(entry["diameter"]), value(entry.get("density", 1025.0))
        area = value(entry.get("area", math.pi * diameter**2 / 4))
        axis = state.motion.poses[body].R.value @ unit(end - start)
        P = np.eye(3) - np.outer(axis, axis)
        ds = length / count
        water = Water(state.data, entry.get("waves", ""), value, state.machine.gravity, value(entry.get("level", 0.0)))
        middles = [start + (end - start) * (k + 0.5) / count for k in range(count)]
        flow = [water.motion(state.motion.poses[body].at(r).value, state.t) for r in middles]
        for k, (r, (u, a)) in enumerate(zip(middles, flow, strict=True)):
            place = state.motion.poses[body].at(r)
            slip = P @ (u - place.rate)
            inertia = rho * value(entry.get("added_mass", 1.0)) * area
            drag = 0.5 * rho * value(entry.get("drag", 1.0)) * diameter * ds * math.hypot(*slip, SLOW) * slip
            force = rho * area * ds * (a - state.machine.gravity) + inertia * ds * P @ a + drag
            before, after = max(k - 1, 0), min(k + 1, count - 1)
            change = (flow[after][1] - flow[before][1]) / max(after - before, 1)
            couple = -rho * area * (area / (4.0 * math.pi)) * np.cross(axis, change)
            yield Slice(body, r, force, [], couple)
        for node in (-1.0, 1.0):  # Gauss: the inertia of the water along the whole length, without slices
            r = start + (end - start) * 0.5 * (1.0 + node / math.sqrt(3.0))
            yield Slice(body, r, np.zeros(3), [(0.5 * inertia * length, P)])
        place = state.motion.poses[body].at(start)
        u, a = water.motion(place.value, state.t)
        along, heavy = float(axis @ (u - place.rate)), value(entry.get("axial_added_mass", 0.0))
        drag = value(entry.get("axial_drag", 0.0)) * math.hypot(along, SLOW) * along
        force = (heavy * (axis @ a) + drag) * axis
        yield Slice(body, start, force, [(heavy, np.outer(axis, axis))])
