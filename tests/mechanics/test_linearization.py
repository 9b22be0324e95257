"""The linear model's matrices against complex step on the residual, the rates, the outputs and the constraints'
accelerations."""

from __future__ import annotations

import numpy as np
import pytest

import eomgen
from eomgen.mechanics.derive import derive
from eomgen.scene.scene import Scene
from tests.mechanics.checks import states_of
from tests.oracles.evaluation import Array, Evaluate, relative_error, tape_evaluator
from tests.oracles.random_scenes import random_scene
from tests.oracles.states import STEP, jacobian

STATES = 4
OF_BASE = [*range(13, 19)]  # omega_dot and velocity_dot in the base struct


def drone(coordinates: str = "joint", *, looped: bool = False) -> Scene:
    """Return a hull with a pendulum: driven and given inputs, states, outputs of everything, and a cord that keeps its
    length."""
    builder = eomgen.SceneBuilder("drone", coordinates=coordinates)
    builder.parameter("lag", 0.05, tunable=True)
    builder.input("thrust_command").input("gust", "3 + sin(t)").input("trim")
    builder.base(
        position=["0.1 * sin(3 * t)", 0, "0.2 * t"], rotation=[([0, 0, 1], "0.3 * t"), ([0, 1, 0], "0.2 * t**2")]
    )
    builder.body("hull", 1.5, inertia=[0.02, 0.03, 0.04]).joint("flight", "free", "base", "hull")
    builder.body("rod", 0.4, center_of_mass=[0, 0, -0.3], inertia=[0.01, 0.01, 0.001])
    builder.joint("hinge", "revolute", "hull", "rod", axis=[0, 1, 0], position=[0.1, 0, 0], damping=0.01)
    builder.point("tip", "rod", [0, 0, -0.6]).point("anchor", "base", [0.4, 0.2, 1.0])
    builder.spring("cord", "tip", "anchor", stiffness=20, damping=0.3, length=0.5, force="2 * trim")
    builder.state("thrust", "(thrust_command * (1 + 0.1 * q.hinge) - thrust) / lag - v.hinge + gust * position.tip[0]")
    builder.force("lift", "hull", force=["gust ** 2", 0, "thrust * (1 + 0.2 * trim)"], axes="body")
    builder.effort("motor", "hinge", "0.3 * thrust * v.hinge - trim * q.hinge")
    if looped:
        builder.constraint("strut", "distance", "anchor", {"body": "hull", "position": [0.2, 0.1, -0.1]}, length=1.3)
    builder.output("felt", formula=["acceleration.tip[0]", "acceleration.tip[2] * trim"])
    builder.output("sensed", formula=["thrust * q.hinge + gust * v.hinge", "energy.power + energy.base_power"])
    return builder.build()


def state_of(
    scene: Scene, terms: list[str], rng: np.random.Generator
) -> tuple[eomgen.System, Evaluate, dict[str, Array]]:
    system = derive(scene, terms)
    return system, tape_evaluator(system), states_of(system, rng, STATES)


def columns(
    evaluate: Evaluate, function: str, output: str, state: dict[str, Array], block: str, numbers: list[int]
) -> Array:
    """Return partials in some numbers of a block that is a vector of free numbers, by complex step."""
    found = []
    for number in numbers:
        moved = state[block].astype(complex)
        moved[:, number] += 1j * STEP
        found.append(evaluate(function, {**state, block: moved})[output].imag / STEP)
    return np.stack(found, axis=-1)


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
@pytest.mark.parametrize("looped", [False, True], ids=["tree", "loop"])
def test_equations_of_motion_and_states(coordinates: str, looped: bool, rng: np.random.Generator) -> None:
    scene = drone(coordinates, looped=looped)
    system, evaluate, state = state_of(scene, ["residual", "internal_rate", "linearization"], rng)
    found = evaluate("linearization", state)
    for name, block in (("M0", "a"), ("C0", "v"), ("K0", "q"), ("Rz", "z")):
        expected = jacobian(evaluate, system.factors, "residual", "r", state, block)
        assert relative_error(found[name], expected, 2) <= 1e-12, name
    for name, block in (("Fq", "q"), ("Fv", "v"), ("Fz", "z")):
        expected = jacobian(evaluate, system.factors, "internal_rate", "zdot", state, block)
        assert relative_error(found[name], expected, 2) <= 1e-12, name
    assert relative_error(found["B0"], -columns(evaluate, "residual", "r", state, "u", [0, 2]), 2) <= 1e-12
    assert relative_error(found["Fu"], columns(evaluate, "internal_rate", "zdot", state, "u", [0, 2]), 2) <= 1e-12
    by_given = -columns(evaluate, "residual", "r", state, "u", [1])
    by_base = -columns(evaluate, "residual", "r", state, "base", OF_BASE)
    of_base = coordinates == "joint"  # absolute bodies do not know the base; their constraints do
    expected = np.concatenate([by_given, by_base], axis=2) if of_base else by_given
    assert relative_error(found["E0"], expected, 2) <= 1e-12
    assert np.max(np.abs(found["B0"])) > 0.1
    assert not of_base or np.all(np.max(np.abs(by_base), axis=(0, 1)) > 0.1)
    assert found["Fw"].shape == (STATES, 1, found["E0"].shape[-1])
    assert relative_error(found["Fw"][..., :1], columns(evaluate, "internal_rate", "zdot", state, "u", [1]), 2) <= 1e-12


