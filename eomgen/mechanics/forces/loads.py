"""Applied loads on a tree: wrenches on links, efforts on coordinates, potential and power."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from eomgen.base.data import dataclass, field
from eomgen.mechanics.forces.symbols import Offer, Quantities
from eomgen.mechanics.kinematics.fields import Wrench
from eomgen.mechanics.tree.links import Tree
from eomgen.scene.forces.element import ForceElement
from eomgen.symbolic.scalar import Scalar, Vector, apply, cross, plus, transpose


@dataclass
class Loads:
    """Applied loads on the tree, without gravity.

    Attributes
    ----------
    wrenches : by link: moment about the link's origin and force, in link axes; None for no load
    efforts : (nv,) generalized forces
    potential : energy of springs, J
    power : of all non-conservative loads (dampers, actuators, formulas), W
    external : by link, the part of the wrenches that the world exerts, not the base or another link
    """

    wrenches: list[Wrench | None]
    efforts: list[Scalar]
    potential: Scalar
    power: Scalar
    external: list[Wrench | None] = field(default_factory=list)


@dataclass(frozen=True)
class Law:
    """Recording functions of a kind of force element: the loads, and the quantities for formulas.

    Attributes
    ----------
    model : class of the force elements
    add : adds the loads of one element to ``Loads``
    offers : functions of quantities in formulas, by kind of symbol
    together : adds the loads of alike elements as loops, and returns the elements that are left to ``add``
    before_joints : whether the loads are recorded before the forces of joints
    """

    model: type[ForceElement]
    add: Callable[[Loads, Any, Quantities], None]
    offers: Mapping[str, Offer] = field(default_factory=dict)
    together: Callable[[Loads, Sequence[Any], Quantities], Sequence[Any]] | None = None
    before_joints: bool = False


def no_loads(tree: Tree) -> Loads:
    """Return zero loads, a start for sums."""
    zero = tree.algebra.zero
    return Loads([None] * len(tree.links), [zero] * tree.nv, zero, zero, [None] * len(tree.links))


def add_effort(loads: Loads, quantities: Quantities, joint: str, value: Scalar, index: int = 0) -> None:
    """Add to ``loads``, in place, a generalized force, N m or N, on component ``index`` of a joint's coordinates."""
    for dof, factor in quantities.work_of(joint, index).items():
        loads.efforts[dof] = loads.efforts[dof] + factor * value


def push(wrenches: list[Wrench | None], quantities: Quantities, name: str, force_in_base: Vector) -> None:
    """Add a force on a named point to the wrenches of the links; a force on the base or the world has no effect.

    Parameters
    ----------
    wrenches : list of Wrench or None
        By link, changed in place: moment about the link's origin and force, in link axes.
    quantities : Quantities
        Positions of the points.
    name : str
        Name of a point of the scene, or of a frame, whose origin is the point; KeyError for any other name.
    force_in_base : sequence of Scalar
        Force (3,), N, in base axes. No opposite force is added.
    """
    link, s = quantities.kinematics.local(*quantities.at(quantities.points[name]))
    if link >= 0:
        force = apply(transpose(quantities.kinematics.pose(link)[0]), force_in_base)
        force = quantities.algebra.named(f"F_on_{name}", force)
        moment = quantities.algebra.named(f"M_on_{name}", cross(s, force))
        add_wrench(wrenches, link, (moment, force))


def add_wrench(wrenches: list[Wrench | None], link: int, load: Wrench) -> None:
    """Add a wrench to the wrench on a link.

    Parameters
    ----------
    wrenches : by link, None without load; changed
    link : index of the link
    load : moment, N m, about the link's origin, and force, N, in link axes
    """
    present = wrenches[link]
    wrenches[link] = load if present is None else (plus(present[0], load[0]), plus(present[1], load[1]))
