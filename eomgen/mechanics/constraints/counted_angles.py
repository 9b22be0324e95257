"""Joint angles counted over revolutions in absolute coordinates; poses give angles modulo 2 pi only.

If an angle acts as a number (in a spring, a stop, an output, a formula other than sines and cosines), q holds a
reference beside the poses, within pi of the angle. The angle is the reference plus the rotation of the frames beyond
it. The reference does not depend on the poses, so partials and rates belong to the frames alone. The configuration is a
point of a covering space, and the reference selects the sheet; steppers update it after each step.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain

from eomgen.formula.nodes import Application, Formula, Number, Symbol
from eomgen.mechanics.forces.internal_states import state_formulas
from eomgen.scene.joints.model import Joint, Mimic
from eomgen.scene.scene import Scene

#: A joint and the number of its coordinate.
Coordinate = tuple[str, int]
#: Functions that whole turns of their argument do not change.
_PERIODIC = frozenset({"sin", "cos", "tan"})


def counted_angles(scene: Scene) -> tuple[Coordinate, ...]:
    """Return (joint, index) of the angles counted over revolutions, in joint order; none in joint coordinates.

    The angle of a helical joint follows from its travel and is not counted.
    """
    if scene.coordinates != "absolute":
        return ()
    used = set(_in_elements(scene))
    for formula in chain(state_formulas(scene), *(output.values for output in scene.outputs)):
        used |= _as_numbers(formula, turns=False)
    return tuple((joint.name, k) for joint in scene.joints for k in joint.kind.counted if (joint.name, k) in used)


def angle_labels(scene: Scene) -> tuple[str, ...]:
    """Return the labels of the references in q: ``hinge.angle``, or ``cross.angle[1]`` for a joint with two angles."""
    angles = {joint.name: joint.kind.angles for joint in scene.joints}
    return tuple(
        f"{joint}.angle" + (f"[{index}]" if angles[joint] > 1 else "") for joint, index in counted_angles(scene)
    )


def follows_modulo_revolutions(joint: Joint, mimic: Mimic, leader: Joint) -> bool:
    """Return whether an angle follows another by an integer factor: revolutions of the leader then have no effect."""
    whole = mimic.multiplier
    return (
        joint.kind.is_revolute
        and leader.kind.is_revolute
        and isinstance(whole, Number)
        and whole.value == int(whole.value)
    )


def _in_elements(scene: Scene) -> Iterator[Coordinate]:
    """Yield the coordinates on which force elements, stops and dependent (mimic) joints act."""
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
    """Return the coordinates in a formula that may not be shifted by 2 pi; ``turns``: the formula's own value may be.

    Same rules as in ``symbolic.periodic``: sines and cosines are periodic; sums, differences and integer multiples pass
    shifts on.
    """
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
