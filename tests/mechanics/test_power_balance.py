"""Energy: d(kinetic + potential)/dt = power + base power along the motion that forward dynamics gives, by complex
step."""

from __future__ import annotations

import numpy as np
import pytest

from eomgen.mechanics.derive import derive
from eomgen.system.description import BASE
from tests.oracles import direct_kinematics
from tests.oracles.evaluation import Array, relative_error, tape_evaluator
from tests.oracles.formulas import value_of
from tests.oracles.random_scenes import random_scene, with_base
from tests.oracles.states import displaced, on_base, random_states, rotation_of

STATES = 6


def energies_of_bodies(scene, system, state: dict[str, Array], base_at) -> tuple[Array, Array]:
    """Return kinetic energy and weight's potential from poses alone, moved along the motion by complex step."""
    step = 1e-40
    moved_q = displaced(system.factors, state["q"], 1j * step * state["v"])
    here = direct_kinematics.poses(scene, moved_q, base_at(state["t"] + 1j * step))
    kinetic, potential = np.zeros(len(moved_q)), np.zeros(len(moved_q))
    gravity = np.array([value_of(item, {}) for item in scene.gravity])
    on_the_base = {BASE}
    for joint in scene.joints:
        if joint.type == "fixed" and joint.parent in on_the_base:
            on_the_base.add(joint.child)
    for name, mass, center, inertia in direct_kinematics.body_data(scene):
        if name in on_the_base:  # it moves with the base, which has no mass of its own either
            continue
        R, p = here[name]
        spin = np.swapaxes(R.real, -1, -2) @ (R.imag / step)
        omega = np.stack([spin[..., 2, 1], spin[..., 0, 2], spin[..., 1, 0]], axis=-1)
        velocity = (p + R @ center).imag / step
        kinetic += 0.5 * (mass * np.sum(velocity**2, axis=1) + np.einsum("ki,ij,kj->k", omega, inertia, omega))
        potential -= mass * (p + R @ center).real @ gravity
    rotors = {
        joint.name: np.array([value_of(item, {}) for item in joint.each(joint.rotor_inertia)]) for joint in scene.joints
    }
    for factor in system.factors:
        kinetic += 0.5 * state["v"][:, factor.v_start : factor.v_start + factor.v_size] ** 2 @ rotors[factor.name]
    return kinetic, potential


@pytest.mark.parametrize("seed", range(6))
def test_energies_are_those_of_the_bodies(seed: int, rng) -> None:
    scene = random_scene(seed, 5)
    scene = with_base(scene, seed) if seed % 2 else scene
    system = derive(scene, ["energy"])
    evaluate = tape_evaluator(system)
    state = random_states(system, STATES, rng)

    def base_at(t: Array):
        if scene.base is None:
            return None
        base = evaluate("base", {**state, "t": t})["base"]
        return rotation_of(base[..., :4]), base[..., 4:7]

    kinetic, potential = energies_of_bodies(scene, system, state, base_at)
    found = evaluate("energy", on_base(evaluate, state) if scene.base is not None else state)["energy"]
    assert relative_error(found[:, :1], kinetic[:, np.newaxis]) <= 1e-12
    assert relative_error(found[:, 1:2], potential[:, np.newaxis], floor=1.0) <= 1e-12
