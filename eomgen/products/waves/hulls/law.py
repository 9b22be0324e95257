"""Forces of water on slender hulls: buoyancy, the pressure of waves, added mass and drag, station by station.

Morison, O'Brien, Johnson and Schaaf (Petroleum Transactions 189, 1950, 149) in its relative form for members that move
(Sarpkaya, Wave Forces on Offshore Structures, 2010, chapter 4). On a slice of volume V of which the share c is wet:

    rho V c (a_w - g) + rho C_a V (a_w - a_b)_n + 1/2 rho C_d D ds c |u_n| u_n,  u = u_w - u_b,

n being the part across the axis. The first term is the pressure of undisturbed water, integrated over the slice, so
the pressure on flat ends is in it. The inertia of the water, rho C_a V a_b, is in the inertia matrix,
with a constant wet length: the inertia of a uniform member across its axis is a second moment, so two places by Gauss
and Legendre's rule, each with half of it, have the same inertia as the member.

In water at rest the first term and its moment are the gradient of one energy, rho times the integral over the slice
of max(G.(surface - r), 0), G = -g. With s along the axis d and y across it, G.r of points of the slice varies by
s G.d + y |G_n|: s is uniform over the length ds of the slice, and y counts as uniform with the variance r^2 = A/4 pi
of a circle of area A. Sums over slices are then integrals over the hull, so that volume, centre of buoyancy and water
plane (BM = r^2 A/V of an upright hull) are exact for any number of slices. In waves G is a_w - g, which is normal
to the surface there, and accelerations that differ over a slice turn it by -rho A r^2 c d x (a_w)' ds, the prime being
the derivative along the axis: gradients of accelerations are symmetric if water does not spin.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Sequence

from eomgen.formula.nodes import ZERO_VECTOR, Formula
from eomgen.mechanics.forces.cosserat_beams import LoopInputs
from eomgen.mechanics.forces.forces import add_load
from eomgen.mechanics.forces.loads import Law, Loads
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.mechanics.tree.inertia import AddedMass
from eomgen.products.waves.formula.fields import WaveField
from eomgen.products.waves.formula.recording import wave_quantity
from eomgen.products.waves.hulls.section import Hull
from eomgen.symbolic.calculus.loops import compact
from eomgen.symbolic.map import Map, add_map
from eomgen.symbolic.operations import Op
from eomgen.symbolic.scalar import (
    Algebra,
    Scalar,
    Vector,
    apply,
    cross,
    dot,
    matrix_plus,
    minus,
    multiply,
    outer,
    plus,
    scaled,
)
from eomgen.symbolic.tape import Tape

#: Added in squares to velocities, m/s, so that drag has a derivative at rest.
_SLOW = 1e-3
#: Square of the half width of a uniform distribution with the variance of a circular section, divided by the area: 3/(4
#: pi).
_UNIFORM = 3.0 / (4.0 * math.pi)
#: Places of added mass in parts of a length.
_GAUSS = (0.5 - 0.5 / math.sqrt(3.0), 0.5 + 0.5 / math.sqrt(3.0))


class Member:
    """The geometry, density and coefficients of a hull as scalars, in SI units; without its axial drag, level and
    waves.

    A missing area is the area of the circle, a missing wet length the whole length.

    Parameters
    ----------
    number : gives the scalar of a formula

    Attributes
    ----------
    start : (3,) of the axis, in the body frame
    axis : (3,) unit vector, in the body's axes
    length, diameter, area, density, added, drag : of the hull; the last two are coefficients
    wet : length that moves water at rest
    across, along : added mass across the axis, in all, and along it, at the start, kg
    """

    def __init__(self, algebra: Algebra, hull: Hull, number: Callable[[Formula], Scalar]) -> None:
        self.start, end = (algebra.vector([number(part) for part in point]) for point in (hull.start, hull.end))
        span = minus(end, self.start)
        self.length = algebra.length(span)
        self.diameter, self.density, self.added = number(hull.diameter), number(hull.density), number(hull.added_mass)
        if hull.area is None:
            self.area = (0.25 * math.pi) * (self.diameter * self.diameter)
        else:
            self.area = number(hull.area)
        self.wet = self.length if hull.wet is None else number(hull.wet)
        self.axis = scaled(algebra.one / self.length, span)
        self.drag = number(hull.drag)
        self.across = self.density * self.added * self.area * self.wet
        self.along = number(hull.axial_added_mass)

    @property
    def places(self) -> tuple[Scalar, Scalar]:
        """Distances from the start at which half of the added mass across the axis is, each."""
        return _GAUSS[0] * self.wet, _GAUSS[1] * self.wet


def added_masses(algebra: Algebra, hull: Hull, number: Callable[[Formula], Scalar]) -> tuple[AddedMass, ...]:
    """Return the added mass of a hull in the body's frame: across the axis as two points, along the axis at the start;
    none if 0."""
    member = Member(algebra, hull, number)
    result: list[AddedMass] = []
    along = outer(member.axis, member.axis)
    across = matrix_plus(algebra.identity, outer(scaled(-1.0, member.axis), member.axis))
    if not member.across.is_zero:
        half = 0.5 * member.across
        matrix = tuple(scaled(half, row) for row in across)
        result += [
            AddedMass(plus(member.start, scaled(distance, member.axis)), (matrix[0], matrix[1], matrix[2]))
            for distance in member.places
        ]
    if not member.along.is_zero:
        rows = tuple(scaled(member.along, row) for row in along)
        result.append(AddedMass(member.start, (rows[0], rows[1], rows[2])))
    return tuple(result)


def add_hulls(loads: Loads, hulls: Sequence[Hull], quantities: Quantities) -> Sequence[Hull]:
    """Add the forces of water on all hulls to ``loads``, with one loop for the hulls of a body in the same water; hulls
    on bodies without a joint have no effect. Return an empty tuple: no hull is left to be added one by one."""
    groups: dict[tuple[str, WaveField | None], list[Hull]] = {}
    for item in hulls:
        if quantities.tree.mounts[item.body].link >= 0:
            groups.setdefault((item.body, item.waves), []).append(item)
    for group in groups.values():
        names = ", ".join(item.name for item in group)
        with quantities.algebra.tape.block(f"water on {'hulls' if len(group) > 1 else 'hull'} {names}"):
            _add_group(loads, group, quantities)
    return ()


def _add_group(loads: Loads, hulls: Sequence[Hull], quantities: Quantities) -> None:
    """Add force and moment of water on hulls of one body in the same water, about the body's origin, and their
    power."""
    algebra = quantities.algebra
    body = hulls[0].body
    axles = [_Axle(item, quantities) for item in hulls]
    force, moment = _slices(axles, quantities)
    gravity = quantities.kinematics.base.gravity_world
    for axle in axles:
        member, axis = axle.member, axle.axis
        on_end = _on_the_end(axle, quantities)
        # weights come from the links' inertias; added masses of water have none
        across, along = scaled(-member.across, _across(axis, gravity)), scaled(-member.along * dot(axis, gravity), axis)
        middle = 0.5 * member.wet
        force = plus(force, plus(on_end, plus(across, along)))
        moment = plus(moment, cross(axle.arm(algebra.zero), plus(on_end, along)))
        moment = plus(moment, cross(axle.arm(middle), across))
        loads.power = loads.power - dot(across, axle.velocity(middle)) - dot(along, axle.velocity(algebra.zero))
        for distance in member.places:
            loads.power = loads.power + 0.5 * member.across * axle.energy_gap(distance)
        loads.power = loads.power - member.along * axle.energy_gap(algebra.zero)
    add_load(loads, quantities, body, quantities.vector(ZERO_VECTOR), force, moment, own_axes=False)


class _Axle:
    """Position and motion of the axis of a hull, in world axes.

    Attributes
    ----------
    axis : (3,) unit vector
    origin : (3,) of the body, m
    """

    def __init__(self, item: Hull, quantities: Quantities) -> None:
        kinematics, tree = quantities.kinematics, quantities.tree
        self.item = item
        self.member = Member(quantities.algebra, item, quantities.formula)
        mount = tree.mounts[item.body]
        orientation = multiply(kinematics.base.orientation, kinematics.pose(mount.link)[0])
        to_world = multiply(orientation, mount.orientation)
        self.axis = apply(to_world, self.member.axis)
        self.omega = apply(orientation, kinematics.inertial_twist(mount.link)[0])
        self.origin = kinematics.position(item.body, quantities.vector(ZERO_VECTOR))
        self._start = apply(to_world, self.member.start)
        self._velocity = kinematics.velocity(item.body, self.member.start)
        self._turning = cross(self.omega, self.axis)

    def arm(self, distance: Scalar) -> Vector:
        """Return a place on the axis, given the distance from the start, from the origin of the body."""
        return plus(self._start, scaled(distance, self.axis))

    def velocity(self, distance: Scalar) -> Vector:
        return plus(self._velocity, scaled(distance, self._turning))

    def energy_gap(self, distance: Scalar) -> Scalar:
        """Return (v . d)(d . omega x v) of a point of the axis at a distance from the start, as power per added mass:
        kinetic energy changes by more than the work, because water that moves along the axis d does not turn with the
        axis."""
        v = self.velocity(distance)
        return dot(v, self.axis) * dot(self.axis, cross(self.omega, v))


def _across(axis: Vector, x: Vector) -> Vector:
    """Return the part of a vector across an axis."""
    return minus(x, scaled(dot(axis, x), axis))


def _slices(axles: Sequence[_Axle], quantities: Quantities) -> tuple[Vector, Vector]:
    """Return force and moment about the origin of the body, world axes, on all slices of hulls, by one loop over the
    slices. Values of waves at each slice are loops of their own, and are gathered."""
    algebra = quantities.algebra
    kernel = Tape()
    inner, columns = Algebra(kernel), defaultdict[str, list[Sequence[Scalar]]](list)
    for axle in axles:
        member, count = axle.member, axle.item.stations
        size = member.length * (1.0 / count)
        accelerations: list[Vector] = []
        for k in range(count):
            arm = axle.arm(size * (k + 0.5))
            here = plus(axle.origin, arm)
            # how much of the slice moves water at rest
            inert = _clamp(algebra, member.wet / size - float(k), algebra.zero)
            columns["arm"].append(arm)
            columns["z"].append([here[2]])
            columns["axis"].append(axle.axis)
            columns["velocity"].append(axle.velocity(size * (k + 0.5)))
            columns["surface"].append([surface_over(quantities, axle.item, here)])
            water, acceleration = water_at(quantities, axle.item, here)
            columns["water"].append(water)
            accelerations.append(acceleration)
            volume = member.density * member.area * size
            columns["size"].append([size, member.area * _UNIFORM, volume, volume * member.added * inert])
            columns["drag"].append([0.5 * member.density * member.drag * member.diameter * size])
            columns["gravity"].append(quantities.kinematics.base.gravity_world)
        columns["acceleration"] += accelerations
        columns["change"] += _changes(algebra, accelerations)
    inputs = LoopInputs(inner, [])
    arguments = {name: [inputs.number([*part]) for part in zip(*rows, strict=True)] for name, rows in columns.items()}
    names = ("axis", "velocity", "water", "acceleration", "gravity", "arm", "change")
    d, velocity, water, acceleration, gravity, arm, change = (inner.vector(arguments[name]) for name in names)
    (z,), (surface,), (drag,) = arguments["z"], arguments["surface"], arguments["drag"]
    size, width, volume, carried = arguments["size"]
    steep = minus(acceleration, gravity)
    up = (steep[0], steep[1], steep[2] + 1e-9)  # m/s^2, so that there is a direction without gravity, too
    leaning = dot(d, up)
    lengths = 0.25 * (size * size) * (leaning * leaning), width * (dot(up, up) - leaning * leaning)
    share, of_length, of_width = _wet_share(inner, up[2] * (surface - z), *lengths)
    past = _across(d, minus(water, velocity))
    speed = inner.call(Op.SQRT, dot(past, past) + _SLOW**2)
    load = plus(scaled(volume * share, steep), scaled(carried, _across(d, acceleration)))
    load = plus(load, scaled(drag * share * speed, past))
    righting = scaled(-volume * leaning * (0.25 * (size * size) * of_length - width * of_width), up)
    couple = cross(d, minus(righting, scaled(volume * (width * (1.0 / 3.0)) * share / size, change)))
    loop = Map(
        kernel,
        len(columns["z"]),
        tuple(inputs.elements),
        tuple(inputs.shared),
        tuple(inputs.gather),
        sums=tuple(value.ref for value in (*load, *plus(cross(arm, load), couple))),
        label="water on hulls, slice by slice",
    )
    result = [Scalar(algebra.tape, ref) for ref in add_map(algebra.tape, compact(loop, ())).sums]
    return (result[0], result[1], result[2]), (result[3], result[4], result[5])


def _wet_share(
    algebra: Algebra, depth: Scalar, along_squared: Scalar, across_squared: Scalar
) -> tuple[Scalar, Scalar, Scalar]:
    """Return the wet share of a slice, and the derivatives of the buoyancy energy by its half lengths.

    The energy is e(u, a, b), the mean of max(u + x + y, 0) over x uniform in (-a, a) and y uniform in (-b, b); see the
    head of this file. Each is written without differences of nearly equal numbers, for any ratio of a to b.

    Parameters
    ----------
    depth : u, of the middle of the slice, times G
    along_squared, across_squared : a^2 and b^2, of half lengths times G along and across; one of both may be 0

    Returns
    -------
    share : de/du, 0 to 1
    of_length, of_width : (de/da)/a and (de/db)/b
    """
    least = 1e-5**2 * (along_squared + across_squared)  # no length is 0: both are divided by
    a, b = (algebra.call(Op.SQRT, item + least) for item in (along_squared, across_squared))
    # limits of the width, -1 to 1, beyond which the length is partly and fully wet, and the wet part of the length
    low, high = (_clamp(algebra, (end - depth) / b, -algebra.one) for end in (-a, a))
    first, last = ((depth + b * part) / a for part in (low, high))
    partly = 0.5 * (high - low)
    share = 0.25 * partly * (2.0 + first + last) + 0.5 * (1.0 - high)

    def growth(lower: Scalar, upper: Scalar) -> Scalar:
        return 0.25 * partly / a * (1.0 - (lower * lower + lower * upper + upper * upper) * (1.0 / 3.0))

    return share, growth(first, last), growth(low, high)


def _changes(algebra: Algebra, accelerations: Sequence[Vector]) -> list[Vector]:
    """Return the change of the water's acceleration over each slice of a hull, from the accelerations at slice centres:
    central differences, one-sided at both ends; zero for a single slice."""
    last = len(accelerations) - 1
    result = []
    for k in range(last + 1):
        before, after = max(k - 1, 0), min(k + 1, last)
        rise = minus(accelerations[after], accelerations[before])
        result.append(scaled(algebra.scalar(1.0 / max(after - before, 1)), rise))
    return result


def _on_the_end(axle: _Axle, quantities: Quantities) -> Vector:
    """Return the force (3,), N, along the axis on the start of a hull by axial added mass and drag; the pressure of
    undisturbed water is counted elsewhere."""
    algebra, item, member, axis = quantities.algebra, axle.item, axle.member, axle.axis
    drag = quantities.formula(item.axial_drag)
    if member.along.is_zero and drag.is_zero:
        return algebra.zero_vector
    here = plus(axle.origin, axle.arm(algebra.zero))
    water, acceleration = water_at(quantities, item, here)
    share = _clamp(algebra, (surface_over(quantities, item, here) - here[2]) / member.diameter + 0.5, algebra.zero)
    past = dot(axis, minus(water, axle.velocity(algebra.zero)))
    speed = algebra.call(Op.SQRT, past * past + _SLOW**2)
    return scaled(member.along * dot(axis, acceleration) + drag * share * speed * past, axis)


def surface_over(quantities: Quantities, item: Hull, here: Vector) -> Scalar:
    """Return z of the surface of the water at a place, m."""
    if item.waves is None:
        return quantities.formula(item.level)
    at = [here[0], here[1], quantities.input("t"), *map(quantities.formula, item.waves.extra_arguments)]
    return wave_quantity(quantities.algebra, item.waves, "elevation", 0, at) + item.waves.level


def water_at(quantities: Quantities, item: Hull, here: Vector) -> tuple[Vector, Vector]:
    """Return velocity and acceleration of the water at a place, in world axes."""
    algebra, waves = quantities.algebra, item.waves
    if waves is None:
        return algebra.zero_vector, algebra.zero_vector
    at = [*here, quantities.input("t"), *map(quantities.formula, waves.extra_arguments)]
    u, a = (
        algebra.vector([wave_quantity(algebra, waves, name, k, at) for k in range(3)])
        for name in ("water_velocity", "water_acceleration")
    )
    return u, a


def _clamp(algebra: Algebra, x: Scalar, least: Scalar) -> Scalar:
    """Return a number between a bound and 1."""
    return algebra.call(Op.MIN, algebra.call(Op.MAX, x, least), algebra.one)


LAW = Law(Hull, lambda loads, item, quantities: None, together=add_hulls)
