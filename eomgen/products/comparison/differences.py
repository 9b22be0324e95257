"""Differences of two machines, quantity by quantity, in the frames of the first.

Two descriptions may choose the frames of a body differently. With all coordinates at zero a body has one pose, so the
frame of the second description is placed in the frame of the first by the poses of both. A joint at another place moves
all further links as well: if the numbers of a body agree as written, and not by poses, the place of the joint is the
difference, and the frames of the body are equal.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.products.comparison.machine import AT_ORIGIN, Machine, MachineBody, MachineLink, MachineLoop, Placement
from eomgen.products.comparison.report import Difference
from eomgen.scene.inertia import Inertia, entries_of
from eomgen.scene.joint_types import JOINTS

#: Quantities of joints that many descriptions leave out, named at the end.
_LATE = ("coulomb", "lower", "upper")
#: Units of a joint's quantities, for an angle and for a travel.
_UNITS: Mapping[str, tuple[str, str]] = {
    "stiffness": ("N m/rad", "N/m"),
    "damping": ("N m s/rad", "N s/m"),
    "rest": ("rad", "m"),
    "rotor_inertia": ("kg m^2", "kg"),
    "coulomb": ("N m", "N"),
    "lower": ("rad", "m"),
    "upper": ("rad", "m"),
    "pitch": ("m/rad", "m/rad"),
}
#: Components of vectors below this are shown as zero.
_ROUNDING = 1e-15
#: Keys of scene files that hold a quantity.
_KEYS = {"coulomb": "friction", "lower": "limits", "upper": "limits"}


class Pairing:
    """Links of two machines that correspond: by the names of joints, then of bodies; with comparisons to a relative
    tolerance.

    Attributes
    ----------
    pairs : numbers of both links, in the order of the first machine
    aligned : by number of the first's link, the place of the second's frame in the first's; filled by ``differences``
    """

    def __init__(self, first: Machine, second: Machine, tolerance: float) -> None:
        self.first, self.second, self.tolerance = first, second, tolerance
        self.partner = _matched(first.links, second.links)
        self.pairs = list(self.partner.items())
        self.aligned: dict[int, Placement] = {-1: AT_ORIGIN}
        self.length = _length(first) or _length(second) or 1.0
        self._children: dict[int, list[tuple[MachineLink, MachineLink]]] = {}
        for i, j in self.pairs:
            one, other = first.links[i], second.links[j]
            if self.same_parents(one, other):
                self._children.setdefault(one.parent, []).append((one, other))

    @property
    def comparable(self) -> bool:
        """Whether both machines have the same coordinates."""
        complete = len(self.pairs) == len(self.first.links) == len(self.second.links)
        return complete and all(
            self.first.links[i].type == self.second.links[j].type
            and self.first.links[i].held == self.second.links[j].held
            for i, j in self.pairs
        )

    @property
    def same_frames(self) -> bool:
        """Whether the frames of all links are the same."""
        return all(self.near(place, AT_ORIGIN) for place in self.aligned.values())

    def same_parents(self, one: MachineLink, other: MachineLink) -> bool:
        """Return whether the parents of two links are paired, or both are the base."""
        if one.parent < 0 or other.parent < 0:
            return one.parent == other.parent
        return self.partner.get(one.parent) == other.parent

    def near(self, one: Placement, other: Placement) -> bool:
        """Return whether two places are equal."""
        return self.near_points(one.origin, other.origin) and self.near_axes(one.axes, other.axes)

    def near_points(self, one: Array, other: Array) -> bool:
        return bool(np.abs(one - other).max() <= self.tolerance * self.length)

    def near_axes(self, one: Array, other: Array) -> bool:
        return bool(np.abs(one - other).max() <= self.tolerance)

    def alike(self, one: Inertia, other: Inertia) -> bool:
        """Return whether two mass properties, given in one frame, are equal to the tolerance."""
        if abs(one.mass - other.mass) > self.tolerance * max(one.mass, other.mass):
            return False
        if one.mass and not self.near_points(one.center, other.center):
            return False
        return self.near_inertias(one, other)

    def near_inertias(self, one: Inertia, other: Inertia) -> bool:
        size = max(float(np.abs(one.about_center).max()), float(np.abs(other.about_center).max()))
        return bool(np.abs(one.about_center - other.about_center).max() <= self.tolerance * size)

    def difference(
        self, keys: tuple[str, str], quantity: str, one: Any, other: Any, unit: str = "", key: str | None = None
    ) -> Difference:
        """Return a difference of an element that both machines have.

        Parameters
        ----------
        keys : of the element in both descriptions, ``joints.hinge``
        one, other : values; small components of arrays are shown as zero
        key : of the quantity below the element, for the places; the name of the quantity by default
        """
        below = f".{quantity if key is None else key}".rstrip(".")
        mine, theirs = (
            tuple(np.where(np.abs(item) < _ROUNDING, 0.0, item).tolist()) if isinstance(item, np.ndarray) else item
            for item in (one, other)
        )
        places = self.first.place(f"{keys[0]}{below}"), self.second.place(f"{keys[1]}{below}")
        return Difference(keys[0], quantity, mine, theirs, unit, places)

    def alone(self, element: str, quantity: str, value: str, *, second: bool = False) -> Difference:
        """Return the difference for an element that the first machine alone has, or with ``second`` the second alone;
        ``value`` is shown for it."""
        if second:
            return Difference(element, quantity, None, value, "", ("", self.second.place(element)))
        return Difference(element, quantity, value, None, "", (self.first.place(element), ""))

    def misses(self, one: MachineLink, other: MachineLink, number: int, aligned: Placement) -> int:
        """Count the quantities that differ if ``other`` has its frame at ``aligned`` relative to ``one``: mass
        properties of the link ``number``, and places and axes of joints on it. Return the count."""
        moved = other.whole.transform(*aligned)
        count = int(not self.alike(one.whole, moved))
        for child, partner in self._children.get(number, ()):
            place = aligned.then(partner.pose)
            count += int(not self.near_points(child.pose.origin, place.origin))
            if child.axis is not None and partner.axis is not None:
                count += int(not self.near_axes(child.pose.axes @ child.axis, place.axes @ partner.axis))
        return count


def _matched(first: Sequence[MachineLink], second: Sequence[MachineLink]) -> dict[int, int]:
    """Return, by number of a link of the first machine, the number of its partner in the second: the link with the same
    joint name, else one with a common body."""
    by_joint = {link.joint: number for number, link in enumerate(second)}
    result = {number: by_joint[link.joint] for number, link in enumerate(first) if link.joint in by_joint}
    taken = set(result.values())
    for number, link in enumerate(first):
        if number in result:
            continue
        for other, theirs in enumerate(second):
            if other not in taken and link.bodies.keys() & theirs.bodies.keys():
                result[number] = other
                taken.add(other)
                break
    return dict(sorted(result.items()))


def _length(machine: Machine) -> float:
    """Return the largest distance, m, of a link's frame from its parent's frame, or of a centre of mass from the link's
    frame."""
    distances = [float(np.linalg.norm(link.pose.origin)) for link in machine.links]
    distances += [float(np.linalg.norm(link.whole.center)) for link in machine.links]
    return max(distances, default=0.0)


def differences(pairing: Pairing) -> list[Difference]:
    """Return the differences of two machines: structure and gravity, then link by link, constraints, limits and
    friction last. Fills ``pairing.aligned``."""
    first, second = pairing.first, pairing.second
    listed = list(_structure(pairing))
    late: list[Difference] = []
    size = max(float(np.linalg.norm(first.gravity)), float(np.linalg.norm(second.gravity)))
    if np.abs(first.gravity - second.gravity).max() > pairing.tolerance * size:
        values = first.gravity, second.gravity
        listed.append(pairing.difference(("gravity", "gravity"), "gravity", *values, "m/s^2", key=""))
    for i, j in pairing.pairs:
        one, other = first.links[i], second.links[j]
        keys = f"joints.{one.joint}", f"joints.{other.joint}"
        if not pairing.same_parents(one, other):
            names = _name(first, one.parent), _name(second, other.parent)
            listed.append(pairing.difference(keys, "parent", *names))
            pairing.aligned[i] = AT_ORIGIN
            continue
        if one.type != other.type:
            listed.append(pairing.difference(keys, "type", one.type, other.type))
        listed += _place_differences(pairing, i, one, other)
        listed += _weighed(pairing, i, one, other)
        if one.type == other.type:
            for item in _of_joint(pairing, one, other):
                (late if item.quantity.partition("[")[0] in _LATE else listed).append(item)
    listed += _loops(pairing)
    return listed + late


def of_solids(pairing: Pairing) -> list[Difference]:
    """Return differences of mass and principal moments of inertia for bodies that the second machine knows without a
    place. Moments are left out if one is zero, as in a plane motion, on which the others have no effect."""
    listed: list[Difference] = []
    for link in pairing.first.links:
        for name, body in link.bodies.items():
            if name not in pairing.second.solids:
                continue
            mass, moments = pairing.second.solids[name]
            mine = np.linalg.eigvalsh(body.inertia.about_center)
            whole = min(mine.min(), moments.min()) > 0.0
            for quantity, one, other, unit in (
                ("mass", np.array([body.inertia.mass]), np.array([mass]), "kg"),
                ("principal moments", mine, moments, "kg m^2"),
            ):
                size = max(float(np.abs(one).max()), float(np.abs(other).max()))
                if np.abs(one - other).max() <= pairing.tolerance * size or (quantity != "mass" and not whole):
                    continue
                first, second = (float(item[0]) if len(item) == 1 else tuple(map(float, item)) for item in (one, other))
                places = pairing.first.place(f"bodies.{name}"), ""
                listed.append(Difference(f"bodies.{name}", quantity, first, second, unit, places))
    return listed


def _structure(pairing: Pairing) -> Iterator[Difference]:
    """Yield a difference for each joint that has no partner in the other description."""
    partners = set(pairing.partner.values())
    for number, link in enumerate(pairing.first.links):
        if number not in pairing.partner:
            yield pairing.alone(f"joints.{link.joint}", "joint", link.type)
    for number, link in enumerate(pairing.second.links):
        if number not in partners:
            yield pairing.alone(f"joints.{link.joint}", "joint", link.type, second=True)


def _name(machine: Machine, number: int) -> str:
    return machine.links[number].body if number >= 0 else "base"


def _place_differences(pairing: Pairing, number: int, one: MachineLink, other: MachineLink) -> Iterator[Difference]:
    """Yield differences of the place and axes of a link's joint, and store in ``pairing.aligned`` the place of the
    second's frame in the first's: as posed, or equal frames if then fewer quantities differ."""
    carrier = pairing.aligned[one.parent]
    theirs = carrier.then(other.pose)
    exact = one.pose.inverse().then(theirs)
    keys = f"joints.{one.joint}", f"joints.{other.joint}"
    if pairing.near(exact, AT_ORIGIN):
        pairing.aligned[number] = AT_ORIGIN
        yield from _axes(pairing, one, other, AT_ORIGIN)
        return
    axis = one.pose.axes @ one.axis if one.axis is not None else None
    apart = theirs.origin - one.pose.origin
    if axis is not None and one.type in ("revolute", "cylindrical", "helical"):  # the same anywhere on the axis
        apart = apart - axis * (axis @ apart)
    moved = one.type not in ("free", "prismatic", "planar") and not pairing.near_points(apart, np.zeros(3))
    tilted = axis is not None and other.axis is not None and _is_tilted(pairing, axis, theirs.axes @ other.axis)
    written, posed = (pairing.misses(one, other, number, place) for place in (AT_ORIGIN, exact))
    if one.type == "free":  # zero is anywhere
        pairing.aligned[number] = AT_ORIGIN if written < posed else exact
        return
    if written < posed or (written == posed and (moved or tilted)):
        pairing.aligned[number] = AT_ORIGIN
        if not pairing.near_axes(exact.axes, np.eye(3)):
            yield pairing.difference(keys, "orientation", one.pose.axes.ravel(), theirs.axes.ravel())
        if not pairing.near_points(theirs.origin, one.pose.origin):
            yield pairing.difference(keys, "position", one.pose.origin, theirs.origin, "m")
    else:
        pairing.aligned[number] = exact
        if moved:
            yield pairing.difference(keys, "position", one.pose.origin, theirs.origin, "m")
    yield from _axes(pairing, one, other, pairing.aligned[number])


def _is_tilted(pairing: Pairing, axis: Array, other: Array) -> bool:
    """Return whether two axes are along different lines."""
    return not (pairing.near_axes(axis, other) or pairing.near_axes(-axis, other))


def _axes(pairing: Pairing, one: MachineLink, other: MachineLink, aligned: Placement) -> Iterator[Difference]:
    """Yield differences of the axes of two joints of one type. ``aligned`` is the frame of ``other`` in the frame of
    ``one``, in which the axes are compared."""
    for name in ("axis", "second_axis"):
        mine, theirs = getattr(one, name), getattr(other, name)
        if one.type != other.type or mine is None or theirs is None:
            continue
        turned = aligned.axes @ theirs
        if not pairing.near_axes(mine, turned):
            yield pairing.difference((f"joints.{one.joint}", f"joints.{other.joint}"), name, mine, turned)


def _weighed(pairing: Pairing, number: int, one: MachineLink, other: MachineLink) -> Iterator[Difference]:
    """Yield differences of mass properties of a link: body by body if both machines have the same bodies with mass,
    else as a whole."""
    aligned = pairing.aligned[number]
    carrying = {name for name, body in one.bodies.items() if _has_inertia(body.inertia)}
    if carrying == {name for name, body in other.bodies.items() if _has_inertia(body.inertia)}:
        for name in one.bodies:
            if name in carrying:
                yield from _of_body(pairing, name, one.bodies[name], other.bodies[name], aligned)
        return
    names = tuple(next(iter(carrying & set(link.bodies)), link.body) for link in (one, other))
    moved = other.whole.transform(*aligned)
    yield from _of_inertia(pairing, (names[0], names[1]), one.whole, moved)


def _has_inertia(inertia: Inertia) -> bool:
    return bool(inertia.mass) or bool(inertia.about_center.any())


def _of_body(
    pairing: Pairing, name: str, one: MachineBody, other: MachineBody, aligned: Placement
) -> Iterator[Difference]:
    """Yield differences of a body on paired links: the place of its fixed joint if mass properties agree in the body's
    frame, else the mass properties."""
    mine, theirs = one.in_link, other.in_link.transform(*aligned)
    if pairing.alike(mine, theirs):
        return
    place = aligned.then(other.place)
    if one.joint and not pairing.near(one.place, place) and pairing.alike(one.inertia, other.inertia):
        keys = f"joints.{one.joint}", f"joints.{other.joint or one.joint}"
        if not pairing.near_axes(one.place.axes, place.axes):
            yield pairing.difference(keys, "orientation", one.place.axes.ravel(), place.axes.ravel())
        if not pairing.near_points(one.place.origin, place.origin):
            yield pairing.difference(keys, "position", one.place.origin, place.origin, "m")
        return
    back = one.place.inverse()
    yield from _of_inertia(pairing, (name, name), one.inertia, theirs.transform(*back))


def _of_inertia(pairing: Pairing, names: tuple[str, str], one: Inertia, other: Inertia) -> Iterator[Difference]:
    """Yield differences of mass, centre of mass and inertia, given in one frame; ``names`` are the body's in both
    machines."""
    keys = f"bodies.{names[0]}", f"bodies.{names[1]}"
    if abs(one.mass - other.mass) > pairing.tolerance * max(one.mass, other.mass):
        yield pairing.difference(keys, "mass", one.mass, other.mass, "kg")
    if one.mass and other.mass and not pairing.near_points(one.center, other.center):
        yield pairing.difference(keys, "center_of_mass", one.center, other.center, "m")
    if not pairing.near_inertias(one, other):
        values = np.array(entries_of(one.about_center)), np.array(entries_of(other.about_center))
        yield pairing.difference(keys, "inertia", *values, "kg m^2")


def _of_joint(pairing: Pairing, one: MachineLink, other: MachineLink) -> Iterator[Difference]:
    """Yield differences of the quantities of a joint that both readers know."""
    for quantity in one.numbers:
        if quantity not in other.numbers:
            continue
        mine, theirs = one.numbers[quantity], other.numbers[quantity]
        if equal(mine, theirs, pairing.tolerance):
            continue
        name = quantity.partition("[")[0]
        keys = f"joints.{one.joint}", f"joints.{other.joint}"
        units = tuple(JOINTS[one.type].coordinates.values()) if one.type in JOINTS else ()
        index = int(quantity.partition("[")[2].rstrip("]") or 0)
        unit = _UNITS[name][units[index] == "m"] if name in _UNITS and index < len(units) else ""
        yield pairing.difference(keys, quantity, _shown(mine), _shown(theirs), unit, _KEYS.get(name, name))


def _shown(value: float | str) -> float | str | None:
    """Return a value for the report; None for an end without a limit."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def equal(mine: float | str, theirs: float | str, tolerance: float) -> bool:
    """Return whether two numbers are equal to a relative tolerance, or two texts are."""
    if isinstance(mine, str) or isinstance(theirs, str):
        return mine == theirs
    if not math.isfinite(mine) or not math.isfinite(theirs):
        return mine == theirs
    return mine == theirs or abs(mine - theirs) <= tolerance * max(abs(mine), abs(theirs))


