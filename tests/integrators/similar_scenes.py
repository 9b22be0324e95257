"""Small scenes for tests of similarity: every kind of joint, of configuration group and of row that steppers tell
apart, in the folder ``scenes``.

Formulas in states of joints name their units; initial states are brought onto the constraints by the tests.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache, partial
from typing import Any

import eomgen
from tests.models.library import scene
from tests.oracles.similarity import Similar, in_units

#: What tests of motions need of a model; energies, outputs and the like would take most of the time of building.
_TERMS = ["residual", "partials", "forward_dynamics", "mass"]
_INTERNAL = [*_TERMS, "internal_rate", "internal_partials", "equations", "iteration"]
_ROWS = [f"constraint{part}" for part in ("", "_velocity", "_bias", "_jacobian", "_size")]
_CONSTRAINED = ["mass", "residual", *_ROWS, "equations", "iteration", "jacobian_values"]


def _scene(name: str, terms: list[str]) -> dict[str, Any]:
    return scene(f"../tests/integrators/scenes/{name}", terms=terms)


def tree() -> dict[str, Any]:
    return _scene("tree", _TERMS)


def servo() -> dict[str, Any]:
    return _scene("servo", _INTERNAL)


def four_bar() -> dict[str, Any]:
    return _scene("four_bar", _CONSTRAINED)


def rods(group: str) -> dict[str, Any]:
    """Return the scene of rods with its bodies on a group."""
    data = _scene("rods", _CONSTRAINED) | {"name": f"rods_{group.lower()}"}
    for body in data["bodies"].values():
        body["group"] = group
    return data


#: Scenes without constraints, and with them.
FREE: Mapping[str, Any] = {"tree": tree, "flight": partial(_scene, "flight", _TERMS), "servo": servo}
BOUND: Mapping[str, Any] = {
    "four_bar": four_bar,
    **{name: partial(_scene, name, _CONSTRAINED) for name in ("slider_crank", "driven", "rolling", "rail")},
    "rods_se3": partial(rods, "SE3"),
    "rods_r3xso3": partial(rods, "R3xSO3"),
}
#: Steps of runs, s in the scene's own units of time; 2e-3 unless they are here.
STEPS: Mapping[str, float] = {"four_bar": 5e-4, "slider_crank": 2e-4, "driven": 5e-4}


@cache
def similar(name: str) -> Similar:
    """Return the model of a scene in any units, with a start on its constraints."""
    return Similar(eomgen.build(in_units({**FREE, **BOUND}[name]()), profile="quick"))
