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
            link, partner = first.links[i], second.links[j]
            if self.same_parents(link, partner):
                self._children.setdefault(link.parent, []).append((link, partner))

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
        return all(self.near(placement, AT_ORIGIN) for placement in self.aligned.values())

    def same_parents(self, link: MachineLink, partner: MachineLink) -> bool:
        """Return whether the parents of two links are paired, or both are the base."""
        return self.partner_of(link.parent) == partner.parent

    def near(self, first: Placement, second: Placement) -> bool:
        """Return whether two places are equal."""
        return self.near_points(first.origin, second.origin) and self.near_axes(first.axes, second.axes)

    def near_points(self, first: Array, second: Array) -> bool:
        return bool(np.abs(first - second).max() <= self.tolerance * self.length)

    def near_axes(self, first: Array, second: Array) -> bool:
        return bool(np.abs(first - second).max() <= self.tolerance)

    def near_masses(self, first: Inertia, second: Inertia) -> bool:
        return abs(first.mass - second.mass) <= self.tolerance * max(first.mass, second.mass)

    def alike(self, first: Inertia, second: Inertia) -> bool:
        """Return whether two mass properties, given in one frame, are equal to the tolerance."""
        near = not first.mass or self.near_points(first.center, second.center)
        return near and self.near_masses(first, second) and self.near_inertias(first, second)

    def near_inertias(self, first: Inertia, second: Inertia) -> bool:
        size = max(float(np.abs(first.about_center).max()), float(np.abs(second.about_center).max()))
        return bool(np.abs(first.about_center - second.about_center).max() <= self.tolerance * size)

    def difference(
        self, keys: tuple[str, str], quantity: str, first: Any, second: Any, unit: str = "", key: str | None = None
    ) -> Difference:
        """Return a difference of an element that both machines have.

        Parameters
        ----------
        keys : of the element in both descriptions, ``joints.hinge``
        first, second : values; small components of arrays are shown as zero
        key : of the quantity below the element, for the places; the name of the quantity by default
        """
        below = f".{quantity if key is None else key}".rstrip(".")
        mine, theirs = (
            tuple(np.where(np.abs(item) < 1e-15, 0.0, item).tolist()) if isinstance(item, np.ndarray) else item
            for item in (first, second)
        )
        places = self.first.place(f"{keys[0]}{below}"), self.second.place(f"{keys[1]}{below}")
        return Difference(keys[0], quantity, mine, theirs, unit, places)

    def place_differences(self, keys: tuple[str, str], first: Placement, second: Placement) -> Iterator[Difference]:
        """Yield the differences of two places: orientation and position."""
        if not self.near_axes(first.axes, second.axes):
            yield self.difference(keys, "orientation", first.axes.ravel(), second.axes.ravel())
        if not self.near_points(first.origin, second.origin):
            yield self.difference(keys, "position", first.origin, second.origin, "m")

    def partner_of(self, number: int) -> int:
        """Return the number of the second machine's link for a link of the first; -1 for the base, -2 without one."""
        return self.partner.get(number, -2) if number >= 0 else -1

    def alone(self, element: str, quantity: str, value: str, *, second: bool = False) -> Difference:
        """Return the difference for an element that the first machine alone has, or with ``second`` the second alone;
        ``value`` is shown for it."""
        if second:
            return Difference(element, quantity, None, value, "", ("", self.second.place(element)))
        return Difference(element, quantity, value, None, "", (self.first.place(element), ""))

    def misses(self, link: MachineLink, partner: MachineLink, number: int, aligned: Placement) -> int:
        """Count the quantities that differ if ``partner`` has its frame at ``aligned`` relative to ``link``: mass
        properties of the link ``number``, and places and axes of joints on it. Return the count."""
        moved = partner.whole.transform(*aligned)
        count = int(not self.alike(link.whole, moved))
        for child, child_partner in self._children.get(number, ()):
            placement = aligned.then(child_partner.pose)
            count += int(not self.near_points(child.pose.origin, placement.origin))
            if child.axis is not None and child_partner.axis is not None:
                count += int(not self.near_axes(child.pose.axes @ child.axis, placement.axes @ child_partner.axis))
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
        for candidate, theirs in enumerate(second):
            if candidate not in taken and link.bodies.keys() & theirs.bodies.keys():
                result[number] = candidate
                taken.add(candidate)
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
        link, partner = first.links[i], second.links[j]
        keys = f"joints.{link.joint}", f"joints.{partner.joint}"
        if not pairing.same_parents(link, partner):
            names = _name(first, link.parent), _name(second, partner.parent)
            listed.append(pairing.difference(keys, "parent", *names))
            pairing.aligned[i] = AT_ORIGIN
            continue
        if link.type != partner.type:
            listed.append(pairing.difference(keys, "type", link.type, partner.type))
        listed += _place_differences(pairing, i, link, partner)
        listed += _weighed(pairing, i, link, partner)
        if link.type == partner.type:
            for item in _differences_of_joint(pairing, link, partner):
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
            element = f"bodies.{name}"
            places = pairing.first.place(element), ""
            if not equal(body.inertia.mass, mass, pairing.tolerance):
                listed.append(Difference(element, "mass", body.inertia.mass, mass, "kg", places))
            mine = np.linalg.eigvalsh(body.inertia.about_center)
            apart = np.abs(mine - moments).max() > pairing.tolerance * max(mine.max(), moments.max())
            if apart and min(mine.min(), moments.min()) > 0.0:
                values = tuple(mine.tolist()), tuple(moments.tolist())
                listed.append(Difference(element, "principal moments", *values, "kg m^2", places))
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


