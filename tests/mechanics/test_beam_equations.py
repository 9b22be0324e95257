"""Equations of motion of elastic beams against sums over many points of mass that move with the exact kinematics."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache

import numpy as np
import pytest

from eomgen.mechanics.derive import derive
from eomgen.scene.bodies.model import Base, Beam, Body, Deformation, DeformationKind
from eomgen.scene.joints.model import Joint
from eomgen.scene.rotations import Rotation
from eomgen.scene.scene import Scene
from eomgen.system.system import System
from tests.oracles.beams import WORLD, Frame, ManyPoints, Points, demanded
from tests.oracles.evaluation import Array, relative_error, tape_evaluator
from tests.oracles.formulas import TIME, call, number, times, vector
from tests.oracles.taylor import Moving, cos, product, rotated, rotation, shifted, sin
from tests.oracles.taylor import vector as moving_vector

LENGTH, DENSITY, POLAR = 2.0, 1.2, 0.05
GRAVITY = (0.3, -0.5, -9.81)
TERMS = ["mass", "coupling", "force", "base_motion", "inverse_dynamics", "forward_dynamics", "partials"]
Modes = Sequence[tuple[DeformationKind, int]]
#: Points of a scene for its coordinates, and that for the base.
OfMotion = Callable[[Sequence[Moving]], list[Points]]
OnBase = Callable[[Frame], OfMotion]
ROOT = moving_vector((0.3, 0.1, 0.2))

PLANAR: Modes = (("bending_y", 2),)
TWO_PLANES: Modes = (("bending_y", 1), ("bending_z", 1))
ALL: Modes = (("bending_y", 2), ("bending_z", 1), ("stretch", 1), ("torsion", 1))


def beam_body(name: str, modes: Modes, order: int, *, stiffening: bool = True, stiffness: float = 0.0) -> Body:
    deformations = tuple(Deformation(kind, "clamped_free", count, number(stiffness)) for kind, count in modes)
    beam = Beam(0.0, LENGTH, number(DENSITY), deformations, number(POLAR), order=order, stiffening=stiffening)  # type: ignore[arg-type]
    mass, across = DENSITY * LENGTH, DENSITY * LENGTH**3 / 12.0 + 0.5 * POLAR * LENGTH
    inertia = tuple(number(entry) for entry in (POLAR * LENGTH, across, across, 0.0, 0.0, 0.0))
    # six entries
    return Body(name, number(mass), vector((0.5 * LENGTH, 0.0, 0.0)), inertia, beam)  # type: ignore[arg-type]


MOVING_BASE = Base(
    (call("sin", TIME), times(0.3, TIME), call("cos", TIME)),
    (Rotation((0.0, 0.6, 0.8), call("sin", TIME)), Rotation((1.0, 0.0, 0.0), times(0.5, TIME))),
)


def base_frame(t: float) -> Frame:
    """Return the moving base as the law above says."""
    time = Moving(t, 1.0, 0.0)
    first = rotation((0.0 * time, 0.6 * sin(time), 0.8 * sin(time)))
    return product(first, rotation((0.5 * time, 0.0 * time, 0.0 * time))), (sin(time), 0.3 * time, cos(time))


def single(modes: Modes, order: int, *, hinged: bool, stiffening: bool = True) -> Scene:
    """Return one beam on a moving base, fixed there or on a hinge."""
    joint = Joint("root", "revolute" if hinged else "fixed", "base", "beam", position=vector((0.3, 0.1, 0.2)))
    return Scene(
        "single", (beam_body("beam", modes, order, stiffening=stiffening),), (joint,), vector(GRAVITY), base=MOVING_BASE
    )


def points_of_single(scene: Scene) -> OnBase:
    hinged, beam = scene.joints[0].type == "revolute", scene.bodies[0].beam
    assert beam is not None
    body = ManyPoints(beam, DENSITY, POLAR)

    def on_base(base: Frame) -> OfMotion:
        def points(q: Sequence[Moving]) -> list[Points]:
            R, p = base[0], shifted(base[1], rotated(base[0], ROOT))
            if hinged:
                R = product(R, rotation((0.0 * q[0], 0.0 * q[0], q[0])))
            return [body.points((R, p), q[int(hinged) :])]

        return points

    return on_base


def chain(order: int, modes: Modes = ALL) -> Scene:
    """Return a spatial beam on a hinge, from beside its middle a hinge to a planar beam, and a mass beside that one's
    tip."""
    first, second = beam_body("first", modes, order), beam_body("second", PLANAR, order)
    tip = Body("tip", number(0.7), vector((0.02, 0.03, 0.04)), (number(0.0),) * 6)
    joints = (
        Joint("root", "revolute", "base", "first", position=vector((0.3, 0.1, 0.2))),
        Joint("middle", "revolute", "first", "second", axis=(0.0, 1.0, 0.0), position=vector((1.4, 0.1, 0.05))),
        Joint("end", "fixed", "second", "tip", position=vector((LENGTH, 0.0, 0.1))),
    )
    return Scene("chain", (first, second, tip), joints, vector(GRAVITY), base=MOVING_BASE)


def points_of_chain(scene: Scene) -> OnBase:
    beams = [body.beam for body in scene.bodies if body.beam is not None]
    first, second = (ManyPoints(beam, DENSITY, POLAR) for beam in beams)
    count = sum(item.modes for item in beams[0].deformations)

    def on_base(base: Frame) -> OfMotion:
        def points(q: Sequence[Moving]) -> list[Points]:
            still = 0.0 * q[0]
            R, p = product(base[0], rotation((still, still, q[0]))), shifted(base[1], rotated(base[0], ROOT))
            eta, angle, others = q[1 : 1 + count], q[1 + count], q[2 + count :]
            middle = first.station((R, p), eta, (1.4, 0.1, 0.05))
            hinged = product(middle[0], rotation((still, angle, still))), middle[1]
            end = second.station(hinged, others, (LENGTH, 0.0, 0.1))
            mass = shifted(end[1], rotated(end[0], moving_vector((0.02, 0.03, 0.04))))
            return [first.points((R, p), eta), second.points(hinged, others), (np.array([0.7]), mass)]

        return points

    return on_base


@cache
def state_of(nv: int) -> dict[str, Array]:
    rng = np.random.default_rng(nv)
    return {"q": rng.uniform(-0.3, 0.3, nv), "v": rng.normal(size=nv), "a": rng.normal(size=nv), "t": np.array([0.7])}


def terms_of(system: System, state: dict[str, Array]) -> dict[str, Array]:
    evaluate = tape_evaluator(system)
    state = {**state, "base": evaluate("base", state)["base"]}
    found: dict[str, Array] = {}
    for term in TERMS:
        found |= {name: value for name, value in evaluate(term, state).items() if term != "partials"}
    return found


def expected_terms(on_base: OnBase, state: dict[str, Array]) -> dict[str, Array]:
    q, v, a = (state[name] for name in "qva")
    moving, resting = on_base(base_frame(float(state["t"][0]))), on_base(WORLD)
    R = np.array([[entry.x for entry in row] for row in base_frame(float(state["t"][0]))[0]], float)
    still = np.zeros_like(q)
    M = np.array([demanded(resting, q, still, unit) for unit in np.eye(len(q))]).T
    h = demanded(resting, q, v, still)
    return {
        "M": M,
        "h": h,
        "b": demanded(moving, q, v, still) - h,
        "Q": -demanded(resting, q, still, still, R.T @ GRAVITY),
        "tau": demanded(moving, q, v, a, GRAVITY),
    }


CASES: dict[str, tuple[Scene, Callable[[Scene], OnBase]]] = {
    "fixed": (single(TWO_PLANES, 2, hinged=False), points_of_single),  # the base moves the beam itself
    "without shortening": (single(ALL, 2, hinged=True, stiffening=False), points_of_single),
    "chain": (chain(2, (("bending_z", 1), ("torsion", 1))), points_of_chain),
}


@pytest.mark.slow
@pytest.mark.long_cases("without shortening", "chain")
@pytest.mark.parametrize(("scene", "points"), list(CASES.values()), ids=list(CASES))
def test_every_term_is_that_of_many_points(scene: Scene, points: Callable[[Scene], OnBase]) -> None:
    """With order 2 nothing is left out, so M, h, b, Q and inverse dynamics agree to rounding, on a base that moves
    every way."""
    system = derive(scene, TERMS)
    state = state_of(system.nv)
    found, expected = terms_of(system, state), expected_terms(points(scene), state)
    for name, value in expected.items():
        assert relative_error(found[name], value, axes=value.ndim, floor=1e-3) <= 2e-13, name
    np.testing.assert_allclose(
        found["vdot"], np.linalg.solve(found["M"], found["Q"] - found["h"] - found["b"]), rtol=1e-9
    )


#: Scales of the elastic part of a state from which a polynomial of degree 4 in the scale follows, and the matrix of its
#: powers.
SCALES = np.cos(np.pi * (np.arange(5) + 0.5) / 5)
POWERS = np.vander(SCALES, increasing=True)


def lowest_weights(values: Array, kept: int) -> Array:
    """Return the part up to ``kept`` of a polynomial of degree 4, at 1, from its values at ``SCALES``."""
    coefficients = np.linalg.solve(POWERS, values.reshape(len(SCALES), -1))
    return coefficients[: kept + 1].sum(axis=0).reshape(values.shape[1:])


@pytest.mark.slow
@pytest.mark.long_cases("all")
@pytest.mark.parametrize(("modes", "hinged"), [(ALL, True), (TWO_PLANES, False)], ids=["all", "fixed"])
def test_order_1_is_the_whole_truncated_at_second_order(modes: Modes, hinged: bool) -> None:
    """Of all terms, what has weight 2 at most in elastic coordinates, their rates, accelerations and variations is
    kept.

    That is what Lagrange's equations of a kinetic energy truncated at second order give, so energy is conserved. A
    variation counts 1, so the rows of elastic coordinates are linear.
    """
    scene = single(modes, 1, hinged=hinged)
    system, on_base = derive(scene, TERMS), points_of_single(scene)
    state, first = state_of(system.nv), int(hinged)
    found = terms_of(system, state)

    scaled = []
    for scale in SCALES:
        scales = np.concatenate([np.ones(first), np.full(system.nv - first, scale)])
        scaled.append(expected_terms(on_base, {name: x * scales if name in "qva" else x for name, x in state.items()}))
    whole = {name: np.array([terms[name] for terms in scaled]) for name in ("M", "h", "b", "Q", "tau")}
    rigid, elastic = slice(0, first), slice(first, None)
    for name in ("h", "b", "Q", "tau"):
        for rows, kept in ((rigid, 2), (elastic, 1)):
            expected = lowest_weights(whole[name][:, rows], kept)
            np.testing.assert_allclose(found[name][rows], expected, rtol=1e-11, atol=1e-11, err_msg=name)
    for rows, columns, kept in ((rigid, rigid, 2), (rigid, elastic, 1), (elastic, rigid, 1), (elastic, elastic, 0)):
        expected = lowest_weights(whole["M"][:, rows, columns], kept)
        np.testing.assert_allclose(found["M"][rows, columns], expected, rtol=1e-11, atol=1e-11)
