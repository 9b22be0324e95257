"""Force elements beyond springs along a line: stops and dry friction of joint coordinates, bushings, tyres.

All values are formulas of parameters, the road under a tyre excepted.
"""

from __future__ import annotations

from dataclasses import dataclass

from eomgen.scene.formula.nodes import Formula
from eomgen.scene.joints.constraint_model import Frame


@dataclass(frozen=True)
class Stop:
    """Compliant stops of one coordinate of a joint, at either end or both (None where there is none).

    Beyond ``lower`` or ``upper`` by d the effort is s(d / onset) max(0, stiffness d + damping d'), back into the range; s rises
    from 0 to 1 over the onset.
    """

    index: int
    lower: Formula | None
    upper: Formula | None
    stiffness: Formula
    damping: Formula
    onset: Formula


@dataclass(frozen=True)
class Friction:
    """Dry friction of one coordinate of a joint, regularised: effort -level(v) tanh(v / velocity).

    The level is ``coulomb``, or where ``static`` is given coulomb + (static - coulomb) exp(-(v / stribeck)^2).
    """

    index: int
    coulomb: Formula
    velocity: Formula
    static: Formula | None = None
    stribeck: Formula | None = None


@dataclass(frozen=True)
class Bushing:
    """Spring and damper in six directions between two frames, angular first, in the axes of the first frame.

    Attributes
    ----------
    stiffness, damping : 6 rows of 6; the stiffness is symmetric
    rest : origin of the second frame in the first when the springs are slack, m
    rest_orientation : axes of the second frame in the first then, as columns, row by row
    preload : moment (N m) and force (N) on the second frame at rest
    """

    name: str
    first: Frame
    second: Frame
    stiffness: tuple[tuple[Formula, ...], ...]
    damping: tuple[tuple[Formula, ...], ...]
    rest: tuple[Formula, Formula, Formula]
    rest_orientation: tuple[tuple[float, float, float], ...]
    preload: tuple[Formula, ...]


@dataclass(frozen=True)
class Slip:
    """Forces of a tyre in the road's plane: load times stiffness times slip, bounded by friction times load.

    Attributes
    ----------
    axis : unit vector of the wheel's spin in the axes of its centre's body
    stiffness : longitudinal and lateral, per unit of slip and of load
    velocity : added in squares to the rolling speed, m/s
    """

    axis: tuple[float, float, float]
    stiffness: tuple[Formula, Formula]
    friction: Formula
    velocity: Formula


@dataclass(frozen=True)
class Tyre:
    """A point contact between a wheel and a road of given height; it lifts off where the road falls away.

    Attributes
    ----------
    center : point, the centre of the wheel
    road : height of the road in the world, formula of time, inputs and the centre's x and y
    road_rate : its rate from time and inputs; None where it follows from the formula
    moving_road : whether time or inputs move the road
    """

    name: str
    center: str
    radius: Formula
    stiffness: Formula
    damping: Formula
    onset: Formula
    road: Formula
    road_rate: Formula | None
    moving_road: bool
    slip: Slip | None = None
