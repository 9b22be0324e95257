"""Notes on hulls that are allowed, and hardly ever meant: dry ones, densities of other units, added mass in the air."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.limits import Limit
from eomgen.base.messages import key_of
from eomgen.formula.nodes import Formula, Number
from eomgen.scene.document.notes import Note, SceneFacts
from eomgen.scene.reading.values import Values

if TYPE_CHECKING:
    from eomgen.products.waves.hulls.section import Hull

LIGHTEST = Limit(400.0, "kg/m^3", "density of the water about a hull", "no liquid is as light")
DIFFRACTING = Limit(0.2, "1", "diameter of a hull in wave lengths", "Morison's equation is of thinner hulls")
UNLIKE = Limit(4.0, "1", "ratio of the areas of a section and of the circle, or its inverse", "a choice")


def doubtful_hulls(facts: SceneFacts) -> Iterator[str]:
    """Yield a note, with the key of the hull, on each property of the hulls of a scene that is hardly intended."""
    for hull in facts.elements("hulls"):
        for text in _doubts(hull, facts.places, facts.values):
            yield f"{key_of('hulls', hull.name)}: {text}"


def _doubts(hull: Hull, places: Mapping[str, tuple[Array, Array]], values: Values) -> Iterator[str]:
    """Yield notes on density, diameter, area and placement of a hull; ``places`` has rotation and position of bodies by
    name, ``values`` evaluates formulas."""
    density, diameter = values.value(hull.density), values.value(hull.diameter)
    if 0.0 < density < LIGHTEST:
        note = f"the density {density:.6g} kg/m^3 is not a density of water"
        yield f"{note}; {1e3 * density:.6g} if it is in t/m^3" if density < 2.0 else note
    if hull.waves is not None and len(hull.waves.components) > 0:
        kx, ky, _, amplitude, *_ = max(hull.waves.components[: hull.waves.free], key=lambda wave: wave.amplitude)
        length = 2.0 * math.pi / max(math.hypot(kx, ky), 1e-300)
        if amplitude > 0.0 and diameter > DIFFRACTING * length:
            note = f"its diameter of {diameter:.4g} m is more than a fifth of the length of the largest wave"
            yield f"{note}, {length:.4g} m, which it would turn and reflect: Morison's equation is of thinner hulls"
    area = values.value(hull.area) if hull.area is not None else math.nan
    round_ = 0.25 * math.pi * diameter**2
    if area > 0.0 and diameter > 0.0 and not 1.0 / UNLIKE <= area / round_ <= UNLIKE:
        note = f"its area, of buoyancy, is {area:.6g} m^2, and a circle of its diameter, which drag goes by, has"
        yield f"{note} {round_:.6g} m^2"
    start, end = (np.array([values.value(part) for part in point]) for point in (hull.start, hull.end))
    counted = [name for name in ("wet", "axial_added_mass", "axial_drag") if getattr(hull, name) not in _NONE]
    if counted and start[2] > end[2]:
        note = f"start is above end in the axes of {hull.body}, and {counted[0]} is of the lower part of a column"
        yield f"{note}, which start is to be at"
    if hull.body in places:
        yield from _doubts_of_place(hull, *places[hull.body], start, end, values)


def _doubts_of_place(
    hull: Hull, turned: Array, origin: Array, start: Array, end: Array, values: Values
) -> Iterator[str]:
    """Yield notes on a hull that begins above the water at rest, or whose added mass counts a part above.

    Parameters
    ----------
    turned, origin : (3, 3) and (3,), the rotation of the body and the place of the origin, m
    start, end : (3,), in the axes of the body, m
    """
    diameter = values.value(hull.diameter)
    low, high = sorted(float((turned @ end_ + origin)[2]) for end_ in (start, end))
    level = values.value(hull.level) if hull.waves is None else hull.waves.level
    if low - 0.5 * diameter >= level:
        yield f"it begins {low - level:.4g} m above the water at rest, where no water acts on it"
    elif hull.wet is None and hull.adds_mass_to and high - low > diameter and high - level > 0.05 * (high - low):
        part = (level - low) / (high - low) * float(np.linalg.norm(end - start))
        note = f"all of its {np.linalg.norm(end - start):.4g} m move water, and {high - level:.4g} m of it begin above"
        yield f"{note} the water at rest; wet = {part:.4g} counts those below"


NOTE = Note("doubtful hulls", doubtful_hulls, behind="doubtful beams", limits=(LIGHTEST, DIFFRACTING, UNLIKE))
_NONE: tuple[Formula | None, ...] = (None, Number(0.0))
