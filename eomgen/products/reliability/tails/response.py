"""Responses to standard normal variables, and the cost of their evaluation."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np

from eomgen.base.arrays import Array
from eomgen.errors import NumericalError
from eomgen.products.reliability.tails.quadratic_form import QuadraticForm


class Expansion(NamedTuple):
    """A response at a point: its value, gradient (n,) and Hessian (n, n)."""

    value: float
    gradient: Array
    hessian: Array

    @property
    def form(self) -> QuadraticForm:
        """The quadratic form of an expansion at z = 0."""
        return QuadraticForm(self.value, self.gradient, self.hessian)


class Response(Protocol):
    """Evaluations of a scalar response y of n standard normal variables z."""

    @property
    def size(self) -> int:
        """n."""

    def values(self, points: Array) -> Array:
        """Return y (m,) at points (m, n)."""

    def gradient(self, point: Array) -> tuple[float, Array]:
        """Return y and its gradient (n,) at a point (n,)."""

    def expansion(self, point: Array) -> Expansion:
        """Return y with its gradient and Hessian at a point (n,)."""


class Multiplied(Response, Protocol):
    """A response whose Hessian can be multiplied by directions."""

    def products(self, point: Array, directions: Array) -> Array:
        """Return the Hessian at a point (n,) times directions (n, r): (n, r)."""


@dataclass
class Counted:
    """A response that counts its evaluations.

    Attributes
    ----------
    solved : times that a value alone was computed
    sloped : times that the value came with its gradient
    expanded : times that the value came with its gradient and Hessian
    """

    response: Response
    solved: int = field(default=0, init=False)
    sloped: int = field(default=0, init=False)
    expanded: int = field(default=0, init=False)

    @property
    def size(self) -> int:
        return self.response.size

    def values(self, points: Array) -> Array:
        self.solved += len(points)
        return self.response.values(points)

    def gradient(self, point: Array) -> tuple[float, Array]:
        self.sloped += 1
        return self.response.gradient(point)

    def expansion(self, point: Array) -> Expansion:
        self.expanded += 1
        result = self.response.expansion(point)
        if not (np.isfinite(result.value) and np.isfinite(result.gradient).all() and np.isfinite(result.hessian).all()):
            far = float(np.linalg.norm(point))
            fault = f"the response is not finite at a point {far:.3g} standard deviations from the mean"
            raise NumericalError(fault, "smaller steps, or thresholds nearer to the mean")
        return result
