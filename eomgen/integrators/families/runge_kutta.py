"""Runge-Kutta methods on Lie groups as data, and explicit tableaus in exact fractions: pairs, real stability intervals.

Munthe-Kaas, Appl. Numer. Math. 29 (1999) 115; Butcher, Numerical Methods for Ordinary Differential Equations (2016),
sections 301 and 315; Hairer and Wanner, Solving Ordinary Differential Equations II (1996), section IV.2.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any

from eomgen.base.data import dataclass
from eomgen.integrators.families.family import (
    BAD_ARGUMENT,
    NOT_FINITE,
    SINGULAR_MASS,
    Family,
    LinearTransitions,
    MethodName,
    Status,
)
from eomgen.integrators.families.needs import UNCONSTRAINED

if TYPE_CHECKING:
    from eomgen.system.system import System

Coefficients = tuple[Fraction, ...]


@dataclass(frozen=True)
class EmbeddedPair:
    """Explicit Runge-Kutta pair with its last stage at the end of the step; the solution of higher order goes on.

    Attributes
    ----------
    name : str
        Public name of the method in the Lie algebra.
    A : strictly lower triangular coefficients, (stages, stages)
    b, b_hat : weights of the solution and of the embedded solution, (stages,)
    c : nodes, (stages,)
    order, embedded_order : int
        Orders of both solutions.
    extension : (stages, degree)
        Continuous extension: the weight of stage i at the fraction s of a step is sum_k extension[i][k] s^(k+1). The
        order of the extension is its degree.
    source, extension_source : str
        Citations of the pair and of the extension.
    aliases : tuple of str
        Other public names.
    """

    name: str
    A: tuple[Coefficients, ...]
    b: Coefficients
    b_hat: Coefficients
    c: Coefficients
    order: int
    embedded_order: int
    extension: tuple[Coefficients, ...]
    source: str
    extension_source: str
    aliases: tuple[str, ...] = ()


def strictly_lower(*rows: Coefficients) -> tuple[Coefficients, ...]:
    """Return a square matrix from the entries of its rows before the diagonal."""
    return tuple((*row, *(Fraction(0),) * (len(rows) - len(row))) for row in rows)


def _dot(x: Sequence[Fraction], y: Sequence[Fraction]) -> Fraction:
    return sum((left * right for left, right in zip(x, y, strict=True) if left and right), Fraction(0))


@cache
def real_stability(A: tuple[Coefficients, ...], b: Coefficients) -> float:
    """Return the length of the interval of absolute stability on the negative real axis.

    The stability polynomial is R(z) = 1 + sum_k z^k b A^(k-1) 1; the interval ends at the smallest x > 0 beyond which
    abs(R(-x)) > 1.
    """
    import numpy as np  # noqa: PLC0415  # only runs with explicit steps ask for it

    ones, coefficients = (Fraction(1),) * len(b), [1.0]
    for power in range(1, len(b) + 1):
        coefficients.append((-1.0) ** power * float(_dot(b, ones)))
        ones = tuple(_dot(row, ones) for row in A)
    constant = np.eye(1, len(coefficients), len(coefficients) - 1)[0]
    R = np.array(coefficients[::-1])
    roots = np.concatenate([np.roots(R - constant), np.roots(R + constant)])
    bounds = sorted(float(root.real) for root in roots if abs(root.imag) < 1e-9 and root.real > 1e-9)
    for lower, upper in zip(bounds, [*bounds[1:], 2.0 * bounds[-1]], strict=True):
        if abs(np.polyval(R, 0.5 * (lower + upper))) > 1.0:
            return lower
    return 0.0


@dataclass(frozen=True)
class RungeKuttaMuntheKaas(Family):
    """An explicit Runge-Kutta method in the Lie algebra, with the terms of T^-1 that its order requires.

    Attributes
    ----------
    A, b, c : exact fractions
        The tableau; stage i uses earlier stages only.
    commutators : int
        Nested brackets after which T^-1 (dexp^-1 of other texts) is truncated: T^-1 v = v + [theta, v]/2 + [theta,
        [theta, v]]/12 + ...; order p needs p - 2 brackets. At most 2 are printed, so the largest order is 4.
    """

    A: tuple[tuple[Fraction, ...], ...]
    b: tuple[Fraction, ...]
    c: tuple[Fraction, ...]
    order: int
    commutators: int
    source: str
    needs = (UNCONSTRAINED,)
    family = "runge_kutta"
    dense_output = "hermite_5"
    state_is_all = True

    @property
    def linear_step(self) -> LinearTransitions:
        A = [list(map(float, row)) for row in self.A]
        return LinearTransitions(A, list(map(float, self.b)), list(map(float, self.c)))

    @cached_property
    def real_stability(self) -> float:
        return real_stability(self.A, self.b)  # asked at every judgement: exact fractions take long to be hashed

    @classmethod
    def names(cls) -> tuple[MethodName, ...]:
        aliases = ("rkmk4", "runge_kutta")  # explicit methods have no numerical damping anyway
        return (
            MethodName(
                "rk4",
                lambda: RUNGE_KUTTA_MUNTHE_KAAS_4,
                aliases=aliases,
                idle=("rho_inf",),
                fixed_steps=("it has no estimate of its errors", "rk45"),
            ),
        )

    @classmethod
    def terms(cls, constrained: bool, internal: bool, mass: bool) -> tuple[str, ...]:
        return ("forward_dynamics",)

    def calls(self, system: System) -> set[str]:
        if "forward_dynamics" in system.functions:
            return set()
        return {"residual", "iteration" if "iteration" in system.functions else "partials"}

    def title(self, constrained: bool) -> str:
        return f"explicit Runge-Kutta in the Lie algebra, order {self.order}"

    def statuses(self, constrained: bool, angles: bool) -> tuple[Status, ...]:
        return (SINGULAR_MASS, NOT_FINITE, BAD_ARGUMENT)

    def data(self, system: System, step: float, samples: Any) -> Mapping[str, Any]:
        nodes = sorted({c for c in self.c if c != 0} | {1})
        return {
            "matrices": "forward_dynamics" not in system.functions,
            "stages": len(self.b),
            "A": [[float(x) for x in row] for row in self.A],
            "b": [float(x) for x in self.b],
            "c": [float(x) for x in self.c],
            "input_rows": [0 if c == 0 else nodes.index(c) + 1 for c in self.c],
            "input_times": [0.0, *(float(x) for x in nodes)],
        }


_HALF, _ZERO = Fraction(1, 2), Fraction(0)
RUNGE_KUTTA_MUNTHE_KAAS_4 = RungeKuttaMuntheKaas(
    A=(
        (_ZERO, _ZERO, _ZERO, _ZERO),
        (_HALF, _ZERO, _ZERO, _ZERO),
        (_ZERO, _HALF, _ZERO, _ZERO),
        (_ZERO, _ZERO, Fraction(1), _ZERO),
    ),
    b=(Fraction(1, 6), Fraction(1, 3), Fraction(1, 3), Fraction(1, 6)),
    c=(_ZERO, _HALF, _HALF, Fraction(1)),
    order=4,
    commutators=2,
    source="Munthe-Kaas 1999, with the classical tableau of Kutta 1901",
)
