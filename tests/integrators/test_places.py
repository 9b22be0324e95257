"""A loop far from the origin moves as one beside it, but for the rounding of the places of its points."""

from __future__ import annotations

import pytest

import eomgen
from tests.integrators.similar_scenes import STEPS, similar
from tests.oracles.similarity import Motion, UnitsOf

EPSILON = 2.220446049250313e-16
LENGTH = 0.1  # of the crank, m
STEPS_OF_RUN = 200
NEWTON = 1e-9  # what iterations may leave, of the largest velocity
METHODS = (
    "generalized_alpha",
    "generalized_alpha_f1",
    "generalized_alpha_f2",
    "generalized_alpha_spatial",
    "generalized_alpha_index3",
    "generalized_alpha_index3_f1",
    "generalized_alpha_index3_f2",
    "generalized_alpha_index3_spatial",
    "hht",
    "hht_index3",
    "rk4_partitioned",
    "rattlie",
)


def motion(method: str, place: float) -> Motion:
    parameters = {"rho_inf": 0.9} if method.startswith("hht") else {}
    settings = {} if method in ("rk4_partitioned", "rattlie") else {"max_halvings": 0.0}
    return similar("four_bar").motion(
        UnitsOf(), method, STEPS["four_bar"], STEPS_OF_RUN, others={"place": place}, settings=settings, **parameters
    )


@pytest.mark.long_except_every(4)
@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_a_loop_moves_far_away_as_near_by(method: str) -> None:
    near = motion(method, 0.0)
    for place in (1e2, 1e4, 1e6 * LENGTH, 1e8 * LENGTH):
        far, rounding = motion(method, place), EPSILON * place / LENGTH
        assert far.difference(near, ("q",)) <= 0.1 * rounding + STEPS["four_bar"] * NEWTON
        assert far.difference(near, ("v",)) <= 0.1 * rounding + NEWTON
        assert far.difference(near, ("vdot", "lam")) <= 10.0 * rounding + 10.0 * NEWTON


def rod_on_free_body(place: float) -> eomgen.Model:
    """Return a pendulum and a body on a ball joint, tied by a rod; the free joint has its place in q."""
    return eomgen.build(
        {
            "format": 1,
            "name": "rod",
            "bodies": {
                "a": {"mass": 1.0, "inertia": [0.1] * 3, "center_of_mass": [0, 0, -0.5]},
                "f": {"mass": 1.0, "inertia": [0.1] * 3},
            },
            "joints": {
                "A": {
                    "type": "revolute",
                    "parent": "base",
                    "child": "a",
                    "axis": [0, 1, 0],
                    "position": [place, 0, 0],
                    "initial": {"position": 0.3, "velocity": 1.0},
                },
                "F": {
                    "type": "free",
                    "parent": "base",
                    "child": "f",
                    "initial": {"position": [place + 1, 0.3, -1], "rotation": [{"axis": [1, 0.3, 0], "angle": 0.5}]},
                },
            },
            "constraints": {
                "rod": {
                    "type": "distance",
                    "first": {"body": "a", "position": [0, 0, -1]},
                    "second": {"body": "f", "position": [0, 0.1, 0.2]},
                    "length": 1.3,
                },
                "ball": {
                    "type": "spherical",
                    "first": {"body": "base", "position": [place + 1, 0.3, -0.7]},
                    "second": {"body": "f", "position": [0, 0, 0.3]},
                },
            },
            "terms": ["residual", "partials", "forward_dynamics", "mass"],
        },
        profile="quick",
    )


@pytest.mark.long
def test_places_in_q_whose_spacing_iterations_come_down_to_stop_no_run() -> None:
    near = rod_on_free_body(0.0).simulate(0.5, 1e-3)
    for place, step in ((1e5, 1e-4), (1e6, 1e-3), (1e6, 1e-4), (1e7, 1e-3)):
        far = rod_on_free_body(place).simulate(0.5, step)
        assert far.success, far.message
        assert far.q[-1, 0] == pytest.approx(near.q[-1, 0], abs=2e-6 + 10.0 * EPSILON * place)
