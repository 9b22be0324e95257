"""Parameters in which inverse dynamics is linear: inertial ones of bodies, rotor inertias, coefficients of friction.

Of a body: mass m, first moments int s dm = m c, and the inertia tensor about the origin of its frame, in its axes
(Atkeson, An and Hollerbach 1986; Khalil and Dombre 2002, section 9.2). In the geometry tau is not linear, so places of
joints and the like keep their values.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

from eomgen.base.data import dataclass
from eomgen.formula.nodes import ZERO, Formula
from eomgen.scene.bodies.model import Body
from eomgen.scene.joints.model import Joint
from eomgen.scene.scene import Scene
from eomgen.system.description import LinearParameter, component_names

#: Inertial parameters of a body with units, in the order of columns.
OF_BODY = (
    ("mass", "kg"),
    *((f"first_moment_{axis}", "kg m") for axis in "xyz"),
    *((f"inertia_{axes}", "kg m^2") for axes in ("xx", "yy", "zz", "xy", "xz", "yz")),
)
Kind = Literal["rotor_inertia", "damping", "coulomb", "static"]


@dataclass(frozen=True)
class JointParameter:
    """A coefficient of one coordinate of a joint, a formula of parameters."""

    joint: Joint
    kind: Kind
    index: int
    value: Formula


def moving_bodies(scene: Scene) -> list[Body]:
    """Return the bodies that some joint moves against the base, in the order of the scene."""
    moving: set[str] = set()
    for joint in scene.joints:
        if joint.kind.moves or joint.parent in moving:
            moving.add(joint.child)
    return [body for body in scene.bodies if body.name in moving]


def joint_parameters(scene: Scene) -> Iterator[JointParameter]:
    """Yield the coefficients of joints in which inverse dynamics is linear: rotor inertias, damping, and friction.
    Joint by joint, in this order; coefficients that are 0 in the scene are left out."""
    for joint in scene.joints:
        of_coordinates: list[tuple[Kind, int, Formula]] = []
        of_coordinates += [("rotor_inertia", k, value) for k, value in enumerate(joint.each(joint.rotor_inertia))]
        of_coordinates += [("damping", k, value) for k, value in enumerate(joint.each(joint.damping))]
        for item in joint.friction:
            of_coordinates.append(("coulomb", item.index, item.coulomb))
            of_coordinates += [("static", item.index, item.static)] if item.static is not None else []
        for kind, index, value in of_coordinates:
            if value != ZERO:
                yield JointParameter(joint, kind, index, value)


def linear_parameters(scene: Scene) -> tuple[LinearParameter, ...]:
    """Return names and units of the parameters in which inverse dynamics is linear, in the order of the regressor's
    columns. Ten of each moving body, then coefficients of joints. Empty in absolute coordinates and if bodies
    deform."""
    if scene.coordinates == "absolute" or any(body.beam is not None for body in scene.bodies):
        return ()
    result = [LinearParameter(f"{body.name}.{of}", unit) for body in moving_bodies(scene) for of, unit in OF_BODY]
    for item in joint_parameters(scene):
        size = item.joint.kind.v_size
        name = component_names("", f"{item.joint.name}.{item.kind}", size)[item.index]
        result.append(LinearParameter(name, _unit(item)))
    return tuple(result)


def _unit(item: JointParameter) -> str:
    units = [unit for _, unit in item.joint.kind.coordinates.items()] or ["rad"] * 3 + ["m"] * 3
    turns = units[item.index] == "rad"
    return {"rotor_inertia": "kg m^2" if turns else "kg", "damping": "N m s/rad" if turns else "N s/m"}.get(
        item.kind, "N m" if turns else "N"
    )
