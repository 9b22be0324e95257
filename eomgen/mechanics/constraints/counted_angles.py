"""Angles of joints in absolute coordinates that are counted over turns: the bodies' poses tell angles up to whole turns only.

Where an angle acts as the number it is (in a spring, a stop, an output, a formula, not only in sines and cosines), the
configuration holds a number beside the bodies' poses, a reference within half a turn of the angle. The angle is the reference and
what the frames have turned past it; as the reference does not depend on the poses, partials and rates are those of the frames.
Whoever moves the bodies lets the reference follow: the configuration is a point of a covering space, and the reference says on
which sheet.
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
    """Return the angles that are counted over turns in absolute coordinates, in the order of the joints; in others none.

    A helical joint's angle is that of its travel and needs no count.
    """
    if scene.coordinates != "absolute":
        return ()
    used = set(_in_elements(scene))
    for formula in chain(state_formulas(scene), *(output.values for output in scene.outputs)):
        used |= _as_numbers(formula, turns=False)
    return tuple((joint.name, k) for joint in scene.joints for k in joint.kind.counted if (joint.name, k) in used)


def angle_labels(scene: Scene) -> tuple[str, ...]:
    """Return what the numbers beside the poses are called: ``hinge.angle``; ``cross.angle[1]`` of a joint with two angles."""
    angles = {joint.name: joint.kind.angles for joint in scene.joints}
    return tuple(f"{joint}.angle" + (f"[{index}]" if angles[joint] > 1 else "") for joint, index in counted_angles(scene))


def follows_modulo_revolutions(joint: Joint, mimic: Mimic, leader: Joint) -> bool:
    """Return whether a joint follows an angle, as an angle, by a whole multiple: turns of the leader do not matter then."""
    whole = mimic.multiplier
    return joint.kind.only_turns and leader.kind.only_turns and isinstance(whole, Number) and whole.value == int(whole.value)


def _in_elements(scene: Scene) -> Iterator[Coordinate]:
    """Yield the coordinates that springs, stops and joints that follow others act on."""
    joints = {joint.name: joint for joint in scene.joints}
    for joint in scene.joints:
        yield from ((joint.name, k) for k, stiffness in enumerate(joint.each(joint.stiffness)) if stiffness != Number(0.0))
        yield from ((joint.name, stop.index) for stop in joint.stops)
        if joint.mimic is not None and not follows_modulo_revolutions(joint, joint.mimic, joints[joint.mimic.joint]):
            yield joint.mimic.joint, 0
    for torsion in scene.torsion_springs:
        if torsion.stiffness != Number(0.0):
            yield torsion.first, torsion.first_index
            yield torsion.second, torsion.second_index


def _as_numbers(formula: Formula, *, turns: bool) -> set[Coordinate]:
    """Return the coordinates in a formula whose whole turns matter; ``turns``: those of the formula's own value do not.

    As ``symbolic.periodic`` finds it on a tape: sines and cosines do not see turns, and sums, differences and whole multiples
    hand them on.
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
