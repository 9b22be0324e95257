"""Beams with everything that can act on them: energy changes by the powers only, and partials are those of the
residual."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from eomgen.mechanics.derive import derive
from eomgen.scene.bodies.model import Body
from eomgen.scene.forces.forces import Force
from eomgen.scene.forces.springs import Spring
from eomgen.scene.joints.model import Joint
from eomgen.scene.scene import Scene
from eomgen.system.description import Point
from tests.mechanics.test_beam_equations import ALL, GRAVITY, LENGTH, MOVING_BASE, PLANAR, beam_body, chain
from tests.models.elements import elements_with
from tests.oracles.evaluation import Array, Evaluate, relative_error, tape_evaluator
from tests.oracles.formulas import TIME, call, number, vector
from tests.oracles.states import derivative, jacobian, on_base, random_states


def damped(body: Body) -> Body:
    """Return a beam with stiffness, and with both kinds of damping."""
    assert body.beam is not None
    changed = tuple(
        replace(item, stiffness=number(30.0 + 7.0 * k), damping_ratio=0.05, stiffness_damping=number(0.01))
        for k, item in enumerate(body.beam.deformations)
    )
    return replace(body, beam=replace(body.beam, deformations=changed))


def loaded_chain(order: int) -> Scene:
    """Return the chain of two beams with a spring from the world to a beam, one between the beams, and a force at a
    tip."""
    scene = chain(order)
    bodies = tuple(body if body.beam is None else damped(body) for body in scene.bodies)
    points = (
        Point("wall", "world", vector((0.5, 1.0, -0.3))),
        Point("quarter", "first", vector((0.25 * LENGTH, 0.02, 0.0))),
        Point("far", "second", vector((0.9 * LENGTH, 0.0, 0.03))),
    )
    springs = (
        Spring("to_wall", "wall", "quarter", number(40.0), number(0.4), number(0.7)),
        Spring("across", "quarter", "far", number(20.0), number(0.2), number(1.0)),
    )
    forces = (
        Force(
            "push",
            "second",
            vector((LENGTH, 0, 0)),
            vector((call("sin", TIME), 0.5, -0.2)),
            vector((0.1, 0, 0.3)),
            "body",
        ),
        Force(
            "wind",
            "first",
            vector((0.6 * LENGTH, 0, 0.1)),
            vector((0.4, call("cos", TIME), 0.0)),
            vector((0, 0, 0)),
            "world",
        ),
    )
    return replace(scene, bodies=bodies, points=points, elements=elements_with(scene, springs=springs, forces=forces))


def floating(order: int) -> Scene:
    """Return a beam on a free joint with a mass at its tip."""
    body = damped(beam_body("beam", ALL, order))
    tip = Body("tip", number(0.4), vector((0.0, 0.03, 0.04)), (number(0.01),) * 3 + (number(0.0),) * 3)
    start = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    joints = (
        Joint("float", "free", "base", "beam", initial_position=start, initial_velocity=(0.0,) * 6),
        Joint("end", "fixed", "beam", "tip", position=vector((LENGTH, 0.0, 0.1))),
    )
    return Scene("floating", (body, tip), joints, vector(GRAVITY), base=MOVING_BASE)


# a System
def state_on_base(evaluate: Evaluate, system, count: int) -> dict[str, Array]:  # type: ignore[no-untyped-def]
    state = random_states(system, count, np.random.default_rng(5))
    for factor in system.factors:
        if factor.group == "R":
            state["q"][:, factor.q_start : factor.q_start + factor.q_size] *= 0.15
    return on_base(evaluate, state)


@pytest.mark.slow_except("loaded_chain-1")
@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("scene", [loaded_chain, floating])
def test_energy_changes_by_the_powers_only(scene, order: int) -> None:  # type: ignore[no-untyped-def]  # order -> Scene
    """Also where kinetic energy is truncated, so the equations are exactly those of the truncated energy."""
    system = derive(scene(order), ["energy", "forward_dynamics", "inverse_dynamics"])
    evaluate = tape_evaluator(system)
    state = state_on_base(evaluate, system, 4)
    state["a"] = evaluate("forward_dynamics", state)["vdot"]
    kinetic, _, power, base_power = evaluate("energy", state)["energy"].T
    rates = {"q": state["v"], "v": state["a"], "t": np.ones((4, 1))}
    rate = derivative(evaluate, system.factors, "energy", state, rates)["energy"]
    scale = np.abs(rate[:, 0]) + np.abs(rate[:, 1]) + np.abs(power) + np.abs(base_power)
    assert np.max(np.abs(rate[:, 0] + rate[:, 1] - power - base_power) / scale) <= 1e-11
    assert np.min(np.abs(base_power)) > 0.0
    assert kinetic.min() > 0.0


@pytest.mark.slow_except("loaded_chain-1")
@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("scene", [loaded_chain, floating])
# order -> Scene
def test_partials_are_those_of_the_residual(scene, order: int) -> None:  # type: ignore[no-untyped-def]
    system = derive(scene(order), ["residual", "partials", "mass"])
    evaluate = tape_evaluator(system)
    state = state_on_base(evaluate, system, 2)
    found = evaluate("partials", state)
    for block, name in (("q", "K"), ("v", "C"), ("a", "M")):
        expected = jacobian(evaluate, system.factors, "residual", "r", state, block)
        assert relative_error(found[name], expected, 2) <= 1e-12, name
    assert relative_error(found["M"], evaluate("mass", state)["M"], 2) <= 1e-13


def test_a_planar_beam_has_constant_mass_and_linear_rows() -> None:
    """One plane, nothing attached, a fixed joint: M is diagonal and constant, and the matrices of a Newton step have no
    q."""
    system = derive(Scene("planar", (damped(beam_body("beam", PLANAR, 1)),), (Joint("root", "fixed", "base", "beam"),)))
    assert system.facts.constant_mass
    assert system.facts.velocity_forces
    assert system.counts["mass"].statements == 0
    assert not {symbol.block for symbol in system.tape.depends_on(system.functions["partials"].refs)}
