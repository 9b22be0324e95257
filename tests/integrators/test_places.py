"""A loop far from the origin moves as one beside it, but for the rounding of the places of its points."""

from __future__ import annotations

import numpy as np
import pytest

import eomgen
from tests.integrators.similar_scenes import STEPS, similar
from tests.oracles.similarity import Motion, UnitsOf

EPSILON = 2.220446049250313e-16
LENGTH = 0.1  # of the crank, m
STEPS_OF_RUN = 200
NEWTON = 1e-9  # what iterations may leave, of the largest velocity
METHODS = (
    *("generalized_alpha", "generalized_alpha_index3_f1", "generalized_alpha_index3_spatial", "hht_index3"),
    *("rk4_partitioned", "rattlie"),
)


def motion(method: str, place: float) -> Motion:
    parameters = {"rho_inf": 0.9} if method.startswith("hht") else {}
    settings = {} if method in ("rk4_partitioned", "rattlie") else {"max_halvings": 0.0}
    return similar("four_bar").motion(
        UnitsOf(), method, STEPS["four_bar"], STEPS_OF_RUN, others={"place": place}, settings=settings, **parameters
    )


@pytest.mark.slow
@pytest.mark.long_except("generalized_alpha", "rattlie")
@pytest.mark.parametrize("method", METHODS)
def test_a_loop_moves_far_away_as_near_by(method: str) -> None:
    near = motion(method, 0.0)
    for place in (1e2, 1e4, 1e6 * LENGTH, 1e8 * LENGTH):
        far, rounding = motion(method, place), EPSILON * place / LENGTH
        assert far.difference(near, ("q",)) <= 0.1 * rounding + STEPS["four_bar"] * NEWTON
        assert far.difference(near, ("v",)) <= 0.1 * rounding + NEWTON
        assert far.difference(near, ("vdot", "lam")) <= 10.0 * rounding + 10.0 * NEWTON


@pytest.mark.long
def test_places_in_q_whose_spacing_iterations_come_down_to_stop_no_run() -> None:
    """A pendulum and a body on a ball joint, tied by a rod; the free joint has its place in q."""
    builder = eomgen.SceneBuilder("rod").parameter("place", 0.0, tunable=True)
    builder.body("a", 1.0, center_of_mass=[0, 0, -0.5], inertia=[0.1] * 3).body("f", 1.0, inertia=[0.1] * 3)
    start = {"position": 0.3, "velocity": 1.0}
    builder.joint("A", "revolute", "base", "a", axis=[0, 1, 0], position=["place", 0, 0], initial=start)
    turned = {"position": [1, 0.3, -1], "rotation": [{"axis": [1, 0.3, 0], "angle": 0.5}]}
    builder.joint("F", "free", "base", "f", initial=turned)
    ends = {"body": "a", "position": [0, 0, -1]}, {"body": "f", "position": [0, 0.1, 0.2]}
    builder.constraint("rod", "distance", *ends, length=1.3)
    ends = {"body": "base", "position": ["place + 1", 0.3, -0.7]}, {"body": "f", "position": [0, 0, 0.3]}
    scene = builder.constraint("ball", "spherical", *ends).build()
    model = eomgen.build(scene, terms=["residual", "partials", "forward_dynamics", "mass"], profile="quick")
    near, along = model.simulate(0.5, 1e-3), np.zeros(model.nq)
    along[model.factors[1].q_start + 4] = 1.0
    for place, step in ((1e5, 1e-4), (1e6, 1e-3), (1e7, 1e-3)):
        start = {"q": model.initial_q + place * along, "v": model.initial_v}
        far = model.simulate(0.5, step, parameters={"place": place}, initial=start)
        assert far.success, far.message
        assert far.q[-1, 0] == pytest.approx(near.q[-1, 0], abs=2e-6 + 10.0 * EPSILON * place)
