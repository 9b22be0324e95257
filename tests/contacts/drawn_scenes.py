"""Scenes with contact and friction by seed, with drawn laws, numbers and starts, whose stated errors are compared with
true ones: ``python -m tests.contacts.drawn_scenes FIRST LAST``. They have no part in any choice of the package."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from tests.contacts.stated_errors import counts, rows_of
from tests.contacts.stated_scenes import (
    BALL,
    BALL_MASS,
    BRUSH,
    COIN,
    COIN_MASS,
    EGG,
    EGG_MASS,
    MAGIC,
    RING,
    RING_MASS,
    SLIP,
    TMEASY,
    Case,
    Data,
    belt,
    block,
    bristles,
    carried,
    chain,
    coulomb,
    dropped,
    free,
    housed,
    leg,
    pendulum,
    plank,
    rotor,
    slider_crank,
    table,
    turned,
    wheel,
)


class Draw:
    """Laws and numbers of a scene, by a seed."""

    def __init__(self, seed: int) -> None:
        self._rng = np.random.default_rng(seed)

    def number(self, low: float, high: float) -> float:
        return round(float(self._rng.uniform(low, high)), 4)

    def vector(self, *sizes: float) -> list[float]:
        return [self.number(-size, size) for size in sizes]

    def one(self, *items: Any) -> Any:
        return items[self._rng.integers(len(items))]

    def normal(self) -> Data:
        n = self.number
        return self.one(
            {"type": "linear", "stiffness": n(1e4, 3e4), "damping": n(5, 40), "onset": n(5e-4, 2e-3)},
            {"type": "hunt_crossley", "stiffness": n(3e5, 2e6), "damping": n(0.1, 0.6)},
            {"type": "hertz", "modulus": n(4e5, 2e6), "curvature_radius": 0.05},
            {
                "type": "lankarani_nikravesh",
                "stiffness": n(4e5, 2e6),
                "restitution": n(0.4, 0.9),
                "impact_velocity": 1.5,
            },
            {"type": "formula", "force": f"{n(1e6, 3e6)} * deflection**2 * max(1 - {n(0.1, 0.4)} * rate, 0)"},
        )

    def tangential(self) -> Data:
        n = self.number
        return self.one(
            coulomb(n(0.1, 0.8), n(0.01, 0.05)),
            bristles(n(0.2, 0.8), n(5e-4, 2e-3), n(0.2, 1.0)),
            {"type": "viscous", "damping": n(1.0, 5.0)},
        )

    def tyre(self) -> Data:
        n = self.number
        brush = {**BRUSH, "coefficients": {"STIFFNESS": n(10, 25), "FRICTION": n(0.6, 1.1)}}
        slip = {**SLIP, "coefficients": {"STIFFNESS_X": n(10, 20), "STIFFNESS_Y": n(8, 16), "FRICTION": n(0.5, 1.0)}}
        return self.one(brush, slip, MAGIC, TMEASY)

    def body(self, shape: Data, mass: Data, height: float) -> Data:
        surface = self.one("", f"{self.number(0.005, 0.02)} * cos({self.number(3, 8)} * x)")
        start = {"q": [*self.vector(0.1, 0.1), height + self.number(0.01, 0.04)], "v": self.vector(5, 5, 12, 1, 1, 0.2)}
        return free(shape, mass, self.normal(), self.tangential(), surface, **start, turn=turned(self.number(0.3, 1.4)))


def _wheel(draw: Draw) -> Data:
    return wheel(draw.tyre(), draw.number(8, 25), draw.number(200, 900), draw.number(0, 0.6), draw.number(-0.1, 0.1))


#: Scenes with durations and steps, s.
FAMILIES: Mapping[str, tuple[Callable[[Draw], Data], float, float]] = {
    "ball": (lambda d: dropped(d.normal(), d.number(0.08, 0.2), d.number(0.3, 1.0), v=d.number(-1, 0.5)), 0.5, 5e-4),
    "belt": (
        lambda d: belt(d.one(coulomb(d.number(0.3, 0.7)), bristles(d.number(0.3, 0.7))), d.number(0.05, 0.2)),
        1.5,
        1e-3,
    ),
    "block": (
        lambda d: block(d.tangential(), d.number(0.1, 0.5), q=[d.number(0, 0.3), 0, 0.08], v=d.vector(1, 0.6, 0.1)),
        0.4,
        5e-4,
    ),
    "table": (
        lambda d: table(
            d.tangential(),
            q=[0, 0, 0.075],
            turn=turned(d.number(0.05, 0.2), 1, 0.5, 0),
            v=d.vector(0, 0, 5, 0.4, 0.3, 0),
        ),
        0.4,
        5e-4,
    ),
    "ball on a surface": (lambda d: d.body(BALL, BALL_MASS, 0.07), 0.5, 5e-4),
    "egg": (lambda d: d.body(EGG, EGG_MASS, 0.09), 0.4, 5e-4),
    "coin": (lambda d: d.body(COIN, COIN_MASS, 0.07), 0.4, 2.5e-4),
    "ring": (lambda d: d.body(RING, RING_MASS, 0.09), 0.4, 2.5e-4),
    "housing": (
        lambda d: housed(
            d.one("cylinder", "sphere"),
            d.normal(),
            d.tangential(),
            q=d.vector(0.05, 0.02, 0.03),
            v=d.vector(0, 10, 0, 0.6, 0.3, 0.3),
        ),
        0.5,
        5e-4,
    ),
    "bore": (lambda d: slider_crank(d.number(3e-4, 1e-3), coulomb(d.number(0.05, 0.3), 0.05)), 0.2, 1e-4),
    "rotor": (lambda d: rotor(coulomb(d.number(0.05, 0.3), 0.1)), 0.4, 2.5e-4),
    "pendulum": (
        lambda d: pendulum(d.one(1, 2, 3), d.normal(), coulomb(d.number(0.1, 0.5), 0.02), -d.number(0.4, 1.2)),
        0.8,
        5e-4,
    ),
    "leg": (lambda d: leg(d.one(bristles(d.number(0.5, 0.9)), coulomb(d.number(0.3, 0.9), 0.05))), 0.8, 5e-4),
    "chain": (lambda d: chain(d.one(2, 3, 5), d.tangential(), d.number(0.1, 0.6)), 0.35, 5e-4),
    "ball on a moving table": (lambda d: carried(d.normal(), d.tangential()), 0.4, 2.5e-4),
    "plank": (lambda d: plank(d.one(bristles(d.number(0.4, 0.9)), coulomb(d.number(0.3, 0.8), 0.02))), 0.5, 1e-3),
    "wheel": (_wheel, 0.5, 1e-3),
}


def drawn(seed: int) -> Case:
    """Return the scene of a seed; families follow one another."""
    name = [*FAMILIES][seed % len(FAMILIES)]
    scene, duration, step = FAMILIES[name]
    return Case(f"{seed} {name}", scene(Draw(seed)), duration, step)


def main(first: int, last: int) -> int:
    """Print runs of the scenes of seeds, and counts."""
    found = []
    for seed in range(first, last):
        try:
            for row in rows_of(drawn(seed)):
                found.append(row)
                print(row, "" if row.near or not row.counted else "<<<", flush=True)
        except Exception as error:  # of the reference
            print(seed, "no reference:", repr(error)[:200], flush=True)
    print(counts(found))
    return 0


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
