"""Symplectic compositions of drifts and kicks for scenes of constant inertia whose forces do not depend on velocities.

A kick changes velocities by accelerations at held positions, a drift moves positions at held velocities: each is the
exact motion of a part of the Hamiltonian, so a step is symplectic and energies do not drift over any number of steps.
Steps begin and end with kicks: the acceleration at the end of one is the first of the next.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

from eomgen.base.data import dataclass
from eomgen.errors import ModelError, Problem
from eomgen.integrators.compositions import Composition, composition_named
from eomgen.integrators.families.family import (
    BAD_ARGUMENT,
    NOT_FINITE,
    SINGULAR_MASS,
    Family,
    MethodName,
    Status,
)
from eomgen.integrators.families.needs import CONSTANT_INERTIA, NO_INNER_STATES, NO_VELOCITY_FORCES, UNCONSTRAINED

if TYPE_CHECKING:
    from eomgen.system.system import System

#: The compositions that are methods, by name in the table.
NAMES = (
    "leapfrog",
    "minimum_norm2",
    "bcss3",
    "yoshida4",
    "suzuki4",
    "omf4",
    "blanes_moan4",
    "yoshida6",
    "suzuki6",
    "blanes_moan6",
    "yoshida8",
    "kahan_li8",
)
_FIXED = ("it keeps energies because its steps are all of one size", "rk45, or taylor")


@dataclass(frozen=True)
class SymplecticComposition(Family):
    """A composition of kicks and drifts with fixed steps.

    Attributes
    ----------
    composition : begins with a kick
    """

    composition: Composition
    needs = (UNCONSTRAINED, NO_INNER_STATES, CONSTANT_INERTIA, NO_VELOCITY_FORCES)
    family = "composition"
    group_functions = ("update",)
    dense_output = "hermite_5"
    state_is_all = True

    @property
    def order(self) -> int:  # type: ignore[override]  # families without coefficients have a number here
        return self.composition.order

    @property
    def source(self) -> str:  # type: ignore[override]
        return self.composition.source

    @classmethod
    def names(cls) -> tuple[MethodName, ...]:
        return tuple(MethodName(name, partial(_make, name), idle=("rho_inf",), fixed_steps=_FIXED) for name in NAMES)

    @classmethod
    def terms(cls, constrained: bool, internal: bool, mass: bool) -> tuple[str, ...]:
        return ("forward_dynamics",)

    def calls(self, system: System) -> set[str]:
        if "forward_dynamics" in system.functions:
            return set()
        return {"residual", "iteration" if "iteration" in system.functions else "partials"}

    def title(self, constrained: bool) -> str:
        return f"symplectic composition {self.composition.name} of kicks and drifts, order {self.order}"

    def statuses(self, constrained: bool, angles: bool) -> tuple[Status, ...]:
        return (SINGULAR_MASS, NOT_FINITE, BAD_ARGUMENT)

    def data(self, system: System, step: float, samples: Any) -> Mapping[str, Any]:
        _check_velocities(system)
        times = self.composition.kick_times
        nodes = sorted({0.0, *times, 1.0})
        return {
            "matrices": "forward_dynamics" not in system.functions,
            "stages": self.composition.gradients,
            "kicks": list(self.composition.kicks),
            "drifts": list(self.composition.drifts),
            "kick_times": list(times),
            "input_rows": [nodes.index(time) for time in times],
            "input_times": nodes,
        }


def _make(name: str) -> SymplecticComposition:
    return SymplecticComposition(composition_named(name, "kick"))


def _check_velocities(system: System) -> None:
    """Raise ModelError if the equations of motion depend on velocities, which no load has to: gyroscopic and
    Coriolis forces do."""
    function = system.functions.get("forward_dynamics") or system.functions["residual"]
    if any(symbol.block == "v" for symbol in system.tape.depends_on(function.refs)):
        fault = "composition needs accelerations that do not depend on velocities, and gyroscopic or Coriolis forces"
        fault += " do: kicks by them would not be symplectic [E0333]"
        raise ModelError(Problem("method", fault, NO_VELOCITY_FORCES.alternative))