def _place_differences(pairing: Pairing, number: int, link: MachineLink, partner: MachineLink) -> Iterator[Difference]:
    """Yield differences of the place and axes of a link's joint, and store in ``pairing.aligned`` the place of the
    second's frame in the first's: as posed, or equal frames if then fewer quantities differ."""
    carrier = pairing.aligned[link.parent]
    theirs = carrier.then(partner.pose)
    exact = link.pose.inverse().then(theirs)
    keys = f"joints.{link.joint}", f"joints.{partner.joint}"
    if pairing.near(exact, AT_ORIGIN):
        pairing.aligned[number] = AT_ORIGIN
        yield from _axes(pairing, link, partner, AT_ORIGIN)
        return
    axis = link.pose.axes @ link.axis if link.axis is not None else None
    offset = theirs.origin - link.pose.origin
    if axis is not None and link.type in ("revolute", "cylindrical", "helical"):  # the same anywhere on the axis
        offset = offset - axis * (axis @ offset)
    moved = link.type not in ("free", "prismatic", "planar") and not pairing.near_points(offset, np.zeros(3))
    tilted = axis is not None and partner.axis is not None and _is_tilted(pairing, axis, theirs.axes @ partner.axis)
    written, posed = (pairing.misses(link, partner, number, placement) for placement in (AT_ORIGIN, exact))
    if link.type == "free":  # zero is anywhere
        pairing.aligned[number] = AT_ORIGIN if written < posed else exact
        return
    if written < posed or (written == posed and (moved or tilted)):
        pairing.aligned[number] = AT_ORIGIN
        yield from pairing.place_differences(keys, link.pose, theirs)
    else:
        pairing.aligned[number] = exact
        if moved:
            yield pairing.difference(keys, "position", link.pose.origin, theirs.origin, "m")
    yield from _axes(pairing, link, partner, pairing.aligned[number])


def _is_tilted(pairing: Pairing, axis: Array, second_axis: Array) -> bool:
    """Return whether two axes are along different lines."""
    return not (pairing.near_axes(axis, second_axis) or pairing.near_axes(-axis, second_axis))


def _axes(pairing: Pairing, link: MachineLink, partner: MachineLink, aligned: Placement) -> Iterator[Difference]:
    """Yield differences of the axes of two joints of one type. ``aligned`` is the frame of ``partner`` in the frame of
    ``link``, in which the axes are compared."""
    for name in ("axis", "second_axis"):
        mine, theirs = getattr(link, name), getattr(partner, name)
        if link.type != partner.type or mine is None or theirs is None:
            continue
        turned = aligned.axes @ theirs
        if not pairing.near_axes(mine, turned):
            yield pairing.difference((f"joints.{link.joint}", f"joints.{partner.joint}"), name, mine, turned)


def _weighed(pairing: Pairing, number: int, link: MachineLink, partner: MachineLink) -> Iterator[Difference]:
    """Yield differences of mass properties of a link: body by body if both machines have the same bodies with mass,
    else as a whole."""
    aligned = pairing.aligned[number]
    carrying = {name for name, body in link.bodies.items() if _has_inertia(body.inertia)}
    if carrying == {name for name, body in partner.bodies.items() if _has_inertia(body.inertia)}:
        for name in link.bodies:
            if name in carrying:
                yield from _differences_of_body(pairing, name, link.bodies[name], partner.bodies[name], aligned)
        return
    names = tuple(next(iter(carrying & set(side.bodies)), side.body) for side in (link, partner))
    moved = partner.whole.transform(*aligned)
    yield from _differences_of_inertia(pairing, (names[0], names[1]), link.whole, moved)


def _has_inertia(inertia: Inertia) -> bool:
    return bool(inertia.mass) or bool(inertia.about_center.any())


def _differences_of_body(
    pairing: Pairing, name: str, body: MachineBody, partner: MachineBody, aligned: Placement
) -> Iterator[Difference]:
    """Yield differences of a body on paired links: the place of its fixed joint if mass properties agree in the body's
    frame, else the mass properties."""
    mine, theirs = body.in_link, partner.in_link.transform(*aligned)
    if pairing.alike(mine, theirs):
        return
    placement = aligned.then(partner.place)
    if body.joint and not pairing.near(body.place, placement) and pairing.alike(body.inertia, partner.inertia):
        keys = f"joints.{body.joint}", f"joints.{partner.joint or body.joint}"
        yield from pairing.place_differences(keys, body.place, placement)
        return
    back = body.place.inverse()
    yield from _differences_of_inertia(pairing, (name, name), body.inertia, theirs.transform(*back))


