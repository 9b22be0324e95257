"""Embedded explicit Runge-Kutta pairs in the Lie algebra, with adaptive steps; a pair is a row of ``PAIRS``.

Row of order 5(4) and its continuous extension: Dormand and Prince, J. Comput. Appl. Math. 6 (1980) 19; Shampine,
Math. Comput. 46 (1986) 135. In the Lie algebra: Munthe-Kaas, Appl. Numer. Math. 29 (1999) 115.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction as F
from functools import partial
from typing import TYPE_CHECKING, Any

from eomgen.base.data import dataclass
from eomgen.integrators.families.adaptive import (
    CONTROL,
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
    velocities,
)
from eomgen.integrators.families.generalized_alpha import indices_in_q
from eomgen.integrators.families.needs import UNCONSTRAINED
from eomgen.integrators.families.runge_kutta import EmbeddedPair, real_stability, strictly_lower

if TYPE_CHECKING:
    from eomgen.system.system import System

DORMAND_PRINCE = EmbeddedPair(
    name="rk45",
    aliases=("dormand_prince", "dopri5"),
    source="Dormand and Prince 1980",
    order=5,
    embedded_order=4,
    A=strictly_lower(
        (),
        (F(1, 5),),
        (F(3, 40), F(9, 40)),
        (F(44, 45), F(-56, 15), F(32, 9)),
        (F(19372, 6561), F(-25360, 2187), F(64448, 6561), F(-212, 729)),
        (F(9017, 3168), F(-355, 33), F(46732, 5247), F(49, 176), F(-5103, 18656)),
        (F(35, 384), F(0), F(500, 1113), F(125, 192), F(-2187, 6784), F(11, 84)),
    ),
    b=(F(35, 384), F(0), F(500, 1113), F(125, 192), F(-2187, 6784), F(11, 84), F(0)),
    b_hat=(F(5179, 57600), F(0), F(7571, 16695), F(393, 640), F(-92097, 339200), F(187, 2100), F(1, 40)),
    c=(F(0), F(1, 5), F(3, 10), F(4, 5), F(8, 9), F(1), F(1)),
    extension_source="Shampine 1986",
    extension=(
        (F(1), F(-8048581381, 2820520608), F(8663915743, 2820520608), F(-12715105075, 11282082432)),
        (F(0), F(0), F(0), F(0)),
        (F(0), F(131558114200, 32700410799), F(-68118460800, 10900136933), F(87487479700, 32700410799)),
        (F(0), F(-1754552775, 470086768), F(14199869525, 1410260304), F(-10690763975, 1880347072)),
        (F(0), F(127303824393, 49829197408), F(-318862633887, 49829197408), F(701980252875, 199316789632)),
        (F(0), F(-282668133, 205662961), F(2019193451, 616988883), F(-1453857185, 822651844)),
        (F(0), F(40617522, 29380423), F(-110615467, 29380423), F(69997945, 29380423)),
    ),
)
#: The register of pairs: each row is a method, also with its stages brought onto constraints.
PAIRS: tuple[EmbeddedPair, ...] = (DORMAND_PRINCE,)


@dataclass(frozen=True)
class EmbeddedRungeKutta(Family):
    """An embedded explicit Runge-Kutta pair in the Lie algebra; the solution of higher order goes on.

    Parameters
    ----------
    tolerance : float
        Bound of the local error of the embedded solution, relative to the motion within the step, by kinetic energy;
        internal states each relative to its own change. Raises UsageError outside 1e-14..0.1.
    pair : EmbeddedPair
        Coefficients.
    """

    tolerance: float = 1e-8
    pair: EmbeddedPair = DORMAND_PRINCE
    needs = (UNCONSTRAINED,)
    family = "embedded_pair"
    chooses_steps = True
    dense_output = "steps"
    groups = STEP_GROUPS

    def __post_init__(self) -> None:
        check_tolerance(self.tolerance)

    @property
    def order(self) -> int:  # type: ignore[override]  # families without coefficients have a number here
        return self.pair.order

    @property
    def source(self) -> str:  # type: ignore[override]
        return f"{self.pair.source}; Munthe-Kaas 1999; {self.pair.extension_source}"

    @property
    def real_stability(self) -> float:
        return real_stability(self.pair.A, self.pair.b)

    @classmethod
    def names(cls) -> tuple[MethodName, ...]:
        return tuple(MethodName(pair.name, partial(cls, pair=pair), ("tolerance",), pair.aliases) for pair in PAIRS)

    @classmethod
    def terms(cls, constrained: bool, internal: bool, mass: bool) -> tuple[str, ...]:
        return ("forward_dynamics", "mass" if mass else "residual")

    def calls(self, system: System) -> set[str]:
        if "forward_dynamics" in system.functions:
            return set() if "mass" in system.functions else {"residual"}
        return {"residual", "iteration" if "iteration" in system.functions else "partials"}

    def title(self, constrained: bool) -> str:
        orders = f"{self.pair.order}({self.pair.embedded_order})"
        return f"explicit Runge-Kutta pair of order {orders} in the Lie algebra, with steps of its own"

    @property
    def parameters(self) -> dict[str, F]:
        return {"tolerance": F(repr(float(self.tolerance)))}

    @property
    def keywords(self) -> dict[str, float]:
        return {"tolerance": self.tolerance}

    def state(self, sizes: Sizes) -> tuple[Field, ...]:
        return step_state(sizes)

    def settings(self, sizes: Sizes) -> tuple[Setting, ...]:
        return (tolerance_setting(self.tolerance), longest_setting(CONTROL.longest))

    def statistics(self, sizes: Sizes) -> tuple[Field, ...]:
        return step_statistics()

    def statuses(self, constrained: bool, angles: bool) -> tuple[Status, ...]:
        return (SINGULAR_MASS, NOT_FINITE, BAD_ARGUMENT, *step_statuses())

    def data(self, system: System, step: float, samples: Any) -> Mapping[str, Any]:
        """Return the data of the templates: tableau, error weights b - b_hat, continuous extension, and control of
        steps."""
        pair = self.pair
        return {
            **step_data(pair.embedded_order),
            "matrices": "forward_dynamics" not in system.functions,
            "stages": len(pair.b),
            "embedded_order": pair.embedded_order,
            "extension_source": pair.extension_source,
            "A": [[float(x) for x in row] for row in pair.A],
            "error": [float(x - y) for x, y in zip(pair.b, pair.b_hat, strict=True)],
            "extension": [[float(x) for x in row] for row in pair.extension],
            "c": [float(x) for x in pair.c],
            "angular": [int(turns) for turns in system.angular] or [0] * velocities(system.factors),
            "places": indices_in_q(system.factors, velocities(system.factors)),
            "input_times": [0.0, 0.25, 0.5, 0.75, 1.0],
        }
