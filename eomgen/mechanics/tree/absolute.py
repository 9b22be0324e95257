"""Absolute coordinates: each body is free in the world, on SE(3) or R^3 x SO(3), and joints become constraints.

Each body's frame is put at its centre of mass, so M is constant and block diagonal. On R^3 x SO(3) a body is a point
that carries the mass (three translations along world axes) and a rigid body turning about it; the two are links of an
ordinary tree, so all terms come from the same recursions, and the mass at the centre of the turning link is grouped
into the point.
"""

from __future__ import annotations

from collections.abc import Mapping

from eomgen.base.data import replace
from eomgen.errors import ModelError, Problem
from eomgen.formula.nodes import Formula
from eomgen.formula.recording import record
from eomgen.lie.product import Factor
from eomgen.mechanics.tree.build import moved_link
from eomgen.mechanics.tree.inertia import RecordedInertia, added_masses, body_inertia, elements_with_mass
from eomgen.mechanics.tree.joints import IDENTITY, JointMotion, own_coordinates
from eomgen.mechanics.tree.links import (
    CARRIER,
    ROOT,
    WORLD,
    WORLD_NAME,
    Link,
    Mount,
    Tree,
    clean,
    no_inertia,
    parameter_scalars,
)
from eomgen.scene.bodies.model import Body
from eomgen.scene.joint_types import MotionKind
from eomgen.scene.joints.model import Joint
from eomgen.scene.scene import Scene
from eomgen.symbolic.scalar import Algebra, Scalar, Vector, apply, minus, multiply, negative, plus, scaled
from eomgen.system.description import BASE

DEFAULT_GROUP = "SE3"
FreeLink = tuple[Link, Factor]


def build_absolute_tree(algebra: Algebra, scene: Scene, groups: Mapping[str, str]) -> Tree:
    """Return the tree of the free bodies of a scene, with frames at the centres of mass.

    A body on a fixed joint is merged into the carrying body.

    Parameters
    ----------
    groups : group of each body, ``SE3`` or ``R3xSO3``; ``SE3`` for bodies that the mapping does not name

    Raises
    ------
    ModelError
        For a body without mass, which absolute coordinates cannot carry.
    """
    parameters = parameter_scalars(algebra, scene)

    def number(formula: Formula) -> Scalar:
        return record(algebra, formula, lambda symbol: parameters[symbol.name])

    mounts = {
        BASE: Mount(CARRIER, algebra.identity, algebra.zero_vector),
        WORLD_NAME: Mount(WORLD, algebra.identity, algebra.zero_vector),
    }
    with_mass = elements_with_mass(scene)
    hosts: list[Body] = []
    totals: list[RecordedInertia] = []
    for body, joint in zip(scene.bodies, scene.joints, strict=True):
        inertia = body_inertia(algebra, body, number)
        inertia = replace(inertia, added=added_masses(algebra, with_mass.get(body.name, ()), number))
        if not joint.kind.moves:
            above = mounts[joint.parent]
            orientation = multiply(above.orientation, algebra.matrix(joint.orientation))
            position = plus(
                above.position, apply(above.orientation, algebra.vector([number(item) for item in joint.position]))
            )
            mounts[body.name] = Mount(above.link, orientation, position)
            if above.link >= 0:
                totals[above.link] = totals[above.link] + inertia.transform(orientation, position)
            continue
        mounts[body.name] = Mount(len(hosts), algebra.identity, algebra.zero_vector)
        hosts.append(body)
        totals.append(inertia)
    if light := [body.name for body, total in zip(hosts, totals, strict=True) if total.mass.is_zero]:
        fault = "has no mass, which absolute coordinates cannot carry [E0515]"
        raise ModelError([Problem(f"bodies.{name}", fault, "a mass, or joint coordinates") for name in light])
    links: list[FreeLink] = []
    turning: list[int] = []
    centers: list[Vector] = []
    for number_of_body, (body, total) in enumerate(zip(hosts, totals, strict=True)):
        center = scaled(algebra.one / total.mass, total.first)
        about_center = total.shift(negative(center))
        central = replace(about_center, first=algebra.zero_vector)
        central = clean(algebra, central)
        q, v, name = 7 * number_of_body, 6 * number_of_body, body.name
        if groups.get(name, DEFAULT_GROUP) == "SE3":
            links.append(_link(algebra, "free", name, ROOT, Factor("SE3", name, q, 7, v, 6), central))
        else:
            links += _separate_links(algebra, name, q, v, central, len(links))
        turning.append(len(links) - 1)
        centers.append(center)
    for name, mount in mounts.items():
        if mount.link >= 0:
            position = minus(mount.position, centers[mount.link])
            mounts[name] = Mount(turning[mount.link], mount.orientation, position)
    of_bodies, factors = zip(*links, strict=True) if links else ((), ())
    return Tree(algebra, of_bodies, mounts, parameters, factors, {})


def _separate_links(
    algebra: Algebra, name: str, q_start: int, v_start: int, inertia: RecordedInertia, index: int
) -> list[FreeLink]:
    """Return the two links of a body on R^3 x SO(3): a translating massless point, and the body rotating about this
    point. Angular velocity comes first in v; ``index`` is the number of the first link."""
    position = Factor("R", f"{name}.position", q_start + 4, 3, v_start + 3, 3)
    turn = Factor("SO3", f"{name}.orientation", q_start, 4, v_start, 3)
    return [
        _link(algebra, "travel", name, ROOT, position, no_inertia(algebra)),
        _link(algebra, "ball", name, index, turn, inertia),
    ]


def _link(
    algebra: Algebra, kind: MotionKind, name: str, parent: int, factor: Factor, inertia: RecordedInertia
) -> FreeLink:
    """Return the link of a free body, and the factor: the coordinates are all of this factor, at the origin of the
    parent. ``kind`` is "free", "travel" or "ball"."""
    coordinates = own_coordinates(algebra, factor, {})
    motion = JointMotion(kind, IDENTITY if kind == "travel" else (), tuple(range(factor.v_size)))
    joint = Joint(factor.name, "spherical" if kind == "ball" else "free", BASE, name)
    mount = Mount(parent, algebra.identity, algebra.zero_vector)
    link = moved_link(name, joint, motion, mount, coordinates, algebra.zero, "body")
    return replace(link, inertia=inertia, balanced=kind == "ball"), factor
