"""``Hamiltonian``: a checked file with ``kind = "hamiltonian"``, formulas as trees."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from eomgen.formula.nodes import Formula

#: What there is for Hamiltonian systems, for messages.
OF_HAMILTONIANS = "eomgen.build(...).simulate(), or the commands info, simulate and generate"
#: What makes H infinite or not a number at a start.
NO_START = "another start, or other parameters: two bodies in one place, a mass of 0, the root of a negative number"
#: Tolerances of rk45 between which steps are chosen by them.
TOLERANCES = (1e-14, 0.1)
#: What a term of H depends on: momenta alone, coordinates alone, or both.
Dependence = Literal["kinetic", "potential", "coupled"]
DEPENDENCES: tuple[Dependence, ...] = ("kinetic", "potential", "coupled")


@dataclass(frozen=True)
class Coordinate:
    """A coordinate with its conjugate momentum, and both at the start."""

    name: str
    momentum: str
    position: float
    momentum_value: float
    unit: str = ""
    momentum_unit: str = ""


@dataclass(frozen=True)
class Parameter:
    """A named number that runs may change."""

    name: str
    value: float
    unit: str = ""
    description: str = ""


@dataclass(frozen=True)
class Term:
    """A summand of H.

    Attributes
    ----------
    name : the key under which it stands
    """

    name: str
    formula: Formula
    dependence: Dependence


@dataclass(frozen=True)
class Output:
    """A quantity that is given along a run, a function of the state."""

    name: str
    formula: Formula
    unit: str = ""


@dataclass(frozen=True)
class Run:
    """The defaults of ``simulate``."""

    duration: float = 10.0
    step: float = 0.01
    method: str = ""
    record_every: int = 1
    compensated: bool = False
    tolerance: float = 1e-8


@dataclass(frozen=True)
class Hamiltonian:
    """A system of q' = dH/dp, p' = -dH/dq.

    Attributes
    ----------
    name : str
        A legal C identifier.
    terms : tuple of Term
        Their sum is H.
    content : bytes
        All that determines the equations and the start; not how runs are made.
    """

    name: str
    coordinates: tuple[Coordinate, ...]
    terms: tuple[Term, ...]
    parameters: tuple[Parameter, ...] = ()
    outputs: tuple[Output, ...] = ()
    simulation: Run = field(default_factory=Run)
    description: str = ""
    content: bytes = b""
    metadata: Mapping[str, Any] = field(default_factory=dict)

    @property
    def separable(self) -> bool:
        """Whether H is T(p) + V(q), by its terms."""
        return all(term.dependence != "coupled" for term in self.terms)
