"""Notes on splines that leave the range of their points between these."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from eomgen.formula.curves import AnyCurve, Curve

#: Part of the range of points by which a spline may leave it without a note.
_NOTED = 0.1


def overshoots(curves: Iterable[AnyCurve]) -> Iterator[str]:
    """Yield a note on each quintic spline that overshoots its points by more than a tenth of their range."""
    for curve in curves:
        if not isinstance(curve, Curve) or curve.interpolation != "quintic":
            continue
        low, high = float(np.min(curve.y)), float(np.max(curve.y))
        place, value = curve.farthest()
        share = max(value - high, low - value) / (high - low) if high > low else 0.0
        if share > _NOTED:
            beyond = f"{100.0 * share:.2g} % of the range of its points, {low:.4g} to {high:.4g}, beyond them"
            hint = 'more points where they turn, or interpolation = "linear", keep it within'
            yield f"{curve.name}: the spline is {value:.4g} at {place:.4g}, {beyond}; {hint}"
