"""Centre of mass and centroidal momentum: sums over the bodies' poses and twists, and complex steps of them.

On moving bases, in absolute coordinates and with beams.
"""

from __future__ import annotations

import numpy as np
import pytest

from eomgen.mechanics.derive import derive
from eomgen.scene.builder import SceneBuilder
from eomgen.scene.scene import Scene
from tests.mechanics.checks import states_of
from tests.mechanics.test_jacobians import in_absolute_coordinates, scene_of
from tests.oracles.evaluation import Array, Evaluate, relative_error, tape_evaluator
from tests.oracles.formulas import value_of
from tests.oracles.states import derivative, jacobian, random_states, rotation_of

TERMS = [
    "center_of_mass", "center_of_mass_jacobian", "center_of_mass_jacobian_rate", "center_of_mass_drift",
    "centroidal_momentum", "centroidal_momentum_rate", "centroidal_drift",
]  # fmt: skip  # a table
STATES = 4


def moving_bodies(scene: Scene) -> list[int]:
    """Return the numbers of the bodies that some joint moves against the base."""
    still = {"base"}
    for joint in scene.joints:
        if joint.parent in still and not joint.kind.moves:
            still.add(joint.child)
    return [k for k, body in enumerate(scene.bodies) if body.name not in still]


def summed_over_bodies(
    scene: Scene, evaluate: Evaluate, state: dict[str, Array], parameters: dict[str, float]
) -> tuple[Array, Array]:
    """Return the centre of mass, and the momentum about it that v has on a base at rest."""
    poses, twists = evaluate("poses", state)["pose"], evaluate("twists", state)["twist"]
    total, center, parts = 0.0, np.zeros((STATES, 3)), []
    for k in moving_bodies(scene):
        body = scene.bodies[k]
        mass = value_of(body.mass, parameters)
        R, p = rotation_of(poses[:, k, :4]), poses[:, k, 4:]
        local = np.array([value_of(entry, parameters) for entry in body.center_of_mass])
        xx, yy, zz, xy, xz, yz = (value_of(entry, parameters) for entry in body.inertia)
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        omega = twists[:, k, :3]
        velocity = np.einsum("sij,sj->si", R, twists[:, k, 3:] + np.cross(omega, local))
        spin = np.einsum("sij,jk,sk->si", R, tensor, omega)
        at = p + R @ local
        total, center = total + mass, center + mass * at
        parts.append((mass, at, velocity, spin))
    center = center / total
    momentum = np.zeros((STATES, 6))
    for mass, at, velocity, spin in parts:
        momentum[:, :3] += spin + mass * np.cross(at - center, velocity)
        momentum[:, 3:] += mass * velocity
    return center, momentum


def check_rates(system: object, evaluate: Evaluate, state: dict[str, Array]) -> None:
    """Hold rates and drifts against complex steps of the matrices."""
    along = {"q": state["v"], "t": np.ones((STATES, 1))}
    factors = system.factors  # type: ignore[attr-defined]  # a System
    for matrix, block, rate, drift in (
        ("center_of_mass_jacobian", "J", "center_of_mass_jacobian_rate", "center_of_mass_drift"),
        ("centroidal_momentum", "A", "centroidal_momentum_rate", "centroidal_drift"),
    ):
        expected = derivative(evaluate, factors, matrix, state, along)[block]
        assert relative_error(evaluate(rate, state)[f"{block}_dot"], expected, 2, floor=1e-3) <= 1e-12
        by_v = np.einsum("sij,sj->si", expected, state["v"])
        assert relative_error(evaluate(drift, state)["drift"], by_v, floor=1e-3) <= 1e-11


@pytest.mark.slow_except("1-joint")
@pytest.mark.parametrize("absolute", [False, True], ids=["joint", "absolute"])
@pytest.mark.parametrize("seed", range(6))
def test_sums_over_the_bodies(seed: int, absolute: bool, rng: np.random.Generator) -> None:
    scene = in_absolute_coordinates(scene_of(seed)) if absolute else scene_of(seed)
    system = derive(scene, [*TERMS, "poses", "twists"])
    evaluate, state = tape_evaluator(system), states_of(system, rng, STATES)
    parameters = {parameter.name: parameter.value for parameter in scene.parameters}
    center, _ = summed_over_bodies(scene, evaluate, state, parameters)
    assert relative_error(evaluate("center_of_mass", state)["c"], center) <= 1e-13
    expected = jacobian(evaluate, system.factors, "center_of_mass", "c", state, "q")
    assert relative_error(evaluate("center_of_mass_jacobian", state)["J"], expected, 2, floor=1e-3) <= 1e-12
    A = evaluate("centroidal_momentum", state)["A"]
    (mass,) = evaluate("center_of_mass", state)["m"][0]
    assert relative_error(A[:, 3:], mass * expected, 2, floor=1e-3) <= 1e-12
    at_rest = dict(state)
    if scene.base is not None:
        at_rest["base"] = state["base"].copy()
        at_rest["base"][:, 7:] = 0.0
    _, momentum = summed_over_bodies(scene, evaluate, at_rest, parameters)
    assert relative_error(np.einsum("sij,sj->si", A, state["v"]), momentum, floor=1e-3) <= 1e-12
    check_rates(system, evaluate, state)


@pytest.mark.slow
def test_beams_have_momentum(rng: np.random.Generator) -> None:
    """The centre of mass is that of the deformed beam; linear rows are its Jacobian times the mass."""
    bends, stretches = {"modes": 2, "stiffness": 100.0}, {"modes": 1, "stiffness": 1e4}
    builder = SceneBuilder("mast").beam("mast", 1.0, mass_per_length=2.0, bending_y=bends, stretch=stretches)
    builder.joint("hinge", "revolute", "base", "mast", axis=[0, 1, 1])
    builder.body("bob", 0.5, inertia=[0.1, 0.1, 0.2])
    builder.joint("pin", "revolute", "mast", "bob", axis=[1, 2, 0], position=[1.0, 0.0, 0.0])
    system = derive(builder.build(), TERMS)
    evaluate, state = tape_evaluator(system), random_states(system, STATES, rng)
    state["q"] = 0.01 * state["q"]
    expected = jacobian(evaluate, system.factors, "center_of_mass", "c", state, "q")
    found = evaluate("center_of_mass_jacobian", state)["J"]
    assert relative_error(found, expected, 2) <= 1e-12 and np.abs(found[..., 1:4]).max() > 1e-2
    check_rates(system, evaluate, state)