def _loops(pairing: Pairing) -> Iterator[Difference]:
    """Yield differences of constraints, which are paired by name, then by the links that they join; none if a reader
    does not know constraints."""
    if pairing.first.loops is None or pairing.second.loops is None:
        return
    rest = {loop.name: loop for loop in pairing.second.loops}
    pairs = [(loop, rest.pop(loop.name, None)) for loop in pairing.first.loops]
    for place, (loop, partner) in enumerate(pairs):
        if partner is None:
            same = [name for name, other in rest.items() if _joins(pairing, loop) == _ends(other)]
            pairs[place] = (loop, rest.pop(same[0]) if same else None)
    for loop, partner in pairs:
        element = f"constraints.{loop.name}"
        if partner is None:
            yield pairing.alone(element, "constraint", loop.type)
            continue
        keys = element, f"constraints.{partner.name}"
        if loop.type != partner.type:
            yield pairing.difference(keys, "type", loop.type, partner.type)
            continue
        yield from _loop(pairing, loop, partner, keys)
    for loop in rest.values():
        yield pairing.alone(f"constraints.{loop.name}", "constraint", loop.type, second=True)


def _ends(loop: MachineLoop) -> frozenset[int]:
    return frozenset(end[0] for end in (loop.first, loop.second) if end is not None)


