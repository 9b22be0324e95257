"""Wrenches (moment about the link's origin, force) in link axes: sums, transport, projection on joints."""

from __future__ import annotations

from eomgen.mechanics.tree.links import Link
from eomgen.symbolic.scalar import Scalar, Vector, cross, dot, minus, plus

Wrench = tuple[Vector, Vector]


def project(link: Link, load: Wrench) -> list[Scalar]:
    """Return the generalized force of a wrench per column of the joint."""
    moment, force = load
    return [dot(column.angular, moment) + dot(column.linear, force) for column in link.columns]


def carry(link: Link, load: Wrench) -> Wrench:
    """Return the equivalent wrench on the parent, in parent axes about the parent's origin."""
    moment, force = link.rotation.rotate(load[0]), link.rotation.rotate(load[1])
    return plus(moment, cross(link.position, force)), force


def difference(first: Wrench, second: Wrench) -> Wrench:
    return minus(first[0], second[0]), minus(first[1], second[1])


def summed(first: Wrench, second: Wrench) -> Wrench:
    return plus(first[0], second[0]), plus(first[1], second[1])
