"""Motion and wrenches in link axes: outward recursion of the links' acceleration fields; sums, transport and
projection of wrenches.

A link's points accelerate with a + U s. On a moving base the field splits exactly into the part of the joints with the
base at rest and the part of the base (Euler, centrifugal, Coriolis), so that h and b are derived separately and never
as a difference.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from eomgen.base.data import dataclass
from eomgen.mechanics.tree.base import BaseMotion
from eomgen.mechanics.tree.links import ROOT, Link, Tree
from eomgen.symbolic.scalar import (
    Algebra,
    Matrix,
    Scalar,
    Vector,
    apply,
    cross,
    dot,
    matrix_plus,
    minus,
    multiply,
    plus,
    scaled,
    skew,
)


@dataclass(frozen=True)
class AccelerationField:
    """Affine acceleration field of a link, a(s) = ``origin`` + (alpha~ + ``symmetric``) s, m/s^2, in link axes."""

    origin: Vector
    alpha: Vector
    symmetric: Matrix

    @property
    def gradient(self) -> Matrix:
        """Gradient alpha~ + symmetric, (3, 3), 1/s^2."""
        return matrix_plus(self.symmetric, skew(self.alpha))

    def at(self, p: Vector) -> Vector:
        """Return the acceleration, (3,), m/s^2, at position p in link axes."""
        return plus(self.origin, apply(self.gradient, p))


@dataclass(frozen=True)
class LinkField(AccelerationField):
    """Acceleration field of a link's frame, and the velocity terms of motion relative to it (elastic links).

    Attributes
    ----------
    spin : angular velocity of the frame: the Coriolis acceleration of relative motion is 2 spin x s'
    relative : included parts of this motion, an argument of ``ElasticBody.relative_motion``
    """

    spin: Vector
    relative: Mapping[str, bool]


#: Of a base's motion, a point moving in a frame feels the Coriolis part only.
_CARRIED: Mapping[str, bool] = {"rates": True, "own_rates": False, "accelerations": False}


def relative(algebra: Algebra, link: Link, values: Sequence[Scalar]) -> tuple[Vector, Vector]:
    """Return the relative twist of a joint, sum of columns times values, as (angular, linear) in child axes. ``values``
    has one number for each column."""
    angular, linear = algebra.zero_vector, algebra.zero_vector
    for column, value in zip(link.columns, values, strict=True):
        angular, linear = plus(angular, scaled(value, column.angular)), plus(linear, scaled(value, column.linear))
    return angular, linear


def centripetal(omega: Vector) -> Matrix:
    """Return omega~ omega~, symmetric by structure."""
    x, y, z = omega
    xx, yy, zz, xy, xz, yz = x * x, y * y, z * z, x * y, x * z, y * z
    return ((-(yy + zz), xy, xz), (xy, -(xx + zz), yz), (xz, yz, -(xx + yy)))


def angular_velocities(tree: Tree, omega_base: Vector) -> list[Vector]:
    """Return the angular velocity of each link, (3,), rad/s, in link axes, for a base with ``omega_base``."""
    algebra, omegas = tree.algebra, list[Vector]()
    for link in tree.links:
        above = omega_base if link.parent == ROOT else omegas[link.parent]
        omegas.append(plus(link.rotation.rotate_back(above), relative(algebra, link, link.velocities)[0]))
    return omegas


def total_fields(tree: Tree, base: BaseMotion, accelerations: bool, gravity: bool) -> list[LinkField]:
    """Return the acceleration fields of all links from joint motion, base motion and (as -g) gravity, in link axes.

    Parameters
    ----------
    base : motion in base axes
    accelerations, velocities : whether the joints' accelerations and velocities contribute
    gravity : whether -g is added to the base's acceleration
    """
    algebra = tree.algebra
    start = plus(base.acceleration, scaled(-1.0, base.gravity)) if gravity else base.acceleration
    relative_motion = {"rates": True, "own_rates": True, "accelerations": accelerations}
    root, fields = LinkField(start, base.alpha, centripetal(base.omega), base.omega, {}), list[LinkField]()
    quantity, bias = ("acceleration", "") if accelerations else ("centripetal and Coriolis acceleration", "0")
    for link in tree.links:
        with algebra.tape.block(f"{quantity} of link {link.name}"):
            above = root if link.parent == ROOT else fields[link.parent]
            turn, slide = relative(algebra, link, link.velocities)
            carried = link.rotation.rotate_back(above.spin)
            omega = algebra.named(f"omega_{link.name}", plus(carried, turn))
            alpha = plus(link.rotation.rotate_back(above.alpha), cross(carried, turn))
            origin = link.rotation.rotate_back(above.at(link.position))
            if link.station is None:
                bias_slide = cross(turn, slide)
            else:
                bias_rotation, bias_slide = link.station.bias
                alpha = plus(alpha, bias_rotation)
            origin = plus(origin, plus(scaled(2.0, cross(carried, slide)), bias_slide))
            if accelerations:
                turn_rate, slide_rate = relative(algebra, link, link.accelerations)
                alpha, origin = plus(alpha, turn_rate), plus(origin, slide_rate)
            algebra.named(f"alpha{bias}_{link.name}", alpha)
            algebra.named(f"acc{bias}_{link.name}", origin)
            fields.append(LinkField(origin, alpha, centripetal(omega), omega, relative_motion))
    return fields


def base_fields(tree: Tree, base: BaseMotion) -> list[LinkField]:
    """Return the part of the links' acceleration fields that vanishes for a base at rest, without gravity, in link
    axes. The field is a_B + (alpha~ + omega~ omega~) p + 2 omega~ (velocity relative to the base); the gradient of the
    field in a link is alpha~ + omega~ (omega~ + 2 omega_relative~). Joint accelerations do not contribute."""
    algebra = tree.algebra
    relative_omegas = angular_velocities(tree, algebra.zero_vector)
    fields: list[LinkField] = []
    root = LinkField(base.acceleration, base.alpha, centripetal(base.omega), base.omega, {})
    for index, link in enumerate(tree.links):
        with algebra.tape.block(f"base motion felt by link {link.name}"):
            above = root if link.parent == ROOT else fields[link.parent]
            _, slide = relative(algebra, link, link.velocities)
            omega, alpha = link.rotation.rotate_back(above.spin), link.rotation.rotate_back(above.alpha)
            origin = plus(link.rotation.rotate_back(above.at(link.position)), scaled(2.0, cross(omega, slide)))
            spin = plus(omega, scaled(2.0, relative_omegas[index]))
            fields.append(LinkField(origin, alpha, multiply(skew(omega), skew(spin)), omega, _CARRIED))
    return fields


#: Moment and force, or the angular and the linear part of a twist.
Pair = tuple[Vector, Vector]
Wrench = Pair


def project(link: Link, load: Wrench) -> list[Scalar]:
    """Return the generalized force of a wrench per column of the joint."""
    return [pair_dot((column.angular, column.linear), load) for column in link.columns]


def carry(link: Link, load: Wrench) -> Wrench:
    """Return the equivalent wrench on the parent, in parent axes about the parent's origin."""
    moment, force = link.rotation.rotate(load[0]), link.rotation.rotate(load[1])
    return plus(moment, cross(link.position, force)), force


def pair_plus(x: Pair, y: Pair) -> Pair:
    return plus(x[0], y[0]), plus(x[1], y[1])


def pair_minus(x: Pair, y: Pair) -> Pair:
    return minus(x[0], y[0]), minus(x[1], y[1])


def pair_scaled(factor: Scalar | float, x: Pair) -> Pair:
    return scaled(factor, x[0]), scaled(factor, x[1])


def pair_dot(x: Pair, y: Pair) -> Scalar:
    return dot(x[0], y[0]) + dot(x[1], y[1])


def bracket(x: Pair, y: Pair) -> Pair:
    """Return ad(x) y of twists."""
    return cross(x[0], y[0]), plus(cross(x[0], y[1]), cross(x[1], y[0]))


def moved_load(x: Pair, load: Wrench) -> Wrench:
    """Return the change of a wrench that moves with the twist x, -ad(x)^T load."""
    return plus(cross(x[0], load[0]), cross(x[1], load[1])), cross(x[0], load[1])
