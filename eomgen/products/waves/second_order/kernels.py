"""Kernels of two waves i and j with amplitudes 1 at one depth, on values of any algebra.

Labels are (a, b, c) with c = 0 at the free surface; positions are labels + e xi + e^2 eta, pressure over density is
-g c + e p1 + e^2 p2. Irrotational flow: eta_t = (xi . grad) u + grad Phi, u = xi_t, with Phi harmonic, which
tests/waves/residuals.py holds to the hierarchy of equations. The dynamic condition at c = 0,

    Phi_tt + g Phi_c = -d/dt (|u|^2 / 2 + xi . u_t) - g (xi . grad) w,

is projected on the sines of sum and difference of two phases. Kernels have no differences of nearly equal numbers,
which lose all digits; arguments by name in their place are w = w_i - w_j, delta = k_i - k_j, lean = 1 - cos of the
angle between both, dt = tanh k_i h - tanh k_j h, s = 1 / sinh^2 k h, q = C_i C_j - 1, E = Ch_i Ch_j - Sh_i Sh_j,
lag = Sh_i Ch_j - Ch_i Sh_j; of the wave vector (px, py) of the sum or difference kT = k tanh k h, P = cosh k (c + h) /
cosh k h and its derivative Pc by c. The argument ``one`` is 1. The
order of operations decides the bits of seas.
Sources: Fouques, Krogstad and Myrhaug, JOMAE 128 (2006) 177; Nouguier, Chapron and Guerin, JFM 772 (2015) 165.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import SimpleNamespace
from typing import Any


def _sum(x: SimpleNamespace) -> list[Any]:
    """Return coefficients of Phi (sine), x and y (sine), z (cosine) at the sum of both phases."""
    rate = x.w_i + x.w_j
    response = x.one / (-(rate * rate) + x.kT * x.g)
    cubes = [_cube(x.w_i, x.s_i), _cube(x.w_j, x.s_j)]
    gap = x.q - x.lean * x.C_i * x.C_j
    product = x.w_i * x.w_j * gap * rate
    forced = -cubes[0] - cubes[1] - product
    potential, slow = x.P * response * forced, x.one / rate
    along = _displacements(x, x.lean * x.Ch_i * x.Ch_j - x.E, response, forced, slow)
    mixed = x.Ch_i * x.Sh_j * x.k_j * x.w_j + x.Ch_j * x.Sh_i * x.k_i * x.w_i
    leaning, turning = 0.5 * x.lean * mixed, x.delta * x.w_j + x.w * x.k_i
    lagging, rising = 0.5 * x.lag * turning, x.Pc * response * forced
    return [potential, *along, slow * (leaning - lagging + rising)]


def _difference(x: SimpleNamespace) -> list[Any]:
    """Return the coefficients of ``_sum`` at the difference of both phases, i less j."""
    response = x.one / (-(x.w * x.w) + x.kT * x.g)
    squares = x.w_i * x.w_i + x.w_j * x.w_j + x.w_i * x.w_j
    steep, cosine = 0.5 * x.s_j * x.w * squares, 1.0 - x.lean
    both = 1.0 + x.C_i * x.C_j * cosine
    product, cube = x.w * x.w_i * x.w_j * both, x.w_i * x.w_i * x.w_i
    sums = x.C_i + x.C_j
    deep = 0.5 * x.dt * x.C_i * x.C_j * cube * sums
    forced = -steep - product + deep
    potential, slow = x.P * response * forced, x.one / x.w
    along = _displacements(x, x.Sh_i * x.Sh_j + x.Ch_i * x.Ch_j * cosine, response, forced, slow)
    rising, less = x.Pc * response * forced, 1.0 - 0.5 * x.lean
    turning, mixed = x.delta * x.w_j + x.w * x.k_i, x.Ch_i * x.Sh_j + x.Ch_j * x.Sh_i
    turned, mean = 0.5 * less * turning * mixed, 0.5 * x.k_i * x.w_i + 0.5 * x.k_j * x.w_j
    lagging = 0.5 * x.lag * x.lean * mean
    return [potential, *along, slow * (rising + turned - lagging)]


def _degenerate(x: SimpleNamespace) -> list[Any]:
    """Return the difference of phases that do not move against one another: the drift velocity along x and y (cosine),
    then x, y (sine) and z (cosine) of grad |xi|^2 / 4 and grad Q, which takes the pressure of both from the
    surface."""
    upright, cosine = x.Sh_i * x.Sh_j, 1.0 - x.lean
    factor = upright + x.Ch_i * x.Ch_j * cosine
    drift = [factor * speed(x) for speed in _SPEEDS]
    lifted = [0.25 * x.Sh_i * x.Sh_j, 0.25 * x.Ch_i * x.Ch_j * cosine]
    of_kT, of_g = x.one / x.kT, x.one / x.g
    still = 0.5 * x.P * x.s_i * x.w_i * x.w_j * of_kT * of_g
    static = -lifted[0] - lifted[1] + still
    along, mixed = [x.px * static, x.py * static], x.Ch_i * x.Sh_j * x.k_j + x.Ch_j * x.Sh_i * x.k_i
    slopes = [0.25 * cosine * mixed, 0.25 * x.Ch_i * x.Sh_j * x.k_i, 0.25 * x.Ch_j * x.Sh_i * x.k_j]
    steep = 0.5 * x.Pc * x.s_i * x.w_i * x.w_j * of_kT * of_g
    return [*drift, *along, slopes[0] + slopes[1] + slopes[2] - steep]


def _cube(w: Any, s: Any) -> Any:
    power = w * w * w
    return 0.5 * s * power


_SPEEDS: tuple[Callable[[SimpleNamespace], Any], ...] = (
    lambda x: 0.5 * x.kx_i * x.w_i + 0.5 * x.kx_j * x.w_j,
    lambda x: 0.5 * x.ky_i * x.w_i + 0.5 * x.ky_j * x.w_j,
)


def _displacements(x: SimpleNamespace, factor: Any, response: Any, forced: Any, slow: Any) -> list[Any]:
    """Return the coefficients along x and y: integrals by time of the velocities of (xi . grad) u and grad Phi."""
    result = []
    for speed, p in zip(_SPEEDS, (x.px, x.py), strict=True):
        carried = factor * speed(x)
        result.append(slow * (-carried - x.P * p * response * forced))
    return result


KERNELS: Mapping[str, Callable[[SimpleNamespace], list[Any]]] = {
    "sum": _sum,
    "difference": _difference,
    "degenerate": _degenerate,
}
