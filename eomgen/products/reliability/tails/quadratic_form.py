"""Quadratic forms of standard normal variables: a response to second order, and its moments in closed form."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from eomgen.base.arrays import Array
from eomgen.errors import ModelError

#: Hessian, by the gradient, that rounding leaves of a linear response.
_ROUNDED = 1e-9


@dataclass(frozen=True)
class QuadraticForm:
    """y(z) = value + gradient . z + z . hessian z / 2 of independent standard normal z.

    Attributes
    ----------
    value : y at z = 0
    gradient : (n,)
    hessian : (n, n), symmetric

    Raises
    ------
    ModelError
        If a number is not finite, or shapes do not match.

    References
    ----------
    Mathai, Provost: Quadratic Forms in Random Variables (1992), 3.2: cumulants.
    """

    value: float
    gradient: Array
    hessian: Array

    def __post_init__(self) -> None:
        n = len(self.gradient)
        if self.hessian.shape != (n, n):
            fault = f"a quadratic form of {n} variables needs a Hessian ({n}, {n}), found {self.hessian.shape}"
            raise ModelError(fault)
        if not (np.isfinite(self.value) and np.isfinite(self.gradient).all() and np.isfinite(self.hessian).all()):
            raise ModelError(
                "a quadratic form needs finite numbers", "a response that is defined at the expansion point"
            )

    @property
    def linear(self) -> bool:
        """Whether the Hessian is 0 but for rounding."""
        return bool(np.linalg.norm(self.hessian) <= _ROUNDED * np.linalg.norm(self.gradient))

    @cached_property
    def principal(self) -> tuple[Array, Array]:
        """Eigenvalues (n,) of the Hessian, and the gradient (n,) along their eigenvectors."""
        values, vectors = np.linalg.eigh(0.5 * (self.hessian + self.hessian.T))
        return values, vectors.T @ self.gradient

    def cumulants(self) -> Array:
        """Return the first four cumulants (4,)."""
        values, slopes = self.principal
        first = self.value + 0.5 * values.sum()
        factorial = [1.0, 1.0, 2.0, 6.0, 24.0]
        higher = [
            0.5 * factorial[r - 1] * np.sum(values**r) + 0.5 * factorial[r] * np.sum(slopes**2 * values ** (r - 2))
            for r in (2, 3, 4)
        ]
        return np.array([first, *higher])

    @property
    def mean(self) -> float:
        return float(self.cumulants()[0])

    @property
    def standard_deviation(self) -> float:
        return float(np.sqrt(self.cumulants()[1]))

    @property
    def skewness(self) -> float:
        _, second, third, _ = self.cumulants()
        return float(third / second**1.5) if second**1.5 > 0.0 else float("nan")

    @property
    def excess_kurtosis(self) -> float:
        _, second, _, fourth = self.cumulants()
        return float(fourth / second**2) if second**2 > 0.0 else float("nan")

    def values(self, points: Array) -> Array:
        """Return y (m,) at points (m, n)."""
        bent = np.einsum("mi,ij,mj->m", points, self.hessian, points, optimize=True)
        return np.asarray(self.value + points @ self.gradient + 0.5 * bent)

    def covariance(self, other: QuadraticForm) -> float:
        """Return the covariance with another quadratic form of the same variables."""
        return float(self.gradient @ other.gradient + 0.5 * np.sum(self.hessian * other.hessian))

    def about(self, point: Array, value: float) -> QuadraticForm:
        """Return the form of z with this one's gradient and Hessian at a point (n,) with that value."""
        bent = self.hessian @ point
        constant = value - self.gradient @ point + 0.5 * point @ bent
        return QuadraticForm(float(constant), self.gradient - bent, self.hessian)
