"""Forces of the medium in MJCF: each body drags like the box of its inertia.

Formulas: MuJoCo's documentation, "Computation: Fluid forces, inertia model".
"""

from __future__ import annotations

from math import pi

import numpy as np

from eomgen.base.arrays import Array
from eomgen.scene.sources.mjcf.draft import Draft, number, total
from eomgen.system.description import BASE

#: Mass and moments of inertia below which MuJoCo counts a body as without inertia.
_SMALLEST = 1e-15


def convert_fluid(draft: Draft) -> None:
    """Add the forces of the medium on all bodies; report bodies with the ellipsoid model."""
    model = draft.model
    density, viscosity = float(model.opt.density), float(model.opt.viscosity)
    if not (density > 0.0 or viscosity > 0.0):
        return
    by_geom = sorted({int(model.geom_bodyid[k]) for k in range(model.ngeom) if model.geom_fluid[k][0] > 0.0})
    for body in range(1, model.nbody):
        if body in by_geom:
            place = draft.place("body", body - 1, model.nbody - 1)
            name = draft.written("body", body) or f"body {body}"
            fault = f"forces of the medium on ellipsoids (fluidshape) are not supported: {name}"
            draft.refuse(place, "option", fault, 'fluidshape="none", or density 0 and viscosity 0')
        elif float(model.body_mass[body]) > _SMALLEST and draft.places[body].body != BASE:
            _add_drag(draft, body, density, viscosity)


def _add_drag(draft: Draft, body: int, density: float, viscosity: float) -> None:
    model = draft.model
    place = draft.places[body].of(np.array(model.body_ipos[body]), model.body_iquat[body])
    box = _box(np.array(model.body_inertia[body]), float(model.body_mass[body]))
    written = draft.written("body", body) or f"body_{body}"
    center, ends = draft.frame_points(f"{written}_center", place)
    linear, angular = [], []
    for axis, end in zip("xyz", ends, strict=True):
        along = draft.along(center, end)
        wind = [number(float(value)) for value in model.opt.wind]
        speeds = [f"{a} * (velocity.{center}[{i}] - {wind[i]})" for i, a in enumerate(along)]
        turns = [f"{a} * angular_velocity.{place.body}[{i}]" for i, a in enumerate(along)]
        linear.append(draft.define(f"{written}_speed_{axis}", total(speeds)))
        angular.append(draft.define(f"{written}_spin_{axis}", total(turns)))
    mean = float(np.mean(box))
    forces: list[str] = []
    torques: list[str] = []
    for k, (speed, spin) in enumerate(zip(linear, angular, strict=True)):
        i, j = (m for m in range(3) if m != k)
        push = [
            (3.0 * pi * mean * viscosity, speed),
            (0.5 * density * float(box[i] * box[j]), f"abs({speed}) * {speed}"),
        ]
        turn = [
            (pi * mean**3 * viscosity, spin),
            (density * float(box[k] * (box[i] ** 4 + box[j] ** 4)) / 64.0, f"abs({spin}) * {spin}"),
        ]
        for parts, all_parts in ((push, forces), (turn, torques)):
            all_parts.append(total([f"{number(-factor)} * {term}" for factor, term in parts if factor]))
    draft.section("forces")[draft.name("force", "", f"{written}_drag")] = {
        "body": place.body,
        "point": place.position.tolist(),
        "axes": "body",
        "force": _turned(place.orientation, forces),
        "torque": _turned(place.orientation, torques),
    }


def _box(inertia: Array, mass: float) -> Array:
    """Return the edges of the homogeneous box with a mass and principal moments of inertia."""
    squares = 6.0 * np.maximum(_SMALLEST, float(np.sum(inertia)) - 2.0 * inertia) / mass
    return np.asarray(np.sqrt(squares))


def _turned(orientation: Array, components: list[str]) -> list[str]:
    """Return the components of a vector of formulas in the axes of the body."""
    rows = []
    for row in orientation:
        rows.append(total([f"{number(float(x))} * ({part})" for x, part in zip(row, components, strict=True) if x]))
    return rows
