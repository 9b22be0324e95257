"""Known discontinuities in a scene's formulas: times of jumps and kinks, ranges of curves, and splines that leave the
range of their points."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from eomgen.formula.curves import AnyCurve, Curve
from eomgen.formula.discontinuities import Breakpoint, breakpoints, reaches
from eomgen.formula.nodes import Symbol
from eomgen.mechanics.describe import formulas_of_forces, prescribed_laws
from eomgen.scene.scene import Scene
from eomgen.system.system import Discontinuity, Validity


def discontinuities(scene: Scene) -> tuple[Discontinuity, ...]:
    """Return the known discontinuities in time of inputs, forces and prescribed motions, by period and time. Of several
    at one time the lowest order counts. Times that depend on tunable parameters are left out."""
    fixed = {item.name: item.value for item in scene.parameters if not item.tunable}

    def value_of(symbol: Symbol) -> float | None:
        return fixed.get(symbol.name)

    first: dict[tuple[float, float], Breakpoint] = {}
    of_inputs = [(item.formula, 0) for item in scene.inputs if item.formula is not None]
    for formula, derivatives in (*of_inputs, *formulas_of_forces(scene)):
        for point in breakpoints(formula, value_of, derivatives):
            known = first.get((point.time, point.period))
            if known is None or point.order < known.order:
                first[point.time, point.period] = point
    of_constraints = {
        (point.time, point.period) for law in prescribed_laws(scene) for point in breakpoints(law, value_of)
    }
    ordered = sorted(first.items(), key=lambda item: (item[0][1], item[0][0]))
    return tuple(
        Discontinuity(point.time, point.period, max(point.order, 0), point.blur, number in of_constraints)
        for number, point in ordered
    )


def validity(scene: Scene) -> tuple[Validity, ...]:
    """Return the time ranges in which curves in formulas have points, each with the name of the input, or "" for
    forces. Ranges that depend on tunable parameters are left out."""
    fixed = {item.name: item.value for item in scene.parameters if not item.tunable}
    owners = [(item.name, item.formula) for item in scene.inputs if item.formula is not None]
    owners += [("", formula) for formula, _ in formulas_of_forces(scene)]
    ranges = [
        Validity(reach.name, owner, reach.start, reach.end)
        for owner, formula in owners
        for reach in reaches(formula, lambda symbol: fixed.get(symbol.name))
    ]
    return tuple(dict.fromkeys(ranges))


#: Numbers by which files mark missing values.
_MISSING = frozenset({999.0, 9999.0, 99999.0, -999.0, -9999.0, -99999.0, 1e20, 1e30})


def overshoots(curves: Iterable[AnyCurve]) -> Iterator[str]:
    """Yield a note on each quintic spline that overshoots its points by more than a tenth of the range of the
    points."""
    for curve in curves:
        if not isinstance(curve, Curve) or curve.interpolation != "quintic":
            continue
        low, high = float(np.min(curve.y)), float(np.max(curve.y))
        point, value = curve.farthest()
        share = max(value - high, low - value) / (high - low) if high > low else 0.0
        if share > 0.1:
            beyond = f"{100.0 * share:.2g} % of the range of its points, {low:.4g} to {high:.4g}, beyond them"
            hint = 'more points where they turn, or interpolation = "linear", keep it within'
            if {low, high} & _MISSING:
                hint = f"a value such as {max(abs(low), abs(high)):g} often marks a missing one, to be left out"
            yield f"{curve.name}: the spline is {value:.4g} at {point:.4g}, {beyond}; {hint} [W0273]"
