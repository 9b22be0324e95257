"""Mass properties of bodies at the default parameters, and the requirement that bodies can have them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from eomgen.base.text import key_of
from eomgen.scene.bodies.model import Body
from eomgen.scene.geometry.inertia import Inertia, tensor
from eomgen.scene.reading.requirements import RELATIONS
from eomgen.scene.reading.values import Values


def body_inertias(bodies: Iterable[Body], values: Values) -> dict[str, Inertia]:
    """Return mass properties at the default parameters."""
    known = {}
    for body in bodies:
        center = [values.value(entry) for entry in body.center_of_mass]
        entries = [values.value(entry) for entry in body.inertia]
        known[body.name] = Inertia(values.value(body.mass), np.array(center), tensor(entries))
    return known


def check_inertias(bodies: Iterable[Body], values: Values) -> None:
    """Require of rigid bodies inertias that bodies can have."""
    for body in bodies:
        key = key_of("bodies", body.name)
        if body.beam is None and not body.node_of and not values.report.concerns(key):
            hint = f"the values of {body.name} about its centre of mass, in its own axes"
            values.require(f"{key}.inertia", replace(RELATIONS["inertia"], hint=hint), body.inertia)
