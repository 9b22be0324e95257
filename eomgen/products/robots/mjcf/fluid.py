"""Forces of the medium in MJCF: a body drags like the box of its inertia, or its geoms move like ellipsoids.

Formulas: MuJoCo's documentation, "Computation: Fluid forces". Inertia of the medium acts by the velocity alone, as in
MuJoCo: the part that goes with the acceleration is left out there.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import pi

import numpy as np

from eomgen.base.arrays import Array
from eomgen.products.robots.mjcf.draft import MjcfDraft, cross, dot, times, total
from eomgen.products.robots.scene_draft import LinkPlace, number
from eomgen.system.description import BASE

#: Square of a speed, (m/s)^2, or of a spin, (rad/s)^2, that stands for rest, so that roots and quotients have slopes.
_AT_REST = "1e-60"


def convert_fluid(draft: MjcfDraft) -> None:
    """Add the forces of the medium on all bodies with mass that are not on the base, if the medium has density or
    viscosity. Geoms with ``fluidshape`` drag as ellipsoids, other bodies as the box with the body's inertia."""
    model = draft.model
    if draft.without_passive_forces or not (float(model.opt.density) > 0.0 or float(model.opt.viscosity) > 0.0):
        return
    by_geom: dict[int, list[int]] = {}
    for number_of_geom in np.flatnonzero(model.geom_fluid[:, 0] > 0.0):
        by_geom.setdefault(int(model.geom_bodyid[number_of_geom]), []).append(int(number_of_geom))
    for body in range(1, model.nbody):
        if float(model.body_mass[body]) < draft.mujoco.mjMINVAL or draft.places[body].body == BASE:
            continue
        if body not in by_geom:
            _add_drag(draft, body)
        for geom in by_geom.get(body, ()):
            _add_ellipsoid(draft, body, geom)


def _motion(draft: MjcfDraft, written: str, placement: LinkPlace) -> tuple[list[str], list[str]]:
    """Return names of the components (3 each) of velocity against the medium and angular velocity, in the axes of the
    frame at ``placement``. Both are added as definitions, with names that begin with ``written``."""
    center, ends = draft.frame_points(f"{written}_center", placement)
    wind = [float(value) for value in draft.model.opt.wind]
    flow = [f"(velocity.{center}[{i}] - {number(wind[i])})" if wind[i] else f"velocity.{center}[{i}]" for i in range(3)]
    spin = [f"angular_velocity.{placement.body}[{i}]" for i in range(3)]
    axes = [draft.along(center, end) for end in ends]
    speeds = draft.define_each(f"{written}_speed", [dot(axis, flow) for axis in axes])
    return speeds, draft.define_each(f"{written}_spin", [dot(axis, spin) for axis in axes])


def _add(draft: MjcfDraft, written: str, placement: LinkPlace, forces: list[str], torques: list[str]) -> None:
    load = {"force": _rotate(placement.orientation, forces), "torque": _rotate(placement.orientation, torques)}
    at = {"body": placement.body, "point": placement.position.tolist(), "axes": "body"}
    draft.add("forces", "force", f"{written}_drag", at | load)


def _add_drag(draft: MjcfDraft, body: int) -> None:
    """Add the drag of the homogeneous box with a body's inertia: viscous and quadratic force and torque at the centre
    of mass."""
    model = draft.model
    density, viscosity = float(model.opt.density), float(model.opt.viscosity)
    placement = draft.places[body].of(np.array(model.body_ipos[body]), model.body_iquat[body])
    inertia, mass = np.array(model.body_inertia[body]), float(model.body_mass[body])
    # the edges of the homogeneous box with this inertia; of a plate the thickness is of MuJoCo's smallest moment
    box = np.sqrt(6.0 * np.maximum(draft.mujoco.mjMINVAL, float(np.sum(inertia)) - 2.0 * inertia) / mass)
    written = draft.element_name("body", body) or f"body_{body}"
    linear, angular = _motion(draft, written, placement)
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
    _add(draft, written, placement, forces, torques)


