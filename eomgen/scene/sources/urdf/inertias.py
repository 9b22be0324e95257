"""Bodies of a URDF as entries of a scene: with fixed numbers, or with ten inertial parameters of one link."""

from __future__ import annotations

from typing import Any

import numpy as np

from eomgen.scene.geometry.inertia import Inertia

_ENTRIES = {"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}


def body_entry(inertia: Inertia) -> dict[str, Any]:
    """Return the entry of a body with the given mass properties."""
    tensor = [float(inertia.about_center[place]) for place in _ENTRIES.values()]
    return {"mass": inertia.mass, "center_of_mass": np.asarray(inertia.center).tolist(), "inertia": tensor}


def tunable_body(link: str, inertia: Inertia) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return ten tunable parameters with the values of a link, and the entry of a body that has them.

    They are ``LINK_mass``, ``LINK_center_x`` (and y, z), m in the link's frame, and ``LINK_inertia_xx`` (yy, zz, xy,
    xz, yz), kg m^2 about the centre of mass in the link's axes.
    """
    fixed = body_entry(inertia)
    values = {f"{link}_mass": (fixed["mass"], "kg")}
    values |= {f"{link}_center_{x}": (value, "m") for x, value in zip("xyz", fixed["center_of_mass"], strict=True)}
    values |= {f"{link}_inertia_{x}": (value, "kg m^2") for x, value in zip(_ENTRIES, fixed["inertia"], strict=True)}
    names = list(values)
    parameters = {name: {"value": value, "unit": unit, "tunable": True} for name, (value, unit) in values.items()}
    return parameters, {"mass": names[0], "center_of_mass": names[1:4], "inertia": names[4:]}
