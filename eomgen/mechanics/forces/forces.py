"""Forces and torques on bodies, and generalized forces on joints, by formulas, also of the motion of the place at
which a load acts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property

from eomgen.base.data import dataclass
from eomgen.formula.evaluate import symbols
from eomgen.formula.nodes import Formula, Symbol
from eomgen.formula.recording import Resolver, record
from eomgen.mechanics.forces.loads import Law, Loads, add_effort, add_wrench
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.mechanics.kinematics.points import rotation_vector
from eomgen.scene.forces.forces import Effort, Force
from eomgen.symbolic.scalar import Algebra, Matrix, Scalar, Vector, apply, cross, dot, multiply, plus, transpose


@dataclass(frozen=True)
class LoadPointFrame:
    """Frame at the point of action of a load, and the motion of the frame in the world.

    Attributes
    ----------
    axes : of the frame, by columns, in world axes
    position : m, in world axes
    angular_velocity, velocity : rad/s and m/s, inertial, in the axes of the frame
    own_axes : whether the load is given in the axes of the frame, not of the world
    elsewhere : gives the value on the tape of a symbol that is not of this motion
    """

    algebra: Algebra
    axes: Matrix
    position: Vector
    angular_velocity: Vector
    velocity: Vector
    own_axes: bool
    elsewhere: Resolver

    @cached_property
    def _quantities(self) -> Mapping[str, Callable[[], Vector]]:
        back = transpose(self.axes)
        return {
            "position": lambda: apply(back, self.position) if self.own_axes else self.position,
            "velocity": lambda: self.velocity if self.own_axes else apply(self.axes, self.velocity),
            "angular_velocity": lambda: (
                self.angular_velocity if self.own_axes else apply(self.axes, self.angular_velocity)
            ),
            # a rotation does not change the rotation vector: same components in both axes
            "rotation": lambda: rotation_vector(self.algebra, self.axes),
        }

    def vector(self, formulas: tuple[Formula, Formula, Formula]) -> Vector:
        """Return the values of three formulas of the load, (3,), in the axes of the frame."""
        x, y, z = (record(self.algebra, formula, self._resolve) for formula in formulas)
        return (x, y, z) if self.own_axes else apply(transpose(self.axes), (x, y, z))

    def _resolve(self, symbol: Symbol) -> Scalar:
        if symbol.kind == "local":
            return self._quantities[symbol.name]()[symbol.index]
        return self.elsewhere(symbol)


def add_force(loads: Loads, item: Force, quantities: Quantities) -> None:
    """Add a force and a torque on a body, by formulas, and the power of both to ``loads``, in place."""
    point, own_axes = quantities.vector(item.point), item.axes == "body"
    if any(symbol.kind == "local" for formula in (*item.force, *item.torque) for symbol in symbols(formula)):
        if quantities.tree.mount_at(item.body, point).link < 0:
            return
        local = _local(quantities, item.body, point, own_axes=own_axes)
        force, torque = local.vector(item.force), local.vector(item.torque)
        own_axes = True
    else:
        force, torque = quantities.vector(item.force), quantities.vector(item.torque)
    add_load(loads, quantities, item.body, point, force, torque, own_axes=own_axes)


def _local(quantities: Quantities, body: str, point: Vector, *, own_axes: bool) -> LoadPointFrame:
    """Return the frame of a body at a point of the body, (3,), m, in body axes, with the inertial motion."""
    kinematics, mount = quantities.kinematics, quantities.tree.mount_at(body, point)
    link, s = kinematics.local(body, point)
    axes = multiply(kinematics.base.orientation, multiply(kinematics.pose(link)[0], mount.orientation))
    omega, velocity = kinematics.inertial_twist(link)
    back, moving = transpose(mount.orientation), plus(velocity, cross(omega, s))
    position = kinematics.position(body, point)
    return LoadPointFrame(
        quantities.algebra, axes, position, apply(back, omega), apply(back, moving), own_axes, quantities
    )


def add_load(
    loads: Loads, quantities: Quantities, body: str, point: Vector, force: Vector, torque: Vector, *, own_axes: bool
) -> None:
    """Add a force, N, at a point of a body, a torque, N m, and the power of both to ``loads``, in place. ``point`` is
    in body axes, m. Force and torque are in body axes with ``own_axes``, else in world axes. Base and world take no
    load."""
    kinematics = quantities.kinematics
    mount = quantities.tree.mount_at(body, point)
    link, s = kinematics.local(body, point)
    if link < 0:
        return
    if own_axes:
        force, torque = apply(mount.orientation, force), apply(mount.orientation, torque)
    else:
        to_link = transpose(kinematics.pose(link)[0])
        to_base = transpose(kinematics.base.orientation)
        force, torque = apply(to_link, apply(to_base, force)), apply(to_link, apply(to_base, torque))
    load = (plus(torque, cross(s, force)), force)
    add_wrench(loads.wrenches, link, load)
    add_wrench(loads.external, link, load)
    omega, velocity = kinematics.inertial_twist(link)
    loads.power = loads.power + dot(load[0], omega) + dot(load[1], velocity)


LAW = Law(Force, add_force, before_joints=True)


def record_effort(loads: Loads, item: Effort, quantities: Quantities) -> None:
    """Add an effort and the power of the effort."""
    value = quantities.formula(item.effort)
    add_effort(loads, quantities, item.joint, value, item.index)
    loads.power = loads.power + value * quantities(Symbol("v", item.joint, item.index))


EFFORT_LAW = Law(Effort, record_effort)