def _joins(pairing: Pairing, loop: MachineLoop) -> frozenset[int]:
    """Return the links of the second machine that a constraint of the first joins."""
    return frozenset(pairing.partner.get(number, -2) if number >= 0 else -1 for number in _ends(loop))


def _loop(pairing: Pairing, loop: MachineLoop, partner: MachineLoop, keys: tuple[str, str]) -> Iterator[Difference]:
    """Yield differences of two constraints of one type, in the frames of the first machine: bodies, positions, axes,
    orientation and numbers. ``keys`` are the elements in both descriptions."""
    if loop.first is not None and loop.second is not None and partner.first is not None and partner.second is not None:
        theirs = [partner.first, partner.second]
        expected = pairing.partner.get(loop.first[0], -1) if loop.first[0] >= 0 else -1
        if theirs[0][0] != expected and theirs[1][0] == expected:
            theirs.reverse()
        for side, mine, other, uses in zip(
            ("first", "second"), (loop.first, loop.second), theirs, loop.uses, strict=True
        ):
            number = pairing.partner.get(mine[0], -2) if mine[0] >= 0 else -1
            if number != other[0]:
                names = _name(pairing.first, mine[0]), _name(pairing.second, other[0])
                yield pairing.difference(keys, f"{side} body", *names, key=side)
                continue
            place = pairing.aligned.get(mine[0], AT_ORIGIN).then(other[1])
            if not pairing.near_points(mine[1].origin, place.origin):
                yield pairing.difference(keys, f"{side} position", mine[1].origin, place.origin, "m", side)
            if uses in ("z", "x and z") and not pairing.near_axes(mine[1].axes[:, 2], place.axes[:, 2]):
                axes = mine[1].axes[:, 2], place.axes[:, 2]
                yield pairing.difference(keys, f"{side} axis", *axes, key=side)
        if loop.type == "fixed":
            mine_axes = loop.first[1].axes @ loop.second[1].axes.T
            ends = [
                pairing.aligned.get(loop_end[0], AT_ORIGIN).then(end[1]).axes
                for loop_end, end in zip((loop.first, loop.second), theirs, strict=True)
            ]
            their_axes = ends[0] @ ends[1].T
            if not pairing.near_axes(mine_axes, their_axes):
                yield pairing.difference(keys, "orientation", mine_axes.ravel(), their_axes.ravel(), key="")
    for name in loop.numbers:
        mine_value, their_value = loop.numbers[name], partner.numbers.get(name)
        if their_value is not None and not equal(mine_value, their_value, pairing.tolerance):
            yield pairing.difference(keys, name, mine_value, their_value)
