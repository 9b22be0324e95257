"""Runge-Kutta methods on Lie groups as data.

Munthe-Kaas, Appl. Numer. Math. 29 (1999) 115.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Any

from eomgen.base.data import dataclass
from eomgen.integrators.families.family import (
    BAD_ARGUMENT,
    NOT_FINITE,
    SINGULAR_MASS,
    Family,
    MethodName,
    Status,
    hold,
)
from eomgen.integrators.families.needs import UNCONSTRAINED
from eomgen.integrators.families.tableaus import check_tableau, real_stability

if TYPE_CHECKING:
    from eomgen.system.system import System


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

    def __post_init__(self) -> None:
        hold("commutators >= order - 2, at most 2", self.order - 2 <= self.commutators <= 2)
        check_tableau(self.A, self.b, self.c, self.order)

    @property
    def real_stability(self) -> float:
        return self._real_stability

    @cached_property
    def _real_stability(self) -> float:
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
