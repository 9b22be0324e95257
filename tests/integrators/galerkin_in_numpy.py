"""Time-discontinuous Galerkin steps in passes for y' = F(y, t), from published numbers, by NumPy's own polynomials."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.polynomial import laguerre, legendre
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Scheme:
    """Degree of the polynomials, the one eigenvalue, passes."""

    degree: int
    gamma: float
    passes: int

    @cached_property
    def nodes(self) -> Array:
        """Zeros of P_s - P_{s-1} on (0, 1]."""
        s = self.degree + 1
        nodes = np.sort(legendre.legroots([*np.zeros(s - 1), -1.0, 1.0]) + 1.0) / 2.0
        nodes[-1] = 1.0
        return np.asarray(nodes)

    @cached_property
    def integration(self) -> Array:
        """Radau IIA's A."""
        s = self.degree + 1
        integrals = np.array([[c ** (k + 1) / (k + 1) for k in range(s)] for c in self.nodes])
        return np.asarray(integrals @ np.linalg.inv(np.vander(self.nodes, s, increasing=True)))

    @cached_property
    def values(self) -> Array:
        """L_j(c_i/gamma)."""
        return np.array([laguerre.lagval(self.nodes / self.gamma, unit) for unit in np.eye(self.degree + 1)]).T

    @cached_property
    def first(self) -> Array:
        """P at the nodes."""
        one = np.eye(self.degree + 1)
        shifted = self.gamma * (one - np.eye(self.degree + 1, k=-1))
        return np.asarray(self.values @ shifted @ np.linalg.inv(self.values))

    @cached_property
    def defect(self) -> Array:
        """r of T = P - gamma r e_p^T."""
        inner = np.linalg.solve(self.values, (self.first - self.integration) @ self.values) / self.gamma
        assert np.abs(inner[:, :-1]).max() < 1e-13
        return np.asarray(inner[:, -1])


#: Of the dossier of this project; TDG3 with six passes, since five give order 6 to what is not linear.
SCHEMES = {
    "tdg1": Scheme(1, 1.0 - np.sqrt(0.5), 2),
    "tdg1_star": Scheme(1, 1.0 / np.sqrt(6.0), 3),
    "tdg2": Scheme(2, 0.25, 4),
    "tdg2s": Scheme(2, 0.43586652150845900, 2),
    "tdg3": Scheme(3, 0.165, 6),
}
ORDERS = {"tdg1": 3, "tdg1_star": 3, "tdg2": 5, "tdg2s": 4, "tdg3": 7}


def stepped(
    scheme: Scheme,
    rate: Callable[[float, Array], Array],
    jacobian: Callable[[float, Array], Array],
    t: float,
    y: Array,
    h: float,
) -> Array:
    """Return y behind a step."""
    s, inverse = scheme.degree + 1, np.linalg.inv(np.eye(len(y)) - scheme.gamma * h * jacobian(t, y))
    Y = np.tile(y, (s, 1))
    for number in range(scheme.passes):
        rates = np.array([rate(t + c * h, value) for c, value in zip(scheme.nodes, Y, strict=True)])
        matrix = scheme.integration if number else scheme.first
        right = np.linalg.solve(scheme.values, y + h * matrix @ rates - Y)
        change = np.zeros_like(Y)
        whole = right[0]
        change[0] = inverse @ whole
        for j in range(1, s):
            whole = right[j] - (change[j - 1] - whole)
            change[j] = inverse @ whole
        Y = Y + scheme.values @ change
    return np.asarray(Y[-1])
