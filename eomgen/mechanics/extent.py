"""Scales of a machine, length and gravity, to which rounding errors of positions and accelerations are relative.

A motion may be as small as it likes against its machine. Its own size tells how accurate it is to be, the size of the
machine how accurate it can be: forces that cancel in a scene at rest leave fractions of their summands.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import chain

from eomgen.formula.nodes import Formula, Number
from eomgen.scene.scene import Scene
from eomgen.symbolic.operations import Op
from eomgen.symbolic.scalar import Algebra, Scalar
from eomgen.system.description import BASE


def extent(scene: Scene, algebra: Algebra, constant: Callable[[Formula], Scalar]) -> tuple[Scalar, Scalar]:
    """Return the root of the sum of the squares of all lengths that a scene gives, m, and the size of gravity, m/s^2.

    Parameters
    ----------
    constant : callable
        From a formula of parameters to its value on the tape.
    """
    return tuple(  # type: ignore[return-value]  # one for each of the two
        _root_of_squares(algebra, map(constant, formulas)) for formulas in (_lengths(scene), scene.gravity)
    )


def _root_of_squares(algebra: Algebra, values: Iterator[Scalar]) -> Scalar:
    total = algebra.zero
    for value in values:
        total = total + value * value
    return total if total.is_zero else algebra.call(Op.SQRT, total)


def _lengths(scene: Scene) -> Iterator[Formula]:
    """Yield the dimensions of moving bodies and force elements, formulas of parameters: the machine's place is no size
    of it."""
    still = {BASE, "world"}
    yield from chain.from_iterable(body.center_of_mass for body in scene.bodies)
    yield from (Number(body.beam.length) for body in scene.bodies if body.beam is not None)
    yield from chain.from_iterable(point.position for point in scene.points if point.body not in still)
    for joint in scene.joints:
        if joint.parent not in still:
            yield from joint.position
        yield from joint.lengths()
    yield from chain.from_iterable(element.lengths() for element in scene.elements)
