"""The shape of force elements beyond springs along a line: stops and dry friction of joints."""

from __future__ import annotations

from eomgen.scene.formula_scope import PARAMETERS
from eomgen.scene.schema_key import Table, key
from eomgen.scene.schema_values import Value

_COORDINATE = {"revolute": "rad", "prismatic": "m"}
_RATE = {"revolute": "rad/s", "prismatic": "m/s"}
_EFFORT = {"revolute": "N m", "prismatic": "N"}
_STIFFNESS = {"revolute": "N m/rad", "prismatic": "N/m"}
_DAMPING = {"revolute": "N m s/rad", "prismatic": "N s/m"}


class Limits(Table):
    """Compliant stops of a joint's coordinate."""

    lower: Value | None = key("lower end of the range, if there is one", None, unit=_COORDINATE, names=PARAMETERS)
    upper: Value | None = key("upper end of the range, if there is one", None, unit=_COORDINATE, names=PARAMETERS)
    stiffness: Value = key("of the stop", unit=_STIFFNESS, names=PARAMETERS)
    damping: Value = key("of the stop", 0.0, unit=_DAMPING, names=PARAMETERS)
    onset: Value | None = key(
        "penetration over which the stop reaches its full stiffness",
        None,
        unit=_COORDINATE,
        names=PARAMETERS,
        shown_default="1e-3 rad, 1e-4 m",
    )


class Friction(Table):
    """Dry friction of a joint's coordinate."""

    coulomb: Value = key("level of the friction", unit=_EFFORT, names=PARAMETERS)
    velocity: Value = key("regularisation: well below this speed the joint counts as sticking", unit=_RATE, names=PARAMETERS)
    static: Value | None = key("level at which it breaks loose; with `stribeck`", None, unit=_EFFORT, names=PARAMETERS)
    stribeck: Value | None = key(
        "speed over which the static level falls to Coulomb's, above `velocity`", None, unit=_RATE, names=PARAMETERS
    )
