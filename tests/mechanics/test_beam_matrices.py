"""K, D and K_geo by name: against partials of the elastic rows, with and without shortening."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from eomgen.mechanics.derive import derive
from eomgen.scene.bodies.model import Body
from eomgen.scene.forces.forces import Force
from eomgen.scene.joints.model import Joint
from eomgen.scene.scene import Scene
from tests.mechanics.checks import states_of
from tests.mechanics.test_beam_energy import damped, nearly_straight
from tests.mechanics.test_beam_equations import ALL, GRAVITY, LENGTH, MOVING_BASE, beam_body
from tests.oracles.evaluation import Array, tape_evaluator
from tests.oracles.formulas import number, vector
from tests.oracles.states import jacobian


def scene_with(*, stiffening: bool, tip: bool) -> Scene:
    """Return a beam on a hinge on a moving base; with a mass at its tip, and an axial force in its middle."""
    body = damped(beam_body("beam", ALL, 1, stiffening=stiffening))
    bodies: tuple[Body, ...] = (body,)
    joints: tuple[Joint, ...] = (Joint("root", "revolute", "base", "beam", position=vector((0.3, 0.1, 0.2))),)
    forces: tuple[Force, ...] = ()
    if tip:
        bodies += (Body("tip", number(0.7), vector((0, 0, 0)), (number(0.0),) * 6),)
        joints += (Joint("end", "fixed", "beam", "tip", position=vector((LENGTH, 0, 0))),)
        forces = (Force("pull", "beam", vector((0.5 * LENGTH, 0, 0)), vector((3.0, 0, 0)), vector((0, 0, 0)), "body"),)
    return Scene("s", bodies, joints, vector(GRAVITY), base=MOVING_BASE, elements=forces)


def matrices(scene: Scene) -> tuple[dict[str, Array], Array, Array]:
    """Return the term, and the partials of the residual in q and v where the beam is straight and its coordinates at
    rest."""
    system = derive(scene, ["elastic", "residual"])
    evaluate = tape_evaluator(system)
    state = nearly_straight(system, states_of(system, np.random.default_rng(5), 3))
    for block in "qva":
        state[block][:, 1:] = 0.0
    found = evaluate("elastic", state)
    by_q, by_v = (jacobian(evaluate, system.factors, "residual", "r", state, block) for block in "qv")
    return found, by_q, by_v


@pytest.mark.parametrize("tip", [False, True])
def test_geometric_stiffness_is_what_shortening_adds(tip: bool) -> None:
    """The partials with shortening less those without are K_geo, for a base that moves every way and a hinge that
    turns."""
    found, by_q, _ = matrices(scene_with(stiffening=True, tip=tip))
    without, by_q_without, _ = matrices(scene_with(stiffening=False, tip=tip))
    added = by_q[:, 1:, 1:] - by_q_without[:, 1:, 1:]
    assert np.abs(added).max() > 1.0
    np.testing.assert_allclose(found["K_geo"][:, 1:, 1:], added, rtol=1e-11, atol=1e-11)
    assert not found["K_geo"][:, 0].any()
    assert not found["K_geo"][:, :, 0].any()
    assert not without["K_geo"].any()


def test_structural_matrices_are_partials_of_the_structural_forces() -> None:
    """What stiffness and damping add to the partials of the residual, a frame at rest or not, is K and D."""
    scene = scene_with(stiffening=True, tip=True)
    beam = scene.bodies[0].beam
    assert beam is not None
    soft = tuple(replace(item, stiffness=number(0.0)) for item in beam.deformations)
    free = replace(scene, bodies=(replace(scene.bodies[0], beam=replace(beam, deformations=soft)), *scene.bodies[1:]))
    found, by_q, by_v = matrices(scene)
    _, by_q_free, by_v_free = matrices(free)
    np.testing.assert_allclose(found["K"], by_q - by_q_free, atol=1e-10)
    np.testing.assert_allclose(found["D"], by_v - by_v_free, atol=1e-11)
    eigenvalues = np.linalg.eigvalsh(found["D"][0, 1:, 1:])
    assert eigenvalues.min() > 0.0


def test_modal_damping_is_the_asked_part_of_critical() -> None:
    """A clamped beam alone, damped with a ratio only, decays as oscillators of that ratio do."""
    body = beam_body("beam", (("bending_y", 3), ("torsion", 1)), 1, stiffness=20.0)
    assert body.beam is not None
    ratios = tuple(replace(item, damping_ratio=0.07) for item in body.beam.deformations)
    scene = Scene(
        "s", (replace(body, beam=replace(body.beam, deformations=ratios)),), (Joint("root", "fixed", "base", "beam"),)
    )
    system = derive(scene, ["elastic", "mass"])
    evaluate = tape_evaluator(system)
    state = {"q": np.zeros(4), "v": np.zeros(4), "a": np.zeros(4), "base": np.zeros(19)}
    K, D, M = evaluate("elastic", state)["K"], evaluate("elastic", state)["D"], evaluate("mass", state)["M"]
    poles = np.linalg.eigvals(
        np.block([[np.zeros((4, 4)), np.eye(4)], [-np.linalg.solve(M, K), -np.linalg.solve(M, D)]])
    )
    np.testing.assert_allclose(-poles.real / np.abs(poles), 0.07, rtol=1e-9)
