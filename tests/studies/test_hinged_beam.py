"""A beam on a flap hinge under a turning base: its steady motion, and what is said where it bends beyond what order 1
is for."""

from __future__ import annotations

import math

import numpy as np
import pytest

import eomgen
from eomgen import ModelError
from eomgen.studies import check

RATE, OFFSET, LENGTH = 30.0, 0.5, 4.5


def blade(position: tuple[float, ...] = (), order: int = 1) -> eomgen.Scene:
    """Return a blade that bends in three modes and flaps about a hinge, without weight."""
    bending = {"modes": 3, "stiffness": 4e4} | ({"initial": {"position": list(position)}} if position else {})
    builder = eomgen.SceneBuilder("hinged", gravity=[0, 0, 0]).base(rotation=[([0, 0, 1], f"{RATE} * t")])
    builder.beam("blade", LENGTH, mass_per_length=6.0, bending_z=bending, order=order)
    builder.joint("flap", "revolute", "base", "blade", axis=[0, -1, 0], position=[OFFSET, 0, 0])
    return builder.simulation(step=1e-3, duration=0.5).build()


@pytest.mark.slow
def test_flapping_of_a_hinged_blade() -> None:
    """A rigid blade flaps with w^2 = rate^2 (1 + m e r / I), r and I of a uniform rod about its hinge."""
    lin = eomgen.build(blade(), profile="instant").linearize(at="steady")
    np.testing.assert_allclose(lin.reference.q, 0.0, atol=1e-12)
    rigid = RATE * math.sqrt(1.0 + 1.5 * OFFSET / LENGTH)
    np.testing.assert_allclose(lin.modes().angular_frequency[0], rigid, rtol=1e-3)  # bending takes a little


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_check_draws_states_that_order_1_is_for(seed: int) -> None:
    report = check(blade(), seed=seed, only=["mass"], profile="instant")
    assert report.passed, [str(form.worst) for form in report.failures]


@pytest.mark.slow
def test_a_beam_bent_too_far_is_named() -> None:
    scene = blade((0.0, 3.0, 0.0))
    model = eomgen.build(scene, profile="instant")
    smallest = float(np.linalg.eigvalsh(model.mass(model.initial_q))[0])
    assert smallest < 0.0
    said = f"is not positive definite, its smallest eigenvalue is {smallest:.3g}: "
    said += "this is beyond the range of order = 1 of beam blade"
    with pytest.raises(ModelError) as caught:
        model.linearize(at="steady")
    (problem,) = caught.value.problems
    assert problem.what == f"the inertia matrix at the start of the search {said}" and problem.hint == "order = 2"
    (form,) = check(scene, states=1, only=["mass.M, definite"], profile="instant").failures
    assert form.worst is not None and form.worst.entry == "1 - smallest eigenvalue of M" and form.worst.value > 1.0
    assert np.linalg.eigvalsh(eomgen.build(blade((0.0, 3.0, 0.0), 2), profile="instant").mass(model.initial_q))[0] > 0.0


@pytest.mark.slow
def test_a_run_away_is_blamed_on_the_step() -> None:
    model = eomgen.build(blade((0.01, 0.0, 0.0)), method="rk4", profile="instant")
    run = model.simulate(1.0, 2e-2, method="rk4")
    assert not run.success
    assert "range of order = 1 of beam blade" in run.message
    assert run.message.endswith("; try: a step smaller than 0.02 s, then order = 2")
