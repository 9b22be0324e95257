"""Two ensembles: Duffing's oscillator and a double pendulum of rods, from random starts, over 10 s.

The oscillator is x'' = -0.3 x' + x - x^3 + 0.5 cos(1.2 t). The rods have 1 m and 1 kg, g is 9.81 m/s^2, and a state is
both angles from the vertical and their rates.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from functools import partial
from itertools import chain
from typing import Any

import numpy as np
from serve import largest_difference

DUFFING, PENDULUM = "duffing", "double pendulum"
END, GRAVITY = 10.0, 9.81
#: Samples on which settings are chosen.
PROBE = 64


def starts(problem: str, samples: int) -> Any:
    """Return states (samples, 2 or 4) at t = 0."""
    random = np.random.default_rng(7)
    if problem == DUFFING:
        return random.uniform(-1.0, 1.0, (samples, 2))
    return random.uniform(-1.0, 1.0, (samples, 4)) * [1.0, 1.0, 0.5, 0.5]


def duffing(t: Any, y: Any, cos: Callable[[Any], Any]) -> tuple[Any, Any]:
    """Return the rates of x and x'."""
    x, v = y
    return v, -0.3 * v + x - x * x * x + 0.5 * cos(1.2 * t)


def pendulum(y: Any, sin: Callable[[Any], Any], cos: Callable[[Any], Any]) -> tuple[Any, Any, Any, Any]:
    """Return the rates of both angles and of their rates, M solved by hand."""
    a, b, u, w = y
    sine, cosine = sin(a - b), cos(a - b)
    first = -0.5 * sine * w * w - 1.5 * GRAVITY * sin(a)
    second = 0.5 * sine * u * u - 0.5 * GRAVITY * sin(b)
    determinant = 4.0 / 9.0 - 0.25 * cosine * cosine
    return (
        u,
        w,
        (first / 3.0 - 0.5 * cosine * second) / determinant,
        (4.0 / 3.0 * second - 0.5 * cosine * first) / determinant,
    )


def cheapest(
    ways: Iterable[Iterable[tuple[str, Callable[[int], Any]]]], expected: Any, samples: int, target: float
) -> tuple[str, Callable[[], Any]]:
    """Return the name and the run of the fastest way that meets an error.

    Each of ``ways`` goes from loose to tight settings, whose runs take a number of samples. Of each way the first
    setting that meets the target on some samples competes; that of the fastest is tightened until all samples meet it.
    Raises ValueError where none does.
    """
    probe, closest = min(samples, PROBE), float("inf")
    found: list[tuple[float, str, Any, Any]] = []
    for way in ways:
        settings = iter(way)
        for name, run in settings:
            error = _error(run, probe, expected)
            closest = min(closest, error)
            if error <= target:
                began = time.process_time()
                run(probe)
                found.append((time.process_time() - began, name, run, settings))
                break
    for _, name, run, tighter in sorted(found, key=lambda one: one[0])[:1]:
        for told, way in chain([(name, run)], tighter):
            closest = _error(way, samples, expected)
            if closest <= target:
                return told, partial(way, samples)
    raise ValueError(f"no setting meets {target:g}: the closest is off by {closest:.1e}")


def _error(run: Callable[[int], Any], samples: int, expected: Any) -> float:
    try:
        return largest_difference(run(samples), expected[:samples])
    except (RuntimeError, ValueError):
        return float("inf")
