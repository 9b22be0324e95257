"""Kernels of two waves i and j with amplitudes 1 at one depth, on values of any algebra.

Labels are (a, b, c) with c = 0 at the free surface; positions are labels + e xi + e^2 eta, pressure over density is
-g c + e p1 + e^2 p2. Irrotational flow: eta_t = (xi . grad) u + grad Phi, u = xi_t, with Phi harmonic, which
tests/waves/test_equations.py holds to the equations of motion. The dynamic condition at c = 0,

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
    gap = x.q - x.lean * x.C_i * x.C_j
    forced = -_cube(x.w_i, x.s_i) - _cube(x.w_j, x.s_j) - x.w_i * x.w_j * gap * rate
    slow = x.one / rate
    along = _displacements(x, x.lean * x.Ch_i * x.Ch_j - x.E, response, forced, slow)
    mixed = x.Ch_i * x.Sh_j * x.k_j * x.w_j + x.Ch_j * x.Sh_i * x.k_i * x.w_i
    leaning, lagging = 0.5 * x.lean * mixed, 0.5 * x.lag * (x.delta * x.w_j + x.w * x.k_i)
    return [x.P * response * forced, *along, slow * (leaning - lagging + x.Pc * response * forced)]


def _difference(x: SimpleNamespace) -> list[Any]:
    """Return the coefficients of ``_sum`` at the difference of both phases, i less j."""
    response, cosine = x.one / (-(x.w * x.w) + x.kT * x.g), 1.0 - x.lean
    steep = 0.5 * x.s_j * x.w * (x.w_i * x.w_i + x.w_j * x.w_j + x.w_i * x.w_j)
    product = x.w * x.w_i * x.w_j * (1.0 + x.C_i * x.C_j * cosine)
    deep = 0.5 * x.dt * x.C_i * x.C_j * (x.w_i * x.w_i * x.w_i) * (x.C_i + x.C_j)
    forced, slow = -steep - product + deep, x.one / x.w
    along = _displacements(x, x.Sh_i * x.Sh_j + x.Ch_i * x.Ch_j * cosine, response, forced, slow)
    turning, mixed = x.delta * x.w_j + x.w * x.k_i, x.Ch_i * x.Sh_j + x.Ch_j * x.Sh_i
    turned = 0.5 * (1.0 - 0.5 * x.lean) * turning * mixed
    lagging = 0.5 * x.lag * x.lean * (0.5 * x.k_i * x.w_i + 0.5 * x.k_j * x.w_j)
    return [x.P * response * forced, *along, slow * (x.Pc * response * forced + turned - lagging)]


def _degenerate(x: SimpleNamespace) -> list[Any]:
    """Return the difference of phases that do not move against one another: the drift velocity along x and y (cosine),
    then x, y (sine) and z (cosine) of grad |xi|^2 / 4 and grad Q, which takes the pressure of both from the
    surface."""
    cosine, of_kT, of_g = 1.0 - x.lean, x.one / x.kT, x.one / x.g
    drift = [(x.Sh_i * x.Sh_j + x.Ch_i * x.Ch_j * cosine) * speed(x) for speed in _SPEEDS]
    still = 0.5 * x.P * x.s_i * x.w_i * x.w_j * of_kT * of_g
    static = -(0.25 * x.Sh_i * x.Sh_j) - 0.25 * x.Ch_i * x.Ch_j * cosine + still
    mixed = x.Ch_i * x.Sh_j * x.k_j + x.Ch_j * x.Sh_i * x.k_i
    slopes = 0.25 * cosine * mixed + 0.25 * x.Ch_i * x.Sh_j * x.k_i + 0.25 * x.Ch_j * x.Sh_i * x.k_j
    steep = 0.5 * x.Pc * x.s_i * x.w_i * x.w_j * of_kT * of_g
    return [*drift, x.px * static, x.py * static, slopes - steep]


def _cube(w: Any, s: Any) -> Any:
    return 0.5 * s * (w * w * w)


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
