"""Outputs of the sections of geometrically exact beams: strains of an element, and loads at a place on the axis."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Mapping

from eomgen.base.text import key_of, nearest, shown
from eomgen.formula.nodes import Formula, Number, Symbol
from eomgen.scene.bodies.cosserat import SECTION_PARTS, SECTION_ROW, Cosserat
from eomgen.scene.reading.values import Values
from eomgen.scene.signals.schema import Output

#: How far beyond an end a place may be by rounding, of the length.
_ROUNDING = 1e-9


def section_formulas(
    beams: Mapping[str, Cosserat], values: Values, key: str, kind: str, output: Output
) -> tuple[Formula, ...]:
    """Return the three components of an output of a section; none if there is a fault.

    Loads are linear between both ends of an element, and at a node the loads of the element beyond.
    """
    name, report = str(getattr(output, kind)), values.report
    beam = beams.get(name)
    if beam is None and report.concerns(key_of("beams", name)):
        return ()
    if beam is None:
        other = name in values.names.beams
        fault = f"the beam {name} is no geometrically exact one" if other else f"there is no beam {shown(name)}"
        report.add(f"{key}.{kind}", fault, 'model = "cosserat"' if other else nearest(name, beams))
        return ()
    if output.at is None:
        report.add(key, f"{kind} needs the place of the section", f"at = {0.5 * beam.length:.6g}, its x in m")
        return ()
    x = values.constant(f"{key}.at", output.at)
    if math.isnan(x):
        return ()
    if not -_ROUNDING * beam.length <= x <= (1.0 + _ROUNDING) * beam.length:
        fault = f"x = {x:.6g} m is not on the beam {name}, which goes from 0 m to {beam.length:.6g} m"
        report.add(f"{key}.at", fault, "a place on the beam")
        return ()
    element = min(bisect_right(beam.places, x + _ROUNDING * beam.length) - 1, beam.elements - 1)
    start, end = beam.places[element : element + 2]
    share = min(max((x - start) / (end - start), 0.0), 1.0)
    first, second = (
        [Symbol("section_load", name, element * SECTION_ROW + start + part) for part in range(3)]
        for start in SECTION_PARTS[kind]
    )
    if first == second or share == 0.0:
        return tuple(first)
    if share == 1.0:
        return tuple(second)
    return tuple(Number(1.0 - share) * one + Number(share) * other for one, other in zip(first, second, strict=True))
