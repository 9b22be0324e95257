"""A loop far from the origin moves as one beside it, but for the rounding of the places of its points."""

from __future__ import annotations

import pytest

from tests.integrators.similar_scenes import STEPS, similar
from tests.oracles.similarity import Motion, UnitsOf

EPSILON = 2.220446049250313e-16
LENGTH = 0.1  # of the crank, m
STEPS_OF_RUN = 200
NEWTON = 1e-9  # what iterations may leave, of the largest velocity
METHODS = (
    "generalized_alpha", "generalized_alpha_f1", "generalized_alpha_f2", "generalized_alpha_spatial", "generalized_alpha_index3",
    "generalized_alpha_index3_f1", "generalized_alpha_index3_f2", "generalized_alpha_index3_spatial", "hht", "hht_index3",
    "rk4_partitioned",
)  # fmt: skip


def motion(method: str, place: float) -> Motion:
    parameters = {"rho_inf": 0.9} if method.startswith("hht") else {}
    settings = {} if method == "rk4_partitioned" else {"max_halvings": 0.0}
    return similar("four_bar").motion(
        UnitsOf(), method, STEPS["four_bar"], STEPS_OF_RUN, others={"place": place}, settings=settings, **parameters
    )


@pytest.mark.parametrize("method", METHODS)
def test_a_loop_moves_far_away_as_near_by(method: str) -> None:
    near = motion(method, 0.0)
    for place in (1e2, 1e4, 1e6 * LENGTH, 1e8 * LENGTH):
        far, rounding = motion(method, place), EPSILON * place / LENGTH
        assert far.difference(near, ("q",)) <= 0.1 * rounding
        assert far.difference(near, ("v",)) <= 0.1 * rounding + NEWTON
        assert far.difference(near, ("vdot", "lam")) <= 10.0 * rounding + 10.0 * NEWTON
