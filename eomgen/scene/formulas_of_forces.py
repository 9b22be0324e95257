"""The formulas of a scene that its motion depends on."""

from __future__ import annotations

from collections.abc import Iterator

from eomgen.scene.formula.nodes import Formula
from eomgen.scene.scene import Scene


def formulas_of_forces(scene: Scene) -> Iterator[tuple[Formula, int]]:
    """Yield every formula that forces depend on, those of inputs excepted, and how many of its time derivatives they do."""
    if scene.base is not None:
        yield from ((formula, 2) for formula in scene.base.position)
        yield from ((rotation.angle, 2) for rotation in scene.base.rotations)
    yield from ((constraint.drive, 2) for constraint in scene.constraints if constraint.drive is not None)
    yield from ((spring.force, 0) for spring in scene.springs)
    yield from ((formula, 0) for force in scene.forces for formula in (*force.force, *force.torque))
    yield from ((effort.effort, 0) for effort in scene.efforts)
    yield from ((state.rate, 0) for state in scene.states)
    yield from ((controller.output, 0) for controller in scene.controllers)
    for tyre in scene.tyres:  # the damping of a tyre takes the rate of its road
        yield tyre.road, 1
        if tyre.road_rate is not None:
            yield tyre.road_rate, 0
