"""Joints of a scene as constraints between absolute bodies, and their coordinates as functions of the bodies' poses."""

from __future__ import annotations

from collections.abc import Sequence

from eomgen.errors import ModelError, Problem
from eomgen.mechanics.constraints import place, rates_of
from eomgen.mechanics.directions import configuration_directions
from eomgen.mechanics.kinematics import Kinematics
from eomgen.mechanics.quantities import Quantities
from eomgen.mechanics.tree import Tree, aligning_turn
from eomgen.scene.constraint import Constraint, Frame
from eomgen.scene.formula_nodes import Number, Symbol
from eomgen.scene.scene import Joint, Scene
from eomgen.symbolic.derivatives import forward_partials, jacobian_vector
from eomgen.symbolic.scalar import Scalar, dot, minus
from eomgen.symbolic.tape import ZERO, Op


def joint_constraint(joint: Joint) -> Constraint | None:
    """Return the constraint that a joint is, its axis along z of both frames; None for joints without equations."""
    if joint.type == "free" or joint.type == "fixed":  # noqa: PLR1714  # the checker narrows the type by equality only
        return None
    turn = aligning_turn(joint.axis)
    orientation = _product(joint.orientation, turn)
    first = Frame(joint.parent, joint.position, orientation)
    return Constraint(joint.name, joint.type, first, Frame(joint.child, orientation=turn))


def _product(A: Sequence[Sequence[float]], B: Sequence[Sequence[float]]) -> tuple[tuple[float, float, float], ...]:
    rows = [[sum(A[i][k] * B[k][j] for k in range(3)) for j in range(3)] for i in range(3)]
    return tuple((row[0], row[1], row[2]) for row in rows)


class AbsoluteQuantities(Quantities):
    """Resolves the symbols of formulas when bodies have absolute coordinates: joint coordinates are measured between frames."""

    def __init__(self, scene: Scene, tree: Tree, kinematics: Kinematics) -> None:
        super().__init__(scene, tree, kinematics)
        self.constraints = {joint.name: joint_constraint(joint) for joint in scene.joints}
        tape = self.algebra.tape
        self.seeds = configuration_directions(tree)
        self.rates = rates_of(tape, self.seeds, scene.base is not None)
        self._coordinates: dict[str, Scalar] = {}
        heavy = [joint.name for joint in scene.joints if joint.rotor_inertia != Number(0.0)]
        if heavy:
            what = "has no place in absolute coordinates"
            raise ModelError([Problem(f"joints.{name}.rotor_inertia", what, "joint coordinates") for name in heavy])

    def __call__(self, symbol: Symbol) -> Scalar:
        if symbol.kind == "q":
            return self.coordinate(symbol.name)
        if symbol.kind == "v":
            tape = self.algebra.tape
            return Scalar(tape, jacobian_vector(tape, [self.coordinate(symbol.name).ref], self.rates)[0])
        if symbol.kind == "a":
            what = f"the acceleration a.{symbol.name} of a joint is no quantity of absolute coordinates"
            raise ModelError(what, "the acceleration of a point")
        return super().__call__(symbol)

    def coordinate(self, joint: str) -> Scalar:
        """Return the angle (within half a turn) or the travel of a joint."""
        if joint not in self._coordinates:
            item = self.constraints[joint]
            if item is None or item.type not in ("revolute", "prismatic"):
                raise ModelError(
                    f"joint {joint!r} has no single coordinate that absolute coordinates could measure",
                    "a force or torque on the body, or joint coordinates",
                )
            first, second = place(self, item.first), place(self, item.second)
            if item.type == "prismatic":
                self._coordinates[joint] = dot(minus(second.origin, first.origin), first.axis(2))
            else:
                x = second.axis(0)
                self._coordinates[joint] = self.algebra.call(Op.ATAN2, dot(first.axis(1), x), dot(first.axis(0), x))
        return self._coordinates[joint]

    def work_of(self, joint: str, index: int = 0) -> dict[int, Scalar]:
        tape = self.algebra.tape
        (tangent,) = forward_partials(tape, [self.coordinate(joint).ref], self.seeds)
        return {direction: Scalar(tape, ref) for direction, ref in tangent.items() if ref != ZERO}