def _differences_of_inertia(
    pairing: Pairing, names: tuple[str, str], first: Inertia, second: Inertia
) -> Iterator[Difference]:
    """Yield differences of mass, centre of mass and inertia, given in one frame; ``names`` are the body's in both
    machines."""
    keys = f"bodies.{names[0]}", f"bodies.{names[1]}"
    if not pairing.near_masses(first, second):
        yield pairing.difference(keys, "mass", first.mass, second.mass, "kg")
    if first.mass and second.mass and not pairing.near_points(first.center, second.center):
        yield pairing.difference(keys, "center_of_mass", first.center, second.center, "m")
    if not pairing.near_inertias(first, second):
        values = np.array(entries_of(first.about_center)), np.array(entries_of(second.about_center))
        yield pairing.difference(keys, "inertia", *values, "kg m^2")


def _differences_of_joint(pairing: Pairing, link: MachineLink, partner: MachineLink) -> Iterator[Difference]:
    """Yield differences of the quantities of a joint that both readers know."""
    units = tuple(JOINTS[link.type].coordinates.values()) if link.type in JOINTS else ()
    for quantity, mine in link.numbers.items():
        if equal(mine, partner.numbers.get(quantity, mine), pairing.tolerance):
            continue
        name, _, rest = quantity.partition("[")
        index = int(rest.rstrip("]") or 0)
        unit = _UNITS[name][units[index] == "m"] if name in _UNITS and index < len(units) else ""
        # None for an end without a limit
        first, second = (None if item in (-np.inf, np.inf) else item for item in (mine, partner.numbers[quantity]))
        keys = f"joints.{link.joint}", f"joints.{partner.joint}"
        yield pairing.difference(keys, quantity, first, second, unit, _KEYS.get(name, name))


def equal(mine: float | str, theirs: float | str, tolerance: float) -> bool:
    """Return whether two numbers are equal to a relative tolerance, or two texts are."""
    if isinstance(mine, str) or isinstance(theirs, str):
        return mine == theirs
    return math.isclose(mine, theirs, rel_tol=tolerance)


def _loops(pairing: Pairing) -> Iterator[Difference]:
    """Yield differences of constraints, which are paired by name, then by the links that they join; none if a reader
    does not know constraints."""
    if pairing.first.loops is None or pairing.second.loops is None:
        return
    rest = {loop.name: loop for loop in pairing.second.loops}
    pairs = [(loop, rest.pop(loop.name, None)) for loop in pairing.first.loops]
    for index, (loop, partner) in enumerate(pairs):
        if partner is None:
            joined = {pairing.partner_of(number) for number, _ in loop.ends}
            same = [name for name, candidate in rest.items() if joined == {number for number, _ in candidate.ends}]
            pairs[index] = (loop, rest.pop(same[0]) if same else None)
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


def _loop(pairing: Pairing, loop: MachineLoop, partner: MachineLoop, keys: tuple[str, str]) -> Iterator[Difference]:
    """Yield differences of two constraints of one type, in the frames of the first machine: bodies, positions, axes,
    orientation and numbers. ``keys`` are the elements in both descriptions."""
    if len(loop.ends) == len(partner.ends) == 2:
        theirs, expected = list(partner.ends), pairing.partner_of(loop.ends[0][0])
        if theirs[0][0] != expected and theirs[1][0] == expected:
            theirs.reverse()
        turned = []
        for side, (number, mine), (their_number, frame), uses in zip(
            ("first", "second"), loop.ends, theirs, loop.uses, strict=True
        ):
            placement = pairing.aligned.get(number, AT_ORIGIN).then(frame)
            turned.append(placement.axes)
            if pairing.partner_of(number) != their_number:
                names = _name(pairing.first, number), _name(pairing.second, their_number)
                yield pairing.difference(keys, f"{side} body", *names, key=side)
                continue
            if not pairing.near_points(mine.origin, placement.origin):
                yield pairing.difference(keys, f"{side} position", mine.origin, placement.origin, "m", side)
            if uses in ("z", "x and z") and not pairing.near_axes(mine.axes[:, 2], placement.axes[:, 2]):
                yield pairing.difference(keys, f"{side} axis", mine.axes[:, 2], placement.axes[:, 2], key=side)
        mine_axes, their_axes = loop.ends[0][1].axes @ loop.ends[1][1].axes.T, turned[0] @ turned[1].T
        if loop.type == "fixed" and not pairing.near_axes(mine_axes, their_axes):
            yield pairing.difference(keys, "orientation", mine_axes.ravel(), their_axes.ravel(), key="")
    for name in loop.numbers:
        mine_value, their_value = loop.numbers[name], partner.numbers.get(name)
        if their_value is not None and not equal(mine_value, their_value, pairing.tolerance):
            yield pairing.difference(keys, name, mine_value, their_value)
