"""Partials of internal states against complex step, with rates and forces that use everything a formula may."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import eomgen
from eomgen.mechanics.derive import derive
from eomgen.scene.scene import Scene
from tests.oracles.evaluation import relative_error, tape_evaluator
from tests.oracles.states import jacobian, on_base, random_states

STATES = 4


def scene(coordinates: str = "joint") -> Scene:
    """Return a drone that carries a pendulum on a moving base: a lagging thrust, a filter of positions, a memory of
    energy."""
    builder = eomgen.SceneBuilder("drone", coordinates=coordinates)
    builder.parameter("lag", 0.05, tunable=True).input("command", "3 + sin(t)")
    builder.base(position=["0.1 * sin(3 * t)", 0, "0.2 * t"], rotation=[([0, 0, 1], "0.3 * t")])
    builder.body("hull", 1.5, inertia=[0.02, 0.03, 0.04]).joint("flight", "free", "base", "hull")
    builder.body("rod", 0.4, center_of_mass=[0, 0, -0.3], inertia=[0.01, 0.01, 0.001])
    builder.joint("hinge", "revolute", "hull", "rod", axis=[0, 1, 0], position=[0.1, 0, 0], damping=0.01)
    builder.point("tip", "rod", [0, 0, -0.6]).point("anchor", "base", [0.4, 0.2, 1.0])
    builder.spring("cord", "tip", "anchor", stiffness=20, damping=0.3, length=0.5, force="2 * wound")
    builder.state("thrust", "(command * (1 + 0.1 * height) - thrust) / lag - v.hinge")
    builder.state("height", "position.tip[2] - height + 0.1 * thrust * velocity.tip[0]")
    wound = "sin(q.hinge) * length.cord - wound ** 3 + 0.1 * rate.cord + 1e-3 * energy.kinetic + 0.01 * tension.cord"
    builder.state("wound", wound)
    builder.force(
        "lift", "hull", force=[0, "0.1 * height", "thrust * (1 + 0.2 * wound)"], torque=["height", 0, 0], axes="body"
    )
    builder.effort("trim", "hinge", "0.3 * thrust * v.hinge - wound * q.hinge")
    return builder.output("thrust", formula=["thrust", "height * q.hinge"]).build()


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_partials_against_complex_step(coordinates: str, rng: np.random.Generator) -> None:
    described = scene(coordinates)
    terms = ["residual", "partials", "internal_rate", "internal_partials", "iteration", "equations", "outputs"]
    system = derive(described, terms)
    evaluate = tape_evaluator(system)
    state = random_states(system, STATES, rng) | {"z": rng.normal(size=(STATES, 3))}
    state["lam"] = rng.normal(size=(STATES, len(system.multipliers)))
    state = on_base(evaluate, state)
    partials, found = evaluate("partials", state), evaluate("internal_partials", state)
    for block, name in (("q", "K"), ("v", "C")):
        expected = jacobian(evaluate, system.factors, "residual", "r", state, block)
        assert relative_error(partials[name], expected, 2) <= 1e-12, name
    expected = jacobian(evaluate, system.factors, "residual", "r", state, "z")
    assert relative_error(found["Rz"], expected, 2) <= 1e-12 and np.max(np.abs(expected)) > 0.1
    for block, name in (("q", "Fq"), ("v", "Fv"), ("z", "Fz")):
        expected = jacobian(evaluate, system.factors, "internal_rate", "zdot", state, block)
        assert relative_error(found[name], expected, 2) <= 1e-12 and np.max(np.abs(expected)) > 0.1, name
        pattern = tuple(np.array(system.patterns[name]).T)
        packed = evaluate("iteration", state)[name]
        assert np.array_equal(packed, found[name][..., *pattern])
        left_out = found[name].copy()
        left_out[..., *pattern] = 0.0
        assert not left_out.any()
    assert np.array_equal(evaluate("equations", state)["zdot"], evaluate("internal_rate", state)["zdot"])


def test_rates_are_those_of_the_formulas(rng: np.random.Generator) -> None:
    """By hand, from poses and twists: the height rate, and the tension that the wound state is part of."""
    system = derive(scene(), ["internal_rate", "poses", "twists", "outputs"])
    evaluate = tape_evaluator(system)
    state = random_states(system, STATES, rng) | {"z": rng.normal(size=(STATES, 3))}
    state = on_base(evaluate, state)
    rod = evaluate("poses", state)["pose"][:, 1], evaluate("twists", state)["twist"][:, 1]
    w, n = rod[0][:, :1], rod[0][:, 1:4]

    def turned(r: np.ndarray) -> np.ndarray:
        return r + 2.0 * w * np.cross(n, r) + 2.0 * np.cross(n, np.cross(n, r))

    offset = np.array([0.0, 0.0, -0.6])
    position = rod[0][:, 4:] + turned(np.broadcast_to(offset, (STATES, 3)))
    velocity = turned(rod[1][:, 3:] + np.cross(rod[1][:, :3], offset))
    thrust, height, _ = state["z"].T
    rates = evaluate("internal_rate", state)["zdot"]
    assert np.allclose(rates[:, 1], position[:, 2] - height + 0.1 * thrust * velocity[:, 0], rtol=1e-13)
    u, hinge = state["u"][:, 0], state["v"][:, 6]
    assert np.allclose(rates[:, 0], (u * (1 + 0.1 * height) - thrust) / 0.05 - hinge, rtol=1e-13)


def test_a_scene_without_states_has_none_of_it() -> None:
    plain = replace(scene(), states=(), elements=(), outputs=())
    system = derive(plain)
    assert system.nz == 0 and not system.facts.internal_states
    assert not {"internal_rate", "internal_partials", "equations", "iteration"} & set(system.functions)
    assert all("z" not in function.inputs for function in system.functions.values())
    assert any(line.startswith("internal states: ") for line in system.dropped)