@pytest.mark.parametrize("looped", [False, True], ids=["tree", "loop"])
def test_outputs(looped: bool, rng: np.random.Generator) -> None:
    system, evaluate, state = state_of(drone(looped=looped), ["outputs", "output_partials"], rng)
    found = evaluate("output_partials", state)
    for block in ("q", "v", "a", "z"):
        expected = jacobian(evaluate, system.factors, "outputs", "y", state, block)
        assert relative_error(found[f"Y{block}"], expected, 2) <= 1e-12, block
    assert relative_error(found["Yu"], columns(evaluate, "outputs", "y", state, "u", [0, 2]), 2) <= 1e-12
    by_given, by_base = (columns(evaluate, "outputs", "y", state, *what) for what in (("u", [1]), ("base", OF_BASE)))
    assert relative_error(found["Yw"], np.concatenate([by_given, by_base], axis=2), 2) <= 1e-12
    assert ("Ylam" in found) == looped
    if looped:
        assert relative_error(found["Ylam"], columns(evaluate, "outputs", "y", state, "lam", [0]), 2) <= 1e-12
        assert found["Ylam"].shape == (STATES, 4, 1)


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_accelerations_of_constraints(coordinates: str, rng: np.random.Generator) -> None:
    scene = drone(coordinates, looped=True)
    terms = ["constraint_jacobian", "constraint_bias", "acceleration_partials"]
    system, evaluate, state = state_of(scene, terms, rng)

    def rows(function: str, at: dict[str, Array]) -> dict[str, Array]:
        B, g = evaluate("constraint_jacobian", at)["B"], evaluate("constraint_bias", at)["g"]
        return {"row": (B @ at["a"][..., np.newaxis])[..., 0] + g}

    found = evaluate("acceleration_partials", state)
    for name, block in (("Aq", "q"), ("Av", "v")):
        expected = jacobian(rows, system.factors, "", "row", state, block)
        assert relative_error(found[name], expected, 2) <= 1e-12, name
        assert np.max(np.abs(expected)) > 0.1


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_constraint_forces(coordinates: str, rng: np.random.Generator) -> None:
    """Against complex steps of the Jacobian times the multipliers."""
    system, evaluate, state = state_of(
        drone(coordinates, looped=True), ["constraint_jacobian", "reaction_partials"], rng
    )

    def forces(function: str, at: dict[str, Array]) -> dict[str, Array]:
        B = evaluate("constraint_jacobian", at)["B"]
        return {"force": (np.swapaxes(B, -1, -2) @ at["lam"][..., np.newaxis])[..., 0]}

    found = evaluate("reaction_partials", state)
    expected = jacobian(forces, system.factors, "", "force", state, "q")
    assert relative_error(found["N"], expected, 2) <= 1e-12
    assert np.max(np.abs(expected)) > 0.1
    by_parameters = columns(forces, "", "force", state, "p", range(state["p"].shape[-1]))
    assert not np.any(by_parameters)
    assert "Np" not in found  # its rows hold places of frames, which no parameter moves


def test_terms_are_made_only_when_asked_for_and_where_they_mean_something() -> None:
    asked = ["linearization", "output_partials", "acceleration_partials"]
    assert not set(asked) & set(derive(drone()).functions)
    assert set(asked) & set(derive(drone(), asked).functions) == {"linearization", "output_partials"}
    system = derive(random_scene(1, 3), asked)
    assert set(asked) & set(system.functions) == {"linearization"}
    assert [block.name for block in system.functions["linearization"].outputs] == ["M0", "C0", "K0"]


def test_names_of_columns_stand_in_the_generated_code() -> None:
    outputs = {
        block.name: block.description for block in derive(drone(), ["linearization"]).functions["linearization"].outputs
    }
    assert outputs["B0"] == "d(Q - b)/du, u: thrust_command, trim"
    angular, linear = (
        ", ".join(f"base.{kind}[{k}]" for k in range(3)) for kind in ("angular_acceleration", "acceleration")
    )
    assert outputs["E0"] == f"d(Q - b)/dw, w: gust, {angular}, {linear}"
