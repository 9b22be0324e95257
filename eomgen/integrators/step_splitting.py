"""Discontinuities at which a stepper splits its steps, as data for the templates.

A derivative of order k that jumps within a step costs an error of order k + 1 there, once; a jump of at least the order
of the method does no harm. Implicit methods find the accelerations of prescribed motions by differences, so
there it costs an error of order k, which numerical damping takes away over many steps. Times have a margin: a step
ends so much before one and goes on so much after it, so that rounding never puts an evaluation on the wrong side.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from eomgen.system.system import Discontinuity

#: Margin beside the time of a jump, in times the precision of the numbers that the time is made of.
MARGIN = 32.0


def jump_data(
    discontinuities: tuple[Discontinuity, ...], order: int, *, by_differences: bool = False
) -> dict[str, Any]:
    """Return the times that matter to a method of an order: ``once``; ``first`` and ``period`` of waves.

    Empty if there are none.

    Parameters
    ----------
    by_differences : whether the method finds accelerations that constraints prescribe by differences of velocities
    """
    those = [item for item in discontinuities if item.order + 1 < order + (by_differences and item.constraint)]
    if not those:
        return {}
    return {
        "once": sorted({item.time for item in those if item.period == 0.0}),
        "periodic": [
            list(pair) for pair in dict.fromkeys((item.time, item.period) for item in those if item.period > 0.0)
        ],
        "margin": MARGIN,
        "blur": max(MARGIN * item.blur for item in those),
    }
