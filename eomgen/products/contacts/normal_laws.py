"""Register of normal forces, N, over ``gap``, m, ``rate`` of the gap, m/s, and ``deflection``, m.

A row gives ``force``, which separates the bodies, the part ``elastic`` of it that has the potential ``energy``, J,
and the formulas of both. Forces of powers of the deflection are as smooth as the power: with an exponent of 1.5 the
first derivatives are continuous, and the second ones grow without bound at the onset of contact.
"""

from __future__ import annotations

from collections.abc import Mapping

from eomgen.mechanics.forces.contacts import contact
from eomgen.products.contacts.laws import NORMAL, ContactLaw, LawKey
from eomgen.scene.reading.requirements import Outside, above_zero, not_below_zero
from eomgen.symbolic.scalar import Algebra, Scalar

_STIFFNESS = above_zero("the stiffness of a contact [E2403]")
_EXPONENT = LawKey(
    "exponent of the deflection",
    bound=(Outside(1.0, 100.0), "the exponent of a contact is {0} [E2404]", "1 to 3"),
    default=1.5,
)
_POWER = {
    "elastic": "stiffness * deflection ** exponent",
    "energy": "stiffness * deflection ** (exponent + 1) / (exponent + 1)",
}
_RESULTS = {"elastic": "elastic", "energy": "energy"}


class _LinearLaw(ContactLaw):
    """The law of stops of joints."""

    def record(self, algebra: Algebra, known: Mapping[str, Scalar]) -> dict[str, Scalar]:
        keys = {name: known[name] for name in self.keys}
        law = contact(algebra, -known["gap"], -known["rate"], **keys)
        return {"force": law.force, "elastic": law.elastic, "energy": law.potential}


_LAWS = (
    ContactLaw(
        "formula",
        {"force": LawKey("force that separates the bodies", "N", example='"1e5*deflection"', names=NORMAL)},
        {"force": "force"},
    ),
    _LinearLaw(
        "linear",
        {
            "stiffness": LawKey("force by deflection", "N/m", _STIFFNESS, example="1e5"),
            "damping": LawKey(
                "force by rate of deflection", "N s/m", not_below_zero("the damping of a contact [E2405]"), 0.0
            ),
            "onset": LawKey(
                "deflection up to which it rises smoothly",
                "m",
                above_zero("the onset of a contact [E2406]"),
                1e-4,
            ),
        },
        {},
    ),
    ContactLaw(
        "hunt_crossley",
        {
            "stiffness": LawKey("force at a deflection of 1 m", "", _STIFFNESS, example="1e6"),
            "exponent": _EXPONENT,
            "damping": LawKey(
                "loss of speed of slow impacts, by speed",
                "s/m",
                not_below_zero("the damping of a contact [E2407]"),
                0.0,
            ),
        },
        {"force": "elastic * max(1 - 1.5 * damping * rate, 0)", **_RESULTS},
        definitions=_POWER,
    ),
    ContactLaw(
        "lankarani_nikravesh",
        {
            "stiffness": LawKey("force at a deflection of 1 m", "", _STIFFNESS, example="1e6"),
            "exponent": _EXPONENT,
            "restitution": LawKey(
                "coefficient of restitution",
                bound=(Outside(0.0, 1.0), "the coefficient of restitution is {0} [E2408]", "0 to 1"),
                example="0.8",
            ),
            "impact_velocity": LawKey(
                "speed of approach at the impact", "m/s", above_zero("the speed of an impact [E2409]"), example="1.0"
            ),
        },
        {"force": "elastic * max(1 - 0.75 * (1 - restitution**2) * rate / impact_velocity, 0)", **_RESULTS},
        definitions=_POWER,
    ),
    ContactLaw(
        "hertz",
        {
            "modulus": LawKey(
                "modulus E*, 1/E* of the sum of (1 - nu^2)/E of both bodies",
                "Pa",
                above_zero("the elastic modulus [E2410]"),
                example="1e9",
            ),
            "curvature_radius": LawKey(
                "effective radius R, 1/R of the sum of the curvatures", "m", above_zero("a radius of curvature [E2411]")
            ),
        },
        {"force": "elastic", **_RESULTS},
        definitions={
            "stiffness": "4 / 3 * modulus * sqrt(curvature_radius)",
            "elastic": "stiffness * deflection ** 1.5",
            "energy": "0.4 * stiffness * deflection ** 2.5",
        },
    ),
)
LAWS: Mapping[str, ContactLaw] = {law.name: law for law in _LAWS}
