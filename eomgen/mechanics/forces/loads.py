"""What acts on a tree besides gravity: wrenches on links, efforts on coordinates, their potential and their power."""

from __future__ import annotations

from dataclasses import dataclass, field

from eomgen.mechanics.forces.symbols import Quantities
from eomgen.mechanics.kinematics.wrenches import Wrench
from eomgen.mechanics.tree.links import Tree
from eomgen.symbolic.scalar import Scalar, Vector, apply, cross, plus, transpose


@dataclass
class Loads:
    """What acts on the tree besides gravity.

    Attributes
    ----------
    wrenches : by link; moment about the link's origin and force, in link axes; None where nothing acts
    efforts : by velocity component
    potential : energy of springs, J
    power : of everything that is not conservative, W (dampers, actuators, formulas)
    external : by link; the part of the wrenches that the world exerts, not the base or another link
    """

    wrenches: list[Wrench | None]
    efforts: list[Scalar]
    potential: Scalar
    power: Scalar
    external: list[Wrench | None] = field(default_factory=list)


def no_loads(tree: Tree) -> Loads:
    """Return loads that are all zero, for adding to them."""
    zero = tree.algebra.zero
    return Loads([None] * len(tree.links), [zero] * tree.nv, zero, zero, [None] * len(tree.links))


def add_effort(loads: Loads, quantities: Quantities, joint: str, value: Scalar, index: int = 0) -> None:
    """Add a generalized force on one coordinate of a joint."""
    for dof, factor in quantities.work_of(joint, index).items():
        loads.efforts[dof] = loads.efforts[dof] + factor * value


def push(wrenches: list[Wrench | None], quantities: Quantities, name: str, force_in_base: Vector) -> None:
    """Add a force in base axes on a point, by the point's name."""
    link, s = quantities.kinematics.local(*quantities.at(quantities.points[name]))
    if link >= 0:
        force = apply(transpose(quantities.kinematics.pose(link)[0]), force_in_base)
        add_wrench(wrenches, link, (cross(s, force), force))


def add_wrench(wrenches: list[Wrench | None], link: int, load: Wrench) -> None:
    """Add a wrench about a link's origin, in its axes."""
    present = wrenches[link]
    wrenches[link] = load if present is None else (plus(present[0], load[0]), plus(present[1], load[1]))