def _add_ellipsoid(draft: MjcfDraft, body: int, geom: int) -> None:
    """Add the forces on a geom that moves through the medium like an ellipsoid: drag, lift by circulation and spin, and
    the inertia of the medium."""
    model = draft.model
    density, viscosity = float(model.opt.density), float(model.opt.viscosity)
    placement = draft.places[body].of(np.array(model.geom_pos[geom]), model.geom_quat[geom])
    axes = _semi_axes(draft, geom)
    blunt, slender, turning, kutta, magnus = (float(value) for value in model.geom_fluid[geom][1:6])
    mass, inertia = (density * np.array(model.geom_fluid[geom][k : k + 3]) for k in (6, 9))
    written = draft.element_name("geom", geom) or f"geom_{geom}"
    v, w = _motion(draft, written, placement)

    def add(word: str, formula: str) -> str:
        return draft.define(f"{written}_{word}", formula)

    speed = add("speed", _norm(v))
    small, middle, large = (float(axis) for axis in np.sort(axes))
    widest = pi * large * middle
    # areas of the projections along the axes by the widest one; all terms below are of sizes and units of speeds
    shares = [small / float(axis) for axis in axes]
    cast = add("cast", f"max({total(_squares(shares, v, 4))}, {_AT_REST})")
    seen = add("seen", f"max({total(_squares(shares, v, 2))}, {_AT_REST})")
    narrow = add("narrow", f"sqrt({cast} / {seen})")
    area = add("area", f"{number(widest)} * {narrow}")
    wide = _sum([(blunt - slender, area), (slender * widest, "")])
    mean = float(np.sum(axes)) / 3.0
    drag = add("drag", f"{number(6.0 * pi * mean * viscosity)} + {number(density)} * {speed} * {wide}")
    swept = [8.0 / 15.0 * pi * float(axes[k] * max(axes[k - 1], axes[k - 2]) ** 4) for k in range(3)]
    most = 8.0 / 15.0 * pi * middle * large**4
    parts = [turning * part / most + slender * (1.0 - part / most) for part in swept]
    moments = [times(part, x) for part, x in zip(parts, w, strict=True)]
    slowing = add("slowing", f"{number(8.0 * pi * mean**3 * viscosity)} + {number(density * most)} * {_norm(moments)}")
    normal = [times(share**2, x) for share, x in zip(shares, v, strict=True)]
    lift = add("lift", f"{number(kutta * density * widest)} / ({narrow} * {speed})")
    circulation = draft.define_each(f"{written}_circulation", [f"{lift} * {part}" for part in cross(normal, v)])
    momentum = [times(float(m), x) for m, x in zip(mass, v, strict=True)]
    spin = [times(float(m), x) for m, x in zip(inertia, w, strict=True)]
    whirl = magnus * density * 4.0 / 3.0 * pi * float(np.prod(axes))
    forces = [
        total([carried, times(whirl, side), lifted, f"(-{drag} * {x})"])
        for carried, side, lifted, x in zip(cross(momentum, w), cross(w, v), cross(circulation, v), v, strict=True)
    ]
    torques = [
        total([pushed, turned, f"(-{slowing} * {x})"])
        for pushed, turned, x in zip(cross(momentum, v), cross(spin, w), w, strict=True)
    ]
    forces, torques = draft.define_each(f"{written}_force", forces), draft.define_each(f"{written}_torque", torques)
    _add(draft, written, placement, forces, torques)


def _semi_axes(draft: MjcfDraft, geom: int) -> Array:
    """Return the semi-axes (3,), m, of the ellipsoid that stands for a sphere, capsule or cylinder; of other geoms
    their size."""
    kinds, kind = draft.mujoco.mjtGeom, int(draft.model.geom_type[geom])
    size = np.array(draft.model.geom_size[geom])
    if kind == kinds.mjGEOM_SPHERE:
        return np.full(3, size[0])
    if kind in (kinds.mjGEOM_CAPSULE, kinds.mjGEOM_CYLINDER):
        return np.array([size[0], size[0], size[1] + (size[0] if kind == kinds.mjGEOM_CAPSULE else 0.0)])
    return size


def _norm(vector: Sequence[str]) -> str:
    return f"sqrt(max({dot(vector, vector)}, {_AT_REST}))"


def _squares(shares: Sequence[float], vector: Sequence[str], power: int) -> list[str]:
    return [f"{number(share**power)} * {x}**2" for share, x in zip(shares, vector, strict=True)]


def _sum(parts: Sequence[tuple[float, str]]) -> str:
    """Return the formula of the sum of factors times terms; an empty term stands for 1."""
    return total([times(factor, term) if term else number(factor) for factor, term in parts])


def _rotate(orientation: Array, components: list[str]) -> list[str]:
    """Return the formulas, in the axes of the body, of a vector of formulas in a frame with this orientation (3, 3)."""
    return [
        total([f"{number(float(x))} * ({part})" for x, part in zip(row, components, strict=True) if x])
        for row in orientation
    ]
