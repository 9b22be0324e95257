"""Quadratic forms of standard normal variables, and responses that they approximate to second order or by
projections."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.rounding import COMPUTED
from eomgen.errors import ModelError


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
            fault = f"a quadratic form of {n} variables needs a Hessian ({n}, {n}), found {self.hessian.shape} [E1031]"
            raise ModelError(fault)
        if not (np.isfinite(self.value) and np.isfinite(self.gradient).all() and np.isfinite(self.hessian).all()):
            raise ModelError(
                "a quadratic form needs finite numbers [E1032]", "a response that is defined at the expansion point"
            )

    @property
    def linear(self) -> bool:
        """Whether the Hessian is 0 but for rounding."""
        return bool(np.linalg.norm(self.hessian) <= COMPUTED * np.linalg.norm(self.gradient))

    @cached_property
    def principal(self) -> tuple[Array, Array]:
        """Eigenvalues (n,) of the Hessian, and the gradient (n,) along the eigenvectors."""
        values, vectors = np.linalg.eigh(0.5 * (self.hessian + self.hessian.T))
        return values, vectors.T @ self.gradient

    def cumulants(self) -> Array:
        """Return the first four cumulants (4,): mean, variance, third and fourth, exact for independent standard normal
        z."""
        values, slopes = self.principal
        first = self.value + 0.5 * values.sum()
        factorial = [1.0, 1.0, 2.0, 6.0, 24.0]
        higher = [
            0.5 * factorial[r - 1] * np.sum(values**r) + 0.5 * factorial[r] * np.sum(slopes**2 * values ** (r - 2))
            for r in (2, 3, 4)
        ]
        return np.array([first, *higher])

    @property
    def moments(self) -> tuple[float, float, float, float]:
        """Mean, standard deviation, skewness and excess kurtosis; the last two are NaN without spread."""
        mean, second, third, fourth = self.cumulants().tolist()
        shape = (third / second**1.5, fourth / second**2) if second > 0.0 else (np.nan, np.nan)
        return mean, float(np.sqrt(second)), *shape

    @property
    def mean(self) -> float:
        return self.moments[0]

    @property
    def standard_deviation(self) -> float:
        return self.moments[1]

    def values(self, points: Array) -> Array:
        """Return y (m,) at points (m, n)."""
        bent = np.einsum("mi,ij,mj->m", points, self.hessian, points, optimize=True)
        return np.asarray(self.value + points @ self.gradient + 0.5 * bent)

    def covariance(self, form: QuadraticForm) -> float:
        """Return the covariance with another quadratic form of the same variables."""
        return float(self.gradient @ form.gradient + 0.5 * np.sum(self.hessian * form.hessian))

    def about(self, point: Array, value: float) -> QuadraticForm:
        """Return the form of z with the gradient and Hessian of this form at a point (n,) and the given value."""
        bent = self.hessian @ point
        constant = value - self.gradient @ point + 0.5 * point @ bent
        return QuadraticForm(float(constant), self.gradient - bent, self.hessian)


class ResponseExpansion(NamedTuple):
    """A response at a point: value, gradient (n,) and Hessian (n, n)."""

    value: float
    gradient: Array
    hessian: Array

    @property
    def form(self) -> QuadraticForm:
        """The quadratic form of an expansion at z = 0."""
        return QuadraticForm(self.value, self.gradient, self.hessian)


class Response(Protocol):
    """A scalar response y of n independent standard normal variables z, which can be evaluated with derivatives."""

    @property
    def size(self) -> int:
        """Number n of standard normal variables."""

    def values(self, points: Array) -> Array:
        """Return y (m,) at points (m, n)."""

    def gradient(self, point: Array) -> tuple[float, Array]:
        """Return y and the gradient (n,) at a point (n,)."""

    def expansion(self, point: Array) -> ResponseExpansion:
        """Return y with gradient and Hessian at a point (n,)."""


class HessianProductResponse(Response, Protocol):
    """A response whose Hessian can be multiplied by directions."""

    def products(self, point: Array, directions: Array) -> Array:
        """Return the Hessian at a point (n,) times directions (n, r): (n, r)."""


def hermite_projection(response: Response, pairs: int, seed: int) -> QuadraticForm:
    """Return the response's projection onto Hermite polynomials of degree 2, as a quadratic form. Its gradient and
    Hessian are the averages E grad y and E Hess y (Stein's identity), over ``pairs`` antithetic pairs z, -z of a
    scrambled Sobol sequence: odd terms of y drop out of the mean, even terms out of the mean gradient. Each pair takes
    two expansions of the response."""
    from scipy.stats import qmc  # noqa: PLC0415  # it takes half a second to import

    n = response.size
    whole = 1 << (pairs - 1).bit_length()  # sciPy considers the sequence balanced for powers of 2 only
    points = qmc.MultivariateNormalQMC(np.zeros(n), rng=seed).random(whole)[:pairs]
    value, gradient, hessian = 0.0, np.zeros(n), np.zeros((n, n))
    for point in points:
        for z in (point, -point):
            expansion = response.expansion(z)
            value += expansion.value / (2 * pairs)
            gradient += expansion.gradient / (2 * pairs)
            hessian += expansion.hessian / (2 * pairs)
    return QuadraticForm(value - 0.5 * float(np.trace(hessian)), gradient, hessian)


def leading_directions(gradients: Array, share: float) -> Array:
    """Return the least number of orthonormal directions (n, r) with a given share of the squares of gradients (m,
    n)."""
    _, values, rows = np.linalg.svd(gradients, full_matrices=False)
    held = np.cumsum(values**2) / np.sum(values**2)
    count = int(np.searchsorted(held, share - 1e-15) + 1)
    return rows[: min(count, len(rows))].T


def projected_hessian(products: Array, directions: Array) -> Array:
    """Return a Hessian (n, n) from products (n, r) with orthonormal directions (n, r): exact for pairs of vectors of
    which one lies in the span of the directions, zero for other pairs."""
    inner = directions.T @ products
    crossed = products @ directions.T
    result: Array = crossed + crossed.T - directions @ (0.5 * (inner + inner.T)) @ directions.T
    return result


@dataclass(frozen=True)
class ProjectedResponse:
    """A response with Hessians of a few directions alone (second-order projected differentiation).

    Attributes
    ----------
    response : whose Hessians are multiplied by directions
    directions : (n, r), orthonormal; at each point the gradient's is added
    """

    response: HessianProductResponse
    directions: Array

    @property
    def size(self) -> int:
        return self.response.size

    def values(self, points: Array) -> Array:
        return self.response.values(points)

    def gradient(self, point: Array) -> tuple[float, Array]:
        return self.response.gradient(point)

    def expansion(self, point: Array) -> ResponseExpansion:
        value, gradient = self.response.gradient(point)
        directions = _widen(self.directions, gradient)
        return ResponseExpansion(
            value, gradient, projected_hessian(self.response.products(point, directions), directions)
        )


def _widen(directions: Array, vector: Array) -> Array:
    """Return orthonormal directions (n, r + 1): the given ones (n, r) and the normalised rest of a vector (n,) outside
    their span; the given ones alone if the vector is in the span."""
    rest = vector - directions @ (directions.T @ vector)
    rest = rest - directions @ (directions.T @ rest)
    length = float(np.linalg.norm(rest))
    if length <= 1e-8 * float(np.linalg.norm(vector)):
        return directions
    return np.column_stack([directions, rest / length])
