"""A family of another distribution, as small as one may be: the methods of Adams and Bashforth on Lie groups, orders 1
and 2.

    v' = v + h (3 vdot - vdot_before)/2,    q' = q o exp(h (3 v - v_before)/2)

Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I (1993), section III.1. The bracket of v and vdot
enters the exponent with h^3, so order 2 needs none.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

from eomgen.extending import (
    BAD_ARGUMENT,
    NOT_FINITE,
    UNCONSTRAINED,
    Family,
    Field,
    MethodName,
    Problem,
    Setting,
    Sizes,
    Status,
    System,
    UsageError,
)


@dataclass(frozen=True)
class AdamsBashforth(Family):
    """An Adams-Bashforth method of order 1 or 2."""

    order: int = 2
    source = "Bashforth and Adams 1883"
    needs = (UNCONSTRAINED,)
    family = "adams"
    templates = Path(__file__).parent / "templates"
    dense_output = "hermite_3"
    group_functions = ("update",)
    state_is_all = True
    groups = (("past", "What the next step takes from the last one."),)

    def __post_init__(self) -> None:
        if self.order not in (1, 2):
            raise UsageError(Problem("order", f"adams_bashforth has the orders 1 and 2, not {self.order:g}", "2"))
        object.__setattr__(self, "order", int(self.order))

    @classmethod
    def names(cls) -> tuple[MethodName, ...]:
        return (MethodName("adams_bashforth", cls, ("order",), ("ab2",)),)

    @classmethod
    def terms(cls, constrained: bool, internal: bool, mass: bool) -> tuple[str, ...]:
        return ("forward_dynamics",)

    def title(self, constrained: bool) -> str:
        return "the methods of Adams and Bashforth in the Lie algebra"

    @property
    def parameters(self) -> Mapping[str, Fraction]:
        return {"order": Fraction(self.order)}

    @property
    def keywords(self) -> Mapping[str, float]:
        return {"order": float(self.order)}

    def state(self, sizes: Sizes) -> tuple[Field, ...]:
        states = (Field("zdot_before", "that of z", sizes.z, group="past"),) if sizes.z else ()
        return (
            Field("v_before", "of the last step", sizes.v, group="past", member="v"),
            Field("vdot_before", "the acceleration with it", sizes.v, group="past", member="vdot"),
            *states,
            Field("history", "1: there is a last step", kind="long", group="past"),
        )

    def settings(self, sizes: Sizes) -> tuple[Setting, ...]:
        return (Setting("order", self.order, "1 or 2", (1, 2)), Setting("largest_speed", 1e9, "at which a run stops"))

    def statistics(self, sizes: Sizes) -> tuple[Field, ...]:
        return (Field("starts", "steps without history", kind="long"), Field("max_speed", "largest |v_i|"))

    def statuses(self, constrained: bool, angles: bool) -> tuple[Status, ...]:
        return (
            NOT_FINITE,
            BAD_ARGUMENT,
            Status(17, "TOO_FAST", "a velocity is beyond largest_speed", "less than {step:.3g} s"),
        )

    def data(self, system: System, step: float, samples: Any) -> Mapping[str, Any]:
        return {"input_times": [0.0, 1.0]}
