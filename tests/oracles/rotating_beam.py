"""Frequencies of a rotating cantilever by power series of its differential equation (Frobenius), to any number of
digits.

With lengths in units of L and rates in units of sqrt(EI / (rhoA L^4)), hub radius d and rotor speed n, the amplitude
obeys

    w'''' - n^2 (T w')' - (omega^2 + k n^2) w = 0,    T = (1 - x^2)/2 + d (1 - x),    k = 0 out of, 1 in the plane of
    rotation,

clamped at x = 0 and free at x = 1. Its coefficients are polynomials, so two power series about the clamped end span all
solutions. There is no shape function and no integral here.
"""

from __future__ import annotations

import numpy as np
from mpmath import findroot, mpf, workdps

TERMS = 90


def _free_end(omega: object, speed: object, hub: object, in_plane: bool, one: object) -> object:
    """Return the determinant of bending moment and shear force at the tip; `one` says in which arithmetic."""
    tension = (one / 2 + hub, -hub, -one / 2)
    own = omega * omega + (speed * speed if in_plane else 0)
    ends = []
    for order in (2, 3):
        c = [0 * own] * (TERMS + 4)
        c[order] = one + 0 * own
        for n in range(TERMS):
            pull = tension[0] * (n + 2) * c[n + 2] + tension[1] * (n + 1) * c[n + 1] + tension[2] * n * c[n]
            c[n + 4] = (speed * speed * (n + 1) * pull + own * c[n]) / ((n + 4) * (n + 3) * (n + 2) * (n + 1))
        moment = sum((n * (n - 1) * c[n] for n in range(2, TERMS + 4)), 0 * own)
        shear = sum((n * (n - 1) * (n - 2) * c[n] for n in range(3, TERMS + 4)), 0 * own)
        ends.append((moment, shear))
    (moment_2, shear_2), (moment_3, shear_3) = ends
    return moment_2 * shear_3 - moment_3 * shear_2


def frequencies(count: int, speed: float, hub: float = 0.0, *, in_plane: bool = False, digits: int = 30) -> list[mpf]:
    """Return the first frequencies in units of sqrt(EI / (rhoA L^4)), below 100."""
    grid = np.linspace(0.05, 100.0, 2000)
    values = _free_end(grid, speed, hub, in_plane, 1.0)
    changes = np.flatnonzero(np.diff(np.sign(values)))[:count]
    with workdps(digits):
        arguments = mpf(speed), mpf(hub), in_plane, mpf(1)
        brackets = [(mpf(grid[i]), mpf(grid[i + 1])) for i in changes]
        return [findroot(lambda z: _free_end(z, *arguments), bracket, solver="anderson") for bracket in brackets]
