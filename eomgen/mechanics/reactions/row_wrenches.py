"""Unit wrenches of constraint equations: the action of each multiplier on the two bodies.

An equation depends on the pose of the second frame in the first one, and on no other part of the machine. Its rate is
g . (omega, v), with the second frame's angular velocity against the first and the velocity of its origin. So the
virtual work of B^T lam is the work of the wrench lam g on the second body and of its opposite, at one place, on the
first. g is differentiated on a tape of its own, with this pose independent although it depends on q on the scene's.
"""

from __future__ import annotations

from eomgen.formula.nodes import Symbol
from eomgen.mechanics.constraints.rows import rows_of_pair
from eomgen.mechanics.forces.frame_pairs import FramePair, FramePose
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.mechanics.kinematics.points import LinkKinematics
from eomgen.mechanics.kinematics.wrenches import Wrench
from eomgen.mechanics.tree.links import Tree
from eomgen.scene.joints.constraint_model import Constraint
from eomgen.symbolic.calculus.partials import Seeds, forward_partials
from eomgen.symbolic.map import splice
from eomgen.symbolic.operations import InputSymbol
from eomgen.symbolic.scalar import Algebra, Scalar, apply, minus, multiply, transpose
from eomgen.symbolic.tape import ONE, ZERO, Ref, Tape

#: Links of the two frames on the tape of their own, and its blocks: axes and origin of the second, and its twist.
_FIRST, _SECOND = 0, 1
_PLACE, _TWIST = "place", "twist"


class _Detached(Quantities):
    """Parameters and time of a scene on another tape, for the formulas of a constraint."""

    def __init__(self, scene: Quantities, tape: Tape) -> None:
        self.source = scene
        self.algebra = Algebra(tape)

    def __call__(self, symbol: Symbol) -> Scalar:
        given, tape = self.source(symbol), self.algebra.tape
        source = given.tape.symbol(given.ref)
        ref = tape.constant(given.constant or 0.0) if source is None else tape.input(source.block, source.index)
        return Scalar(tape, ref)


def row_wrenches(quantities: Quantities, item: Constraint, pair: FramePair) -> list[Wrench]:
    """Return the unit wrench of each equation of a constraint, holonomic ones first.

    Returns
    -------
    list of (moment, force)
        On the second body, about the origin of the second frame, in the axes in which the pair is given; N m (of
        equations in m: N m per N) and N per unit of the multiplier.
    """
    own = Tape()
    rows = rows_of_pair(_Detached(quantities, own), item, _pair_of_its_own(own))
    unit = forward_partials(own, [row.value.ref for row in rows.holonomic], _displacements(own))
    unit += forward_partials(
        own, [row.value.ref for row in rows.velocity], {InputSymbol(_TWIST, k): {k: ONE} for k in range(6)}
    )
    to_first = transpose(pair.first.axes)
    place = [entry for row in multiply(to_first, pair.second.axes) for entry in row]
    place += apply(to_first, minus(pair.second.origin, pair.first.origin))
    bound = {InputSymbol(_PLACE, number): value.ref for number, value in enumerate(place)}
    refs = splice(quantities.algebra.tape, own, [row.get(k, ZERO) for row in unit for k in range(6)], bound)
    parts = [Scalar(quantities.algebra.tape, ref) for ref in refs]
    wrenches = []
    for start in range(0, len(parts), 6):
        a, b, c, x, y, z = parts[start : start + 6]
        wrenches.append((apply(pair.first.axes, (a, b, c)), apply(pair.first.axes, (x, y, z))))
    return wrenches


def _pair_of_its_own(tape: Tape) -> FramePair:
    """Return the second frame at a place in the first one that is twelve inputs, moving with a twist of six."""
    algebra = Algebra(tape)
    zero, place = algebra.zero_vector, algebra.block(_PLACE, 12)
    axes = algebra.matrix([place[0:3], place[3:6], place[6:9]])
    origin = algebra.vector(place[9:12])
    twist = algebra.block(_TWIST, 6)
    kinematics = LinkKinematics(
        Tree(algebra, (), {}, {}, (), {}),
        {_FIRST: (algebra.identity, zero), _SECOND: (algebra.identity, origin)},
        {_FIRST: (zero, zero), _SECOND: (algebra.vector(twist[:3]), algebra.vector(twist[3:]))},
    )
    first, second = FramePose(_FIRST, algebra.identity, zero), FramePose(_SECOND, axes, origin)
    return FramePair(kinematics, first, second, algebra.one, algebra.zero, algebra.one)


def _displacements(tape: Tape) -> Seeds:
    """Return the changes of the second frame's place: turned about its origin, directions 0 to 2, and moved, 3 to 5."""
    seeds: dict[Ref | InputSymbol, dict[int, Ref]] = {}
    for k, i, j in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):  # a turn about k takes axis i to j and axis j to minus i
        for column in range(3):
            at_i, at_j = InputSymbol(_PLACE, 3 * i + column), InputSymbol(_PLACE, 3 * j + column)
            seeds.setdefault(at_j, {})[k] = tape.input(_PLACE, 3 * i + column)
            seeds.setdefault(at_i, {})[k] = -tape.input(_PLACE, 3 * j + column)
    return seeds | {InputSymbol(_PLACE, 9 + k): {3 + k: ONE} for k in range(3)}
