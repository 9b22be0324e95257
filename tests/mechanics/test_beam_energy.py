"""Beams with everything that can act on them, and terms that a planar beam is spared.

Their partials and powers are in ``test_partials_and_powers.py``.
"""

from __future__ import annotations

from dataclasses import replace

from eomgen.mechanics.derive import derive
from eomgen.scene.bodies.model import Body
from eomgen.scene.forces.forces import Force
from eomgen.scene.forces.springs import Spring
from eomgen.scene.joints.model import Joint
from eomgen.scene.scene import Scene
from eomgen.system.description import Point
from eomgen.system.system import System
from tests.mechanics.test_beam_equations import ALL, GRAVITY, LENGTH, MOVING_BASE, PLANAR, beam_body, chain
from tests.models.elements import elements_with
from tests.oracles.evaluation import Array
from tests.oracles.formulas import TIME, call, number, vector


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


def nearly_straight(system: System, state: dict[str, Array]) -> dict[str, Array]:
    """Return the state with smaller coordinates of beams, for which linearised ones still are beams."""
    for factor in system.factors:
        if factor.group == "R":
            state["q"][:, factor.q] *= 0.15
    return state


def test_a_planar_beam_has_constant_mass_and_linear_rows() -> None:
    """One plane, nothing attached, a fixed joint: M is diagonal and constant, and the matrices of a Newton step have no
    q."""
    system = derive(Scene("planar", (damped(beam_body("beam", PLANAR, 1)),), (Joint("root", "fixed", "base", "beam"),)))
    assert system.facts.constant_mass
    assert system.facts.velocity_forces
    assert system.counts["mass"].statements == 0
    assert not {symbol.block for symbol in system.tape.depends_on(system.functions["partials"].refs)}
