"""Inertia factors: all terms gain what the kinetic energy of more mass gives that only moves with the deflection of one
kind.

About the hinge of a beam that turns in its plane with rate w, deflections r of one kind (all along one axis) have the
energy (1/2) (factor - 1) (r'^T m r' + w^2 r^T m r), where m is the integral of the products of their shape functions
over the mass.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from eomgen.mechanics.derive import derive
from eomgen.scene.bodies.model import Base, DeformationKind
from eomgen.scene.scene import Scene
from tests.mechanics.test_beam_equations import DENSITY, LENGTH, POLAR, Modes, single
from tests.oracles.evaluation import Array, tape_evaluator
from tests.oracles.formulas import number

MODES: Modes = (("bending_y", 2), ("stretch", 2), ("torsion", 1))
PLACES = {"bending_y": slice(1, 3), "stretch": slice(3, 5), "torsion": slice(5, 6)}
#: Integrals of the squares of natural clamped-free shapes over mass and, of torsion, over polar inertia.
SQUARES = {"bending_y": DENSITY * LENGTH, "stretch": 0.5 * DENSITY * LENGTH, "torsion": 0.5 * POLAR * LENGTH}


def scene_with(kind: DeformationKind, factor: float) -> Scene:
    scene = single(MODES, 1, hinged=True)
    beam = scene.bodies[0].beam
    assert beam is not None
    changed = tuple(
        replace(item, inertia_factor=number(factor)) if item.kind == kind else item for item in beam.deformations
    )
    return replace(scene, base=Base(), bodies=(replace(scene.bodies[0], beam=replace(beam, deformations=changed)),))


def terms(scene: Scene, q: Array, v: Array, a: Array) -> dict[str, Array]:
    system = derive(scene, ["mass", "coupling", "inverse_dynamics", "force", "energy"])
    evaluate, found = tape_evaluator(system), {}
    state = {"q": q, "v": v, "a": a, "t": np.zeros(1)}
    state |= evaluate("base", state)
    for term in ("mass", "coupling", "force", "inverse_dynamics", "energy"):
        found |= evaluate(term, state)
    return found


@pytest.mark.parametrize("kind", list(PLACES))
@pytest.mark.parametrize("factor", [15.0, 0.25])
def test_factor_adds_kinetic_energy_of_one_kind(kind: DeformationKind, factor: float) -> None:
    rng = np.random.default_rng(5)
    q, v, a = rng.uniform(-0.3, 0.3, 6), rng.normal(size=6), rng.normal(size=6)
    plain, changed = terms(scene_with(kind, 1.0), q, v, a), terms(scene_with(kind, factor), q, v, a)
    own, more = PLACES[kind], (factor - 1.0) * SQUARES[kind]
    carried = more if kind != "torsion" else 0.0  # sections that twist have the same inertia about all other axes
    r, r_rate = q[own], v[own]
    M, h = np.zeros((6, 6)), np.zeros(6)
    M[own, own] = more * np.eye(len(r))
    M[0, 0] = carried * r @ r
    h[0] = 2.0 * carried * v[0] * (r @ r_rate)
    h[own] = -carried * v[0] ** 2 * r
    np.testing.assert_allclose(changed["M"] - plain["M"], M, atol=1e-13)
    np.testing.assert_allclose(changed["h"] - plain["h"], h, atol=1e-13)
    np.testing.assert_array_equal(changed["Q"], plain["Q"])
    np.testing.assert_allclose(changed["tau"] - plain["tau"], M @ a + h, atol=1e-12)
    assert changed["energy"][0] - plain["energy"][0] == pytest.approx(0.5 * v @ M @ v, abs=1e-13)
