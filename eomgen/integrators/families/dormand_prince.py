"""Embedded explicit pair of order 5(4) in the Lie algebra, with steps of its own.

Pair and continuous extension: Dormand and Prince, J. Comput. Appl. Math. 6 (1980) 19; Shampine, Math. Comput. 46 (1986)
135. In the Lie algebra: Munthe-Kaas, Appl. Numer. Math. 29 (1999) 115.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction as F
from typing import TYPE_CHECKING, Any

from eomgen.integrators.families.adaptive import (
    LONGEST,
    STEP_GROUPS,
    check_tolerance,
    longest_setting,
    step_data,
    step_state,
    step_statistics,
    step_statuses,
    tolerance_setting,
)
from eomgen.integrators.families.family import (
    BAD_ARGUMENT,
    NOT_FINITE,
    SINGULAR_MASS,
    Family,
    Field,
    MethodName,
    Setting,
    Sizes,
    Status,
    hold,
    velocities,
)
from eomgen.integrators.families.generalized_alpha import indices_in_q
from eomgen.integrators.families.needs import UNCONSTRAINED

if TYPE_CHECKING:
    from eomgen.system.system import System

DEFAULT_TOLERANCE = 1e-8
#: Tolerances that studies compare.
COMPARED_TOLERANCES = (1e-3, 1e-5, 1e-7, 1e-9, 1e-11)
#: Steps are let grow where they grow by so much: nothing is kept that belongs to a size.
LEAST_GROWTH = 1.0
_0 = F(0)
NODES = (_0, F(1, 5), F(3, 10), F(4, 5), F(8, 9), F(1), F(1))
STAGES = (
    (_0,) * 7,
    (F(1, 5), *(_0,) * 6),
    (F(3, 40), F(9, 40), *(_0,) * 5),
    (F(44, 45), F(-56, 15), F(32, 9), *(_0,) * 4),
    (F(19372, 6561), F(-25360, 2187), F(64448, 6561), F(-212, 729), _0, _0, _0),
    (F(9017, 3168), F(-355, 33), F(46732, 5247), F(49, 176), F(-5103, 18656), _0, _0),
    (F(35, 384), _0, F(500, 1113), F(125, 192), F(-2187, 6784), F(11, 84), _0),
)
#: Weights of the embedded solution of order 4.
EMBEDDED = (F(5179, 57600), _0, F(7571, 16695), F(393, 640), F(-92097, 339200), F(187, 2100), F(1, 40))
#: Of the continuous extension of order 4: weight i at the share s of a step is the sum of [i][k] s^(k+1).
EXTENSION = (
    (F(1), F(-8048581381, 2820520608), F(8663915743, 2820520608), F(-12715105075, 11282082432)),
    (_0, _0, _0, _0),
    (_0, F(131558114200, 32700410799), F(-68118460800, 10900136933), F(87487479700, 32700410799)),
    (_0, F(-1754552775, 470086768), F(14199869525, 1410260304), F(-10690763975, 1880347072)),
    (_0, F(127303824393, 49829197408), F(-318862633887, 49829197408), F(701980252875, 199316789632)),
    (_0, F(-282668133, 205662961), F(2019193451, 616988883), F(-1453857185, 822651844)),
    (_0, F(40617522, 29380423), F(-110615467, 29380423), F(69997945, 29380423)),
)


@dataclass(frozen=True)
class DormandPrince(Family):
    """The pair of Dormand and Prince in the Lie algebra; the solution of order 5 goes on.

    Parameters
    ----------
    tolerance : float
        Of the local error of the solution of order 4, relative to what the motion moves within the step, by kinetic
        energy; internal states each relative to its own change. Raises UsageError outside 1e-14..0.1.
    """

    tolerance: float = DEFAULT_TOLERANCE
    order = 5
    source = "Dormand and Prince 1980; Munthe-Kaas 1999; Shampine 1986"
    needs = (UNCONSTRAINED,)
    family = "dormand_prince"
    dense_output = "steps"
    groups = STEP_GROUPS

    def __post_init__(self) -> None:
        check_tolerance(self.tolerance)
        check_pair()

    @classmethod
    def names(cls) -> tuple[MethodName, ...]:
        compared = {"tolerance": COMPARED_TOLERANCES}
        aliases = ("dormand_prince", "dopri5")
        return (MethodName("rk45", cls, ("tolerance",), aliases, compared=compared, ladders=("all",)),)

    @classmethod
    def terms(cls, constrained: bool, internal: bool, mass: bool) -> tuple[str, ...]:
        return ("forward_dynamics", "mass" if mass else "residual")

    def calls(self, system: System) -> set[str]:
        if "forward_dynamics" in system.functions:
            return set() if "mass" in system.functions else {"residual"}
        return {"residual", "iteration" if "iteration" in system.functions else "partials"}

    def title(self, constrained: bool) -> str:
        return "explicit Runge-Kutta pair of order 5(4) in the Lie algebra, with steps of its own"

    @property
    def parameters(self) -> dict[str, F]:
        return {"tolerance": F(repr(float(self.tolerance)))}

    @property
    def keywords(self) -> dict[str, float]:
        return {"tolerance": self.tolerance}

    @property
    def chooses_steps(self) -> bool:
        return True

    def state(self, sizes: Sizes) -> tuple[Field, ...]:
        return step_state(sizes)

    def settings(self, sizes: Sizes) -> tuple[Setting, ...]:
        return (tolerance_setting(self.tolerance), longest_setting(LONGEST))

    def statistics(self, sizes: Sizes) -> tuple[Field, ...]:
        return step_statistics()

    def statuses(self, constrained: bool, angles: bool) -> tuple[Status, ...]:
        return (SINGULAR_MASS, NOT_FINITE, BAD_ARGUMENT, *step_statuses())

    def data(self, system: System, step: float, samples: Any) -> Mapping[str, Any]:
        return {
            **step_data(4),
            "least_growth": LEAST_GROWTH,
            "matrices": "forward_dynamics" not in system.functions,
            "stages": len(NODES),
            "A": [[float(x) for x in row] for row in STAGES],
            "error": [float(x - y) for x, y in zip(STAGES[-1], EMBEDDED, strict=True)],
            "extension": [[float(x) for x in row] for row in EXTENSION],
            "c": [float(x) for x in NODES],
            "angular": [int(turns) for turns in system.angular] or [0] * velocities(system.factors),
            "places": indices_in_q(system.factors, velocities(system.factors)),
            "input_times": [0.0, 0.25, 0.5, 0.75, 1.0],
        }


def check_pair() -> None:
    """Raise UsageError where the tables break a condition: row sums, quadrature to order 5, and that the extension ends
    as the step does."""
    b = STAGES[-1]
    hold("row sums: c_i = sum_j A_ij", all(sum(row) == c for row, c in zip(STAGES, NODES, strict=True)))
    for k in range(5):
        moment = sum((b[i] * NODES[i] ** k for i in range(7)), _0)
        hold(f"order 5: sum b c^{k} = 1/{k + 1}", moment == F(1, k + 1))
    for k in range(4):
        moment = sum((EMBEDDED[i] * NODES[i] ** k for i in range(7)), _0)
        hold(f"order 4: sum b^ c^{k} = 1/{k + 1}", moment == F(1, k + 1))
    hold("the extension ends with the step", all(sum(row) == weight for row, weight in zip(EXTENSION, b, strict=True)))
