"""Register of tangential forces on the second body, N, over the quantities of a pair.

These are ``load``, the normal force, N; ``slip_velocity_x`` and ``slip_velocity_y``, the velocity of the second body
at the contact, and ``velocity_x`` and ``velocity_y`` at its centre, m/s; the angular velocities ``turn_x``, ``turn_y``
and ``spin`` about x, y and the normal, and ``wheel_speed`` about its axis, rad/s; ``camber``, rad; and the names of
normal laws.

A row gives ``force_x``, ``force_y`` and moments, N m, about x, y and the normal z. Axes are the axes of the surface,
and of a disc or a torus the heading and the direction across it.
"""

from __future__ import annotations

from collections.abc import Mapping

from eomgen.products.contacts import slip_laws
from eomgen.products.contacts.laws import TANGENTIAL, ContactLaw, LawKey
from eomgen.scene.reading.requirements import above_zero, not_below_zero

_FRICTION = LawKey("largest force by load", "", not_below_zero("the friction of a contact [E2416]"), example="0.5")


def _own_formula(words: str, unit: str) -> LawKey:
    return LawKey(words, unit, default=0.0, example='"-load * slip_velocity_x"', names=TANGENTIAL)


_LAWS = (
    ContactLaw(
        "formula",
        {
            **{f"force_{axis}": _own_formula(f"force along {axis}", "N") for axis in "xy"},
            **{f"moment_{axis}": _own_formula(f"moment about {axis}", "N m") for axis in "xyz"},
        },
        {name: name for name in ("force_x", "force_y", "moment_x", "moment_y", "moment_z")},
    ),
    ContactLaw(
        "coulomb",
        {
            "friction": _FRICTION,
            "velocity": LawKey(
                "slip at which the force is 0.7 of the largest",
                "m/s",
                above_zero("the regularisation velocity [E2417]"),
                1e-3,
            ),
        },
        {"force_x": "-factor * slip_velocity_x", "force_y": "-factor * slip_velocity_y"},
        definitions={"factor": "friction * load / sqrt(slip_velocity_x**2 + slip_velocity_y**2 + velocity**2)"},
    ),
    ContactLaw(
        "viscous",
        {"damping": LawKey("force by load and slip", "s/m", not_below_zero("the damping of a contact [E2418]"))},
        {"force_x": "-damping * load * slip_velocity_x", "force_y": "-damping * load * slip_velocity_y"},
    ),
    # elastic up to half of the largest deflection; beyond it, slip along the bristles makes them slide
    ContactLaw(
        "bristles",
        {
            "friction": _FRICTION,
            "bristle_length": LawKey(
                "deflection of sliding bristles", "m", above_zero("the deflection of bristles [E2419]"), 1e-4
            ),
            "damping": LawKey(
                "force by load and rate of the bristles", "s/m", not_below_zero("the damping of a contact [E2420]"), 0.0
            ),
            "release": LawKey("time constant in the air", "s", above_zero("the time of release [E2421]"), 1e-3),
        },
        {
            "force_x": "-load * (stiffness * bristle_x + damping * rate_x)",
            "force_y": "-load * (stiffness * bristle_y + damping * rate_y)",
        },
        definitions={
            "stiffness": "friction / bristle_length",
            "square": "bristle_x**2 + bristle_y**2",
            "part": "min(max(2 * sqrt(square) / bristle_length - 1, 0), 1)",
            "sliding": "part * part * (3 - 2 * part)",
            "outward": "max(bristle_x * slip_velocity_x + bristle_y * slip_velocity_y, 0)",
            "yielding": "sliding * outward / square if sliding > 0 else 0",
            "rate_x": "slip_velocity_x - yielding * bristle_x",
            "rate_y": "slip_velocity_y - yielding * bristle_y",
            "open": "min(max(gap / bristle_length, 0), 1)",
            "free": "open * open * (3 - 2 * open)",
        },
        states={
            "bristle_x": "(1 - free) * rate_x - free * bristle_x / release",
            "bristle_y": "(1 - free) * rate_y - free * bristle_y / release",
        },
    ),
)
LAWS: Mapping[str, ContactLaw] = {law.name: law for law in (*_LAWS, *slip_laws.ROWS)}
