"""Joints as constraints between absolute bodies: their equations, their coordinates and velocities as functions of
the bodies' motions, and angles counted over revolutions.

Poses give angles modulo 2 pi only. If an angle acts as a number (in a spring, a stop, an output, a formula other than
sines and cosines), q holds a reference in addition to the poses, within pi of the angle. The angle is the reference
plus the rotation of the frames beyond it. The reference does not depend on the poses, so partials and rates belong to
the frames alone. The configuration is a point of a covering space, and the reference selects the sheet; steppers update
it after each step.

Velocities of joints are the velocity coordinates in which linear models are compared. Eigenvalues of a linear model
that is frozen at an instant of a motion depend on its coordinates: only coordinates that are constant multiples of each
other along the motion have the same. Velocities of bodies are not such multiples of the velocities of joints.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain

from eomgen.base.data import dataclass
from eomgen.errors import ModelError, Problem
from eomgen.formula.nodes import Application, Formula, Number, Symbol
from eomgen.formula.prescribed_motion import smooth
from eomgen.mechanics.constraints.rows import ConstraintCalculus, ConstraintRow, ConstraintRows, sine_of_excess_rotation
from eomgen.mechanics.forces.frame_pairs import frame_pair, magnitude
from eomgen.mechanics.forces.internal_states import state_formulas
from eomgen.mechanics.forces.symbols import Offers, Quantities
from eomgen.mechanics.kinematics.directions import configuration_directions, rates_of
from eomgen.mechanics.kinematics.points import Kinematics
from eomgen.mechanics.tree.joints import Direction, frame_of, perpendicular
from eomgen.mechanics.tree.links import Tree
from eomgen.scene.joints.model import Constraint, Frame, Joint, Mimic
from eomgen.scene.scene import Scene
from eomgen.symbolic.calculus.partials import forward_partials, jacobian_vector
from eomgen.symbolic.operations import Op
from eomgen.symbolic.scalar import Scalar, Vector, apply, dot, minus, transpose
from eomgen.symbolic.tape import ZERO

#: A joint and the number of the coordinate.
Coordinate = tuple[str, int]
#: Functions that are periodic in whole turns of the argument.
_PERIODIC = frozenset({"sin", "cos", "tan"})


def counted_angles(scene: Scene) -> tuple[Coordinate, ...]:
    """Return (joint, index) of the joint angles counted over revolutions, in joint order; none in joint coordinates. In
    absolute coordinates these are the angles that act as numbers, such as in springs, stops, dependent joints and
    formulas other than sines and cosines. The angle of a helical joint follows from its travel and is not counted."""
    if scene.coordinates != "absolute":
        return ()
    used = set(_in_elements(scene))
    equations = [item.equation for item in scene.constraints if item.equation is not None]
    for formula in chain(state_formulas(scene), equations, *(output.values for output in scene.outputs)):
        used |= _as_numbers(formula, turns=False)
    return tuple((joint.name, k) for joint in scene.joints for k in joint.kind.counted if (joint.name, k) in used)


def angle_labels(scene: Scene) -> tuple[str, ...]:
    """Return the labels of the references in q: ``hinge.angle``, or ``cross.angle[1]`` for a joint with two angles."""
    angles = {joint.name: joint.kind.angles for joint in scene.joints}
    return tuple(
        f"{joint}.angle" + (f"[{index}]" if angles[joint] > 1 else "") for joint, index in counted_angles(scene)
    )


def follows_modulo_revolutions(joint: Joint, mimic: Mimic, leader: Joint) -> bool:
    """Return whether both joints are revolute and the multiplier of the mimic relation is an integer constant.
    Revolutions of the leading joint then have no effect on the dependent joint."""
    whole = mimic.multiplier
    return (
        joint.kind.is_revolute
        and leader.kind.is_revolute
        and isinstance(whole, Number)
        and whole.value == int(whole.value)
    )


def _in_elements(scene: Scene) -> Iterator[Coordinate]:
    """Yield (joint, index) of the coordinates on which joint springs, stops, force elements and mimic relations act.
    Leading joints of mimic relations by an integer factor between revolute joints are left out."""
    joints = {joint.name: joint for joint in scene.joints}
    for joint in scene.joints:
        yield from (
            (joint.name, k) for k, stiffness in enumerate(joint.each(joint.stiffness)) if stiffness != Number(0.0)
        )
        yield from ((joint.name, stop.index) for stop in joint.stops)
        if joint.mimic is not None and not follows_modulo_revolutions(joint, joint.mimic, joints[joint.mimic.joint]):
            yield joint.mimic.joint, 0
    yield from chain.from_iterable(element.angles() for element in scene.elements)


def _as_numbers(formula: Formula, *, turns: bool) -> set[Coordinate]:
    """Return (joint, index) of the joint coordinates in a formula whose shift by 2 pi would change its effect.
    ``turns`` states that the value of the formula may itself be shifted by 2 pi. Same rules as in
    ``symbolic.periodic``: sines and cosines are periodic; sums, differences and integer multiples pass shifts on."""
    if isinstance(formula, Number):
        return set()
    if isinstance(formula, Symbol):
        return {(formula.name, formula.index)} if formula.kind == "q" and not turns else set()
    if isinstance(formula, Application):
        return _as_numbers(formula.argument, turns=False)
    whole = any(isinstance(item, Number) and item.value == int(item.value) for item in formula.arguments)
    handed_on = formula.name in ("add", "sub", "neg") or (formula.name == "mul" and whole)
    inner = formula.name in _PERIODIC or (turns and handed_on)
    return set().union(*(_as_numbers(argument, turns=inner) for argument in formula.arguments))


def joint_constraint(joint: Joint) -> Constraint | None:
    """Return the constraint between parent and child body that is equivalent to a joint. None for fixed joints, and for
    joints without constraint equations, such as free joints."""
    if not joint.kind.moves or joint.kind.rows == (0, 0):
        return None
    turn = _frame(joint)
    first = Frame(joint.parent, joint.position, _product(joint.orientation, turn))
    return Constraint(joint.name, joint.type, first, Frame(joint.child, orientation=turn), pitch=joint.pitch)


def _frame(joint: Joint) -> tuple[Direction, ...]:
    """Return the axes of the constraint frame in child axes, (3, 3): z along the axis of the joint, or x and y along
    its two axes."""
    if len(joint.kind.turned_about) > 1:
        return tuple(zip(joint.axis, joint.second_axis, perpendicular(joint.axis, joint.second_axis), strict=True))
    return frame_of(joint)


def _product(A: Sequence[Sequence[float]], B: Sequence[Sequence[float]]) -> tuple[tuple[float, float, float], ...]:
    rows = [[sum(A[i][k] * B[k][j] for k in range(3)) for j in range(3)] for i in range(3)]
    return tuple((row[0], row[1], row[2]) for row in rows)


@dataclass(frozen=True)
class SineCosine:
    """An angle by sine and cosine, up to a common positive factor."""

    sine: Scalar
    cosine: Scalar

    def past(self, sine: Scalar, cosine: Scalar) -> SineCosine:
        """Return this angle minus another angle with the given sine and cosine, up to the common positive factor."""
        return SineCosine(self.sine * cosine - self.cosine * sine, self.cosine * cosine + self.sine * sine)


class AbsoluteQuantities(Quantities):
    """Values on the tape of the symbols of formulas in absolute coordinates. Coordinates and velocities of joints are
    measured between the frames of the two joined bodies."""

    def __init__(self, scene: Scene, tree: Tree, kinematics: Kinematics, offered: Offers) -> None:
        """Express the joints as constraints between free bodies, and take the references of counted angles as inputs of
        q. ``offered`` are the quantities that force elements offer to formulas. Raises ModelError for a rotor
        inertia."""
        super().__init__(scene, tree, kinematics, offered)
        self.constraints = {joint.name: joint_constraint(joint) for joint in scene.joints}
        tape = self.algebra.tape
        self.seeds = configuration_directions(tree)
        self.rates = rates_of(tape, self.seeds, kinematics.carrier)
        self._measures: dict[str, tuple[Scalar | SineCosine, ...]] = {}
        poses = sum(factor.q_size for factor in tree.factors)
        self._references = {
            angle: self.input("q", poses + number) for number, angle in enumerate(counted_angles(scene))
        }
        rotors = [joint.name for joint in scene.joints if set(joint.each(joint.rotor_inertia)) - {Number(0.0)}]
        if rotors:
            fault = "has no place in absolute coordinates [E0489]"
            raise ModelError([Problem(f"joints.{name}.rotor_inertia", fault, "joint coordinates") for name in rotors])

    def __call__(self, symbol: Symbol) -> Scalar:
        if symbol.kind == "q":
            return self.coordinate(symbol.name, symbol.index)
        if symbol.kind == "v":
            tape = self.algebra.tape
            return Scalar(tape, jacobian_vector(tape, [self._wrap(symbol.name, symbol.index).ref], self.rates)[0])
        if symbol.kind == "a":
            fault = f"the acceleration a.{symbol.name} of a joint is not a quantity of absolute coordinates [E0487]"
            raise ModelError(fault, "the acceleration of a point")
        return super().__call__(symbol)

    def coordinate(self, joint: str, index: int = 0) -> Scalar:
        """Return component ``index`` of a joint's coordinates: a travel, m, or an angle, rad, over revolutions for
        counted angles, else in (-pi, pi]."""
        reference, measure = self._references.get((joint, index)), self._measure(joint, index)
        if reference is None or isinstance(measure, Scalar):
            return self._wrap(joint, index)
        call = self.algebra.call
        past = measure.past(call(Op.SIN, reference), call(Op.COS, reference))
        return reference + call(Op.ATAN2, past.sine, past.cosine)

    def beyond(self, joint: str, index: int, law: Scalar, *, turns: bool) -> Scalar:
        """Return a joint's coordinate minus a law, in m or rad; the difference of an angle is in (-pi, pi]. ``turns``
        is not used here; other quantities take the same arguments."""
        measure, call = self._measure(joint, index), self.algebra.call
        if isinstance(measure, Scalar):
            return measure - law
        past = measure.past(call(Op.SIN, law), call(Op.COS, law))
        return call(Op.ATAN2, past.sine, past.cosine)

    def _wrap(self, joint: str, index: int) -> Scalar:
        """Return a joint's travel, m, or its angle in (-pi, pi]. The wrapped angle has the same rates and the same
        virtual work as the angle counted over revolutions."""
        measure = self._measure(joint, index)
        return measure if isinstance(measure, Scalar) else self.algebra.call(Op.ATAN2, measure.sine, measure.cosine)

    def _measure(self, joint: str, index: int) -> Scalar | SineCosine:
        if joint not in self._measures:
            item = self.constraints[joint]
            if item is None or not item.kind.coordinates:
                raise ModelError(
                    f"joint {joint!r} has no single coordinate that absolute coordinates could measure [E0488]",
                    "a force or torque on the body, or joint coordinates",
                )
            self._measures[joint] = self._measure_joint(item)
        return self._measures[joint][index]

    def _measure_joint(self, item: Constraint) -> tuple[Scalar | SineCosine, ...]:
        """Return the coordinates of a joint from the poses of its two frames: angles as ``SineCosine``, travels in m.
        Angles precede travels. A helical joint has one coordinate, the angle, rad, that follows from its travel and
        pitch."""
        pair = frame_pair(self, item.first, item.second)
        first, second = pair.first, pair.second
        gap = minus(second.origin, first.origin)

        def angle(x: Vector, y: Vector, along: Vector) -> SineCosine:
            return SineCosine(dot(y, along), dot(x, along))

        def turn() -> SineCosine:
            return angle(first.axis(0), first.axis(1), second.axis(0))

        def travel(k: int) -> Scalar:
            return dot(gap, first.axis(k))

        kind = item.kind
        if kind.has("screw"):
            return (travel(2) / self.formula(item.pitch),)
        angles = [turn()] * len(kind.turned_about)
        if len(angles) > 1:
            about_x = angle(first.axis(1), first.axis(2), second.axis(1))
            angles = [about_x, angle(second.axis(0), second.axis(2), first.axis(0))]
        return (*angles, *(travel(kind.frame_axes[axis]) for axis in kind.travels))

    def work_of(self, joint: str, index: int = 0) -> dict[int, Scalar]:
        """Return the left-trivialised partials of a joint coordinate in q, as {velocity component: nonzero partial}. A
        force on the coordinate, times these partials, is the generalized force."""
        tape = self.algebra.tape
        (tangent,) = forward_partials(tape, [self._wrap(joint, index).ref], self.seeds)
        return {direction: Scalar(tape, ref) for direction, ref in tangent.items() if ref != ZERO}


def following_rows(quantities: AbsoluteQuantities) -> list[ConstraintRow]:
    """Return one holonomic equation per dependent (mimic) joint: coordinate = multiplier * leading coordinate + offset.
    Dependent angles are compared by the sine of the difference, and so need no count of revolutions. Joints without an
    equivalent constraint are left out."""
    rows = list[ConstraintRow]()
    for joint in quantities.scene.joints:
        if joint.mimic is None:
            continue
        target = quantities.formula(joint.mimic.multiplier) * quantities.coordinate(joint.mimic.joint)
        target = target + quantities.formula(joint.mimic.offset)
        item = quantities.constraints[joint.name]
        if item is None:
            continue
        pair, name = frame_pair(quantities, item.first, item.second), f"{joint.name}: follows {joint.mimic.joint}"
        if joint.kind.is_revolute:
            value = sine_of_excess_rotation(quantities, target, pair.first, pair.second)
            rows.append(
                ConstraintRow(
                    name, value, "1", quantities.algebra.one + magnitude(target), pair.lever, pair.path_length
                )
            )
        else:
            value = quantities.coordinate(joint.name) - target
            rows.append(ConstraintRow(name, value, "m", pair.size + magnitude(target), pair.lever, pair.path_length))
    return rows


def driven_rows(quantities: Quantities) -> list[ConstraintRow]:
    """Return one holonomic equation, coordinate - law = 0 in m or rad, for each coordinate of a joint with a drive.
    Each equation has the joint as ``owner`` and the index of the coordinate as ``number``."""
    rows = list[ConstraintRow]()
    for joint in quantities.scene.joints:
        for index, (drive, (kind, unit)) in enumerate(zip(joint.drive, joint.kind.coordinates.items(), strict=False)):
            with quantities.algebra.tape.block(f"drive of joint {joint.name}"):
                pair = frame_pair(quantities, Frame(joint.parent, joint.position), Frame(joint.child))
                law, angle = quantities.formula(drive), unit == "rad"
                value = quantities.beyond(joint.name, index, law, turns=angle and not smooth(drive))
                size = (quantities.algebra.one if angle else pair.size) + magnitude(law)
            name = f"{joint.name}: driven {kind}"
            rows.append(
                ConstraintRow(name, value, "1" if angle else "m", size, pair.lever, pair.path_length, joint, index)
            )
    return rows


def joint_velocities(scene: Scene, tree: Tree, quantities: Quantities) -> ConstraintCalculus:
    """Return the velocities of all independent joints as equations at velocity level, in the order of
    ``leading_joints``. The ``velocity`` and ``jacobian`` of the result are the joint velocities, rad/s or m/s, and the
    partials in v."""
    rows = ConstraintRows()
    for joint in scene.leading_joints:
        with quantities.algebra.tape.block(f"velocity of joint {joint.name}"):
            rows.velocity += _velocities(quantities, joint)
    return ConstraintCalculus(tree, rows, quantities.kinematics.carrier)


def _velocities(quantities: Quantities, joint: Joint) -> list[ConstraintRow]:
    """Return the velocity components of a joint, rad/s or m/s, each as the value of a ``ConstraintRow``. Spherical and
    free joints have the relative angular velocity in child axes, free joints then the relative velocity; other joints
    have a component for each axis of rotation, then for each travel."""
    item = joint_constraint(joint)
    if item is None or not item.kind.coordinates:
        pair = frame_pair(quantities, Frame(joint.parent, joint.position, joint.orientation), Frame(joint.child))
    else:
        pair = frame_pair(quantities, item.first, item.second)
    first, second = pair.first, pair.second
    turning = minus(pair.angular_velocity(second), pair.angular_velocity(first))
    sliding = minus(pair.velocity_at(second, second.origin), pair.velocity_at(first, second.origin))

    def components() -> Iterator[Scalar]:
        kind = joint.kind
        if not kind.coordinates:
            yield from apply(transpose(second.axes), turning)
            if kind.has("free"):
                yield from apply(transpose(second.axes), sliding)
        for frame, axis in zip((first, second), kind.turned_about, strict=False):
            yield dot(turning, frame.axis(kind.frame_axes[axis]))
        for axis in kind.travels:
            yield dot(sliding, first.axis(kind.frame_axes[axis]))

    return [ConstraintRow(joint.name, value, "m/s", pair.size, pair.lever, pair.path_length) for value in components()]
