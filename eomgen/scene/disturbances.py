"""The columns of a linear model's right-hand side: inputs that someone drives, and disturbances that the scene itself gives.

Disturbances are the inputs with a formula, a table or a road, and, where the scene has a ``[base]`` section, the accelerations of
the base: angular where it turns, then linear, in base axes. Its pose and twist stay what they are.
"""

from __future__ import annotations

from eomgen.scene.scene import Scene

ANGULAR = tuple(f"base.angular_acceleration[{k}]" for k in range(3))
LINEAR = tuple(f"base.acceleration[{k}]" for k in range(3))


def driven_inputs(scene: Scene) -> tuple[int, ...]:
    """Return the numbers of the inputs that a controller or a caller drives."""
    return tuple(number for number, item in enumerate(scene.inputs) if not item.given)


def given_inputs(scene: Scene) -> tuple[int, ...]:
    """Return the numbers of the inputs that the scene itself gives."""
    return tuple(number for number, item in enumerate(scene.inputs) if item.given)


def base_disturbances(scene: Scene) -> tuple[str, ...]:
    """Return the names of the base's accelerations; none in absolute coordinates, where the base is part of the constraints."""
    if scene.base is None or scene.coordinates == "absolute":
        return ()
    return (*ANGULAR, *LINEAR) if scene.base.rotations else LINEAR


def disturbance_names(scene: Scene) -> tuple[str, ...]:
    """Return the names of all disturbances, in the order of their columns."""
    return (*(scene.inputs[number].name for number in given_inputs(scene)), *base_disturbances(scene))
