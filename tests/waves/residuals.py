"""Residuals of the full nonlinear Lagrangian equations, from positions and pressures alone: derivatives by labels are
differences of fourth order, whose own error is below 1e-9. Of their second order also by SymPy."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import sympy
from sympy import Expr, Matrix, diff

from eomgen.base.arrays import Array
from eomgen.waves import Components, Motion, Sea

STEP = 0.1
_PLACES = np.array([-2.0, -1.0, 1.0, 2.0])
_WEIGHTS = np.array([1.0, -8.0, 8.0, -1.0]) / (12.0 * STEP)


@dataclass(frozen=True)
class Residuals:
    """Greatest magnitudes over all labels."""

    continuity: float
    vorticity: float
    momentum: float
    pressure: float
    bottom: float

    @property
    def of_equations(self) -> Array:
        return np.array([self.continuity, self.vorticity, self.momentum])


def _around(sea: Sea, places: Array, time: float, c: float) -> Callable[[Callable[[Motion], Array]], Array]:
    """Return what takes the gradient by labels of a quantity of the motion, (points, ..., 3)."""
    at = [
        [sea.motion(places + move[:2], time, c + move[2]) for move in _PLACES[:, None] * STEP * np.eye(3)[axis]]
        for axis in range(3)
    ]

    def gradient(of: Callable[[Motion], Array]) -> Array:
        columns = [sum(w * of(m) for w, m in zip(_WEIGHTS, row, strict=True)) for row in at]
        return np.stack(columns, axis=-1)

    return gradient


def vorticity(sea: Sea, places: Array, time: float, c: float) -> Array:
    """Return the invariants of Cauchy, (points, 3, 3), which keep their values on a particle."""
    gradient = _around(sea, places, time, c)
    products = np.einsum("nki,nkj->nij", gradient(lambda m: m.position), gradient(lambda m: m.velocity))
    return products - np.swapaxes(products, 1, 2)


def residuals(sea: Sea, depths: Sequence[float], labels: int = 60) -> Residuals:
    """Return residuals at random labels of several depths, at a random time each."""
    random = np.random.default_rng(3)
    worst = np.zeros(4)
    for c in depths:
        places, time = random.uniform(-100.0, 100.0, (labels, 2)), float(random.uniform(0.0, 10.0))
        gradient = _around(sea, places, time, c)
        here = sea.motion(places, time, c)
        X, U = gradient(lambda m: m.position), gradient(lambda m: m.velocity)
        products = np.einsum("nki,nkj->nij", X, U)
        carried = np.einsum("nki,nk->ni", X, here.acceleration)
        momentum = carried + sea.restoring * X[:, 2] + gradient(lambda m: m.pressure)
        found = [np.linalg.det(X) - 1.0, products - np.swapaxes(products, 1, 2), momentum]
        found.append(here.pressure if c == 0.0 else np.zeros(1))
        worst = np.maximum(worst, [np.abs(x).max() for x in found])
    bottom = 0.0
    if np.isfinite(sea.depth):
        low = sea.motion(places, time, -sea.depth).position[:, 2]
        bottom = float(np.abs(low + sea.depth).max())
    return Residuals(*map(float, worst), bottom)


def three_waves(small: float, vectors: Sequence[tuple[float, float]]) -> Components:
    """Return three components with amplitudes in the ratio 1 : 0.7 : 0.5, steepest about ``small``."""
    amplitude = np.array([1.0, 0.7, 0.5]) * small / 0.06
    return Components(np.array(vectors), amplitude, np.array([0.3, 1.0, 2.0]))


LABELS = sympy.symbols("a b c", real=True)
TIME, SMALL, GRAVITY = sympy.symbols("t epsilon g", real=True)


def hierarchy() -> Mapping[str, tuple[list[Expr], list[Expr]]]:
    """Return momentum (3 equations), continuity (1) and vorticity (3) by name, each as expressions of first and of
    second order that are to be zero. They contain functions X1, Y1, Z1, P1 and X2, Y2, Z2, P2 of labels and time."""
    at = (*LABELS, TIME)
    first, second = ([sympy.Function(f"{name}{order}")(*at) for name in "XYZ"] for order in (1, 2))
    p1, p2 = (sympy.Function(f"P{order}")(*at) for order in (1, 2))
    position = [label + SMALL * x + SMALL**2 * y for label, x, y in zip(LABELS, first, second, strict=True)]
    pressure = -GRAVITY * LABELS[2] + SMALL * p1 + SMALL**2 * p2
    gradient = Matrix([[diff(x, label) for label in LABELS] for x in position])
    velocity = [diff(x, TIME) for x in position]
    carried = [sum(gradient[k, i] * velocity[k] for k in range(3)) for i in range(3)]  # (grad X)^T X_t
    equations = {
        "momentum": [
            sum(diff(x, TIME, 2) * diff(x, label) for x in position)
            + GRAVITY * diff(position[2], label)
            + diff(pressure, label)
            for label in LABELS
        ],
        "continuity": [gradient.det() - 1],
        "vorticity": [
            diff(carried[(i + 2) % 3], LABELS[(i + 1) % 3]) - diff(carried[(i + 1) % 3], LABELS[(i + 2) % 3])
            for i in range(3)
        ],
    }
    return {
        name: ([_order(item, 1) for item in items], [_order(item, 2) for item in items])
        for name, items in equations.items()
    }


def _order(expression: Expr, order: int) -> Expr:
    return sympy.expand(expression.doit()).coeff(SMALL, order)


def second_order_residuals() -> Mapping[str, Expr]:
    """Return, by equation, the residual of the equations of second order for the solution of the kernels; 0 for a valid
    one.

    xi = grad psi with psi two harmonic exponentials of any growth in time; eta_t = (xi . grad) u, and p2 without Phi,
    which is harmonic and solves the linear equations. Each equation is differentiated by time once, so that eta enters
    through its velocity.
    """
    growth = [sympy.Function(f"f{i}")(TIME) for i in (1, 2)]
    p, r = sympy.symbols("p_1 p_2"), sympy.symbols("r_1 r_2")
    q = [sympy.I * sympy.sqrt(p[i] ** 2 + r[i] ** 2) for i in range(2)]
    a, b, c = LABELS
    psi = sum(growth[i] * sympy.exp(p[i] * a + q[i] * b + r[i] * c) for i in range(2))
    xi = [diff(psi, label) for label in LABELS]
    u = [diff(x, TIME) for x in xi]
    velocity = [sum(x * diff(v, label) for x, label in zip(xi, LABELS, strict=True)) for v in u]
    p1 = -diff(psi, TIME, 2) - GRAVITY * xi[2]
    energy = sum(v * v for v in u) / 2 + sum(x * diff(v, TIME) for x, v in zip(xi, u, strict=True))
    names = [sympy.Function(f"{name}{order}")(*LABELS, TIME) for order in (1, 2) for name in "XYZP"]
    of_first = dict(zip(names, (*xi, p1, 0, 0, 0, 0), strict=True))
    of_second = dict(zip(names, (0, 0, 0, 0, *velocity, -diff(energy, TIME) - GRAVITY * velocity[2]), strict=True))
    left = {}
    for name, (_, items) in hierarchy().items():
        each = [diff(x.subs(of_first).doit(), TIME) + x.subs(of_second).doit() for x in items]
        left[name] = sum(abs(sympy.expand(x)) for x in each)
    return left
