"""Bending shapes of uniform Euler-Bernoulli beams in mpmath: roots of the frequency equation, shapes, integrals by
quadrature.

All shapes live on 0 <= x <= 1 and are normalised to int phi^2 = 1. Nothing of eomgen is used; integrals are quadratures
of products, never closed forms.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache

import numpy as np
from mpmath import cos, cosh, findroot, mp, mpf, pi, quad, sin, sinh, sqrt, workdps

DIGITS = 45  # cosh(14) - sinh(14) loses 12 of them in the fifth shape, quadrature a few more


@cache
def root_and_ratio(support: str, mode: int) -> tuple[mpf, mpf]:
    """Return lambda and sigma of a mode (from 1), for `clamped-free` or `free-free`."""
    with workdps(DIGITS):
        if support == "clamped-free":
            root = findroot(lambda z: cos(z) + 1 / cosh(z), (mode - mpf(1) / 2) * pi)
            return root, (sinh(root) - sin(root)) / (cosh(root) + cos(root))
        root = findroot(lambda z: cos(z) - 1 / cosh(z), (mode + mpf(1) / 2) * pi)
        return root, (cosh(root) - cos(root)) / (sinh(root) - sin(root))


def shape(support: str, mode: int, derivative: int = 0) -> Callable[[mpf], mpf]:
    """Return a derivative of a shape as a function of x; rigid shapes of a free-free beam are not counted as modes."""
    if support == "pinned-pinned":
        return lambda x: sqrt(mpf(2)) * (mode * pi) ** derivative * sin(mode * pi * x + derivative * pi / 2)
    root, ratio = root_and_ratio(support, mode)
    sign = -1 if support == "clamped-free" else 1

    def value(x: mpf) -> mpf:
        z = root * x
        hyperbolic = (cosh(z), sinh(z)) if derivative % 2 == 0 else (sinh(z), cosh(z))
        circular = cos(z + derivative * pi / 2), sin(z + derivative * pi / 2)
        return root**derivative * (hyperbolic[0] + sign * circular[0] - ratio * (hyperbolic[1] + sign * circular[1]))

    return value


def integral(*factors: Callable[[mpf], mpf]) -> mpf:
    """Return the integral over 0 <= x <= 1 of a product of functions."""
    with workdps(DIGITS):

        def product(x: mpf) -> mpf:
            value = mpf(1)
            for factor in factors:
                value *= factor(x)
            return value

        return quad(product, np.linspace(0.0, 1.0, 5).tolist())


def stiffening(support: str, first: int, second: int) -> tuple[mpf, mpf, mpf]:
    """Return the integrals of (1 - x), of (1 - x^2)/2 and of 1 times phi' phi' of two modes."""
    slopes = shape(support, first, 1), shape(support, second, 1)
    with workdps(DIGITS):
        return integral(lambda x: 1 - x, *slopes), integral(lambda x: (1 - x * x) / 2, *slopes), integral(*slopes)


def sampled(support: str, modes: int, x: Sequence[float], derivative: int = 0) -> np.ndarray:
    """Return the first `modes` shapes (or a derivative of them) at points, shape (modes, points), rounded to
    doubles."""
    with workdps(DIGITS):
        functions = [shape(support, mode, derivative) for mode in range(1, modes + 1)]
        return np.array([[float(function(mp.mpf(float(point)))) for point in x] for function in functions]).reshape(
            modes, len(x)
        )
