"""Random trees of rigid bodies, and differences of their equations to values of a peer."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from eomgen.formula.nodes import Formula
from eomgen.scene.joints.model import Joint
from eomgen.scene.scene import Scene
from eomgen.system.system import System
from tests.oracles.evaluation import Array, relative_error, tape_evaluator
from tests.oracles.formulas import number, value_of
from tests.oracles.random_scenes import random_scene
from tests.oracles.states import random_states

#: Terms that all peers have.
TERMS = ["mass", "inverse_dynamics", "forward_dynamics"]
#: Smallest norm by which differences are divided, in SI units: velocity terms may vanish.
SMALL = 1e-3
Differences = dict[str, float]
#: Values of a peer at states, by quantity, function of the system and its output.
Values = Mapping[tuple[str, str, str], Array]


def first_scene(seed: int, fits: Callable[[Scene], bool]) -> Scene:
    """Return the first random tree that fits, of ten thousand trees that belong to this seed alone."""
    return next(scene for scene in map(random_scene, range(10000 * seed, 10000 * (seed + 1))) if fits(scene))


def kinds(scene: Scene) -> set[str]:
    """Return the types of the joints of a scene."""
    return {joint.type for joint in scene.joints}


def without_rotors(scene: Scene) -> Scene:
    """Return the scene with joints whose rotors have no inertia."""

    def bare(joint: Joint) -> Joint:
        zeros = tuple(number(0.0) for _ in joint.each(joint.rotor_inertia))
        return replace(joint, rotor_inertia=zeros if isinstance(joint.rotor_inertia, tuple) else number(0.0))

    return replace(scene, joints=tuple(bare(joint) for joint in scene.joints))


def numbers_of(formulas: Sequence[Formula]) -> Array:
    """Return the values of formulas without parameters."""
    return np.array([value_of(formula, {}) for formula in formulas])


def tensor_of(entries: Sequence[Formula]) -> Array:
    """Return the tensor of inertia of a body, (3, 3), from its six entries."""
    xx, yy, zz, xy, xz, yz = numbers_of(entries)
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def states(system: System, seed: int) -> dict[str, Array]:
    """Return five random states of a system."""
    return random_states(system, 5, np.random.default_rng(seed))


def differences(system: System, state: Mapping[str, Array], expected: Values) -> Differences:
    """Return the largest relative differences by quantity: of norms at each state, which count as `SMALL` at least."""
    evaluate = tape_evaluator(system)
    return {
        name: relative_error(evaluate(function, state)[block], values, values.ndim - 1, SMALL)
        for (name, function, block), values in expected.items()
    }
