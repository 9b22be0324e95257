"""Heights of surfaces in scene files: scopes of their formulas, and the rate of a surface that time or inputs move."""

from __future__ import annotations

from typing import Any

from eomgen.formula.evaluate import symbols
from eomgen.formula.nodes import Formula, Symbol
from eomgen.formula.substitution import map_symbols
from eomgen.scene.formula.scope import SURFACE, Scope
from eomgen.scene.joints.constraint_reading import read_surface
from eomgen.scene.reading.values import Values

#: A wheel that touches the surface straight below its centre, however rough the surface is.
FOLLOWER = "follower"
_MOVING = ("time", "input")
#: Of heights of surfaces of contacts.
HEIGHT = Scope(
    "x and y, time, parameters, inputs and curves",
    SURFACE.kinds | {"input"},
    tuple(reason for reason in SURFACE.reasons if reason[0] != "input"),
)
#: Of heights of roads of [tyres].
ROAD = Scope(
    "time, parameters, inputs, curves and the position of the wheel's centre",
    (HEIGHT.kinds | {"position"}) - {"frame"},
    (
        (
            "external",
            "damping of the tyre needs the rate of the road, whose slopes need second derivatives, and laws of files do"
            " not have these",
            "a map of the heights in [maps], or the force of the tyre by the law in [forces]",
        ),
    ),
)


def surface_fields(
    key: str, word: str, entry: Any, values: Values, owner: str, *, needed: bool = True
) -> dict[str, Any]:
    """Return the fields ``surface``, ``surface_rate`` and ``moving_surface`` of a contact. Faults are reported: a
    height without the derivatives of a closest point, a rate of a surface at rest, and a missing rate.

    Parameters
    ----------
    word : key of the height in the entry, ``surface`` or ``road``
    owner : noun of the part that needs the rate if an input moves the surface and the rate is ``needed``
    """
    text, rate_key, center = getattr(entry, word), f"{word}_rate", getattr(entry, "center", "")
    height, rate = None, getattr(entry, rate_key)
    if text is not None and getattr(entry, "shape", FOLLOWER) == FOLLOWER:
        height = read_height(f"{key}.{word}", text, center, values)
    elif text is not None:
        remedy = f', or shape = "{FOLLOWER}" for a wheel'
        height = read_surface(f"{key}.{word}", text, values, HEIGHT, ("parameter", "local", *_MOVING), owner, remedy)
    kinds = set[str]() if height is None else {symbol.kind for symbol in symbols(height)}
    if rate is not None:
        if "input" not in kinds and not values.report.concerns(f"{key}.{word}"):
            fault = f"no input moves the {word}, whose rate follows from its formula [E1513]"
            values.report.add(f"{key}.{rate_key}", fault, f"no {rate_key}, or an input in the {word}")
        rate = read_height(f"{key}.{rate_key}", rate, center, values)
    elif "input" in kinds and needed:
        fault = f"the {owner} needs the rate of the {word}, which does not follow from an input [E1514]"
        hint = f'the {word} as a table in [curves.profile] with {word} = "profile(speed * t)", whose rate is known; or '
        hint += f'{rate_key} = "...", a second input for instance'
        values.report.add(key, fault, hint + "; or no damping" * (word == "road"))
    return {"surface": height, "surface_rate": rate, "moving_surface": not kinds.isdisjoint(_MOVING)}


def read_height(key: str, value: float | str, center: str, values: Values) -> Formula:
    """Return a height, m, or rate, m/s, as a formula of the place in the first frame. z, and positions other than x
    and y of the point ``center`` of a tyre, are reported."""
    formula = values.formula(key, value, ROAD if center else HEIGHT)
    for symbol in sorted(symbols(formula), key=lambda symbol: (symbol.name, symbol.index)):
        if symbol.kind == "position" and (symbol.name != center or symbol.index == 2):
            fault = f"position.{symbol.name}[{symbol.index}] is not x or y of the road's own wheel [E1515]"
            values.report.add(key, fault, f"position.{center}[0] or position.{center}[1]")
            break
        if symbol.kind == "local" and symbol.index > 1:
            values.report.add(key, "the height of a surface depends on x and y, not on z [E1603]", '"0.1 * x**2"')
            break
    return map_symbols(
        formula, lambda symbol: Symbol("local", "position", symbol.index) if symbol.kind == "position" else symbol
    )
